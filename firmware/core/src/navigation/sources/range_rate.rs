//! Acoustic range rate (2.39): h(x) = dp · dv / |dp|, positive opening.
//!
//! dp and dv are position and velocity over ground of the vehicle relative to the ship, each at its
//! own acoustic event; m/s, NED. The Jacobian is (2.43) with the derivative of R by
//! attitude, which the print omits.
//! Invalid when the ends coincide or the ship is not known. A Doppler that was measured against sound speed is a
//! range rate only while both ends move slowly compared with sound.
//!
//! It turns with the bearing. With s the position and v the relative velocity across the path, r the distance,
//! ∂²h/∂s² = −h/r² and ∂²h/∂s∂v = 1/r: where s is uncertain these add to the mean and to the noise, as for
//! [`super::range`].

use super::acoustic::{Gradient, Path, by_position};
use super::models::range_rate;
use crate::dynamics::Attitude;
use crate::navigation::algebra::covariance::Covariance;
use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::{Observation, Observations, Refused};
use crate::navigation::interface::config::NavigationConfig;
use crate::navigation::interface::measurement::{AcousticPath, FusionOutcome};
use crate::state::{self, X, Y};
use nalgebra::Vector3;

pub(crate) fn observe(
    x: &Estimate,
    p: &Covariance,
    path: &AcousticPath,
    range_rate_mps: f64,
    config: &NavigationConfig,
    out: &mut Observations,
) -> Result<(), Refused> {
    let path = Path::new(x, path, config);
    let path = path.as_ref().map_err(|refused| *refused)?;
    let attitude = Attitude::new(&state::attitude(&x.vehicle));
    let dv = path.relative_velocity(x, &attitude);
    let rate = range_rate(&path.dp, &dv).ok_or(FusionOutcome::Invalid)?;
    let gradient = Gradient { position: rate.by_position, velocity: rate.by_velocity };
    let noise = config.sensors.range_rate_mps * config.sensors.range_rate_mps;
    let observation = out.add(range_rate_mps - rate.range_rate_mps, noise);
    path.add_vehicle(x, Some(&attitude), &gradient, observation);
    path.add_ship(&gradient, observation);
    // ½ dv σ²/r² is what first order leaves out.
    let little = config.range_curvature * config.sensors.range_rate_mps * path.distance_m * path.distance_m;
    if (p.get(X, X) + p.get(Y, Y)) * dv.norm() > little {
        let [mean_mps, variance] = second_order(x, p, path, &attitude, rate.range_rate_mps);
        observation.innovation -= mean_mps;
        observation.variance += variance;
    }
    Ok(())
}

/// What the second derivatives add to mean, m/s, and variance, (m/s)²: ½ tr(H P) and ½ tr(H P H P) for s and v.
#[cold]
#[inline(never)]
fn second_order(x: &Estimate, p: &Covariance, path: &Path<'_>, attitude: &Attitude, range_rate_mps: f64) -> [f64; 2] {
    let across = path.across();
    let mut s = Observation::NONE;
    let by_s = by_position(across);
    path.add_vehicle(x, None, &by_s, &mut s);
    path.add_ship(&by_s, &mut s);
    let mut v = Observation::NONE;
    let by_v = Gradient { position: Vector3::zeros(), velocity: across };
    path.add_vehicle(x, Some(attitude), &by_v, &mut v);
    path.add_ship(&by_v, &mut v);
    // Angles: s/r, at most one as for the range.
    let r = path.distance_m;
    let spread = (p.bilinear(&s.row, &s.row) + s.variance) / (r * r);
    let shrink = libm::sqrt(spread.min(1.0) / spread.max(f64::MIN_POSITIVE));
    let ss = spread.min(1.0);
    let sv = shrink * p.bilinear(&s.row, &v.row) / r;
    let vv = p.bilinear(&v.row, &v.row) + v.variance;
    let h = range_rate_mps;
    [sv - 0.5 * h * ss, 0.5 * h * h * ss * ss - 2.0 * h * ss * sv + ss * vv + sv * sv]
}
