//! The controller: a mission, an estimate and a current in, actuators out.

use super::allocation::{Datum, allocate, allocate_to};
use super::aside::Aside;
use super::dive::Dive;
use super::guidance::{GuidanceGains, crab_angle_rad, turn_rate_max_radps};
use super::limits::{ActuatorLimits, Limiter};
use super::lqr::Lqr;
use super::mission::{Mission, MissionError, MissionStatus, Progress, Waypoint};
use super::reference::ReferenceTrajectory;
use super::speed::propeller_radps;
use super::trackline::{Segment, TrackError};
use super::{ControlConfig, ControlError, ControlLaw, LawContext, attitude_law};
use crate::dynamics::{ActuatorInput, FINS, VehicleModel};
use crate::state::{self, VehicleState};

/// Time that the first command is taken to last, s: the board's step.
const FIRST_STEP_S: f64 = 0.1;
/// A longer gap between commands counts as this, s: actuators do not jump after a pause.
const LONGEST_STEP_S: f64 = 0.2;

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

/// A heading is held as the course of a segment this long, m: the rounding of its ends does not turn it.
const AHEAD_M: f64 = 1000.0;

impl HelmCommand {
    /// From the vehicle along the heading: wherever it drifts, it is on it.
    fn segment(&self, x: &VehicleState) -> Segment {
        let (sin, cos) = libm::sincos(self.heading_rad);
        let [north_m, east_m] = [x[state::X], x[state::Y]];
        Segment {
            from_ne_m: [north_m, east_m],
            to_ne_m: [north_m + AHEAD_M * cos, east_m + AHEAD_M * sin],
            depth_m: self.depth_m,
            speed_mps: self.speed_mps,
        }
    }
}

/// What the controller wants now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Fins and propeller, always finite and within the limits; neutral unless a mission is under way.
    pub input: ActuatorInput,
    /// The same command as heading, depth and speed; `None` unless a mission is under way.
    pub helm: Option<HelmCommand>,
    /// Error about the active leg, or about the heading that is held instead; zero unless a mission is under way.
    pub error: TrackError,
    /// Progress of the mission.
    pub status: MissionStatus,
}

/// Steers the vehicle along a mission. About 16 kB: keep it in a static.
#[derive(Clone, Debug)]
pub struct Controller {
    config: ControlConfig,
    model: Option<VehicleModel>,
    /// The vehicle with its broken fins, if there are any.
    broken: Option<VehicleModel>,
    lqr: Lqr,
    reference: ReferenceTrajectory,
    mission: Mission,
    progress: Progress,
    dive: Dive,
    aside: Option<Aside>,
    steered: Option<HelmCommand>,
    limiter: Limiter,
    last_us: Option<u64>,
}

impl Controller {
    /// Not configured: commands neutral.
    #[must_use]
    pub const fn new() -> Self {
        let limiter = Limiter::new(ActuatorLimits::NONE);
        Self {
            config: ControlConfig::BLANK,
            model: None,
            broken: None,
            lqr: Lqr::new(),
            reference: ReferenceTrajectory::new(limiter),
            mission: Mission::new(),
            progress: Progress::new(),
            dive: Dive::new(),
            aside: None,
            steered: None,
            limiter,
            last_us: None,
        }
    }

    /// Takes over a configuration and the vehicle it is for; solves the trim and the first gain.
    ///
    /// # Errors
    /// What is wrong; the old configuration stays active then.
    pub fn configure(&mut self, config: &ControlConfig, model: &VehicleModel) -> Result<(), ControlError> {
        config.validate()?;
        self.lqr.configure(model, config.cruise_speed_mps)?;
        self.limiter.set_limits(config.limits.within(model.parameters()));
        let speed = config.speed.for_vehicle(model.parameters(), config.cruise_speed_mps);
        self.config = ControlConfig { speed, ..*config };
        self.model = Some(model.clone());
        self.broken = None;
        Ok(())
    }

    /// Adopts another vehicle model while running; its gain is worked out over the next commands, until then the old
    /// one stays. Its fins are whole.
    pub fn set_model(&mut self, model: &VehicleModel) {
        self.limiter.set_limits(self.config.limits.within(model.parameters()));
        self.model = Some(model.clone());
        self.broken = None;
        self.lqr.renew();
    }

    /// Takes fins as broken: the shares of lift and drag that they have, 1 for a whole fin, and the angles at which they
    /// stand, rad. The LQR's allocation gives their part to the others; the PD law steers on as before.
    pub fn set_fins(&mut self, shares: &[f64; FINS], stands_rad: &[Option<f64>; FINS]) {
        let whole = shares.iter().all(|share| *share == 1.0) && stands_rad.iter().all(Option::is_none);
        self.broken = self.model.clone().filter(|_| !whole);
        if let Some(broken) = &mut self.broken {
            broken.set_fin_effectiveness(shares);
            broken.set_standing_fins(stands_rad);
        }
    }

    /// The regulator: trim and gain in force.
    #[must_use]
    pub fn lqr(&self) -> &Lqr {
        &self.lqr
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

    /// Forgets the stored mission; one that is under way stops.
    pub fn clear_mission(&mut self) {
        self.mission.clear();
        self.progress.stop();
    }

    /// Replaces the stored mission by one leg that ends at `waypoint`.
    ///
    /// # Errors
    /// What is wrong with the waypoint; there is no mission then.
    pub fn set_single_leg(&mut self, waypoint: Waypoint) -> Result<(), MissionError> {
        self.clear_mission();
        self.mission.push(waypoint)
    }

    /// Starts the stored mission from where the vehicle is.
    ///
    /// # Errors
    /// The mission is empty, or the vehicle's position is not finite.
    pub fn start(&mut self, x: &VehicleState) -> Result<(), MissionError> {
        // Whatever was commanded before, the vehicle is neutral now.
        self.limiter.reset();
        self.last_us = None;
        self.dive = Dive::new();
        self.aside = None;
        self.steered = None;
        self.reference.start(&self.mission, x, &self.limiter)?;
        self.progress.start(&self.mission, [x[state::X], x[state::Y]])
    }

    /// Stops: from now on commands are neutral.
    pub fn stop(&mut self) {
        self.progress.stop();
    }

    /// Departs from the leg from now on, or follows it again; not with the law about the reference trajectory, which
    /// flies the leg itself.
    pub fn set_aside(&mut self, aside: Option<Aside>) {
        self.aside = aside.filter(|_| self.can_go_aside());
    }

    /// Holds a heading, a depth and a speed instead of the leg from now on, or flies the leg again from where the vehicle
    /// is. Meanwhile the mission stands still: no waypoint is passed. As little with the law about the reference
    /// trajectory, and no number that is not finite.
    pub fn set_helm(&mut self, helm: Option<HelmCommand>) {
        let is_finite =
            |helm: &HelmCommand| [helm.heading_rad, helm.depth_m, helm.speed_mps].iter().all(|x| x.is_finite());
        self.steered = helm.filter(|helm| self.can_go_aside() && is_finite(helm));
    }

    /// The law follows legs: one about a reference trajectory has no place for what departs from it.
    #[must_use]
    pub fn can_go_aside(&self) -> bool {
        self.config.law != ControlLaw::LqrOnReference
    }

    /// The leg that is flown now.
    #[must_use]
    pub fn segment(&self) -> Option<&Segment> {
        self.progress.segment()
    }

    /// Progress of the mission.
    #[must_use]
    pub fn status(&self) -> MissionStatus {
        self.progress.status()
    }

    /// The command at `time_us` for the estimate `x` in a current of `current_ne_mps` (north, east; zero where
    /// it is not estimated). Call it at a steady rate, 10 Hz by design; a state that is not finite gives neutral.
    pub fn command(&mut self, time_us: u64, x: &VehicleState, current_ne_mps: [f64; 2]) -> Command {
        #[allow(clippy::cast_precision_loss)] // exact below 285 years
        let dt_s = self.last_us.map_or(FIRST_STEP_S, |last| time_us.saturating_sub(last) as f64 * 1e-6);
        let dt_s = dt_s.min(LONGEST_STEP_S);
        self.last_us = Some(time_us);

        let mut command = Command { status: self.progress.status(), ..Command::default() };
        // a heading is held, not a course: nothing is held up against the current
        let is_known = self.steered.is_none() && current_ne_mps.iter().all(|c| c.is_finite());
        let current = if is_known { current_ne_mps } else { [0.0; 2] };
        let mut wanted = ActuatorInput::default();
        if let Some(model) = &self.model
            && x.iter().all(|value| value.is_finite())
        {
            if self.steered.is_none() {
                command.status = self.progress.update(&self.mission, x, self.config.turn_radius_m);
            }
            if let Some(leg) = self.progress.segment() {
                let leg = self.steered.map_or(*leg, |helm| helm.segment(x));
                let speed_mps = self.dive.speed_mps(time_us, x[state::Z], leg.depth_m, leg.speed_mps);
                let leg = Segment { speed_mps, ..leg };
                let aside = self.aside.filter(|_| self.steered.is_none());
                let segment = &aside.map_or(leg, |aside| aside.of(&leg));
                let crab = crab_angle_rad(segment, x, current);
                command.error = segment.error(x);
                command.helm = Some(HelmCommand {
                    heading_rad: GuidanceGains::DEFAULT.heading_rad(&command.error, crab),
                    depth_m: segment.depth_m,
                    speed_mps: segment.speed_mps,
                });
                self.lqr.advance(model, speed_mps);
                let trim = self.lqr.trim();
                let context = LawContext { config: &self.config, model, trim, current_ne_mps: current };
                let reference = match self.config.law {
                    ControlLaw::LqrOnReference => self.reference.step(&context, &self.mission, x, dt_s),
                    ControlLaw::Pd | ControlLaw::Lqr => None,
                };
                wanted = match (self.config.law, &reference) {
                    (ControlLaw::Pd, _) => attitude_law(&context, x, segment),
                    (_, Some((x_ref, input_ref))) => self.regulate_about(model, x, x_ref, input_ref),
                    (_, None) => self.regulate_line(model, x, segment, crab),
                };
                if let Some(aside) = &aside {
                    wanted.fins_rad.iter_mut().zip(aside.fins_rad).for_each(|(fin, more)| *fin += more);
                }
            }
        }
        // A clock that jumps ahead gives no fin more time than a step.
        command.input = self.limiter.apply(&wanted, dt_s.min(FIRST_STEP_S));
        command
    }

    /// LQR about the line, held at trim with the crab angle.
    fn regulate_line(&self, model: &VehicleModel, x: &VehicleState, segment: &Segment, crab: f64) -> ActuatorInput {
        let trim = self.lqr.trim();
        let track = segment.error(x);
        let mut error = x - trim.state();
        error[state::X] = 0.0;
        error[state::Y] = track.cross_m;
        error[state::Z] = track.depth_m;
        error[state::PSI] = state::wrap_angle(x[state::PSI] - track.course_rad - crab);
        error[state::U] = x[state::U] - segment.speed_mps;
        let ratio = segment.speed_mps / trim.surge_mps;
        self.regulate(model, x, &error, trim.thrust_n * ratio * ratio, trim.fins_rad)
    }

    /// LQR about a state of the reference trajectory, in the frame of its heading.
    fn regulate_about(
        &self,
        model: &VehicleModel,
        x: &VehicleState,
        x_ref: &VehicleState,
        input_ref: &ActuatorInput,
    ) -> ActuatorInput {
        let mut error = x - x_ref;
        let (sin, cos) = libm::sincos(x_ref[state::PSI]);
        let (north, east) = (error[state::X], error[state::Y]);
        error[state::X] = cos * north + sin * east;
        error[state::Y] = cos * east - sin * north;
        error[state::PHI] = state::wrap_angle(error[state::PHI]);
        error[state::PSI] = state::wrap_angle(error[state::PSI]);
        let thrust = model.propeller().thrust(input_ref.propeller_radps, x_ref[state::U]);
        self.regulate(model, x, &error, thrust, input_ref.fins_rad)
    }

    fn regulate(
        &self,
        model: &VehicleModel,
        x: &VehicleState,
        error: &VehicleState,
        thrust_n: f64,
        fins_rad: [f64; 4],
    ) -> ActuatorInput {
        let demand = self.lqr.demand(error, turn_rate_max_radps(model));
        let limits = self.limiter.limits();
        let (v, datum) = (state::velocity(x), Datum::Above(fins_rad));
        let thrust = (thrust_n + demand.thrust_n).max(0.0).min(self.config.speed.thrust_max_n);
        ActuatorInput {
            propeller_radps: propeller_radps(model.propeller(), thrust, x[state::U]),
            fins_rad: match &self.broken {
                Some(actual) => allocate_to(actual, model, &v, &demand.moments, &datum, limits.fin_rad),
                None => allocate(self.config.allocation, model, &v, &demand.moments, &datum, limits.fin_rad),
            },
        }
    }
}
