//! Data sets for diagnosis and identification: measured logs of a vehicle that does more than was declared.
//!
//! The truth stays apart from the log. The vehicle is the simulator's own; where nothing is injected it is exactly
//! what the vehicle file declares (no servo or propeller lag, no surface), so that a log without effects has none.
//! The vehicle is steered in closed loop by an autopilot of its own on the noisy measurements, and what it commands
//! is logged; a log of half an hour takes a fraction of a second.

mod autopilot;
mod files;
mod mission;
mod positioning;
mod readings;
pub mod runs;

pub use files::{effects_json, write, write_effects};
pub use mission::{Leg, Shape};

use crate::noise::NoiseKind;
use crate::observation::{Observation, ObservationKind};
use crate::rng::{Source, Stream};
use crate::scenario::{self, Effect, Effects, Request, Scenario};
use crate::truth::Actuators;
use crate::world::World;
pub use autopilot::Autopilot;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::state::VehicleState;
use backseat_logs::{Column, Log, LogRow, Truth, TruthRow, VehicleFile};

/// Time between two commands, µs.
pub const COMMAND_US: u64 = 200_000;
/// Time between two rows of truth, µs.
const TRUTH_US: u64 = 1_000_000;
/// Log times are whole steps of this, µs.
const CLOCK_US: u64 = 10_000;

/// What data are wanted.
#[derive(Clone, Debug)]
pub struct Spec {
    /// The declared vehicle, its noise and that of its sensors.
    pub vehicle: VehicleFile,
    /// Length of the log, s.
    pub duration_s: f64,
    /// What the vehicle does that is not declared.
    pub effects: Vec<Request>,
    /// How it moves.
    pub shape: Shape,
    /// Spectra of sensors and disturbance.
    pub noise: NoiseKind,
    /// A DVL is fitted; without it the autopilot holds the propeller instead of the speed.
    pub dvl: bool,
    /// The ship sends.
    pub ranges: bool,
    /// A USBL on the ship sees the vehicle.
    pub usbl: bool,
    /// The vehicle asks fixed transponders.
    pub lbl: bool,
    /// A CTD gives the water's density.
    pub ctd: bool,
    /// Fins and propeller move on from one command to the next, and the log samples them; else they hold each command.
    pub ramps: bool,
}

impl Spec {
    /// Half an hour of lines with every usual sensor and nothing undeclared.
    pub fn new(vehicle: VehicleFile) -> Self {
        Self {
            vehicle,
            duration_s: 1800.0,
            effects: Vec::new(),
            shape: Shape::Lawnmower,
            noise: NoiseKind::White,
            dvl: true,
            ranges: true,
            usbl: false,
            lbl: false,
            ctd: false,
            ramps: false,
        }
    }
}

/// A log and what is behind it.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// What was measured and commanded.
    pub log: Log,
    /// What was: states and current once a second.
    pub truth: Truth,
    /// What was not declared.
    pub effects: Vec<Effect>,
    /// What was flown.
    pub legs: Vec<Leg>,
    /// The seed of it all.
    pub seed: u64,
}

/// Flies and logs; the same specification and seed give the same bits.
///
/// # Panics
/// Never: the built-in scenario that it starts from is checked by a test.
#[must_use]
pub fn simulate(spec: &Spec, seed: u64) -> Dataset {
    let effects = Request::resolve(&spec.effects, seed, spec.duration_s);
    let legs = spec.shape.legs(spec.duration_s, seed);
    let scenario = scenario(spec, &effects, &legs[0], seed);
    let mut world = World::new(&scenario);
    let mut autopilot = Autopilot::new(&spec.vehicle.parameters, &legs, spec.dvl);
    let mut recorder = Recorder::default();
    let mut readings = readings::Readings::new(spec.noise, seed);
    let mut rows = Vec::new();
    let density = scenario.physics().vehicle.rho_kg_per_m3;
    let mut ctd = Stream::new(seed, Source::Ctd);
    let end_us = (spec.duration_s * 1e6) as u64;
    let mut before = None;
    let arm_m = scenario.physics().installation.transducer_arm_m;
    let mut places = Vec::new();
    for time_us in (0..=end_us).step_by(COMMAND_US as usize) {
        world.advance(time_us, &mut |observation| {
            autopilot.observe(observation);
            match &mut readings {
                Some(readings) => readings.logged(observation).iter().for_each(|logged| recorder.observe(logged)),
                None => recorder.observe(observation),
            }
        });
        if spec.usbl || spec.lbl {
            places.push(positioning::Place {
                vehicle_m: world.truth().position_at(arm_m),
                ship_m: world.ship().position_m,
            });
        }
        if time_us.is_multiple_of(TRUTH_US) {
            let now = world.truth();
            rows.push(TruthRow {
                time_us,
                state: VehicleState::from_column_slice(&now.state),
                current_mps: now.current_mps,
            });
            if spec.ctd {
                /// One sigma of a CTD's density, kg/m³.
                const CTD_SIGMA: f64 = 0.05;
                let error = spec.noise.factor() * CTD_SIGMA * ctd.normal();
                recorder.row(time_us).set(Column::WaterDensity, density + error);
            }
        }
        let targets = autopilot.command(time_us);
        let mut logged = targets;
        if spec.ramps {
            // what the log samples is where the actuators are: at the last command, on their way to this one
            logged = before.replace(targets).unwrap_or(targets);
            ramp(&mut world, time_us, &logged, &targets);
        } else {
            world.set_actuator_targets(time_us, targets);
        }
        let input = ActuatorInput { propeller_radps: logged.propeller_radps, fins_rad: logged.fins_rad };
        recorder.row(time_us).set_actuators(&input);
    }
    if let Some(positioning) = positioning::Positioning::new(spec, &scenario, places, seed) {
        positioning.log(&mut recorder.log.rows);
    }
    let truth = Truth { rows, notes: Vec::new() };
    Dataset { log: recorder.log, truth, effects, legs, seed }
}

/// Targets in a straight line over the time between two commands.
fn ramp(world: &mut World, time_us: u64, from: &Actuators, to: &Actuators) {
    const STEPS: u32 = 20;
    for step in 0..STEPS {
        let share = (f64::from(step) + 0.5) / f64::from(STEPS);
        let between = |a: f64, b: f64| a + share * (b - a);
        let targets = Actuators {
            propeller_radps: between(from.propeller_radps, to.propeller_radps),
            fins_rad: core::array::from_fn(|fin| between(from.fins_rad[fin], to.fins_rad[fin])),
        };
        world.set_actuator_targets(time_us + u64::from(step) * COMMAND_US / u64::from(STEPS), targets);
    }
}

/// The world of a data set: the declared vehicle in unbounded water, its sensors at the rates and times of a log.
fn scenario(spec: &Spec, effects: &[Effect], first: &Leg, seed: u64) -> Scenario {
    let mut scenario = Scenario::built_in("survey").expect("a test reads it");
    scenario.vehicle = spec.vehicle.clone();
    let settings = &mut scenario.settings;
    settings.seed = seed;
    settings.duration_s = spec.duration_s;
    settings.start = scenario::Start {
        x_m: 0.0,
        y_m: 0.0,
        depth_m: first.depth_m,
        heading_rad: first.heading_rad,
        speed_mps: first.speed_mps,
    };
    settings.effects = effects.iter().cloned().collect::<Effects>();
    settings.noise = spec.noise;
    settings.plant =
        scenario::Plant { servo_rate_radps: 1.0e6, propeller_lag_s: 0.0, surface: false, ..scenario::Plant::default() };
    settings.environment.bottom_depth_m = 60.0;
    let sensors = &mut settings.sensors;
    sensors.ahrs.offset_s = 0.33;
    sensors.dvl.fitted = spec.dvl;
    sensors.gnss.max_depth_m = mission::SURFACED_M;
    if !spec.ranges {
        settings.acoustics.slots.clear();
    }
    scenario
}

/// Puts the log together; samples of one time share a row.
#[derive(Default)]
struct Recorder {
    log: Log,
}

impl Recorder {
    /// The row of a time, made if there is none; times come a little out of order.
    fn row(&mut self, time_us: u64) -> &mut LogRow {
        let rows = &mut self.log.rows;
        let place = rows.iter().rposition(|row| row.time_us <= time_us);
        let place = match place {
            Some(place) if rows[place].time_us == time_us => place,
            _ => {
                let place = place.map_or(0, |place| place + 1);
                rows.insert(place, LogRow::new(time_us));
                place
            }
        };
        &mut rows[place]
    }

    fn observe(&mut self, observation: &Observation) {
        let time_us = match &observation.kind {
            // Logged when the receiver believes that it arrived: the true time would tell of its clock.
            ObservationKind::Downlink(packet) => packet.toa_us.next_multiple_of(CLOCK_US),
            _ => observation.time_us,
        };
        observation.kind.log(|| self.row(time_us));
    }
}
