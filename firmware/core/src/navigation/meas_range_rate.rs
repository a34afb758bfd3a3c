//! Acoustic range rate (2.39): h(x) = dp · dv / |dp|, positive opening.
//!
//! dp and dv are position and velocity over ground of the vehicle relative to the ship, each at its
//! own acoustic event; m/s, NED. The Jacobian is (2.43) with the derivative of R by
//! attitude, which the print omits.
//! Invalid when the ends coincide or the ship is not known. A Doppler that was measured against sound speed is a
//! range rate only while both ends move slowly compared with sound.

use super::acoustic::{Gradient, Path, report_variance};
use super::estimate::Estimate;
use super::observation::{Observation, Observations, Refused};
use super::row::Row;
use super::{AcousticPath, NavigationConfig};

pub(super) fn observe(
    x: &Estimate,
    path: &AcousticPath,
    range_rate_mps: f64,
    config: &NavigationConfig,
) -> Result<Observations, Refused> {
    let path = Path::new(x, path, config)?;
    let direction = path.direction();
    let dv = path.relative_velocity(x);
    let range_rate = direction.dot(&dv);
    let across = dv - direction * range_rate;
    let gradient = Gradient { position: across / path.distance_m, velocity: direction };
    let mut row = Row::EMPTY;
    let mut variance = config.sensors.range_rate_mps * config.sensors.range_rate_mps;
    path.add_vehicle(x, &gradient, &mut row, &mut variance);
    if let Some((report, by)) = path.add_ship(&gradient, &mut row) {
        variance += report_variance(&report, &by);
    }
    Ok(Observations::new([Observation { innovation: range_rate_mps - range_rate, row, variance }]))
}
