//! Flights along a plan: the board's controller steers, and the exact state is sampled at 10 Hz.

use super::PlanError;
use crate::simulation::runge_kutta;
use crate::{PERIOD_S, PeriodInput, Sample};
use backseat_core::control::mission::{Mission, MissionStatus, Waypoint};
use backseat_core::control::{ControlConfig, Controller};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::state::{self, VehicleState};

/// A vehicle that moves.
pub trait Body {
    /// Its state.
    fn state(&self) -> VehicleState;
    /// Moves it by one period of constant input.
    fn step(&mut self, input: &ActuatorInput);
}

/// The vehicle as declared, for planning.
#[derive(Clone)]
pub struct Declared<'a> {
    /// Its model.
    pub model: &'a VehicleModel,
    /// Its state.
    pub x: VehicleState,
}

impl Body for Declared<'_> {
    fn state(&self) -> VehicleState {
        self.x
    }

    fn step(&mut self, input: &ActuatorInput) {
        // Roll's 1 Hz is right to 1e-4 with two steps.
        for _ in 0..2 {
            self.x = runge_kutta(self.model, &self.x, &[*input; 2], 0.5 * PERIOD_S);
        }
        self.x[state::PSI] = state::wrap_angle(self.x[state::PSI]);
    }
}

/// Heading north at a depth, at 1 m/s.
#[must_use]
pub fn start(depth_m: f64) -> VehicleState {
    let mut x = VehicleState::zeros();
    (x[state::Z], x[state::U]) = (depth_m, 1.0);
    x
}

/// The sample of a step, without error.
#[must_use]
pub fn exact_sample(step: u64, x: &VehicleState, input: &ActuatorInput) -> Sample {
    Sample {
        time_us: step * 100_000,
        attitude: state::attitude(x),
        velocity: state::velocity(x),
        input: PeriodInput::held(*input),
    }
}

/// A controller of the reference configuration for a model.
///
/// # Errors
/// [`PlanError::Controller`].
pub fn controller(model: &VehicleModel) -> Result<Box<Controller>, PlanError> {
    let mut controller = Box::new(Controller::new());
    controller.configure(&ControlConfig::REFERENCE, model).map_err(PlanError::Controller)?;
    Ok(controller)
}

/// Follows waypoints until the last is reached or the time is over; each sample comes with its depth, m.
///
/// # Errors
/// [`PlanError::Mission`].
pub fn follow(
    body: &mut impl Body,
    controller: &mut Controller,
    waypoints: &[Waypoint],
    duration_s: f64,
) -> Result<Vec<(Sample, f64)>, PlanError> {
    Ok(follow_legs(body, controller, waypoints, duration_s)?.samples)
}

/// A flight along legs.
pub struct Followed {
    /// Each sample with its depth, m.
    pub samples: Vec<(Sample, f64)>,
    /// Where each leg after the first begins: the sample, and the state.
    pub turns: Vec<(usize, VehicleState)>,
    /// The last waypoint was reached.
    pub finished: bool,
}

impl Followed {
    /// Steepest pitch, rad.
    pub fn steepest_rad(&self) -> f64 {
        self.samples.iter().map(|(sample, _)| sample.attitude.y.abs()).fold(0.0, f64::max)
    }

    /// Shallowest and deepest, m.
    pub fn depths_m(&self) -> [f64; 2] {
        let depths = self.samples.iter().map(|(_, depth_m)| *depth_m);
        [depths.clone().fold(f64::INFINITY, f64::min), depths.fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Length, s.
    pub fn duration_s(&self) -> f64 {
        self.samples.len() as f64 * PERIOD_S
    }
}

/// [`follow`], with the turns.
///
/// # Errors
/// [`PlanError::Mission`].
pub fn follow_legs(
    body: &mut impl Body,
    controller: &mut Controller,
    waypoints: &[Waypoint],
    duration_s: f64,
) -> Result<Followed, PlanError> {
    let mut mission = Mission::new();
    for waypoint in waypoints {
        mission.push(*waypoint).map_err(PlanError::Mission)?;
    }
    controller.set_mission(&mission);
    controller.start(&body.state()).map_err(PlanError::Mission)?;
    let mut followed = Followed { samples: Vec::new(), turns: Vec::new(), finished: false };
    let mut leg = MissionStatus::Leg(0);
    for step in 0..(duration_s / PERIOD_S).round() as u64 {
        let x = body.state();
        let command = controller.command(step * 100_000, &x, [0.0; 2]);
        if command.status == MissionStatus::Finished {
            followed.finished = true;
            break;
        }
        if command.status != leg {
            leg = command.status;
            followed.turns.push((followed.samples.len(), x));
        }
        followed.samples.push((exact_sample(step, &x, &command.input), x[state::Z]));
        body.step(&command.input);
    }
    Ok(followed)
}
