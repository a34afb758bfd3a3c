//! Attitude (Table 2.1): h(x) = [φ θ ψ].
//!
//! Euler angles of the body in NED, rad; heading true. The innovation is the shorter way round.
//! Near θ = ±90°, where roll and heading are one angle, the filter measures a rotation vector instead.

use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::observation::Observations;
use crate::state::{PHI, wrap_angle};

pub(crate) fn observe(x: &Estimate, euler_rad: &[f64; 3], sigma_rad: &[f64; 3], out: &mut Observations) {
    for (i, (angle, sigma_rad)) in euler_rad.iter().zip(sigma_rad).enumerate() {
        out.add_direct(PHI + i, wrap_angle(angle - x.get(PHI + i)), sigma_rad * sigma_rad);
    }
}
