//! Faults from the model's residual: which single cause explains the motion that the identified parameters no longer
//! predict.
//!
//! θ does not separate one fin from another (β1…β4 are shared), and its averages take a quarter of an hour. So each
//! fault has a magnitude φ of its own here, relative to the parameters in use: lift and drag lost by each fin, surge
//! drag gained, thrust lost, water taken in. An observer v̂ follows the measured v with the model's acceleration. The
//! signature G is the observer's error per unit of each fault. The errors e = G φ + noise are collected as normal
//! equations with two memories: φ of the long memory is the error that the parameters in use already have, φ of the
//! short one is the change. The gain in likelihood of each fault alone, with its magnitude within its bounds, is its
//! generalised likelihood ratio (Willsky and Jones 1976). It is measured in units of its own mean in quiet times: a
//! deficient model raises the threshold instead of alarms.
//!
//! A gain above [`ALARM`] raises a suspicion. Only later data count from then on: they must confirm it and single out
//! one fault, or it is dropped.
//!
//! Scale: forces are not measured. The masses of the model in use are taken as known, so magnitudes are relative to
//! them, and water that has come in is recognised by its weight.

mod cause;
mod evidence;

pub use cause::{Diagnosis, FaultCause};

use crate::dynamics::{ActuatorInput, Attitude, VehicleModel};
use evidence::{DRAG, Evidence, MODES, MOMENT, Signature, THRUST, WATER};
use nalgebra::{SMatrix, SVector, Vector3, Vector6};

/// Smaller changes are wear or errors of the declaration, not faults. In the order of [`FaultCause::ALL`].
const SMALLEST: [f64; FaultCause::COUNT] = [0.15, 0.15, 0.15, 0.15, 0.15, 0.05, 0.05];

/// Bandwidth of the observer, 1/s.
const BANDWIDTH_PER_S: f64 = 1.0;
/// Every so many samples one counts: those between carry little new information.
const STRIDE: u8 = 5;
/// Longest time between samples, µs; after it the observer starts afresh.
const LONGEST_US: u64 = 150_000;
/// Short memory, s.
const RECENT_S: f64 = 40.0;
/// Memory of the amount of water once it is diagnosed, s: it rises.
const TRACKING_S: f64 = 60.0;
/// Memory of the magnitude of other faults, s: a fin says nothing between two turns.
const HOLDING_S: f64 = 1000.0;
/// Long memory, s.
const REFERENCE_S: f64 = 1500.0;
/// No verdict before this time, s.
const SETTLED_S: f64 = 300.0;
/// Before this time gains are those of parameters that were wrong from the start, s.
const STARTED_S: f64 = 200.0;
/// Shortest memory of the quiet means once settled, s: a fault raises suspicion long before it has raised them.
const QUIET_S: f64 = 300.0;
/// Gain that raises a suspicion, in units of its quiet mean, which is 1 for white noise. Seven faults with some 180
/// independent short memories an hour are to raise less than one false alarm in 100 hours: this takes 20 of χ² with one
/// degree of freedom. The rest allows for a mean of few independent values.
const ALARM: f64 = 40.0;
/// Gain by which one fault has to lead all others.
const LEAD: f64 = 30.0;
/// A suspicion is confirmed no earlier, s.
const EARLIEST_S: f64 = 8.0;
/// A suspicion that names no single fault by then names the best two, s.
const LATEST_S: f64 = 120.0;
/// A suspicion whose gain falls below this is dropped.
const QUIET: f64 = 6.0;
/// Larger errors count as this many standard deviations in their variance.
const OUTLIER: f64 = 3.0;
/// An error whose square is this many times the variance is taken for half noise.
const TRUSTED: f64 = 10.0;
/// Least variance of an error, (m/s)² and (rad/s)².
const LEAST: f64 = 1.0e-10;

/// Where the monitor stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FaultState {
    /// Learns what is normal.
    Learning,
    /// Nothing is wrong.
    Quiet,
    /// A fault is suspected; later data have to confirm it.
    Suspicious,
    /// One fault is diagnosed.
    Diagnosed,
}

/// Watches for faults; 1.3 kB.
pub struct FaultMonitor {
    state: FaultState,
    stride: u8,
    /// Previous sample: time, velocity, s; none after a gap.
    last_us: Option<u64>,
    velocity: Vector6<f64>,
    down: Vector3<f64>,
    /// v̂.
    observer: Vector6<f64>,
    signature: Signature,
    /// Variance of the errors by axis.
    variance: [f64; 6],
    recent: Evidence,
    reference: Evidence,
    /// Errors of the parameters in use.
    offset: SVector<f64, MODES>,
    /// Mean gain in quiet times.
    quiet: [f64; FaultCause::COUNT],
    /// When each gain was last small, µs.
    small_us: [u64; FaultCause::COUNT],
    observed_s: f64,
    /// Time since the suspicion, s.
    suspicious_s: f64,
    since_us: u64,
    /// The diagnosed fault's place and one, once it led all others; 0 before.
    named: u8,
}

impl FaultMonitor {
    /// Before the first sample.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            state: FaultState::Learning,
            stride: 0,
            last_us: None,
            velocity: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            down: Vector3::new(0.0, 0.0, 0.0),
            observer: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            signature: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; 6]; MODES])),
            variance: [0.0; 6],
            recent: Evidence::NONE,
            reference: Evidence::NONE,
            offset: SVector::from_array_storage(nalgebra::ArrayStorage([[0.0; MODES]])),
            quiet: [0.0; FaultCause::COUNT],
            small_us: [0; FaultCause::COUNT],
            observed_s: 0.0,
            suspicious_s: 0.0,
            since_us: 0,
            named: 0,
        }
    }

    /// Starts to learn again: another model is in use.
    pub fn restart(&mut self) {
        *self = Self::new();
    }

    /// No sample for a while.
    pub fn interrupt(&mut self) {
        self.last_us = None;
    }

    /// Where it stands.
    #[must_use]
    pub fn state(&self) -> FaultState {
        self.state
    }

    /// One sample: time (µs), Euler angles (rad), velocity through the water (m/s, rad/s) and what the actuators did
    /// since the sample before; `model` is the vehicle as it is believed to be. Values that are not finite count as a
    /// gap.
    pub fn sample(
        &mut self,
        model: &VehicleModel,
        time_us: u64,
        attitude: &Vector3<f64>,
        velocity: &Vector6<f64>,
        input_since: &ActuatorInput,
    ) -> FaultState {
        let down = Attitude::new(attitude).down();
        if !velocity.iter().chain(down.iter()).chain(&input_since.fins_rad).all(|value| value.is_finite()) {
            self.last_us = None;
            return self.state;
        }
        let elapsed_us = self.last_us.and_then(|last| time_us.checked_sub(last)).filter(|&us| us <= LONGEST_US);
        let (velocity_then, down_then) = (self.velocity, self.down);
        (self.last_us, self.velocity, self.down) = (Some(time_us), *velocity, down);
        let Some(elapsed_us) = elapsed_us.filter(|&us| us > 0) else {
            self.observer = *velocity;
            self.signature.fill(0.0);
            return self.state;
        };
        let dt = elapsed_us as f64 * 1.0e-6;

        self.predict(model, &((velocity_then + velocity) * 0.5), &((down_then + down) * 0.5), input_since, dt);
        let error = velocity - self.observer;
        if !error.iter().chain(self.signature.iter()).all(|value| value.is_finite() && value.abs() < 1.0e6) {
            self.last_us = None;
            return self.state;
        }
        self.stride += 1;
        if self.stride >= STRIDE {
            self.stride = 0;
            self.weigh(time_us, &error, f64::from(STRIDE) * dt);
        }
        self.observer += error * (BANDWIDTH_PER_S * dt);
        self.signature *= 1.0 - BANDWIDTH_PER_S * dt;
        self.state
    }

    /// Moves observer and signature by the model at the middle of the interval.
    fn predict(&mut self, model: &VehicleModel, v: &Vector6<f64>, down: &Vector3<f64>, input: &ActuatorInput, dt: f64) {
        let parameters = model.parameters();
        let fins = model.fin_wrenches(v, &input.fins_rad);
        let lost = model.fin_wrenches(&self.quiet_velocity(v), &input.fins_rad);
        let surge_drag = -parameters.quadratic_diag[0] * v[0].abs() * v[0];
        let thrust = model.propeller().thrust(input.propeller_radps, v[0]);
        let mut wrench = model.restoring().wrench(down) - model.coriolis(v) - model.drag(v);
        let torque = -model.propeller().torque_arm * thrust;
        wrench[0] += thrust;
        wrench[3] += torque;
        for fin in &fins {
            wrench += fin;
        }
        let acceleration = model.acceleration_of(&wrench);
        self.observer += acceleration * dt;

        let mut add = |mode: usize, wrench: &Vector6<f64>| {
            let change = model.acceleration_of(wrench) * dt;
            let mut column = self.signature.column_mut(mode);
            column += change;
        };
        for (mode, fin) in lost.iter().enumerate() {
            add(mode, &-fin);
        }
        add(DRAG, &Vector6::new(surge_drag, 0.0, 0.0, 0.0, 0.0, 0.0));
        add(THRUST, &Vector6::new(-thrust, 0.0, 0.0, -torque, 0.0, 0.0));
        let g = parameters.g_mps2;
        let (nu, omega) = (Vector3::new(v[0], v[1], v[2]), Vector3::new(v[3], v[4], v[5]));
        let inertial = acceleration.fixed_rows::<3>(0) + omega.cross(&nu);
        let water = down * g - inertial;
        add(WATER, &Vector6::new(water.x, water.y, water.z, 0.0, 0.0, 0.0));
        add(MOMENT, &Vector6::new(0.0, 0.0, 0.0, 0.0, -g * down.z, g * down.y));
    }

    /// v̂, which is less noisy than v: noise in the signature of a fin would make its fault look smaller. On an axis
    /// where the two differ by more than noise, v.
    fn quiet_velocity(&self, v: &Vector6<f64>) -> Vector6<f64> {
        if matches!(self.state, FaultState::Learning | FaultState::Quiet) {
            return self.observer;
        }
        Vector6::from_fn(|axis, _| {
            let error = v[axis] - self.observer[axis];
            let square = error * error;
            self.observer[axis] + error * square / (square + TRUSTED * self.variance[axis].max(LEAST))
        })
    }

    /// Takes the error of one sample that counts.
    fn weigh(&mut self, time_us: u64, error: &Vector6<f64>, dt: f64) {
        self.observed_s += dt;
        let learning = matches!(self.state, FaultState::Learning | FaultState::Quiet);
        let new = error - self.signature * self.offset;
        let weights = self.weights(&new, learning, dt);
        if learning {
            self.reference.add(1.0 - dt / self.observed_s.min(REFERENCE_S), &self.signature, error, &weights);
            if let Some(offset) = self.reference.solve() {
                self.offset = offset;
            }
        }
        let keep = match self.state {
            FaultState::Suspicious => 1.0,
            FaultState::Diagnosed if self.named == WATER as u8 + 1 => 1.0 - dt / TRACKING_S,
            FaultState::Diagnosed => 1.0 - dt / HOLDING_S,
            FaultState::Learning | FaultState::Quiet => 1.0 - dt / RECENT_S,
        };
        self.recent.add(keep, &self.signature, &new, &weights);
        self.judge(time_us, dt);
    }

    /// One over the variance of the errors; learns it.
    fn weights(&mut self, error: &Vector6<f64>, learning: bool, dt: f64) -> [f64; 6] {
        let share = dt / self.observed_s.min(REFERENCE_S);
        let mut weights = [0.0; 6];
        for ((weight, variance), error) in weights.iter_mut().zip(&mut self.variance).zip(error.iter()) {
            let mut square = error * error;
            if self.observed_s > RECENT_S {
                square = square.min(OUTLIER * OUTLIER * *variance);
            }
            if learning {
                *variance += (square - *variance) * share;
            }
            *weight = 1.0 / variance.max(LEAST);
        }
        weights
    }

    fn judge(&mut self, time_us: u64, dt: f64) {
        if matches!(self.state, FaultState::Learning | FaultState::Quiet) {
            let learnt_s = self.observed_s - STARTED_S;
            let settled = self.observed_s > SETTLED_S;
            let memory_s = if settled { learnt_s.clamp(QUIET_S, REFERENCE_S) } else { learnt_s };
            let share = if learnt_s > 0.0 { (dt / memory_s).min(1.0) } else { 0.0 };
            for cause in 0..FaultCause::COUNT {
                let gain = self.recent.gain(cause)[0];
                let quiet = self.quiet[cause].max(1.0);
                if gain < QUIET * quiet {
                    self.small_us[cause] = time_us;
                }
                // A fault must not hide itself.
                let gain = if settled { gain.min(OUTLIER * quiet) } else { gain };
                self.quiet[cause] += (gain - self.quiet[cause]) * share;
            }
        }
        let Leader { cause: best, score, lead, magnitude, .. } = self.leader();
        let best = best.min(FaultCause::COUNT - 1); // is below; the compiler cannot always see it
        let large = magnitude > SMALLEST[best];
        match self.state {
            FaultState::Learning => {
                if self.observed_s > SETTLED_S {
                    self.state = FaultState::Quiet;
                }
            }
            FaultState::Quiet => {
                if score > ALARM && large {
                    self.state = FaultState::Suspicious;
                    self.suspicious_s = 0.0;
                    self.since_us = self.small_us[best];
                    self.recent = Evidence::NONE;
                }
            }
            FaultState::Suspicious => {
                self.suspicious_s += dt;
                if self.suspicious_s < EARLIEST_S {
                    return;
                }
                if score > ALARM && large && (lead > LEAD || self.suspicious_s > LATEST_S) {
                    self.state = FaultState::Diagnosed;
                } else if self.suspicious_s > LATEST_S {
                    self.state = FaultState::Quiet;
                    self.recent = Evidence::NONE;
                }
            }
            FaultState::Diagnosed => {}
        }
        if self.state == FaultState::Diagnosed && self.named == 0 && lead > LEAD && large {
            self.named = best as u8 + 1;
        }
    }

    /// The diagnosed fault, if there is one; its magnitude improves with time.
    #[must_use]
    pub fn diagnosis(&self) -> Option<Diagnosis> {
        if self.state != FaultState::Diagnosed {
            return None;
        }
        let Leader { cause, mut lead, rival, mut magnitude, mut moment_kgm, .. } = self.leader();
        let mut cause = FaultCause::ALL.get(cause).copied()?;
        let mut rival = FaultCause::ALL.get(rival).copied();
        if let Some(named) = self.named.checked_sub(1) {
            let named = usize::from(named);
            cause = FaultCause::ALL.get(named).copied()?;
            rival = None;
            [_, magnitude, moment_kgm] = self.recent.gain(named);
            lead = lead.max(LEAD);
        }
        let confidence = 1.0 / (1.0 + libm::exp(-0.5 * lead));
        Some(Diagnosis { cause, rival, magnitude, moment_kgm, confidence, since_us: self.since_us })
    }

    /// The fault of the largest gain.
    fn leader(&self) -> Leader {
        let mut best = Leader { cause: 0, gain: 0.0, score: 0.0, lead: 0.0, rival: 0, magnitude: 0.0, moment_kgm: 0.0 };
        let (mut second, mut rival) = (0.0_f64, 0);
        for cause in 0..FaultCause::COUNT {
            let [gain, magnitude, moment_kgm] = self.recent.gain(cause);
            let own = self.quiet[cause].max(1.0);
            if gain > best.gain {
                (second, rival) = (best.gain, best.cause);
                best = Leader { cause, gain, score: gain / own, lead: 0.0, rival, magnitude, moment_kgm };
            } else if gain > second {
                (second, rival) = (gain, cause);
            }
        }
        best.rival = rival;
        best.lead = (best.gain - second) / self.quiet[best.cause].max(self.quiet[rival]).max(1.0);
        best
    }
}

/// The fault that explains most.
struct Leader {
    cause: usize,
    gain: f64,
    /// Gain in units of its quiet mean.
    score: f64,
    /// By how much the gain leads all others, in units of the larger quiet mean.
    lead: f64,
    /// Next best.
    rival: usize,
    magnitude: f64,
    moment_kgm: f64,
}
