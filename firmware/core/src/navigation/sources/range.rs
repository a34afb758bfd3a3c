//! Acoustic range (2.34): h(x) = |p_vehicle − p_ship|, each at its own acoustic event.
//!
//! Downlink: vehicle at arrival, ship at launch; uplink: vehicle at launch, ship at arrival. One-way
//! travel time multiplied by sound speed, m; NED, the ship at its transducer's depth. H is the unit vector from
//! ship to vehicle ((2.35)-(2.38), read as range² = xᵀAᵀA x).
//! Invalid when the ends coincide or the ship is not known.
//!
//! A range circle is not its tangent: with σ one sigma of the position across the path, |p| exceeds |p̂| by σ²/2r on
//! average, with a variance of σ⁴/2r² (the Gaussian second-order filter: Bar-Shalom, Li and Kirubarajan, 2001, 10.3).
//! Where this is large compared with the noise, a first-order filter becomes overconfident: see `range_curvature` of
//! the configuration.

use super::acoustic::{Path, by_position};
use crate::navigation::algebra::covariance::Covariance;
use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::{Observation, Observations, Refused};
use crate::navigation::interface::config::NavigationConfig;
use crate::navigation::interface::measurement::AcousticPath;
use crate::state::{X, Y};
use nalgebra::Vector3;

/// Horizontal distance below which across has no direction, m.
const MIN_GROUND_M: f64 = 1.0e-3;

pub(crate) fn observe(
    x: &Estimate,
    p: &Covariance,
    path: &AcousticPath,
    range_m: f64,
    config: &NavigationConfig,
    out: &mut Observations,
) -> Result<(), Refused> {
    let path = Path::new(x, path, config);
    let path = path.as_ref().map_err(|refused| *refused)?;
    let observation = out.add(0.0, 0.0);
    let curvature_m = curvature(x, p, path, config, observation);
    observation.row.clear();

    let gradient = by_position(path.direction);
    observation.innovation = range_m - path.distance_m - 0.5 * curvature_m;
    observation.variance = config.sensors.range_m * config.sensors.range_m + 0.5 * curvature_m * curvature_m;
    path.add_vehicle(x, None, &gradient, observation);
    path.add_ship(&gradient, observation);
    Ok(())
}

/// σ²/r of the position across the path, at most r, m; 0 where it is little. `scratch` is used up.
fn curvature(
    x: &Estimate,
    p: &Covariance,
    path: &Path<'_>,
    config: &NavigationConfig,
    scratch: &mut Observation,
) -> f64 {
    let little = config.range_curvature * config.sensors.range_m * path.distance_m;
    if p.get(X, X) + p.get(Y, Y) <= little {
        return 0.0;
    }
    // Depth is known: across means in the horizontal.
    let (north, east) = (path.dp.x, path.dp.y);
    let ground_m = libm::sqrt(north * north + east * east).max(MIN_GROUND_M);
    let across = by_position(Vector3::new(-east / ground_m, north / ground_m, 0.0));
    path.add_vehicle(x, None, &across, scratch);
    path.add_ship(&across, scratch);
    let spread = p.bilinear(&scratch.row, &scratch.row) + scratch.variance;
    (spread / path.distance_m).min(path.distance_m)
}
