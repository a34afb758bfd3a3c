//! Coriolis and centripetal wrench of rigid body and added mass, ad(v) M v (3.8).

use nalgebra::{Matrix6, Vector6};

/// ad(v) M v with M = diag(m): stands on the left of (3.2), does no work (vᵀ ad(v) M v = 0).
///
/// N and N m.
#[must_use]
pub fn coriolis(m: &[f64; 6], velocity: &Vector6<f64>) -> Vector6<f64> {
    let [u, v, w, p, q, r] = velocity.data.0[0];
    Vector6::new(
        q * m[2] * w - r * m[1] * v,
        r * m[0] * u - p * m[2] * w,
        p * m[1] * v - q * m[0] * u,
        (m[2] - m[1]) * v * w + (m[5] - m[4]) * q * r,
        (m[0] - m[2]) * w * u + (m[3] - m[5]) * r * p,
        (m[1] - m[0]) * u * v + (m[4] - m[3]) * p * q,
    )
}

/// ∂(ad(v) M v)/∂v.
#[must_use]
pub fn coriolis_by_velocity(m: &[f64; 6], velocity: &Vector6<f64>) -> Matrix6<f64> {
    let [u, v, w, p, q, r] = velocity.data.0[0];
    let (yz, zx, xy) = (m[2] - m[1], m[0] - m[2], m[1] - m[0]);
    let (qr, rp, pq) = (m[5] - m[4], m[3] - m[5], m[4] - m[3]);
    #[rustfmt::skip]
    let jacobian = Matrix6::new(
        0.0,       -r * m[1],  q * m[2],  0.0,       m[2] * w, -m[1] * v,
        r * m[0],  0.0,       -p * m[2], -m[2] * w,  0.0,       m[0] * u,
        -q * m[0], p * m[1],   0.0,       m[1] * v, -m[0] * u,  0.0,
        0.0,       yz * w,     yz * v,    0.0,       qr * r,    qr * q,
        zx * w,    0.0,        zx * u,    rp * r,    0.0,       rp * p,
        xy * v,    xy * u,     0.0,       pq * q,    pq * p,    0.0,
    );
    jacobian
}
