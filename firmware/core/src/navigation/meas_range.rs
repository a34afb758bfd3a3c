//! Acoustic range (2.34): h(x) = |p_vehicle − p_ship|, each at its own acoustic event.
//!
//! Downlink: vehicle at arrival, ship at launch; uplink: vehicle at launch, ship at arrival. One-way
//! travel time multiplied by sound speed, m; NED, the ship at its transducer's depth. H is the unit vector from
//! ship to vehicle ((2.35)-(2.38), read as range² = xᵀAᵀA x).
//! Invalid when the ends coincide or the ship is not known.

use super::acoustic::{Path, by_position, report_variance};
use super::estimate::Estimate;
use super::observation::{Observation, Observations, Refused};
use super::row::Row;
use super::{AcousticPath, NavigationConfig};

pub(super) fn observe(
    x: &Estimate,
    path: &AcousticPath,
    range_m: f64,
    config: &NavigationConfig,
) -> Result<Observations, Refused> {
    let path = Path::new(x, path, config)?;
    let gradient = by_position(path.direction());
    let mut row = Row::EMPTY;
    let mut variance = config.sensors.range_m * config.sensors.range_m;
    path.add_vehicle(x, &gradient, &mut row, &mut variance);
    if let Some((report, by)) = path.add_ship(&gradient, &mut row) {
        variance += report_variance(&report, &by);
    }
    Ok(Observations::new([Observation { innovation: range_m - path.distance_m, row, variance }]))
}
