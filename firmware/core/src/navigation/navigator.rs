//! The filter itself.

use super::{
    CloneError, CloneId, ConfigError, Fusions, InitialShip, InitialState, Measurement, NavigationConfig,
    NavigationError, ProcessModel, ProcessNoise, Sensor,
};
use crate::dynamics::{ActuatorInput, VehicleModel};
use crate::state::VehicleState;
use nalgebra::SMatrix;

/// Longest gap that one call of [`Navigator::predict`] crosses, µs.
pub const MAX_GAP_US: u64 = 600_000_000;

/// The centralized extended Kalman filter. Lives in a static; never passed by value.
pub struct Navigator {
    config: NavigationConfig,
    model: Option<VehicleModel>,
    time_us: u64,
    vehicle: VehicleState,
}

impl Navigator {
    /// Empty: configure and initialise it.
    #[must_use]
    pub const fn new() -> Self {
        todo!()
    }

    /// Adopts a configuration and a vehicle and forgets everything else.
    ///
    /// # Errors
    /// The first value out of range; the filter is then as it was.
    pub fn configure(&mut self, config: &NavigationConfig, model: &VehicleModel) -> Result<(), ConfigError> {
        self.config = *config;
        self.model = Some(model.clone());
        Ok(())
    }

    /// Adopts new numbers while running; state and covariance stay.
    ///
    /// # Errors
    /// A value out of range, or a change of the effect states.
    pub fn reconfigure(&mut self, _config: &NavigationConfig) -> Result<(), ConfigError> {
        todo!()
    }

    /// Adopts another vehicle model while running.
    pub fn set_model(&mut self, _model: &VehicleModel) {
        todo!()
    }

    /// Changes the process model and its noise while running.
    ///
    /// # Errors
    /// A value out of range.
    pub fn set_process_model(&mut self, _model: ProcessModel, _noise: &ProcessNoise) -> Result<(), ConfigError> {
        todo!()
    }

    /// The configuration in use.
    #[must_use]
    pub fn config(&self) -> &NavigationConfig {
        &self.config
    }

    /// Starts (or starts again) at `time_us`; ship and clones are forgotten.
    ///
    /// # Errors
    /// Not configured, or a value that is not finite (sigma: not positive).
    pub fn initialise(&mut self, _time_us: u64, _initial: &InitialState) -> Result<(), NavigationError> {
        todo!()
    }

    /// Makes the ship known (again) at the filter's present time; ship clones are forgotten.
    ///
    /// # Errors
    /// Not initialised, or a value that is not finite (sigma: not positive).
    pub fn initialise_ship(&mut self, _ship: &InitialShip) -> Result<(), NavigationError> {
        todo!()
    }

    /// Whether state and covariance mean anything.
    #[must_use]
    pub fn is_initialised(&self) -> bool {
        todo!()
    }

    /// How the filter failed, if it did; it then refuses everything until initialised again.
    #[must_use]
    pub fn failure(&self) -> Option<NavigationError> {
        todo!()
    }

    /// Filter time, µs.
    #[must_use]
    pub fn time_us(&self) -> u64 {
        self.time_us
    }

    /// x_v.
    #[must_use]
    pub fn state(&self) -> &VehicleState {
        &self.vehicle
    }

    /// The ship [x y ψ ẋ ẏ ψ̇], if it is known.
    #[must_use]
    pub fn ship_state(&self) -> Option<[f64; 6]> {
        todo!()
    }

    /// Current [north, east], m/s; zero where it is not estimated.
    #[must_use]
    pub fn current(&self) -> [f64; 2] {
        todo!()
    }

    /// One sigma of the current [north, east], m/s, if it is estimated.
    #[must_use]
    pub fn current_sigma(&self) -> Option<[f64; 2]> {
        todo!()
    }

    /// Number of states at present.
    #[must_use]
    pub fn dimension(&self) -> usize {
        todo!()
    }

    /// Variance of state `i` (vehicle states come first); 0 beyond the last.
    #[must_use]
    pub fn variance(&self, _i: usize) -> f64 {
        todo!()
    }

    /// Covariance of states `i` and `j`; 0 beyond the last.
    #[must_use]
    pub fn covariance(&self, _i: usize, _j: usize) -> f64 {
        todo!()
    }

    /// Copies the vehicle's covariance.
    pub fn vehicle_covariance(&self, _out: &mut SMatrix<f64, 12, 12>) {
        todo!()
    }

    /// √(σx² + σy²) of the vehicle (DRMS), m.
    #[must_use]
    pub fn horizontal_sigma_m(&self) -> f64 {
        todo!()
    }

    /// Moves the filter to `to_us` under an input that is constant since the last call.
    ///
    /// # Errors
    /// See [`NavigationError`]; refused calls leave the filter as it was.
    pub fn predict(&mut self, _to_us: u64, _input: &ActuatorInput) -> Result<(), NavigationError> {
        todo!()
    }

    /// Takes a delayed state of the vehicle at the filter's present time.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_vehicle(&mut self) -> Result<CloneId, CloneError> {
        todo!()
    }

    /// Takes a delayed state of the ship at the filter's present time.
    ///
    /// # Errors
    /// See [`CloneError`].
    pub fn clone_ship(&mut self) -> Result<CloneId, CloneError> {
        todo!()
    }

    /// Forgets a delayed state; a stale id does nothing.
    pub fn drop_clone(&mut self, _id: CloneId) {
        todo!()
    }

    /// Fuses one measurement and says what became of each of its scalars.
    pub fn fuse(&mut self, _measurement: &Measurement) -> Fusions {
        todo!()
    }

    /// Rejections in a row of one sensor.
    #[must_use]
    pub fn consecutive_rejections(&self, _sensor: Sensor) -> u32 {
        todo!()
    }

    /// How often one sensor was taken back after an outage.
    #[must_use]
    pub fn recoveries(&self, _sensor: Sensor) -> u32 {
        todo!()
    }

    /// 64-bit digest of time, state and covariance, bit for bit (NaN canonicalised).
    #[must_use]
    pub fn digest(&self) -> u64 {
        todo!()
    }

    /// The digest continued from an earlier one: `running = navigator.digest_from(running)` at
    /// every step covers every step.
    #[must_use]
    pub fn digest_from(&self, _running: u64) -> u64 {
        todo!()
    }
}

impl Default for Navigator {
    fn default() -> Self {
        Self::new()
    }
}
