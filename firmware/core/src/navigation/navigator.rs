//! The filter that the vehicle navigates by: one, or a bank of two.
//!
//! The robust filter estimates what is not known of the vehicle; where everything is known as declared, its states cost it
//! half of the accuracy. The bank runs the nominal filter beside it and weighs the two by what their ranges say: w_i is
//! proportional to the likelihood of filter i's range innovations, its logarithm forgotten by [`MEMORY`] a range. Only
//! ranges count, because they measure what is wanted; a nominal filter with a wrong model contradicts them long before it
//! contradicts compass and depth sensor, whose many innovations would drown them. The estimate is the mixture:
//! x = Σ w_i x_i, P = Σ w_i (P_i + (x_i − x)(x_i − x)ᵀ).
//!
//! A nominal filter that fails or has lost the vehicle has no weight; the robust one is what all else is asked of.

use super::digest::Digest;
use super::effect_states::EffectStates;
use super::filter::Filter;
use super::{
    CloneError, CloneId, ConfigError, Fusions, InitialShip, InitialState, Measurement, NavigationConfig,
    NavigationError, Observer, ProcessModel, ProcessNoise, Sensor,
};
use crate::dynamics::{ActuatorInput, VehicleModel};
use crate::state::{PSI, VEHICLE_STATES, VehicleState, X, Y, wrap_angle};
use core::ops::Deref;
use nalgebra::{ArrayStorage, SMatrix, Vector2};

/// What a range leaves of the evidence before it: fifty ranges, 25 minutes at one every 30 s. A current that sets in later
/// outweighs them within three ranges.
const MEMORY: f64 = 0.98;

/// The navigation filter. Some 50 kB: lives in a static, never passed by value; a host may copy it.
///
/// What is asked of the main filter alone (augmented states, ship, monitor) is found through [`Deref`].
#[derive(Clone)]
pub struct Navigator {
    main: Filter,
    nominal: Filter,
    /// The bank runs.
    paired: bool,
    /// ln of the likelihood ratio of the ranges, nominal over main, with [`MEMORY`].
    log_ratio: f64,
    /// Weight of the nominal filter.
    weight: f64,
    /// The mixture.
    state: VehicleState,
}

impl Navigator {
    /// Empty: configure and initialise it.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            main: Filter::new(),
            nominal: Filter::new(),
            paired: false,
            log_ratio: 0.0,
            weight: 0.0,
            state: VehicleState::from_array_storage(ArrayStorage([[0.0; VEHICLE_STATES]; 1])),
        }
    }

    /// Adopts a configuration and a vehicle and forgets everything else.
    ///
    /// # Errors
    /// The first value out of range, or a vehicle that its effects do not fit; the filter is then as it was.
    pub fn configure(&mut self, config: &NavigationConfig, model: &VehicleModel) -> Result<(), ConfigError> {
        self.main.configure(config, model)?;
        self.paired = false;
        if config.bank {
            self.nominal.configure(&nominal(config), model)?;
        }
        self.mix();
        Ok(())
    }

    /// Adopts new numbers while running; state and covariance stay.
    ///
    /// # Errors
    /// A value out of range, effect states that come or go, or effects that do not fit the vehicle; the filter is then
    /// as it was.
    pub fn reconfigure(&mut self, config: &NavigationConfig) -> Result<(), ConfigError> {
        if config.bank != self.main.config().bank {
            return Err(ConfigError::LayoutChange);
        }
        self.main.reconfigure(config)?;
        if config.bank { self.nominal.reconfigure(&nominal(config)) } else { Ok(()) }
    }

    /// Adopts another vehicle while running.
    ///
    /// # Errors
    /// [`ConfigError::Plant`] if the effects do not fit it; the model is then as it was.
    pub fn set_model(&mut self, model: &VehicleModel) -> Result<(), ConfigError> {
        self.main.set_model(model)?;
        if self.main.config().bank { self.nominal.set_model(model) } else { Ok(()) }
    }

    /// Time that the effects' onsets and drifts count from, µs of the filter's time; 0 if nobody says.
    pub fn set_epoch(&mut self, epoch_us: u64) {
        self.main.set_epoch(epoch_us);
        self.nominal.set_epoch(epoch_us);
    }

    /// Changes the process model and its noise while running.
    ///
    /// # Errors
    /// A value out of range.
    pub fn set_process_model(&mut self, model: ProcessModel, noise: &ProcessNoise) -> Result<(), ConfigError> {
        self.nominal.set_process_model(model, noise)?;
        self.main.set_process_model(model, noise)
    }

    /// Starts (or starts again) at `time_us` (2.3.1.2); ship, clones and a failure are forgotten.
    ///
    /// # Errors
    /// Not configured, or a value that is not finite (sigma: not positive).
    pub fn initialise(&mut self, time_us: u64, initial: &InitialState) -> Result<(), NavigationError> {
        self.main.initialise(time_us, initial)?;
        self.paired = self.main.config().bank && self.nominal.initialise(time_us, initial).is_ok();
        self.log_ratio = 0.0;
        self.mix();
        Ok(())
    }

    /// Makes the ship known (again) at the filter's present time; ship clones are forgotten.
    ///
    /// # Errors
    /// Not initialised, or a value that is not finite (sigma: not positive).
    pub fn initialise_ship(&mut self, ship: &InitialShip) -> Result<(), NavigationError> {
        self.initialise_ship_observed(ship, &mut ())
    }

    /// [`Self::initialise_ship`], showing the states of the main filter to `observer`.
    ///
    /// # Errors
    /// As [`Self::initialise_ship`].
    pub fn initialise_ship_observed(
        &mut self,
        ship: &InitialShip,
        observer: &mut impl Observer,
    ) -> Result<(), NavigationError> {
        self.main.initialise_ship_observed(ship, observer)?;
        self.paired = self.paired && self.nominal.initialise_ship(ship).is_ok();
        Ok(())
    }

    /// Moves the filter to `to_us` under an input that is constant since the last call; see [`super::MAX_GAP_US`].
    ///
    /// # Errors
    /// See [`NavigationError`]; a refused call leaves the filter as it was, a failure is kept.
    pub fn predict(&mut self, to_us: u64, input: &ActuatorInput) -> Result<(), NavigationError> {
        self.predict_observed(to_us, input, &mut ())
    }

    /// [`Self::predict`], showing each step of the main filter to `observer`.
    ///
    /// # Errors
    /// As [`Self::predict`].
    pub fn predict_observed(
        &mut self,
        to_us: u64,
        input: &ActuatorInput,
        observer: &mut impl Observer,
    ) -> Result<(), NavigationError> {
        self.main.predict_observed(to_us, input, observer)?;
        self.paired = self.paired && self.nominal.predict(to_us, input).is_ok();
        self.mix();
        Ok(())
    }

    /// Fuses one measurement and says what became of each of its scalars in the main filter.
    pub fn fuse(&mut self, measurement: &Measurement) -> Fusions {
        self.fuse_observed(measurement, &mut ())
    }

    /// [`Self::fuse`], showing each scalar that the main filter uses to `observer`.
    pub fn fuse_observed(&mut self, measurement: &Measurement, observer: &mut impl Observer) -> Fusions {
        let fusions = self.main.fuse_observed(measurement, observer);
        if self.paired {
            let other = self.nominal.fuse(measurement);
            if measurement.sensor() == Sensor::Range {
                self.weigh(&fusions, &other);
            }
            self.paired = self.nominal.failure().is_none();
        }
        self.mix();
        fusions
    }

    /// Bayes' rule on a range, used or refused; a reading that neither filter can predict says nothing.
    fn weigh(&mut self, main: &Fusions, nominal: &Fusions) {
        let log_likelihood =
            |fusions: &Fusions| fusions.iter().next().map(|record| -0.5 * (record.nis() + libm::log(record.variance)));
        if let (Some(main), Some(nominal)) = (log_likelihood(main), log_likelihood(nominal))
            && (nominal - main).is_finite()
        {
            self.log_ratio = MEMORY * self.log_ratio + nominal - main;
        }
    }

    /// Takes a delayed state of the vehicle at the filter's present time.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_vehicle(&mut self) -> Result<CloneId, CloneError> {
        self.clone_vehicle_observed(&mut ())
    }

    /// [`Self::clone_vehicle`], showing the states of the main filter to `observer`.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_vehicle_observed(&mut self, observer: &mut impl Observer) -> Result<CloneId, CloneError> {
        let id = self.main.clone_vehicle_observed(observer)?;
        self.paired = self.paired && self.nominal.clone_vehicle() == Ok(id);
        Ok(id)
    }

    /// Takes a delayed state of the ship at the filter's present time.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_ship(&mut self) -> Result<CloneId, CloneError> {
        self.clone_ship_observed(&mut ())
    }

    /// [`Self::clone_ship`], showing the states of the main filter to `observer`.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_ship_observed(&mut self, observer: &mut impl Observer) -> Result<CloneId, CloneError> {
        let id = self.main.clone_ship_observed(observer)?;
        self.paired = self.paired && self.nominal.clone_ship() == Ok(id);
        Ok(id)
    }

    /// Forgets a delayed state; a stale id does nothing.
    pub fn drop_clone(&mut self, id: CloneId) {
        self.drop_clone_observed(id, &mut ());
    }

    /// [`Self::drop_clone`], showing it to `observer`.
    pub fn drop_clone_observed(&mut self, id: CloneId, observer: &mut impl Observer) {
        self.main.drop_clone_observed(id, observer);
        self.nominal.drop_clone(id);
    }

    fn mix(&mut self) {
        self.weight = if self.paired { 1.0 / (1.0 + libm::exp(-self.log_ratio)) } else { 0.0 };
        self.state = *self.main.state();
        if self.paired {
            let mut difference = self.nominal.state() - self.main.state();
            difference[PSI] = wrap_angle(difference[PSI]);
            self.state += difference * self.weight;
            self.state[PSI] = wrap_angle(self.state[PSI]);
        }
    }

    /// Weight of the nominal filter in the bank, 0 to 1; 0 without a bank.
    #[must_use]
    pub fn nominal_weight(&self) -> f64 {
        self.weight
    }

    /// x_v.
    #[must_use]
    pub fn state(&self) -> &VehicleState {
        &self.state
    }

    /// Current [north, east], m/s: estimated, or as the effect set says.
    #[must_use]
    pub fn current(&self) -> [f64; 2] {
        let [main, nominal] = [&self.main, &self.nominal].map(|filter| Vector2::from(filter.current()));
        if self.paired { (main + (nominal - main) * self.weight).into() } else { main.into() }
    }

    /// State `i`, those behind the vehicle's as the main filter has them; 0 beyond the last.
    #[must_use]
    pub fn state_at(&self, i: usize) -> f64 {
        self.state.as_slice().get(i).copied().unwrap_or_else(|| self.main.state_at(i))
    }

    /// Variance of state `i` (vehicle states come first); 0 beyond the last. See [`Self::covariance`].
    #[must_use]
    pub fn variance(&self, i: usize) -> f64 {
        self.covariance(i, i)
    }

    /// Covariance of states `i` and `j`; 0 beyond the last. That of vehicle states is that of the mixture; that of the
    /// position covers both accounts while ranges are unconfirmed, which P itself does not ([`Filter::unconfirmed_sigma`]).
    #[must_use]
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let main = self.main.covariance(i, j);
        if !self.paired || i.max(j) >= VEHICLE_STATES {
            return main;
        }
        let apart = |i: usize| {
            let difference = self.nominal.state_at(i) - self.main.state_at(i);
            if i == PSI { wrap_angle(difference) } else { difference }
        };
        let w = self.weight;
        (1.0 - w) * main + w * self.nominal.covariance(i, j) + w * (1.0 - w) * apart(i) * apart(j)
    }

    /// Copies the vehicle's covariance.
    pub fn vehicle_covariance(&self, out: &mut SMatrix<f64, 12, 12>) {
        for j in 0..VEHICLE_STATES {
            for i in 0..VEHICLE_STATES {
                out[(i, j)] = self.covariance(i, j);
            }
        }
    }

    /// √(σx² + σy²) of the vehicle (DRMS), m.
    #[must_use]
    pub fn horizontal_sigma_m(&self) -> f64 {
        libm::sqrt(self.variance(X) + self.variance(Y))
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
        let digest = self.main.digest_from(running);
        if !self.paired {
            return digest;
        }
        let mut digest = Digest::from(self.nominal.digest_from(digest));
        digest.number(self.log_ratio);
        digest.finish()
    }

    /// Model, Jacobian and discretisation of one step of the main filter. For the cost table only.
    #[doc(hidden)]
    pub fn discretise(&mut self, step_s: f64, input: &ActuatorInput) {
        self.main.discretise(step_s, input);
    }

    /// State and covariance of the main filter over the step last discretised. For the cost table only.
    #[doc(hidden)]
    pub fn propagate(&mut self, step_s: f64) {
        self.main.propagate(step_s);
    }
}

/// The configuration of the nominal filter beside a robust one.
fn nominal(config: &NavigationConfig) -> NavigationConfig {
    NavigationConfig { effect_states: EffectStates::NONE, noise_factor: [1.0; 6], ..*config }
}

impl Deref for Navigator {
    type Target = Filter;

    fn deref(&self) -> &Filter {
        &self.main
    }
}

impl Default for Navigator {
    fn default() -> Self {
        Self::new()
    }
}
