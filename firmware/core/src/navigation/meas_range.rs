//! Acoustic range (2.34): h(x) = |p_vehicle − p_ship|, each at its own acoustic event.
//!
//! Downlink: vehicle at arrival, ship at launch; uplink: vehicle at launch, ship at arrival. One-way
//! travel time multiplied by sound speed, m; NED, the ship at its transducer's depth. H is the unit vector from
//! ship to vehicle ((2.35)-(2.38), read as range² = xᵀAᵀA x).
//! Invalid when the ends coincide or the ship is not known.

use super::acoustic::{Path, by_position, report_variance};
use super::estimate::Estimate;
use super::observation::{Observations, Refused};
use super::{AcousticPath, NavigationConfig};

pub(super) fn observe(
    x: &Estimate,
    path: &AcousticPath,
    range_m: f64,
    config: &NavigationConfig,
    out: &mut Observations,
) -> Result<(), Refused> {
    let path = Path::new(x, path, config);
    let path = path.as_ref().map_err(|refused| *refused)?;
    let gradient = by_position(path.direction());
    let noise = config.sensors.range_m * config.sensors.range_m;
    let observation = out.add(range_m - path.distance_m, noise);
    path.add_vehicle(x, None, &gradient, observation);
    if let Some(report) = path.add_ship(&gradient, observation) {
        observation.variance += report_variance(report, &gradient);
    }
    Ok(())
}
