//! A vehicle that turns, dives and changes its speed, as its sensors say: something in it depends on every parameter.

use super::random::Random;
use backseat_core::dynamics::ActuatorInput;
use nalgebra::{Vector3, Vector6};

/// Attitude, velocity through the water and input at sample `k` of 10 Hz.
pub fn sample(k: u64, random: &mut Random) -> (Vector3<f64>, Vector6<f64>, ActuatorInput) {
    let wave = |period_s: f64, size: f64| size * libm::sin(core::f64::consts::TAU * 0.1 * k as f64 / period_s);
    let noise: [f64; 8] = random.array(1.0);
    let [u, v, w, p, q, r, roll, pitch] = noise;
    let attitude = Vector3::new(wave(7.0, 0.1) + 4e-3 * roll, wave(23.0, 0.2) + 4e-3 * pitch, wave(61.0, 1.5));
    let velocity = Vector6::new(
        1.2 + wave(31.0, 0.4) + 0.01 * u,
        wave(13.0, 0.08) + 0.01 * v,
        wave(17.0, 0.06) + 0.01 * w,
        wave(7.0, 0.1) + 1e-4 * p,
        wave(11.0, 0.1) + 1e-4 * q,
        wave(19.0, 0.15) + 1e-4 * r,
    );
    let fins_rad = [wave(19.0, 0.2), wave(29.0, 0.2), wave(11.0, 0.15), wave(37.0, -0.15)];
    (attitude, velocity, ActuatorInput { propeller_radps: 110.0 + wave(31.0, 30.0), fins_rad })
}
