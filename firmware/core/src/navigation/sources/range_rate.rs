//! Acoustic range rate (2.39): h(x) = dp · dv / |dp|, positive opening.
//!
//! dp and dv are position and velocity over ground of the vehicle relative to the ship, each at its
//! own acoustic event; m/s, NED. The Jacobian is (2.43) with the derivative of R by
//! attitude, which the print omits.
//! Invalid when the ends coincide or the ship is not known. A Doppler that was measured against sound speed is a
//! range rate only while both ends move slowly compared with sound.
//!
//! It turns with the bearing. An error of the position across the path turns the bearing of all range rates of the next
//! minutes alike, so that it is no noise of theirs: they are not used while the position is uncertain.

use super::acoustic::{Gradient, Path};
use super::models::range_rate;
use crate::dynamics::Attitude;
use crate::navigation::algebra::covariance::Covariance;
use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::{Observations, Refused};
use crate::navigation::interface::config::NavigationConfig;
use crate::navigation::interface::measurement::{AcousticPath, FusionOutcome};
use crate::state::{self, X, Y};

pub(crate) fn observe(
    x: &Estimate,
    p: &Covariance,
    path: &AcousticPath,
    range_rate_mps: f64,
    config: &NavigationConfig,
    out: &mut Observations,
) -> Result<(), Refused> {
    if p.get(X, X) + p.get(Y, Y) > config.range_rate_within_m * config.range_rate_within_m {
        return Err(FusionOutcome::PositionUncertain);
    }
    let path = Path::new(x, path, config);
    let path = path.as_ref().map_err(|refused| *refused)?;
    let attitude = Attitude::new(&state::attitude(&x.vehicle));
    let rate = range_rate(&path.dp, &path.relative_velocity(x, &attitude)).ok_or(FusionOutcome::Invalid)?;
    let gradient = Gradient { position: rate.by_position, velocity: rate.by_velocity };
    let noise = config.sensors.range_rate_mps * config.sensors.range_rate_mps;
    let observation = out.add(range_rate_mps - rate.range_rate_mps, noise);
    path.add_vehicle(x, Some(&attitude), &gradient, observation);
    path.add_ship(&gradient, observation);
    Ok(())
}
