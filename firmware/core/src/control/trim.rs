//! Straight level flight: the pitch, fins and thrust that hold speed and depth.

use crate::dynamics::{ActuatorInput, VehicleModel};
use crate::state::{self, VehicleState};
use nalgebra::Vector3;

/// Newton steps; it takes about five from level.
const MAX_STEPS: usize = 20;
/// Steepest pitch of a trim, rad: beyond it the vehicle is not in level flight but falls or climbs.
const MAX_PITCH_RAD: f64 = 0.5;

/// Longest step where whole ones lead nowhere, rad: drag across the hull goes with w |w|, and from level its slope is
/// nothing.
const MAX_STEP_RAD: f64 = 0.1;

/// Straight level flight at one speed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trim {
    /// Surge velocity u, m/s.
    pub surge_mps: f64,
    /// Heave velocity w = u tan θ, m/s, so that the depth is steady.
    pub heave_mps: f64,
    /// Pitch θ, rad.
    pub pitch_rad: f64,
    /// Thrust, N.
    pub thrust_n: f64,
    /// Fins [top, bottom, port, starboard], rad: only port = −starboard differ from zero.
    pub fins_rad: [f64; 4],
    /// Moment of the fins about y, N m.
    pub fin_pitch_moment_nm: f64,
}

impl Trim {
    /// All zero: no speed.
    pub const REST: Self = Self {
        surge_mps: 0.0,
        heave_mps: 0.0,
        pitch_rad: 0.0,
        thrust_n: 0.0,
        fins_rad: [0.0; 4],
        fin_pitch_moment_nm: 0.0,
    };

    /// Solves u̇ = ẇ = q̇ = 0 and ż = 0 at surge speed `surge_mps` by Newton's method.
    ///
    /// Roll, sway and the rates are zero: exact for a vehicle that is symmetric about its vertical plane.
    ///
    /// `None` when there is no such flight within the fins' range and 0.5 rad of pitch, or not within 20 steps.
    #[must_use]
    pub fn solve(model: &VehicleModel, surge_mps: f64) -> Option<Self> {
        Self::newton(model, surge_mps, f64::INFINITY).or_else(|| Self::newton(model, surge_mps, MAX_STEP_RAD))
    }

    fn newton(model: &VehicleModel, surge_mps: f64, max_step_rad: f64) -> Option<Self> {
        let (mut pitch, mut fin) = (0.0, 0.0);
        for _ in 0..MAX_STEPS {
            let x = state_at(surge_mps, pitch);
            let input = input_at(fin);
            let l = model.linearise(&x, &input);
            let (heave_acceleration, pitch_acceleration) = (l.f[state::W], l.f[state::Q]);
            if heave_acceleration.abs() + pitch_acceleration.abs() < 1e-12 {
                return accept(model, &x, fin);
            }
            // w = u tan θ moves with the pitch.
            let (_, cos) = libm::sincos(pitch);
            let heave_by_pitch = surge_mps / (cos * cos);
            let by_pitch = |row: usize| {
                l.acceleration_by_roll_pitch[(row, 1)] + l.acceleration_by_velocity[(row, 2)] * heave_by_pitch
            };
            let by_input = model.input_jacobian(&x, &input);
            let by_fin = |row: usize| by_input[(row, 3)] - by_input[(row, 4)];
            let (a, b, c, d) = (by_pitch(2), by_fin(state::W), by_pitch(4), by_fin(state::Q));
            let determinant = a * d - b * c;
            let pitch_step = (d * heave_acceleration - b * pitch_acceleration) / determinant;
            let fin_step = (a * pitch_acceleration - c * heave_acceleration) / determinant;
            let longest = if pitch_step.abs() > fin_step.abs() { pitch_step.abs() } else { fin_step.abs() };
            let share = if longest > max_step_rad { max_step_rad / longest } else { 1.0 };
            pitch -= share * pitch_step;
            fin -= share * fin_step;
            // NaN fails the comparison too.
            let inside = pitch.abs() < MAX_PITCH_RAD && fin.abs() <= model.parameters().delta_max_rad;
            if !inside {
                return None;
            }
        }
        None
    }

    /// The trim as a state at the origin, heading north.
    #[must_use]
    pub fn state(&self) -> VehicleState {
        state_at(self.surge_mps, self.pitch_rad)
    }
}

fn state_at(surge_mps: f64, pitch: f64) -> VehicleState {
    let mut x = VehicleState::zeros();
    x[state::THETA] = pitch;
    x[state::U] = surge_mps;
    x[state::W] = surge_mps * libm::tan(pitch);
    x
}

fn input_at(fin: f64) -> ActuatorInput {
    ActuatorInput { propeller_radps: 0.0, fins_rad: [0.0, 0.0, fin, -fin] }
}

fn accept(model: &VehicleModel, x: &VehicleState, fin: f64) -> Option<Trim> {
    let input = input_at(fin);
    let attitude = Vector3::new(0.0, x[state::THETA], 0.0);
    let velocity = state::velocity(x);
    let coasting = model.acceleration(&attitude, &velocity, &input);
    let thrust_n = -model.parameters().m_diag[0] * coasting[0];
    (thrust_n.is_finite() && thrust_n >= 0.0).then_some(Trim {
        surge_mps: x[state::U],
        heave_mps: x[state::W],
        pitch_rad: x[state::THETA],
        thrust_n,
        fins_rad: input.fins_rad,
        fin_pitch_moment_nm: model.fin_wrenches(&velocity, &input.fins_rad).iter().map(|wrench| wrench[4]).sum(),
    })
}
