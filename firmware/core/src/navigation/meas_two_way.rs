//! Two-way ping: h(x) = (|p_v(launch) − p_s| + |p_v(arrival) − p_s|) / 2.
//!
//! The vehicle interrogates, the ship replies after a known turnaround; half the remaining round
//! trip multiplied by sound speed, m, and `sensors.range_m` is the noise of that half. No clock is shared. The ship
//! is at the time of its reply on both ways, so that a reported ship's error is one error.
//! Invalid when the ends coincide or the ship is not known.

use super::acoustic::{Path, by_position, report_variance};
use super::estimate::Estimate;
use super::observation::{Observations, Refused};
use super::{AcousticPath, NavigationConfig, ShipReport};
use nalgebra::Vector3;

pub(super) fn observe(
    x: &Estimate,
    outward: &AcousticPath,
    back: &AcousticPath,
    range_m: f64,
    config: &NavigationConfig,
    out: &mut Observations,
) -> Result<(), Refused> {
    let observation = out.add(range_m, config.sensors.range_m * config.sensors.range_m);
    let (mut reported, mut by_ship): (Option<&ShipReport>, _) = (None, Vector3::zeros());
    for path in [outward, back] {
        let path = Path::new(x, path, config)?;
        let gradient = by_position(path.direction() * 0.5);
        observation.innovation -= 0.5 * path.distance_m;
        path.add_vehicle(x, None, &gradient, observation);
        if let Some(report) = path.add_ship(&gradient, observation) {
            by_ship += gradient.position;
            reported = Some(report);
        }
    }
    if let Some(report) = reported {
        observation.variance += report_variance(report, &by_position(by_ship));
    }
    Ok(())
}
