//! Parameter sets predict the same motion open loop; which predicts better, and is that more than luck?
//!
//! Every [`HORIZON_STEPS`] samples all sets start from the same measured attitude and velocity; from there they are
//! driven by fins and propeller alone. Their errors are weighed by those of a perfect model: sensor noise, and the
//! process noise accumulated over half the horizon. Stretches are short and start afresh, so their outcomes are
//! independent. The logarithm of the ratio of two sets' errors keeps one wild stretch from deciding.

use super::aid::{Instant, model_acceleration};
use super::theta::Theta;
use crate::dynamics::{ActuatorInput, Attitude, VehicleModel};
use crate::state::wrap_angle;
use nalgebra::{Vector3, Vector6};

/// Samples of a stretch: 15 s at 10 Hz, twice the time constant of surge, which is the slowest.
pub const HORIZON_STEPS: u16 = 150;
/// Roll, pitch and the axes of v.
const CHANNELS: usize = 8;
/// Largest mean weighed square of a prediction: a diverged one counts as this.
const LOST: f64 = 1.0e4;
/// Standard errors of the mean: one-sided 1 % by Student's t with the fewest stretches, 0.4 % with thirty.
const CONFIDENCE: f64 = 2.8;
/// Fewest stretches for a verdict.
pub const FEWEST_STRETCHES: u16 = 10;
/// A smaller gain is not worth a change: 2 % of the mean squared error.
const MARGIN: f64 = 0.02;

/// Role of a parameter set in a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ModelRole {
    /// In use: the others are compared with it.
    Active,
    /// Might be used.
    Candidate,
    /// Was in use before.
    Previous,
}

const ROLES: usize = 3;

/// One parameter set and where its prediction stands.
#[derive(Clone, Copy)]
struct OpenLoopModel {
    entered: bool,
    theta: Theta,
    roll_pitch_rad: [f64; 2],
    velocity: Vector6<f64>,
    /// Sum of the weighed squares of this stretch.
    missed: f64,
}

const NO_VELOCITY: Vector6<f64> = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);

impl OpenLoopModel {
    const NONE: Self = Self {
        entered: false,
        theta: Theta::from_array_storage(nalgebra::ArrayStorage([[0.0; super::PARAMETERS]])),
        roll_pitch_rad: [0.0; 2],
        velocity: NO_VELOCITY,
        missed: 0.0,
    };

    /// Rates of roll, pitch and velocity.
    fn derivative(
        &self,
        model: &VehicleModel,
        roll_pitch_rad: [f64; 2],
        velocity: &Vector6<f64>,
        input: &ActuatorInput,
    ) -> ([f64; 2], Vector6<f64>) {
        let attitude = Attitude::new(&Vector3::new(roll_pitch_rad[0], roll_pitch_rad[1], 0.0));
        let euler = attitude.euler_rate_matrix() * Vector3::new(velocity[3], velocity[4], velocity[5]);
        let at = Instant::new(model, velocity, &attitude.down(), input);
        ([euler[0], euler[1]], model_acceleration(&self.theta, &at))
    }

    /// One sample on, by the classical Runge-Kutta step: the natural frequency of roll is 1 Hz.
    fn advance(&mut self, model: &VehicleModel, input: &ActuatorInput, dt: f64) {
        let (angles, v) = (self.roll_pitch_rad, self.velocity);
        let moved = |rate: [f64; 2], time: f64| [angles[0] + rate[0] * time, angles[1] + rate[1] * time];
        let (e1, a1) = self.derivative(model, angles, &v, input);
        let (e2, a2) = self.derivative(model, moved(e1, 0.5 * dt), &(v + a1 * (0.5 * dt)), input);
        let (e3, a3) = self.derivative(model, moved(e2, 0.5 * dt), &(v + a2 * (0.5 * dt)), input);
        let (e4, a4) = self.derivative(model, moved(e3, dt), &(v + a3 * dt), input);
        let sixth = dt / 6.0;
        self.velocity = v + (a1 + (a2 + a3) * 2.0 + a4) * sixth;
        self.roll_pitch_rad = core::array::from_fn(|i| angles[i] + (e1[i] + 2.0 * (e2[i] + e3[i]) + e4[i]) * sixth);
    }

    /// Weighed square of its present error; at most [`LOST`], also where the prediction is not finite.
    fn miss(&self, weight: &[f64; CHANNELS], roll_pitch_rad: [f64; 2], velocity: &Vector6<f64>) -> f64 {
        let mut sum = 0.0;
        for (i, weight) in weight.iter().enumerate() {
            let error = if i < 2 {
                wrap_angle(self.roll_pitch_rad[i] - roll_pitch_rad[i])
            } else {
                self.velocity[i - 2] - velocity[i - 2]
            };
            sum += weight * error * error;
        }
        let mean = sum / CHANNELS as f64;
        if mean < LOST { mean } else { LOST }
    }
}

/// Evidence of the stretches for one set against the active one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ComparisonEvidence {
    /// Stretches.
    pub stretches: u16,
    /// Mean of ln(error of the active set / error of this set): positive where this set is better.
    pub gain: f64,
    /// Sum of squared deviations from that mean.
    squares: f64,
    /// Mean squared errors of the active and of this set, in units of a perfect model's.
    pub error: [f64; 2],
}

impl ComparisonEvidence {
    /// Nothing is known.
    pub const NONE: Self = Self { stretches: 0, gain: 0.0, squares: 0.0, error: [0.0; 2] };

    fn add(&mut self, active: f64, other: f64) {
        self.stretches = self.stretches.saturating_add(1);
        let n = f64::from(self.stretches);
        let gain = libm::log((active + f64::MIN_POSITIVE) / (other + f64::MIN_POSITIVE));
        let deviation = gain - self.gain;
        self.gain += deviation / n;
        self.squares += deviation * (gain - self.gain);
        self.error[0] += (active - self.error[0]) / n;
        self.error[1] += (other - self.error[1]) / n;
    }

    /// Standard error of `gain`; infinite below two stretches.
    #[must_use]
    pub fn standard_error(&self) -> f64 {
        let n = f64::from(self.stretches);
        if n < 2.0 { f64::INFINITY } else { libm::sqrt(self.squares / ((n - 1.0) * n)) }
    }

    /// This set predicts better than the active one: over all, by a margin, and by more than chance gives.
    #[must_use]
    pub fn is_better(&self) -> bool {
        self.stretches >= FEWEST_STRETCHES
            && self.gain > MARGIN + CONFIDENCE * self.standard_error()
            && self.error[1] < self.error[0]
    }
}

/// Predictions of up to three sets side by side: streaming, without a buffer of the motion.
pub struct ModelComparison {
    weight: [f64; CHANNELS],
    models: [OpenLoopModel; ROLES],
    /// Of candidate and previous.
    evidence: [ComparisonEvidence; ROLES - 1],
    /// Samples predicted in this stretch; `None` between stretches.
    step: Option<u16>,
    /// Time of the last sample, µs.
    last_us: u64,
}

impl ModelComparison {
    /// Without sets.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            weight: [0.0; CHANNELS],
            models: [OpenLoopModel::NONE; ROLES],
            evidence: [ComparisonEvidence::NONE; ROLES - 1],
            step: None,
            last_us: 0,
        }
    }

    /// Starts afresh. `noise`: one sigma of a sample of roll and pitch (rad) and v (m/s, rad/s); `density`: root PSD of
    /// the acceleration along v.
    pub fn configure(&mut self, roll_pitch_noise_rad: f64, noise: &[f64; 6], density: &[f64; 6], period_s: f64) {
        let half_s = 0.5 * f64::from(HORIZON_STEPS) * period_s;
        let inverse = |variance: f64| if variance > 0.0 { 1.0 / variance } else { 0.0 };
        let attitude = inverse(roll_pitch_noise_rad * roll_pitch_noise_rad);
        self.weight = core::array::from_fn(|i| match i.checked_sub(2) {
            None => attitude,
            Some(axis) => inverse(noise[axis] * noise[axis] + density[axis] * density[axis] * half_s),
        });
        self.models = [OpenLoopModel::NONE; ROLES];
        self.evidence = [ComparisonEvidence::NONE; ROLES - 1];
        self.step = None;
    }

    /// Gives a role to a set, or takes it away (`None`). Evidence that rests on the role is forgotten; a new stretch
    /// begins.
    pub fn enter(&mut self, role: ModelRole, theta: Option<&Theta>) {
        let model = &mut self.models[role as usize];
        model.entered = theta.is_some();
        if let Some(theta) = theta {
            model.theta = *theta;
        }
        match role {
            ModelRole::Active => self.evidence = [ComparisonEvidence::NONE; ROLES - 1],
            ModelRole::Candidate => self.evidence[0] = ComparisonEvidence::NONE,
            ModelRole::Previous => self.evidence[1] = ComparisonEvidence::NONE,
        }
        self.step = None;
    }

    /// The set in a role.
    #[must_use]
    pub fn theta(&self, role: ModelRole) -> Option<&Theta> {
        let model = &self.models[role as usize];
        model.entered.then_some(&model.theta)
    }

    /// Evidence for candidate or previous against the active set; none for the active set itself.
    #[must_use]
    pub fn evidence(&self, role: ModelRole) -> ComparisonEvidence {
        match role {
            ModelRole::Active => ComparisonEvidence::NONE,
            ModelRole::Candidate => self.evidence[0],
            ModelRole::Previous => self.evidence[1],
        }
    }

    /// The motion was not measured for a while: the stretch under way does not count.
    pub fn interrupt(&mut self) {
        self.step = None;
    }

    /// One sample: Euler angles (rad), velocity through the water, and the mean input since the sample before; `model`
    /// is where the sets take from what θ does not hold. True at the end of a stretch. Costs four evaluations of the
    /// model a set.
    pub fn sample(
        &mut self,
        model: &VehicleModel,
        time_us: u64,
        attitude: &Vector3<f64>,
        velocity: &Vector6<f64>,
        input: &ActuatorInput,
    ) -> bool {
        let elapsed_us = time_us.saturating_sub(self.last_us);
        self.last_us = time_us;
        let roll_pitch_rad = [attitude[0], attitude[1]];
        let running = self.models.iter_mut().filter(|model| model.entered);
        let Some(step) = self.step else {
            for set in running {
                (set.roll_pitch_rad, set.velocity, set.missed) = (roll_pitch_rad, *velocity, 0.0);
            }
            self.step = Some(0);
            return false;
        };
        let dt = elapsed_us as f64 * 1.0e-6;
        for set in running {
            set.advance(model, input, dt);
            set.missed += set.miss(&self.weight, roll_pitch_rad, velocity);
        }
        if step + 1 < HORIZON_STEPS {
            self.step = Some(step + 1);
            return false;
        }
        self.step = None;
        let steps = f64::from(HORIZON_STEPS);
        let [active, others @ ..] = &self.models;
        if active.entered {
            for (other, evidence) in others.iter().zip(&mut self.evidence).filter(|(other, _)| other.entered) {
                evidence.add(active.missed / steps, other.missed / steps);
            }
        }
        true
    }
}

impl Default for ModelComparison {
    fn default() -> Self {
        Self::new()
    }
}
