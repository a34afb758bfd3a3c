//! The identifier that runs beside the filter: one call a sample.

use super::aid::{AidState, Instant, heun, interval, model_acceleration, rates};
use super::config::{
    ALPHA_PER_S, AVERAGE_S, ConfigError, EXCITATION_FLOOR, GAMMA_PER_S2, GAMMA_TIME_S, IdentificationConfig, PERIOD_S,
};
use super::drift::DriftMonitor;
use super::excitation::{Excitation, ExcitationMonitor, UNKNOWN};
use super::filter::{Measured, PreFilter};
use super::projection::ParameterBox;
use super::regressor::{Regressor, regressor};
use super::theta::{B1, PARAMETERS, Theta, theta_of, with_theta};
use crate::dynamics::{ActuatorInput, Attitude, VehicleModel, VehicleParameters};
use nalgebra::{Vector3, Vector6};

/// λ_max(M⁻¹ Y Γ Yᵀ) dt² above this is unstable with Heun's step; steps that reach it have their gains scaled down.
const STIFFNESS_LIMIT: f64 = 0.3;
/// Largest plausible velocity of a torpedo, m/s and rad/s: beyond it a sample is refused.
const FASTEST: [f64; 6] = [30.0, 30.0, 30.0, 10.0, 10.0, 10.0];

/// Outcome of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleOutcome {
    /// [`Identifier::configure`] has not succeeded.
    NotConfigured,
    /// A value is not finite, or beyond what a vehicle can do.
    Refused,
    /// The time is not after that of the sample before.
    OutOfOrder,
    /// The filter's window is not yet full, at the start or after a gap.
    Filling,
    /// v̂ follows, θ̂ waits for gains.
    WarmingUp,
    /// θ̂ was moved.
    Adapting,
    /// The laws gave a number that is not finite; θ̂ is unchanged.
    Diverged,
}

/// One sample's report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Its outcome.
    pub outcome: SampleOutcome,
    /// Δv = v̂ − v of the filtered sample, m/s and rad/s; zero unless warming up or adapting.
    pub velocity_error: Vector6<f64>,
    /// The gains were scaled down for stability.
    pub limited: bool,
    /// Parameters that met their box, bit j for θ_j.
    pub projected: u32,
}

/// Adaptive identification of a vehicle's parameters while it moves.
///
/// Give every sample to [`Self::sample`]. The cost of a call is bounded and does not depend on the data, except that
/// calls after a gap are cheaper. [`Self::estimate`] is useful after some minutes of turns, dives and changes of speed.
/// Samples are used [`super::DELAY`] periods late.
pub struct Identifier {
    config: IdentificationConfig,
    model: Option<VehicleModel>,
    bounds: Option<ParameterBox>,
    filter: PreFilter,
    excitation: ExcitationMonitor,
    drift: DriftMonitor,
    /// Time of the last sample taken, µs.
    last_us: Option<u64>,
    /// The last filtered measurement.
    previous: Option<Measured>,
    /// One sigma of the filtered measurement in each of its directions.
    sigma: [f64; NOISE_DIRECTIONS],
    /// Direction to disturb next.
    direction: usize,
    state: AidState,
    /// Mean of θ̂.
    average: Theta,
    gains: Theta,
    y: Regressor,
    disturbed: Regressor,
    adapted_s: f64,
    restarts: u32,
}

impl Identifier {
    /// Refuses samples until configured.
    #[must_use]
    pub const fn new() -> Self {
        const NO_REGRESSOR: Regressor = Regressor::from_array_storage(nalgebra::ArrayStorage([[0.0; 6]; PARAMETERS]));
        const NO_THETA: Theta = Theta::from_array_storage(nalgebra::ArrayStorage([[0.0; PARAMETERS]]));
        Self {
            config: IdentificationConfig::NONE,
            model: None,
            bounds: None,
            filter: PreFilter::new(),
            excitation: ExcitationMonitor::new(),
            drift: DriftMonitor::new(),
            last_us: None,
            previous: None,
            sigma: [0.0; NOISE_DIRECTIONS],
            direction: 0,
            state: AidState { velocity: Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), theta: NO_THETA },
            average: NO_THETA,
            gains: NO_THETA,
            y: NO_REGRESSOR,
            disturbed: NO_REGRESSOR,
            adapted_s: 0.0,
            restarts: 0,
        }
    }

    /// Starts afresh from a prior, which also holds what is not identified (geometry, displacement, advance, …).
    ///
    /// # Errors
    /// The setting or the property of the prior that is refused; nothing is changed then.
    pub fn configure(&mut self, config: &IdentificationConfig, prior: &VehicleParameters) -> Result<(), ConfigError> {
        config.validate()?;
        let model = VehicleModel::new(prior).map_err(ConfigError::Vehicle)?;
        let bounds = ParameterBox::around(prior, config.box_ratio);
        let theta = theta_of(prior);
        if theta[B1 + 2] <= 0.0 {
            return Err(ConfigError::Unstable);
        }
        let reach = Theta::from_fn(|j, _| bounds.reach(j));
        self.config = *config;
        self.filter.restart();
        self.excitation.configure(&prior.m_diag, &EXCITATION_FLOOR, &reach, 0.5 * AVERAGE_S);
        let [u, v, w, p, q, r] = config.velocity_noise;
        let roll_pitch = config.roll_pitch_noise_rad;
        self.sigma = [u, v, w, p, q, r, roll_pitch, roll_pitch].map(|sigma| sigma * PreFilter::noise_gain());
        self.direction = 0;
        self.drift.reset();
        self.model = Some(model);
        self.bounds = Some(bounds);
        self.last_us = None;
        self.previous = None;
        self.state = AidState { velocity: Vector6::zeros(), theta };
        self.average = theta;
        self.gains.fill(0.0);
        self.adapted_s = 0.0;
        self.restarts = 0;
        Ok(())
    }

    /// One sample: time (µs), Euler angles (rad), body velocity through the water (m/s, rad/s), and the mean of what
    /// fins and propeller did since the sample before.
    ///
    /// Samples without a velocity are not given; the gap they leave restarts the filter, and θ̂ stays.
    pub fn sample(
        &mut self,
        time_us: u64,
        attitude: &Vector3<f64>,
        velocity: &Vector6<f64>,
        input: &ActuatorInput,
    ) -> Report {
        let mut report = Report {
            outcome: SampleOutcome::NotConfigured,
            velocity_error: Vector6::zeros(),
            limited: false,
            projected: 0,
        };
        let (Some(model), Some(bounds)) = (&self.model, &self.bounds) else { return report };

        if !is_plausible(attitude, velocity, input, model.parameters()) {
            report.outcome = SampleOutcome::Refused;
            return report;
        }
        if let Some(last_us) = self.last_us {
            let Some(elapsed_us) = time_us.checked_sub(last_us).filter(|&elapsed| elapsed > 0) else {
                report.outcome = SampleOutcome::OutOfOrder;
                return report;
            };
            let periods = elapsed_us as f64 * 1.0e-6 / PERIOD_S;
            if !(0.5..1.5).contains(&periods) {
                self.filter.restart();
                self.previous = None;
                self.restarts = self.restarts.saturating_add(1);
            }
        }
        self.last_us = Some(time_us);

        let measured = Measured { time_us, velocity: *velocity, down: Attitude::new(attitude).down(), input: *input };
        report.outcome = SampleOutcome::Filling;
        let Some(filtered) = self.filter.push(&measured) else { return report };
        let Some(then) = self.previous.replace(filtered) else {
            self.state.velocity = filtered.velocity;
            return report;
        };
        let dt = filtered.time_us.saturating_sub(then.time_us) as f64 * 1.0e-6;
        let ends = [&then, &filtered].map(|end| (&end.velocity, &end.down));
        let [then, now] = interval(model, &self.state.theta, ends, &filtered.input, dt);

        let first = rates(&self.state, ALPHA_PER_S, &then);
        regressor(&first.model_acceleration, &then.velocity, &then.down, &then.actuators, &mut self.y);
        let size = self.sigma.get(self.direction).copied().unwrap_or(0.0);
        let (velocity, down) = disturbed(&then, self.direction, size);
        let noisy = Instant::new(model, &velocity, &down, &filtered.input);
        let acceleration = model_acceleration(&self.state.theta, &noisy);
        regressor(&acceleration, &noisy.velocity, &noisy.down, &noisy.actuators, &mut self.disturbed);
        self.direction = (self.direction + 1) % NOISE_DIRECTIONS;
        self.excitation.observe(&self.y, &self.disturbed, NOISE_DIRECTIONS as f64, dt);
        let adapting = self.excitation.observed_s() > self.config.warm_up_s;
        if adapting {
            self.excitation.gains(self.gamma(), self.config.scale.parameter(), &mut self.gains);
            let stiffness = self.excitation.stiffness(&self.y, &self.gains) * dt * dt;
            if stiffness > STIFFNESS_LIMIT {
                self.gains *= STIFFNESS_LIMIT / stiffness;
                report.limited = true;
            }
        } else {
            self.gains.fill(0.0);
        }

        let mut next = heun(&self.state, &first, &self.gains, ALPHA_PER_S, &now, dt);
        report.projected = bounds.project(&mut next.theta);
        if !next.velocity.iter().chain(next.theta.iter()).all(|value| value.is_finite()) {
            self.previous = None;
            self.filter.restart();
            report.outcome = SampleOutcome::Diverged;
            return report;
        }
        self.state = next;
        report.velocity_error = next.velocity - filtered.velocity;
        report.outcome = if adapting { SampleOutcome::Adapting } else { SampleOutcome::WarmingUp };
        if adapting {
            self.adapted_s += dt;
            self.average(dt);
            self.drift.observe(&self.state.theta, &self.gains, dt);
        }
        report
    }

    /// γ of now: falls with the time of adaptation.
    fn gamma(&self) -> f64 {
        let [start, end] = GAMMA_PER_S2;
        end + (start - end) * libm::exp(-self.adapted_s / GAMMA_TIME_S)
    }

    /// Exponential mean of θ̂. It averages noise as a window twice its time constant does, hence the halves; the time
    /// constant grows with the time of adaptation, so that the first estimates are forgotten.
    fn average(&mut self, dt: f64) {
        let time_constant = 0.5 * self.adapted_s.min(AVERAGE_S);
        let weight = (dt / time_constant).min(1.0);
        for j in 0..PARAMETERS {
            if self.gains[j] > 0.0 {
                self.average[j] += (self.state.theta[j] - self.average[j]) * weight;
            }
        }
    }

    /// The estimate: the mean of θ̂, frozen parameters at their last mean. `None` until configured.
    #[must_use]
    pub fn estimate(&self) -> Option<Theta> {
        self.model.as_ref().map(|_| self.average)
    }

    /// The estimate as a vehicle; see [`with_theta`] for mass and displacement.
    #[must_use]
    pub fn parameters(&self) -> Option<VehicleParameters> {
        self.model.as_ref().map(|model| with_theta(model.parameters(), &self.average))
    }

    /// v̂ and θ̂ as they stand.
    #[must_use]
    pub fn state(&self) -> &AidState {
        &self.state
    }

    /// Excitation of each parameter by the recent motion: costs far more than a sample.
    #[must_use]
    pub fn excitation(&self) -> Excitation {
        let mut excitation = UNKNOWN;
        if self.model.is_some() {
            self.excitation.assess(self.config.scale.parameter(), &mut excitation);
        }
        excitation
    }

    /// Drift of the estimates against their noise.
    #[must_use]
    pub fn drift(&self) -> &DriftMonitor {
        &self.drift
    }

    /// Time that θ̂ has adapted, s.
    #[must_use]
    pub fn adapted_s(&self) -> f64 {
        self.adapted_s
    }

    /// How often a gap emptied the filter.
    #[must_use]
    pub fn restarts(&self) -> u32 {
        self.restarts
    }
}

/// Directions in which a measured instant can be wrong: the axes of v, and s turned about body x and y.
const NOISE_DIRECTIONS: usize = 8;

/// v and s as they would have been measured with an error `size` (m/s, rad/s or rad) in one of [`NOISE_DIRECTIONS`].
fn disturbed(at: &Instant, direction: usize, size: f64) -> (Vector6<f64>, Vector3<f64>) {
    let (mut velocity, mut down) = (at.velocity, at.down);
    match direction {
        axis @ 0..6 => velocity[axis] += size,
        6 => down += at.down.cross(&Vector3::x()) * size,
        _ => down += at.down.cross(&Vector3::y()) * size,
    }
    (velocity, down)
}

/// Whether a vehicle can do this; what passes keeps all arithmetic finite.
fn is_plausible(
    attitude: &Vector3<f64>,
    velocity: &Vector6<f64>,
    input: &ActuatorInput,
    vehicle: &VehicleParameters,
) -> bool {
    let within = |value: f64, limit: f64| value.abs() <= limit; // a NaN is not
    attitude.iter().all(|&angle| within(angle, 10.0))
        && velocity.iter().zip(FASTEST).all(|(&value, limit)| within(value, limit))
        && within(input.propeller_radps, 2.0 * vehicle.omega_max_radps)
        && input.fins_rad.iter().all(|&delta| within(delta, 2.0))
}
