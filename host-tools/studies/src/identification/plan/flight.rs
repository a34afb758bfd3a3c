//! Flights of a plan: the controller steers, and everything is known at 10 Hz.

use crate::identification::experiment::Programme;
use anyhow::anyhow;
use backseat_core::control::mission::{Mission, MissionStatus, Waypoint};
use backseat_core::control::{ControlConfig, Controller};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::state::{self, VehicleState};
use backseat_identify::PERIOD_S;
use backseat_identify::simulation::runge_kutta;
use backseat_identify::{IdentificationData, Sample};
use hil_sim::rng::{Source, Stream};
use hil_sim::truth::{Actuators, Parameters, State, Undeclared, Vehicle, Water};
use nalgebra::{Vector3, Vector6};

/// What moves.
pub trait Body {
    /// Where it is.
    fn state(&self) -> VehicleState;
    /// One period of constant input.
    fn step(&mut self, input: &ActuatorInput);
}

/// The declared model moves: for planning.
#[derive(Clone)]
pub struct Declared<'a> {
    pub model: &'a VehicleModel,
    pub x: VehicleState,
}

impl Body for Declared<'_> {
    fn state(&self) -> VehicleState {
        self.x
    }

    fn step(&mut self, input: &ActuatorInput) {
        // Roll's 1 Hz is right to 1e-4 with two steps.
        for _ in 0..2 {
            self.x = runge_kutta(self.model, &self.x, input, 0.5 * PERIOD_S);
        }
        self.x[state::PSI] = state::wrap_angle(self.x[state::PSI]);
    }
}

/// The simulator's vehicle moves: for judging a plan.
pub struct True(Vehicle);

impl True {
    const STEPS: u32 = 5;

    /// Heading north at a depth, at 1 m/s.
    pub fn new(parameters: &Parameters, depth_m: f64, seed: u64) -> Self {
        let undeclared = Undeclared { no_surface: true, ..Undeclared::default() };
        let start = State::new([0.0, 0.0, depth_m], [0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]);
        Self(Vehicle::with(parameters, &undeclared, start, PERIOD_S / f64::from(Self::STEPS), seed))
    }
}

impl Body for True {
    fn state(&self) -> VehicleState {
        let state = self.0.state();
        let parts = [state.position_m(), state.euler_rad(), state.velocity_mps(), state.rates_radps()];
        VehicleState::from_iterator(parts.into_iter().flatten())
    }

    fn step(&mut self, input: &ActuatorInput) {
        let targets = Actuators { propeller_radps: input.propeller_radps, fins_rad: input.fins_rad };
        for _ in 0..Self::STEPS {
            self.0.step(&targets, &Water::default());
        }
    }
}

/// Heading north at a depth, at 1 m/s.
pub fn start(depth_m: f64) -> VehicleState {
    let mut x = VehicleState::zeros();
    (x[state::Z], x[state::U]) = (depth_m, 1.0);
    x
}

/// A sample without error.
fn sample(step: u64, x: &VehicleState, input: &ActuatorInput) -> Sample {
    Sample { time_us: step * 100_000, attitude: state::attitude(x), velocity: state::velocity(x), input: *input }
}

/// A controller of the reference configuration for a model.
pub fn controller(model: &VehicleModel) -> anyhow::Result<Box<Controller>> {
    let mut controller = Box::new(Controller::new());
    controller.configure(&ControlConfig::REFERENCE, model).map_err(|error| anyhow!("controller: {error:?}"))?;
    Ok(controller)
}

/// Follows waypoints until the last is reached or the time is over; with every sample goes the depth.
pub fn follow(
    body: &mut impl Body,
    controller: &mut Controller,
    waypoints: &[Waypoint],
    duration_s: f64,
) -> anyhow::Result<Vec<(Sample, f64)>> {
    Ok(follow_legs(body, controller, waypoints, duration_s)?.samples)
}

/// A flight along legs.
pub struct Followed {
    /// With every sample goes the depth.
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

/// The same, with the turns.
pub fn follow_legs(
    body: &mut impl Body,
    controller: &mut Controller,
    waypoints: &[Waypoint],
    duration_s: f64,
) -> anyhow::Result<Followed> {
    let mut mission = Mission::new();
    for waypoint in waypoints {
        mission.push(*waypoint).map_err(|error| anyhow!("mission: {error:?}"))?;
    }
    controller.set_mission(&mission);
    controller.start(&body.state()).map_err(|error| anyhow!("mission: {error:?}"))?;
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
        followed.samples.push((sample(step, &x, &command.input), x[state::Z]));
        body.step(&command.input);
    }
    Ok(followed)
}

/// The open-loop inputs of the thesis' experiment for a time, or until `ends` says so.
pub fn open_loop(body: &mut impl Body, duration_s: f64, ends: impl Fn(&VehicleState) -> bool) -> Vec<(Sample, f64)> {
    let mut samples = Vec::new();
    for step in 0..(duration_s / PERIOD_S).round() as u64 {
        let x = body.state();
        if ends(&x) {
            break;
        }
        let input = Programme::IDENTIFICATION.input(step as f64 * PERIOD_S);
        samples.push((sample(step, &x, &input), x[state::Z]));
        body.step(&input);
    }
    samples
}

/// Noise of Table 4.13 on stretches of exact samples.
pub fn measured(
    stretches: &[Vec<(Sample, f64)>],
    noise: &crate::identification::experiment::Noise,
    seed: u64,
) -> IdentificationData {
    let (mut ahrs, mut dvl) = (Stream::new(seed, Source::Ahrs), Stream::new(seed, Source::Dvl));
    let mut data = IdentificationData::default();
    for stretch in stretches {
        let from = data.samples.len();
        let offset_us = data.samples.last().map_or(0, |last| last.time_us + 10_000_000);
        for (sample, _) in stretch {
            let [roll, pitch] = ahrs.normals::<2>(noise.roll_pitch_rad);
            let ([u, v, w], [p, q, r]) = (dvl.normals::<3>(noise.linear_mps), ahrs.normals::<3>(noise.angular_radps));
            data.samples.push(Sample {
                time_us: sample.time_us + offset_us,
                attitude: sample.attitude + Vector3::new(roll, pitch, 0.0),
                velocity: sample.velocity + Vector6::new(u, v, w, p, q, r),
                input: sample.input,
            });
        }
        data.stretches.push(from..data.samples.len());
    }
    data
}
