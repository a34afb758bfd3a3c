//! LQR trackline following: the model linearised about straight level flight, steered by thrust and moments.
//!
//! State: the vehicle's twelve states relative to the line, in the line's frame (x along it, y to its right), so that
//! one gain serves every heading. Inputs: [dX, dM, dN], changes of thrust (N) and of the fins' moments (N m) from trim.
//! A is the model's analytic Jacobian, fins included: their passive damping stays, without it roll has none. A moment
//! from the stern comes with a side force, Y = N/x_fin and Z = −M/x_fin, which is in B.
//!
//! Steady disturbances: the crab angle compensates a known current (the reference heading turns, so every error is zero
//! in the steady state). An unknown disturbance leaves an offset of disturbance over gain, 5 N m per metre of
//! cross-track error: 9 cm for a fin bent by 2 degrees, below the filter's own error. Integral action, which can wind
//! up, is therefore not needed. An unestimated current (0.8 m for each 0.1 m/s across) displaces the estimate by far
//! more.

use super::ControlError;
use super::allocation::{Moments, pitch_lever_m, yaw_lever_m};
use super::guidance::GuidanceGains;
use super::riccati::{RiccatiError, RiccatiSolver};
use super::trim::Trim;
use crate::dynamics::{ActuatorInput, VehicleModel};
use crate::state::{self, VehicleState};
use nalgebra::{SMatrix, SVector};

/// Inputs of the regulator: dX, dM, dN.
pub const LQR_INPUTS: usize = 3;

/// K, 3 x 12: [dX dM dN] = −K · error.
pub type LqrGain = SMatrix<f64, LQR_INPUTS, 12>;

/// A speed this close to the gain's needs no new one, as a share: moments per fin angle differ by twice that.
const SPEED_TOLERANCE: f64 = 0.05;

/// Weights by Bryson's rule: the deviation of each state and input that is just acceptable; Q and R are their
/// inverse squares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LqrWeights {
    /// x, y, z (m); φ, θ, ψ (rad); u, v, w (m/s); p, q, r (rad/s).
    pub state_deviation: [f64; 12],
    /// dX (N), dM, dN (N m).
    pub input_deviation: [f64; LQR_INPUTS],
}

impl LqrWeights {
    /// A metre across the line, 0.2 m in depth: the survey asks more of depth, and the depth sensor is better
    /// than the position. 5° of pitch, 10° of heading and as much per second keep turns gentle. 0.1 m/s of
    /// surge; 0.3 and 0.2 m/s of sway and heave, which follow anyway. 5 N and 5 N m are within the fins'
    /// linear range at 1 m/s. Roll has no input and is left to the keel: 31.6 rad is a weight of 1e-3.
    pub const DEFAULT: Self = Self {
        state_deviation: [
            1.0,
            1.0,
            0.2,
            31.622_776_601_683_793,
            5.0 * RAD_PER_DEG,
            10.0 * RAD_PER_DEG,
            0.1,
            0.3,
            0.2,
            31.622_776_601_683_793,
            5.0 * RAD_PER_DEG,
            10.0 * RAD_PER_DEG,
        ],
        input_deviation: [5.0; LQR_INPUTS],
    };
}

const RAD_PER_DEG: f64 = core::f64::consts::PI / 180.0;

/// Output of the regulator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LqrDemand {
    /// dX: thrust above the reference's, N.
    pub thrust_n: f64,
    /// dM, dN: above the moments of the fins at the reference's angles, N m.
    pub moments: Moments,
}

/// The regulator with its gain, and the next gain in the making.
#[derive(Clone, Debug)]
pub struct Lqr {
    trim: Trim,
    gain: LqrGain,
    solver: RiccatiSolver<12, LQR_INPUTS>,
    /// Trim of the gain that the solver works on.
    pending: Option<Trim>,
    /// A speed without trim or gain, which is not tried again.
    refused_mps: Option<f64>,
    /// The gain in force belongs to another vehicle.
    stale: bool,
}

impl Lqr {
    /// Without a gain: asks for nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            trim: Trim::REST,
            gain: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; LQR_INPUTS]; 12])),
            solver: RiccatiSolver::new(),
            pending: None,
            refused_mps: None,
            stale: false,
        }
    }

    /// Solves trim and gain at `speed_mps` at once.
    ///
    /// # Errors
    /// No trim, or no gain; the old one stays then.
    pub fn configure(&mut self, model: &VehicleModel, speed_mps: f64) -> Result<(), ControlError> {
        let trim = Trim::solve(model, speed_mps).ok_or(ControlError::NoTrim)?;
        self.pending = None;
        start(&mut self.solver, model, &trim).map_err(|_| ControlError::NoGain)?;
        for _ in 0..RiccatiSolver::<12, LQR_INPUTS>::MAX_STEPS {
            if self.solver.step().map_err(|_| ControlError::NoGain)? {
                self.trim = trim;
                self.solver.gain_to(&mut self.gain);
                self.refused_mps = None;
                self.stale = false;
                return Ok(());
            }
        }
        Err(ControlError::NoGain)
    }

    /// The vehicle changed: [`Self::advance`] works towards a gain for the new one.
    pub fn renew(&mut self) {
        self.stale = true;
        self.pending = None;
        self.refused_mps = None;
    }

    /// Works towards the gain for `speed_mps`, one slice a call: about 35 calls after the speed changed by more
    /// than 5 % the new gain is in force. Until then, and where there is none, the old one stays.
    pub fn advance(&mut self, model: &VehicleModel, speed_mps: f64) {
        let near = |speed: f64| (speed - speed_mps).abs() <= SPEED_TOLERANCE * speed;
        if (near(self.trim.surge_mps) && !self.stale) || self.refused_mps.is_some_and(near) {
            self.pending = None;
            return;
        }
        let done = match self.pending {
            Some(pending) if near(pending.surge_mps) => self.solver.step(),
            _ => {
                self.pending = Trim::solve(model, speed_mps);
                match &self.pending {
                    Some(trim) => start(&mut self.solver, model, trim).map(|()| false),
                    None => Err(RiccatiError::NotStabilisable),
                }
            }
        };
        match (done, self.pending) {
            (Ok(true), Some(trim)) => {
                self.trim = trim;
                self.solver.gain_to(&mut self.gain);
                self.pending = None;
                self.refused_mps = None;
                self.stale = false;
            }
            (Ok(_), _) => {}
            (Err(_), _) => {
                self.pending = None;
                self.refused_mps = Some(speed_mps);
            }
        }
    }

    /// Straight level flight that the gain is for.
    #[must_use]
    pub fn trim(&self) -> &Trim {
        &self.trim
    }

    /// K.
    #[must_use]
    pub fn gain(&self) -> &LqrGain {
        &self.gain
    }

    /// −K · error. Offsets are cut to where heading and pitch weigh against them at the guidance's largest approach
    /// angles: beyond, the linear law would turn the vehicle in circles. What they and the heading then ask for
    /// together is cut to where the turn rate weighs against it at `turn_rate_max_radps`.
    #[must_use]
    pub fn demand(&self, error: &VehicleState, turn_rate_max_radps: f64) -> LqrDemand {
        let (k, guidance) = (&self.gain, GuidanceGains::DEFAULT);
        let across_max_m = guidance.approach_max_rad * ratio(k[(2, state::PSI)], k[(2, state::Y)]);
        let depth_max_m = guidance.pitch_max_rad * ratio(k[(1, state::THETA)], k[(1, state::Z)]);
        let mut bounded = *error;
        for (index, limit) in [(state::X, across_max_m), (state::Y, across_max_m), (state::Z, depth_max_m)] {
            bounded[index] = bounded[index].max(-limit).min(limit);
        }
        let mut demand: SVector<f64, LQR_INPUTS> = -(k * bounded);
        let turn = k[(2, state::Y)] * bounded[state::Y] + k[(2, state::PSI)] * bounded[state::PSI];
        let turn_max = k[(2, state::R)].abs() * turn_rate_max_radps;
        if turn.abs() > turn_max {
            demand[2] += turn - turn_max.copysign(turn);
        }
        LqrDemand { thrust_n: demand[0], moments: Moments { roll_nm: 0.0, pitch_nm: demand[1], yaw_nm: demand[2] } }
    }
}

fn ratio(a: f64, b: f64) -> f64 {
    let ratio = (a / b).abs();
    if ratio.is_finite() { ratio } else { 0.0 }
}

/// B = ∂ẋ/∂[dX dM dN], side forces included.
#[must_use]
pub fn lqr_input_matrix(model: &VehicleModel) -> SMatrix<f64, 12, LQR_INPUTS> {
    let m = &model.parameters().m_diag;
    let mut b = SMatrix::<f64, 12, LQR_INPUTS>::zeros();
    b[(state::U, 0)] = 1.0 / m[0];
    b[(state::W, 1)] = -1.0 / (pitch_lever_m(model) * m[2]);
    b[(state::Q, 1)] = 1.0 / m[4];
    b[(state::V, 2)] = 1.0 / (yaw_lever_m(model) * m[1]);
    b[(state::R, 2)] = 1.0 / m[5];
    b
}

fn start(solver: &mut RiccatiSolver<12, LQR_INPUTS>, model: &VehicleModel, trim: &Trim) -> Result<(), RiccatiError> {
    let input = ActuatorInput {
        propeller_radps: super::speed::propeller_radps(model.propeller(), trim.thrust_n, trim.surge_mps),
        fins_rad: trim.fins_rad,
    };
    let (a, q) = solver.matrices();
    model.linearise(&trim.state(), &input).F_to(a);
    let b = lqr_input_matrix(model);
    let LqrWeights { state_deviation, input_deviation } = LqrWeights::DEFAULT;
    let inverse_square = |d: f64| 1.0 / (d * d);
    q.fill(0.0);
    q.set_diagonal(&SVector::from(state_deviation.map(inverse_square)));
    let r = SMatrix::from_diagonal(&SVector::from(input_deviation.map(inverse_square)));
    solver.begin(&b, &r)
}
