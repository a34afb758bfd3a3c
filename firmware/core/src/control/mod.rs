//! Trackline following: guidance, PD and LQR, fin allocation, speed, mission sequencing.
//!
//! [`Controller`] is the one thing a board calls; the modules are its parts, each usable and tested by itself.
//! A mission's waypoints become legs ([`mission`]), a leg and an estimate become an error ([`trackline`]), the error
//! becomes thrust and moments ([`pd`] with [`guidance`] and [`speed`], or [`lqr`] on a gain from [`riccati`] at a
//! [`trim`]), those become fin angles and propeller speed ([`allocation`]), and [`limits`] has the last word.

pub mod allocation;
mod aside;
mod controller;
mod dive;
pub mod guidance;
pub mod limits;
mod linear;
pub mod lqr;
pub mod mission;
pub mod pd;
pub mod reference;
pub mod riccati;
pub mod speed;
pub mod trackline;
pub mod trim;

pub use allocation::AllocationMethod;
pub use aside::{Aside, MANOEUVRES, Manoeuvre};
pub use controller::{Command, Controller, HelmCommand};

use crate::dynamics::{ActuatorInput, VehicleModel};
use crate::parameters::{ParameterError, check};
use crate::state::{self, VehicleState};
use allocation::{Datum, allocate};
use guidance::{GuidanceGains, crab_angle_rad, turn_rate_max_radps};
use limits::ActuatorLimits;
use mission::Mission;
use pd::PdGains;
use speed::{SpeedGains, propeller_radps};
use trackline::Segment;
use trim::Trim;

/// Which law steers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControlLaw {
    /// Kappa guidance and PD (3.31)-(3.34) corrected.
    Pd,
    /// LQR about the line.
    Lqr,
    /// LQR about the reference trajectory of 5.1.
    LqrOnReference,
}

crate::declared! {
    /// Configuration of the controller.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ControlConfig;
    /// LQR for the reference survey.
    const REFERENCE, with {
        /// Actuator limits.
        limits: ActuatorLimits = ActuatorLimits::DEFAULT,
        /// Gains of the PD law.
        pd: PdGains = PdGains::DEFAULT,
        /// Gains of the speed law; its largest thrust holds for every law.
        speed: SpeedGains = SpeedGains::DEFAULT,
    };
    /// Its rows of the table of parameters.
    const ROWS {
        [choice "app.control_law"] "Control law: 0 PD, 1 LQR, 2 LQR about the reference trajectory." law: ControlLaw = ControlLaw::Lqr; [ControlLaw::Pd, ControlLaw::Lqr, ControlLaw::LqrOnReference],
        [choice "app.allocation"] "Fin allocation: 0 decoupled, 1 six degrees of freedom." allocation: AllocationMethod = AllocationMethod::Decoupled; [AllocationMethod::Decoupled, AllocationMethod::SixDof],
        [real "app.fin_limit_rad", "", "rad", [0.01, 1.0]] "Largest fin angle that the controller commands." (limits.fin_rad),
        [real "app.fin_rate_radps", "", "rad/s", [0.01, 50.0]] "Largest rate of a fin." (limits.fin_rate_radps),
        [real "app.propeller_limit_radps", "", "rad/s", [1.0, 1000.0]] "Largest propeller speed that the controller commands." (limits.propeller_radps),
        [real "app.propeller_rate_radps2", "", "rad/s^2", [0.1, 10000.0]] "Largest acceleration of the propeller." (limits.propeller_radps2),
        [real "app.turn_radius_m", "", "m", [0.0, 500.0]] "Radius of the turns at waypoints." turn_radius_m: f64 = 5.0,
        [real "app.cruise_speed_mps", "", "m/s", [Mission::MIN_SPEED_MPS, Mission::MAX_SPEED_MPS]] "Speed through the water for which the first gain is computed." cruise_speed_mps: f64 = 1.0,
    }
}

impl ControlConfig {
    /// All zero: of a controller that is not configured, and whose static takes no flash.
    pub(super) const BLANK: Self = Self {
        law: ControlLaw::Pd,
        allocation: AllocationMethod::Decoupled,
        limits: ActuatorLimits::NONE,
        turn_radius_m: 0.0,
        cruise_speed_mps: 0.0,
        pd: PdGains { kp_psi: 0.0, kd_r: 0.0, kp_theta: 0.0, kd_q: 0.0 },
        speed: SpeedGains { kp_u: 0.0, thrust_max_n: 0.0 },
    };

    /// Checks what does not depend on the vehicle.
    ///
    /// # Errors
    /// The first parameter outside its range, or gains that are not finite or have the wrong sign.
    pub fn validate(&self) -> Result<(), ControlError> {
        check(Self::ROWS, self).map_err(ControlError::OutOfRange)?;
        let (pd, s) = (&self.pd, &self.speed);
        let gains = [pd.kp_psi, pd.kd_r, pd.kp_theta, pd.kd_q, s.kp_u, s.thrust_max_n];
        if gains.iter().all(|x| x.is_finite() && *x >= 0.0) { Ok(()) } else { Err(ControlError::Gains) }
    }
}

/// Why a configuration was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ControlError {
    /// A parameter is not finite or outside its range.
    OutOfRange(ParameterError),
    /// A gain is not finite or has the wrong sign.
    Gains,
    /// The vehicle has no straight level flight at the cruise speed.
    NoTrim,
    /// The Riccati equation has no stabilising solution.
    NoGain,
}

/// Inputs of a law besides the state.
#[derive(Clone, Copy, Debug)]
pub struct LawContext<'a> {
    /// Gains and limits.
    pub config: &'a ControlConfig,
    /// The vehicle.
    pub model: &'a VehicleModel,
    /// Straight level flight of the vehicle.
    pub trim: &'a Trim,
    /// Water current, north and east, m/s; zero where it is not known.
    pub current_ne_mps: [f64; 2],
}

/// Kappa guidance, PD and speed law: the actuators wanted for a segment, before rate limits.
#[must_use]
pub fn attitude_law(context: &LawContext<'_>, x: &VehicleState, segment: &Segment) -> ActuatorInput {
    let LawContext { config, model, trim, current_ne_mps } = *context;
    let error = segment.error(x);
    let heading = GuidanceGains::DEFAULT.heading_rad(&error, crab_angle_rad(segment, x, current_ne_mps));
    let pitch = GuidanceGains::DEFAULT.pitch_rad(&error, trim.pitch_rad);
    let (pd, turn_max) = (config.pd.at_speed(segment.speed_mps), turn_rate_max_radps(model));
    let moments = pd.moments(x, heading, pitch, trim.fin_pitch_moment_nm, turn_max);
    let limit_rad = config.limits.within(model.parameters()).fin_rad;
    let fins_rad = allocate(config.allocation, model, &state::velocity(x), &moments, &Datum::Total, limit_rad);
    let thrust = config.speed.thrust_n(model, x, &fins_rad, segment.speed_mps);
    ActuatorInput { propeller_radps: propeller_radps(model.propeller(), thrust, x[state::U]), fins_rad }
}
