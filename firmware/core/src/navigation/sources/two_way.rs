//! Two-way ping: h(x) = (|p_v(launch) − p_s| + |p_v(arrival) − p_s|) / 2.
//!
//! The vehicle interrogates, the ship replies after a known turnaround; half the remaining round
//! trip multiplied by sound speed, m, and `sensors.range_m` is the noise of that half. No clock is shared. The ship
//! is at the time of its reply on both ways, so that a reported ship's error is one error.
//! Invalid when the ends coincide or the ship is not known.

use super::acoustic::{Path, by_position};
use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::{Observations, Refused};
use crate::navigation::interface::config::NavigationConfig;
use crate::navigation::interface::measurement::AcousticPath;

pub(crate) fn observe(
    x: &Estimate,
    outward: &AcousticPath,
    back: &AcousticPath,
    range_m: f64,
    config: &NavigationConfig,
    out: &mut Observations,
) -> Result<(), Refused> {
    let (outward, back) = (Path::new(x, outward, config), Path::new(x, back, config));
    let outward = outward.as_ref().map_err(|refused| *refused)?;
    let back = back.as_ref().map_err(|refused| *refused)?;
    let noise = config.sensors.range_m * config.sensors.range_m;
    let observation = out.add(range_m - 0.5 * outward.distance_m - 0.5 * back.distance_m, noise);
    let by_outward = by_position(outward.direction * 0.5);
    let by_back = by_position(back.direction * 0.5);
    outward.add_vehicle(x, None, &by_outward, observation);
    back.add_vehicle(x, None, &by_back, observation);
    if outward.shares_ship(back) {
        outward.add_ship(&by_position(by_outward.position + by_back.position), observation);
    } else {
        outward.add_ship(&by_outward, observation);
        back.add_ship(&by_back, observation);
    }
    Ok(())
}
