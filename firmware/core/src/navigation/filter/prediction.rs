//! Time update: the model's step for x̂, Φ P Φᵀ + Q_d for P.

use super::cekf::Filter;
use super::vertical;
use crate::dynamics::{ActuatorInput, kinematic_linearise};
use crate::effects::Step;
use crate::navigation::algebra::layout::{EFFECTS, SHIP_VELOCITY};
use crate::navigation::algebra::observer::{LinearStep, Observer};
use crate::navigation::algebra::propagation::{propagate_double_integrator, propagate_vehicle};
use crate::navigation::interface::config::{
    LONGEST_HOLD_S, ProcessModel, SurfaceNoise, UNKNOWN_INPUT, UNKNOWN_POSE_RAD, UNKNOWN_RATE_RADPS,
};
use crate::navigation::interface::error::NavigationError;
use crate::state::{self, P, PHI, Q, R, THETA, V, VEHICLE_STATES, W, X, Y, Z};

/// Longest step while the gap is at most [`MOST_STEPS`] of them, µs.
const STEP_US: u64 = 100_000;
/// Most steps of one call.
const MOST_STEPS: u64 = 600;
/// Elevators beyond this are hard over, rad: two thirds of what they can.
const HARD_OVER_RAD: f64 = 0.23;
/// A nose that is down by more dives, rad.
const NOSE_DOWN_RAD: f64 = 0.1;
/// A hull that dives has its nose down before, s.
const HELD_S: f64 = 3.0;
/// Longest gap that one call of [`Filter::predict`] crosses, µs: the steps are then 1 s long. Over
/// longer gaps a linearised model and its covariance mean nothing.
pub const MAX_GAP_US: u64 = 600_000_000;

impl Filter {
    /// Moves the filter to `to_us` under an input that is constant since the last call.
    ///
    /// The gap is split into equal steps of at most 0.1 s; from one minute on there are 600 steps,
    /// which grow up to 1 s. Each step is the zero-order hold of the model linearised at its start. From [`LONGEST_HOLD_S`]
    /// on the input is unknown: the vehicle goes on straight, by the kinematic model, as uncertain as an AUV may move.
    /// Each step is shown to `observer`.
    ///
    /// # Errors
    /// See [`NavigationError`]; a refused call leaves the filter as it was, a failure is kept.
    pub fn predict(
        &mut self,
        to_us: u64,
        input: &ActuatorInput,
        observer: &mut impl Observer,
    ) -> Result<(), NavigationError> {
        if let Some(failure) = self.failure {
            return Err(failure);
        }
        if !self.is_initialised() {
            return Err(NavigationError::NotInitialised);
        }
        let gap_us = to_us.checked_sub(self.time_us).ok_or(NavigationError::TimeBackwards)?;
        if gap_us > MAX_GAP_US {
            return Err(NavigationError::GapTooLong);
        }
        let dynamic = self.config.process_model == ProcessModel::Dynamic;
        if dynamic && !(input.propeller_radps.is_finite() && input.fins_rad.iter().all(|fin| fin.is_finite())) {
            return Err(NavigationError::InvalidInput);
        }
        let steps = gap_us.div_ceil(STEP_US).min(MOST_STEPS);
        if steps > 0 {
            let step_s = gap_us as f64 * 1.0e-6 / steps as f64;
            let start_s = self.effect_time_s();
            for k in 0..steps {
                let since_s = k as f64 * step_s;
                self.predict_step(start_s + since_s, step_s, (since_s < LONGEST_HOLD_S).then_some(input));
                observer.observe(&LinearStep::Transition(self.transition(step_s)));
            }
            if self.is_input_unknown {
                let pose = (PHI..).zip(UNKNOWN_POSE_RAD);
                let rates = (P..).zip([UNKNOWN_RATE_RADPS; 3]);
                pose.chain(rates).for_each(|(at, sigma)| self.p.add(at, at, sigma * sigma));
            }
        }
        self.time_us = to_us;
        let health = self.health();
        self.failure = health.err();
        health
    }

    /// `None`: the input is unknown.
    fn predict_step(&mut self, t_s: f64, step_s: f64, input: Option<&ActuatorInput>) {
        if self.effects.is_stale(t_s)
            && let Some(model) = &mut self.model
        {
            self.effects.retune(model, t_s, &self.config, &self.x);
        }
        self.is_input_unknown = input.is_none();
        match input {
            None => {
                [V, W, P, Q, R].iter().for_each(|state| self.x.vehicle[*state] = 0.0);
                self.held_s = 0.0;
                self.discretise(step_s, &ActuatorInput::default());
            }
            Some(input) => {
                self.held_s = if self.lies_at_surface(input) { self.held_s + step_s } else { 0.0 };
                if self.effects.actuate() {
                    let input = self.effects.actuated(input, &Step { t_s, h_s: step_s }, &self.config, &self.x);
                    self.discretise(step_s, &input);
                } else {
                    self.discretise(step_s, input);
                }
            }
        }
        self.propagate(step_s);
    }

    /// Model, Jacobian and discretisation of one step. Public for the cost table only.
    #[doc(hidden)]
    pub fn discretise(&mut self, step_s: f64, input: &ActuatorInput) {
        self.step.effect_count = 0;
        let is_held = self.is_input_unknown || self.held_s > HELD_S || self.hangs;
        let mut linearisation = match (self.config.process_model, &self.model) {
            (ProcessModel::Dynamic, Some(model)) if !is_held => {
                let linearisation = model.linearise(&self.x.vehicle, input);
                if self.effects.accelerate() {
                    let acceleration = state::velocity(&linearisation.f);
                    self.effects.accelerations(model, input, &acceleration, &self.config, &self.x, &mut self.step);
                }
                linearisation
            }
            _ => kinematic_linearise(&self.x.vehicle),
        };
        let psd = if self.is_input_unknown {
            UNKNOWN_INPUT.psd()
        } else if is_held {
            SurfaceNoise::KINEMATIC.noise.psd()
        } else {
            self.config.psd_at(self.x.vehicle[Z], self.monitor.waves.sea_factor())
        };
        let steep = vertical::is_steep(&self.x.vehicle);
        if steep {
            vertical::in_rotation_vector(&self.x.vehicle, &mut linearisation);
        }
        self.step.compute(&linearisation, &psd, step_s);
        if steep {
            vertical::in_euler_angles(&self.x.vehicle, &mut self.step);
        }
    }

    /// Whether the elevators are hard over and the vehicle lies at the surface all the same. If that lasts, the surface
    /// holds it. The model knows of no surface: it would turn and slow down the hull, which would pass for one with a
    /// weak propeller. The kinematic model takes its place.
    fn lies_at_surface(&self, input: &ActuatorInput) -> bool {
        let [.., port, starboard] = input.fins_rad;
        port.abs().min(starboard.abs()) > HARD_OVER_RAD
            && self.x.vehicle[THETA] > -NOSE_DOWN_RAD
            && self.config.is_at_surface(self.x.vehicle[Z])
    }

    /// State and covariance over the step last discretised. Public for the cost table only.
    #[doc(hidden)]
    pub fn propagate(&mut self, step_s: f64) {
        let n = self.dimension();
        for (x, increment) in self.x.vehicle.iter_mut().zip(&self.step.increment) {
            *x += increment;
        }
        self.x.wrap_heading();
        propagate_vehicle(&mut self.p, n, &self.step);

        let current = self.x.layout.current();
        let rate = current.and_then(|_| self.x.layout.current_rate());
        for (at, state) in (EFFECTS..).zip(self.config.effect_states.iter()) {
            let q = state.random_walk_per_sqrt_s * state.random_walk_per_sqrt_s;
            match current.and_then(|current| [X, Y].get(at - current)) {
                Some(&position) => {
                    self.x.vehicle[position] += self.x.get(at) * step_s;
                    propagate_double_integrator(&mut self.p, n, position, at, q, step_s);
                    if let Some(rate) = rate.map(|first| first + position - X) {
                        let change = self.x.get(rate) * step_s;
                        self.x.vehicle[position] += 0.5 * change * step_s;
                        self.x.add_tail(at, change);
                        self.p.shear(n, position, rate, 0.5 * step_s * step_s);
                        self.p.shear(n, at, rate, step_s);
                    }
                }
                None => self.p.add(at, at, q * step_s),
            }
        }
        if let (true, Some(current), Some(rate)) = (self.is_alone(), current, rate) {
            self.turn_tide(current, rate, step_s);
        }
        if current.is_none() {
            for (position, velocity) in [X, Y].into_iter().zip(self.x.water_mps) {
                self.x.vehicle[position] += velocity * step_s;
            }
        }
        if let Some(at) = self.x.layout.ship() {
            let linear = self.config.ship_noise.linear_mps2_per_sqrt_hz;
            let angular = self.config.ship_noise.angular_radps2_per_sqrt_hz;
            let linear =
                if self.is_input_unknown { linear.max(UNKNOWN_INPUT.linear_mps2_per_sqrt_hz[0]) } else { linear };
            for (i, root) in [linear, linear, angular].into_iter().enumerate() {
                let (position, velocity) = (at + i, at + SHIP_VELOCITY + i);
                self.x.add_tail(position, self.x.get(velocity) * step_s);
                propagate_double_integrator(&mut self.p, n, position, velocity, root * root, step_s);
            }
        }
        if self.monitor.alert {
            self.grow_suspects(step_s);
        }
    }

    /// Every state finite and every variance positive.
    fn health(&self) -> Result<(), NavigationError> {
        let n = self.dimension();
        let tail = self.x.tail.iter().take(n.saturating_sub(VEHICLE_STATES));
        if !self.x.vehicle.as_slice().iter().chain(tail).all(|x| x.is_finite()) {
            return Err(NavigationError::NotFinite);
        }
        for i in 0..n {
            let variance = self.p.get(i, i);
            if !variance.is_finite() {
                return Err(NavigationError::NotFinite);
            }
            // A position and its clone may be one and the same; nothing else may be certain.
            if variance < 0.0 || (variance == 0.0 && i < VEHICLE_STATES) {
                return Err(NavigationError::NotPositive);
            }
        }
        Ok(())
    }
}
