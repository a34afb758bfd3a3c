//! Attitude (Table 2.1): h(x) = [φ θ ψ].
//!
//! Euler angles of the body in NED, rad; heading true. The innovation is the shorter way round.
//! Invalid near θ = ±90°, where roll and heading are one angle.

use super::estimate::Estimate;
use super::observation::{Observation, Observations};
use crate::state::{PHI, wrap_angle};

pub(super) fn observe(x: &Estimate, euler_rad: &[f64; 3], sigma_rad: f64) -> Observations {
    Observations::new(core::array::from_fn::<_, 3, _>(|i| {
        let (predicted, row) = x.direct(PHI + i);
        Observation { innovation: wrap_angle(euler_rad[i] - predicted), row, variance: sigma_rad * sigma_rad }
    }))
}
