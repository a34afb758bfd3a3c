//! The filter itself: state and covariance, and access to them.

use super::effects::Effects;
use crate::dynamics::{FINS, VehicleModel};
use crate::identification::theta::{BETA1, BETA5, D11, M11};
use crate::navigation::algebra::covariance::{Covariance, ROWS, Vector};
use crate::navigation::algebra::digest::Digest;
use crate::navigation::algebra::discretisation::Discretisation;
use crate::navigation::algebra::estimate::Estimate;
use crate::navigation::algebra::layout::{EFFECTS, SHIP_STATES, SHIP_VELOCITY};
use crate::navigation::algebra::observation::Observations;
use crate::navigation::algebra::observer::{LinearStep, Observer, Transition};
use crate::navigation::interface::config::{NavigationConfig, ProcessModel};
use crate::navigation::interface::effect_states::StateParameter;
use crate::navigation::interface::error::{ConfigError, NavigationError};
use crate::navigation::interface::fixed_effects::water_of;
use crate::navigation::interface::initial::{InitialShip, InitialState};
use crate::navigation::interface::measurement::Sensor;
use crate::navigation::trust::innovation_monitor::InnovationMonitor;
use crate::navigation::trust::peers::Peers;
use crate::parameters;
use crate::parameters::ProcessNoise;
use crate::state::{VehicleState, Y};

/// The centralized extended Kalman filter. Some 18 kB: lives in a static, never passed by value; a host may copy it.
#[derive(Clone)]
pub struct Filter {
    pub(super) config: NavigationConfig,
    pub(super) model: Option<VehicleModel>,
    pub(super) time_us: u64,
    initialised: bool,
    pub(super) failure: Option<NavigationError>,
    pub(super) x: Estimate,
    pub(super) p: Covariance,
    pub(super) monitor: InnovationMonitor,
    pub(super) peers: Peers,
    /// When a position or a velocity was last used, µs.
    pub(super) heard_us: u64,
    /// The vehicle has lain at the surface with its elevators hard over for this time, s.
    pub(super) held_s: f64,
    /// Fins and propeller have not been heard of for longer than they are taken to hold.
    pub(super) is_input_unknown: bool,
    /// It hangs: [`Filter::watch_pitch`].
    pub(super) hangs: bool,
    /// What the declared model lacks.
    pub(super) effects: Effects,
    /// Scratch of the prediction.
    pub(super) step: Discretisation,
    /// Scratch of the update: what the measurement under way observes.
    pub(super) observations: Observations,
    /// K of the last update.
    pub(super) gain: Vector,
    /// g = P hᵀ of the update under way; zero behind the last state.
    pub(super) w: Vector,
}

impl Filter {
    /// Empty: configure and initialise it.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            config: NavigationConfig::BLANK,
            model: None,
            time_us: 0,
            initialised: false,
            failure: None,
            x: Estimate::new(),
            p: Covariance::new(),
            monitor: InnovationMonitor::new(),
            peers: Peers::NONE,
            heard_us: 0,
            held_s: 0.0,
            is_input_unknown: false,
            hangs: false,
            effects: Effects::new(),
            step: Discretisation::new(),
            observations: Observations::new(),
            gain: [0.0; ROWS],
            w: [0.0; ROWS],
        }
    }

    /// Adopts a configuration and a vehicle and forgets everything else.
    ///
    /// # Errors
    /// The first value out of range, or a vehicle that its effects do not fit; the filter is then as it was.
    pub fn configure(&mut self, config: &NavigationConfig, model: &VehicleModel) -> Result<(), ConfigError> {
        config.validate()?;
        self.adopt(config, model)?;
        self.initialised = false;
        Ok(())
    }

    /// Model and configuration together; the effects tie them.
    fn adopt(&mut self, config: &NavigationConfig, model: &VehicleModel) -> Result<(), ConfigError> {
        self.effects.select(config);
        if let Err(refused) = self.effects.adopt(model, config) {
            self.effects.select(&self.config);
            return Err(refused);
        }
        self.config = *config;
        self.x.water_mps = water_of(&self.config.effects);
        self.model = Some(model.clone());
        Ok(())
    }

    /// Adopts new numbers while running; state and covariance stay.
    ///
    /// # Errors
    /// A value out of range, effect states that come or go, or effects that do not fit the vehicle; the filter is then
    /// as it was.
    pub fn reconfigure(&mut self, config: &NavigationConfig) -> Result<(), ConfigError> {
        config.validate()?;
        if !config.effect_states.alike(&self.config.effect_states) {
            return Err(ConfigError::LayoutChange);
        }
        match (self.model.is_some(), VehicleModel::new(self.effects.declared())) {
            (true, Ok(declared)) if config.effects != self.config.effects => self.adopt(config, &declared),
            _ => {
                self.config = *config;
                Ok(())
            }
        }
    }

    /// Time that the effects' onsets and drifts count from, µs of the filter's time; 0 unless set.
    pub fn set_epoch(&mut self, epoch_us: u64) {
        self.effects.epoch_us = epoch_us;
        self.effects.restart();
    }

    /// s since the epoch.
    pub(super) fn effect_time_s(&self) -> f64 {
        1.0e-6 * (self.time_us as i64).wrapping_sub(self.effects.epoch_us as i64) as f64
    }

    /// Changes the process model and its noise while running.
    ///
    /// # Errors
    /// A value out of range.
    pub fn set_process_model(&mut self, model: ProcessModel, noise: &ProcessNoise) -> Result<(), ConfigError> {
        parameters::check(ProcessNoise::ROWS, noise)?;
        self.config.process_model = model;
        self.config.process_noise = *noise;
        Ok(())
    }

    /// The vehicle as declared and with what is estimated of it.
    pub(crate) fn model(&self) -> Option<&VehicleModel> {
        self.model.as_ref()
    }

    /// The configuration in use.
    #[must_use]
    pub fn config(&self) -> &NavigationConfig {
        &self.config
    }

    /// Starts (or starts again) at `time_us` (2.3.1.2); ship, clones and a failure are forgotten.
    ///
    /// # Errors
    /// Not configured, or a value that is not finite (sigma: not positive).
    pub fn initialise(&mut self, time_us: u64, initial: &InitialState) -> Result<(), NavigationError> {
        if self.model.is_none() {
            return Err(NavigationError::NotInitialised);
        }
        check(initial.state.as_slice(), initial.sigma.as_slice())?;
        let states = self.config.effect_states;
        self.x.layout.reset(states.len(), states.current().is_some(), states.has_current_rate());
        self.x.vehicle = initial.state;
        self.x.wrap_heading();
        self.p.set_vehicle(initial.sigma.as_slice());
        self.w = [0.0; ROWS];
        for (at, state) in (EFFECTS..).zip(states.iter()) {
            let declared = match state.parameter {
                StateParameter::Effect(id) => self.config.effects.get(id),
                _ => 0.0,
            };
            self.x.set_tail(at, &[declared]);
            self.p.set_diagonal(at, &[state.initial_sigma]);
        }
        self.effects.restart();
        self.monitor = InnovationMonitor::new();
        self.peers = Peers::NONE;
        self.heard_us = time_us;
        (self.held_s, self.hangs) = (0.0, false);
        self.time_us = time_us;
        self.failure = None;
        self.initialised = true;
        Ok(())
    }

    /// Takes fins as broken from now on: the shares of lift and drag that they have, the angles at which they stand. What
    /// was estimated of the vehicle's handling explained others by something else: it begins anew from its prior, unless
    /// only a size has changed.
    pub(crate) fn set_fins(&mut self, shares: &[f64; FINS], stands_rad: &[Option<f64>; FINS]) {
        let Some(model) = &mut self.model else { return };
        let broken = |model: &VehicleModel| {
            (model.fin_effectiveness().map(|share| share != 1.0), model.standing_fins().map(|angle| angle.is_some()))
        };
        let before = broken(model);
        model.set_fin_effectiveness(shares);
        model.set_standing_fins(stands_rad);
        if broken(model) == before {
            return;
        }
        let n = self.dimension();
        for (at, state) in (EFFECTS..).zip(self.config.effect_states.iter()) {
            let is_of_handling = match state.parameter {
                StateParameter::LogFactor(j) => ![M11, D11, BETA1, BETA5].contains(&usize::from(j)),
                StateParameter::FinTrim(_) => true,
                _ => false,
            };
            if is_of_handling {
                self.x.set_tail(at, &[0.0]);
                (0..n).for_each(|other| self.p.set(at, other, 0.0));
                self.p.set(at, at, state.initial_sigma * state.initial_sigma);
            }
        }
    }

    /// Makes the ship known (again) at the filter's present time; ship clones are forgotten.
    /// Each step is shown to `observer`.
    ///
    /// # Errors
    /// Not initialised, a value that is not finite (sigma: not positive), or three other vehicles, beside which there is
    /// no room.
    pub fn initialise_ship(&mut self, ship: &InitialShip, observer: &mut impl Observer) -> Result<(), NavigationError> {
        if !self.is_initialised() {
            return Err(NavigationError::NotInitialised);
        }
        check(&ship.state, &ship.sigma)?;
        self.forget_ship(observer);
        if !self.x.layout.has_room(SHIP_STATES) {
            return Err(NavigationError::NotInitialised);
        }
        let (n, at) = (self.dimension(), self.x.layout.ship_place());
        self.p.insert(n, at, SHIP_STATES);
        self.x.insert(n, at, SHIP_STATES);
        self.x.layout.set_ship(true);
        self.x.set_tail(at, &ship.state);
        self.p.set_diagonal(at, &ship.sigma);
        observer.observe(&LinearStep::Insert { at, count: SHIP_STATES });
        Ok(())
    }

    /// Whether state and covariance mean anything.
    #[must_use]
    pub fn is_initialised(&self) -> bool {
        self.initialised && self.failure.is_none()
    }

    /// How the filter failed, if it did; it then refuses everything until initialised again.
    #[must_use]
    pub fn failure(&self) -> Option<NavigationError> {
        self.failure
    }

    /// Filter time, µs.
    #[must_use]
    pub fn time_us(&self) -> u64 {
        self.time_us
    }

    /// x_v.
    #[must_use]
    pub fn state(&self) -> &VehicleState {
        &self.x.vehicle
    }

    /// The ship [x y ψ ẋ ẏ ψ̇], if it is known.
    #[must_use]
    pub fn ship_state(&self) -> Option<[f64; SHIP_STATES]> {
        self.x.layout.ship().map(|at| self.x.block(at))
    }

    /// One sigma of the ship's velocity, north and east, m/s, if it is known.
    #[must_use]
    pub fn ship_velocity_sigma_mps(&self) -> Option<[f64; 2]> {
        let at = self.x.layout.ship()? + SHIP_VELOCITY;
        Some([at, at + 1].map(|i| libm::sqrt(self.p.get(i, i))))
    }

    /// An effect state: value and one sigma, if it is estimated.
    #[must_use]
    pub fn effect_state(&self, effect: &str, parameter: &str) -> Option<(f64, f64)> {
        let mut states = (EFFECTS..).zip(self.config.effect_states.iter());
        let (at, _) =
            states.find(|(_, state)| state.parameter.group() == effect && state.parameter.name() == parameter)?;
        (at < self.dimension()).then(|| (self.x.get(at), libm::sqrt(self.p.get(at, at))))
    }

    /// Current [north, east], m/s: estimated, or as the effect set says.
    #[must_use]
    pub fn current(&self) -> [f64; 2] {
        self.x.current().into()
    }

    /// One sigma of the current [north, east], m/s, if it is estimated.
    #[must_use]
    pub fn current_sigma(&self) -> Option<[f64; 2]> {
        let at = self.x.layout.current()?;
        Some([at, at + 1].map(|i| libm::sqrt(self.p.get(i, i))))
    }

    /// Place of the current's two states, if it is estimated.
    #[must_use]
    pub fn current_place(&self) -> Option<usize> {
        self.x.layout.current()
    }

    /// Φ of the step last taken, for an observer.
    pub(super) fn transition(&self, step_s: f64) -> Transition<'_> {
        Transition {
            step: &self.step,
            states: self.dimension(),
            live: EFFECTS + self.config.effect_states.len(),
            current: self.x.layout.current(),
            current_rate: self.x.layout.current().and_then(|_| self.x.layout.current_rate()),
            turn: self.turn_of_tide(step_s),
            ship: self.x.layout.ship(),
            step_s,
        }
    }

    /// Number of states at present: vehicle 12, effects, ship 6, clones 6 each, in this order.
    #[must_use]
    pub fn dimension(&self) -> usize {
        self.x.layout.len()
    }

    /// State `i`; 0 beyond the last.
    #[must_use]
    pub fn state_at(&self, i: usize) -> f64 {
        if i < self.dimension() { self.x.get(i) } else { 0.0 }
    }

    /// Variance of state `i` (vehicle states come first); 0 beyond the last. See [`Self::covariance`].
    #[must_use]
    pub fn variance(&self, i: usize) -> f64 {
        self.covariance(i, i)
    }

    /// Covariance of states `i` and `j`; 0 beyond the last. While ranges are unconfirmed, that of the position also
    /// covers the place before them, which P itself does not ([`Self::unconfirmed_sigma`]).
    #[must_use]
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        if i.max(j) >= self.dimension() {
            return 0.0;
        }
        let [unconfirmed, ..] = if i == j && i <= Y { self.monitor.floor(Sensor::Range) } else { [0.0; 3] };
        self.p.get(i, j) + unconfirmed * unconfirmed
    }

    /// P_ij as the gains are computed from it, without what [`Self::covariance`] adds; 0 beyond the last.
    #[must_use]
    pub fn propagated_covariance(&self, i: usize, j: usize) -> f64 {
        if i.max(j) < self.dimension() { self.p.get(i, j) } else { 0.0 }
    }

    /// Variance of the depth by waves, which the filter takes as noise of the depth cell, m².
    #[must_use]
    pub fn wave_variance(&self) -> f64 {
        if self.monitor.waves.have_refused(Sensor::Depth) { self.monitor.waves.variance(Sensor::Depth) } else { 0.0 }
    }

    /// The gate's memory, for [`crate::navigation::Integrity`].
    #[must_use]
    pub fn monitor(&self) -> &InnovationMonitor {
        &self.monitor
    }

    /// Whether one sensor and the filter contradict each other. The sensor is then not fused, and the states that it
    /// observes are propagated with more noise until it is consistent again, or silent.
    #[must_use]
    pub fn is_suspect(&self, sensor: Sensor) -> bool {
        self.monitor.is_suspect(sensor)
    }

    /// Which sensors of the vehicle itself are suspect, one bit each: in a bank, a filter that suspects one which the
    /// main filter uses has a wrong model, and no weight as long as it does.
    #[must_use]
    pub fn refused(&self) -> u8 {
        const SENSORS: [Sensor; 5] =
            [Sensor::Depth, Sensor::Attitude, Sensor::Rates, Sensor::BottomTrack, Sensor::WaterTrack];
        SENSORS.iter().enumerate().fold(0, |bits, (i, sensor)| bits | u8::from(self.is_suspect(*sensor)) << i)
    }

    /// Floor under the sigma of the states that this sensor observes, while the sensor is unconfirmed (it came back in
    /// contradiction to the filter, and no fix has decided between the two); 0 otherwise.
    #[must_use]
    pub fn unconfirmed_sigma(&self, sensor: Sensor) -> f64 {
        self.monitor.floor(sensor).into_iter().fold(0.0, f64::max)
    }

    /// Since when a suspect sensor has contradicted the filter, µs.
    #[must_use]
    pub fn suspect_since_us(&self, sensor: Sensor) -> Option<u64> {
        self.monitor.suspect_since_us(sensor)
    }

    /// How often one sensor was taken back after it had been suspect.
    #[must_use]
    pub fn recoveries(&self, sensor: Sensor) -> u32 {
        self.monitor.recoveries(sensor)
    }

    /// 64-bit digest of time, state and covariance, bit for bit (NaN canonicalised).
    #[must_use]
    pub fn digest(&self) -> u64 {
        self.digest_from(Digest::START)
    }

    /// The digest continued from an earlier one: `running = navigator.digest_from(running)` at
    /// every step covers every step.
    #[must_use]
    pub fn digest_from(&self, running: u64) -> u64 {
        let mut digest = Digest::from(running);
        let n = self.dimension();
        digest.word(self.time_us);
        digest.word(n as u64);
        self.x.iter().for_each(|x| digest.number(x));
        for j in 0..n {
            self.p.column(j).iter().take(n).skip(j).for_each(|p| digest.number(*p));
        }
        digest.finish()
    }
}

/// Every state finite, every sigma positive.
fn check(state: &[f64], sigma: &[f64]) -> Result<(), NavigationError> {
    if !state.iter().chain(sigma).all(|value| value.is_finite()) {
        return Err(NavigationError::NotFinite);
    }
    if sigma.iter().any(|sigma| *sigma <= 0.0) { Err(NavigationError::NotPositive) } else { Ok(()) }
}
