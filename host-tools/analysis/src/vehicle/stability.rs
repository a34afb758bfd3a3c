//! Stability of straight level flight: eigenvalues of the linearised dynamics, in words.

use backseat_core::control::trim::Trim;
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::state::{P, PHI, Q, R, THETA, U, V, W};
use nalgebra::{Complex, Matrix4};
use std::f64::consts::TAU;

/// A motion that grows slower than this is held by any autopilot, s to double.
const SLOW_S: f64 = 1.0;

/// One natural motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// In the vertical plane, or sideways.
    pub plane: &'static str,
    /// Eigenvalue, 1/s.
    pub eigenvalue: Complex<f64>,
}

/// Motions of the vertical plane (u, w, q, θ) and sideways (v, p, r, φ), slowest decay first. They are separate for a
/// vehicle that is symmetric about its vertical plane.
pub fn modes(model: &VehicleModel, trim: &Trim, propeller_radps: f64) -> Vec<Mode> {
    let input = ActuatorInput { propeller_radps, fins_rad: trim.fins_rad };
    let f = model.linearise(&trim.state(), &input).F();
    let of = |plane, states: [usize; 4]| {
        let block = Matrix4::from_fn(|i, j| f[(states[i], states[j])]);
        block.complex_eigenvalues().iter().map(|eigenvalue| Mode { plane, eigenvalue: *eigenvalue }).collect::<Vec<_>>()
    };
    let mut modes = of("vertical plane", [U, W, Q, THETA]);
    modes.extend(of("sideways", [V, P, R, PHI]));
    // one of each pair
    modes.retain(|mode| mode.eigenvalue.im >= 0.0);
    modes.sort_by(|a, b| b.eigenvalue.re.total_cmp(&a.eigenvalue.re));
    modes
}

impl Mode {
    /// Whether it grows faster than steering holds.
    pub fn is_violent(&self) -> bool {
        self.eigenvalue.re > std::f64::consts::LN_2 / SLOW_S
    }

    /// What it does, for people.
    pub fn words(&self) -> String {
        let Complex { re, im } = self.eigenvalue;
        let change = |rate: f64| std::f64::consts::LN_2 / rate.abs();
        let fate = match re {
            re if re > 1e-4 => format!("unstable, doubles in {:.1} s (steering has to hold it)", change(re)),
            re if re > -1e-4 => "neutral".to_owned(),
            re => format!("stable, halves in {:.1} s", change(re)),
        };
        if im > 1e-6 {
            let damping = -re / re.hypot(im);
            format!("{}: oscillates with a period of {:.1} s, damping {damping:.2}; {fate}", self.plane, TAU / im)
        } else {
            format!("{}: {fate}", self.plane)
        }
    }
}
