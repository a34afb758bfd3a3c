//! `backseat studies adaptive-control`: gains and feed-forward that follow the parameters the filter holds, against
//! fixed.
//!
//! The simulator's vehicle, steered by the board's controller on the robust filter's estimate, without a DVL. Adaptive:
//! every twenty seconds the controller gets the declared vehicle with the factors that the filter estimates; its trim,
//! feed-forward and LQR gain are worked out anew. Fixed: it keeps the declared vehicle.

use crate::EnsembleArgs;
use crate::ensemble::run_all;
use crate::table::{markdown_table, with_interval, wrapped};
use anyhow::{Context, anyhow};
use backseat_core::control::mission::{Mission, Waypoint};
use backseat_core::control::{ControlConfig, ControlError, ControlLaw, Controller};
use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::identification::theta;
use backseat_core::navigation::{
    AcousticPath, InitialState, Measurement, Navigator, ShipEnd, ShipReport, StateParameter, VehicleEnd,
};
use backseat_core::state::{PHI, PSI, U, VehicleState, X, Y, Z};
use backseat_data::console;
use backseat_data::filter::FilterOptions;
use hil_sim::observation::{Observation, ObservationKind};
use hil_sim::scenario::{Effect, Line, Plant, Scenario, Start, perturbed};
use hil_sim::truth::Actuators;
use hil_sim::world::World;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// The board's step, µs.
const STEP_US: u64 = 100_000;
/// Time between two vehicles for the controller, µs.
const RENEWAL_US: u64 = 20_000_000;
/// Flights end here unless asked otherwise: three lines and a half.
const MINUTES: f64 = 60.0;
/// The fin is lost at this time, s, in the middle of the first line.
const LOST_S: f64 = 500.0;
/// Errors count from this time on, s: on the second line.
const FROM_S: f64 = 1100.0;

/// What is wrong with the declared vehicle, and the law that steers.
#[derive(Clone, Copy, Debug)]
struct Case {
    name: &'static str,
    wrong_share: f64,
    fin_lost: bool,
    law: ControlLaw,
}

const RIGHT: Case = Case { name: "LQR, right parameters", wrong_share: 0.0, fin_lost: false, law: ControlLaw::Lqr };

const CASES: [Case; 6] = [
    RIGHT,
    Case { name: "LQR, 10 % wrong", wrong_share: 0.1, ..RIGHT },
    Case { name: "LQR, 30 % wrong", wrong_share: 0.3, ..RIGHT },
    Case { name: "LQR, a fin lost", fin_lost: true, ..RIGHT },
    Case { name: "PD, 30 % wrong", wrong_share: 0.3, law: ControlLaw::Pd, ..RIGHT },
    Case { name: "PD, a fin lost", fin_lost: true, law: ControlLaw::Pd, ..RIGHT },
];

/// Columns of the table: root mean squares.
const COLUMNS: [&str; 6] = [
    "across the line, by the estimate [m]",
    "across the line, true [m]",
    "depth, true [m]",
    "speed [m/s]",
    "roll [deg]",
    "fins [deg]",
];

/// A vehicle at sea: what is measured goes to the filter, its estimate steers.
struct Flight {
    world: World,
    navigator: Box<Navigator>,
    controller: Box<Controller>,
    declared: VehicleParameters,
    lines: Vec<Line>,
    input: ActuatorInput,
}

impl Flight {
    /// `None` where the declared vehicle has no trim at the speed of the mission, so that no gain can be worked out for
    /// it: the board would refuse it.
    fn new(case: &Case, seed: u64) -> anyhow::Result<Option<Self>> {
        let mut scenario = Scenario::built_in("survey")?;
        let settings = &mut scenario.settings;
        settings.seed = seed;
        // Under way and deep from the first moment on.
        settings.start = Start { x_m: -50.0, y_m: 0.0, depth_m: 3.0, heading_rad: 0.0, speed_mps: 1.0 };
        settings.plant = Plant { surface: false, ..settings.plant };
        if case.fin_lost {
            let values = [("fin", (1 + seed % 4) as f64), ("share", 0.0), ("time_s", LOST_S)];
            settings.effects.push(Effect::new("fin_lost", &values).map_err(|error| anyhow!(error))?);
        }
        let lines = settings.lines();
        let mut mission = Mission::new();
        for [x_m, y_m] in lines.iter().flat_map(|line| [line.from_m, line.to_m]) {
            let waypoint = Waypoint { x_m, y_m, depth_m: 3.0, speed_mps: 1.0 };
            mission.push(waypoint).map_err(|error| anyhow!("mission: {error:?}"))?;
        }
        let world = World::new(&scenario);
        let mut vehicle = scenario.vehicle.clone();
        vehicle.parameters = perturbed(&vehicle.parameters, case.wrong_share, seed);
        let model = VehicleModel::new(&vehicle.parameters).map_err(|error| anyhow!("declared vehicle: {error}"))?;
        let config = FilterOptions::robust(&vehicle).navigation;
        let mut navigator = Box::new(Navigator::new());
        navigator.configure(&config, &model).map_err(|error| anyhow!("filter: {error:?}"))?;
        let state = VehicleState::from_column_slice(&world.truth().state);
        let sensors = &vehicle.sensors;
        let ([roll, pitch, heading], rates) = (sensors.angles_rad(), sensors.rates_radps);
        let sigma = VehicleState::from([1.5, 1.5, 0.06, roll, pitch, heading, 0.1, 0.1, 0.1, rates, rates, rates]);
        navigator.initialise(0, &InitialState { state, sigma }).map_err(|error| anyhow!("filter: {error:?}"))?;
        let mut controller = Box::new(Controller::new());
        let control = ControlConfig { law: case.law, ..ControlConfig::REFERENCE };
        match controller.configure(&control, &model) {
            Err(ControlError::NoTrim) => return Ok(None),
            configured => configured.map_err(|error| anyhow!("controller: {error:?}"))?,
        }
        controller.set_mission(&mission);
        controller.start(&state).map_err(|error| anyhow!("start: {error:?}"))?;
        let declared = vehicle.parameters;
        Ok(Some(Self { world, navigator, controller, declared, lines, input: ActuatorInput::default() }))
    }

    /// Moves world and filter to a time.
    fn advance(&mut self, to_us: u64) -> anyhow::Result<()> {
        let mut observed: Vec<Observation> = Vec::new();
        self.world.advance(to_us, &mut |observation| observed.push(*observation));
        for observation in observed {
            let path = |ship| AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Reported(ship) };
            let [first, second] = match observation.kind {
                ObservationKind::Depth { depth_m } => [Some(Measurement::Depth { z_m: depth_m }), None],
                ObservationKind::Ahrs { euler_rad, rates_radps } => {
                    [Some(Measurement::Attitude { euler_rad }), Some(Measurement::Rates { rates_radps })]
                }
                ObservationKind::Downlink(packet) => {
                    let ship = ShipReport {
                        position_m: packet.ship.position_m,
                        velocity_mps: packet.ship.velocity_mps,
                        position_sigma_m: packet.ship.position_sigma_m,
                        velocity_sigma_mps: packet.ship.velocity_sigma_mps,
                    };
                    let (range_m, range_rate_mps) = (packet.range_m, packet.range_rate_mps);
                    [
                        Some(Measurement::Range { path: path(ship), range_m }),
                        Some(Measurement::RangeRate { path: path(ship), range_rate_mps }),
                    ]
                }
                _ => continue,
            };
            self.predict(observation.time_us)?;
            for measurement in [first, second].iter().flatten() {
                self.navigator.fuse(measurement);
            }
        }
        self.predict(to_us)
    }

    fn predict(&mut self, to_us: u64) -> anyhow::Result<()> {
        self.navigator.predict(to_us, &self.input).map_err(|error| anyhow!("filter: {error:?}"))
    }

    /// The declared vehicle with the factors that the filter holds.
    fn held(&self) -> VehicleParameters {
        let mut held = self.declared;
        for estimate in self.navigator.estimates() {
            if let StateParameter::LogFactor(j) = estimate.parameter {
                theta::scale(&mut held, usize::from(j), estimate.value.exp());
            }
        }
        held
    }

    /// Distance of the true vehicle from the line that it flies; none in turns and before the first.
    fn across_m(&self, x: &[f64; 12]) -> Option<f64> {
        let along = |line: &&Line| {
            let way = [line.to_m[0] - line.from_m[0], line.to_m[1] - line.from_m[1]];
            let length = way[0].hypot(way[1]);
            let off = [x[X] - line.from_m[0], x[Y] - line.from_m[1]];
            let at = (off[0] * way[0] + off[1] * way[1]) / length;
            let across = (off[1] * way[0] - off[0] * way[1]) / length;
            let turned = (way[1].atan2(way[0]) - x[PSI]).cos();
            (at > 50.0 && at < length - 50.0 && turned > 0.7).then_some(across)
        };
        let all = self.lines.iter().filter_map(|line| along(&line));
        all.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    }
}

/// Root mean squares of a flight, in the order of [`COLUMNS`]; `None` of a vehicle that could not start.
fn fly(case: &Case, seed: u64, is_adaptive: bool, minutes: f64) -> anyhow::Result<Option<[f64; 6]>> {
    let Some(mut flight) = Flight::new(case, seed)? else { return Ok(None) };
    let (mut squares, mut counts) = ([0.0; 6], [0.0; 6]);
    for time_us in (STEP_US..=(60.0e6 * minutes) as u64).step_by(STEP_US as usize) {
        flight.advance(time_us)?;
        if is_adaptive
            && time_us % RENEWAL_US == 0
            && let Ok(model) = VehicleModel::new(&flight.held())
        {
            flight.controller.set_model(&model);
        }
        let command = flight.controller.command(time_us, flight.navigator.state(), flight.navigator.current());
        flight.input = command.input;
        let (propeller_radps, fins_rad) = (flight.input.propeller_radps, flight.input.fins_rad);
        flight.world.set_actuator_targets(time_us, Actuators { propeller_radps, fins_rad });
        let truth = flight.world.truth().state;
        let Some(across_m) = flight.across_m(&truth).filter(|_| time_us as f64 * 1e-6 > FROM_S) else { continue };
        let fins = (fins_rad.iter().map(|fin| fin * fin).sum::<f64>() / 4.0).sqrt();
        let errors = [
            command.error.cross_m,
            across_m,
            truth[Z] - 3.0,
            truth[U] - 1.0,
            truth[PHI].to_degrees(),
            fins.to_degrees(),
        ];
        for ((sum, count), error) in squares.iter_mut().zip(&mut counts).zip(errors) {
            *sum += error * error;
            *count += 1.0;
        }
    }
    Ok(Some(core::array::from_fn(|column| f64::sqrt(squares[column] / counts[column]))))
}

/// Runs the study.
///
/// # Errors
/// A flight that fails; a page that cannot be written.
pub fn run(args: &EnsembleArgs) -> anyhow::Result<()> {
    let minutes = args.minutes.unwrap_or(MINUTES);
    let seeds = args.first_seed..args.first_seed + args.runs;
    let jobs: Vec<(Case, bool, u64)> = CASES
        .iter()
        .flat_map(|case| [false, true].map(|is_adaptive| (*case, is_adaptive)))
        .flat_map(|(case, is_adaptive)| seeds.clone().map(move |seed| (case, is_adaptive, seed)))
        .collect();
    let flown = run_all("flights", &jobs, |(case, is_adaptive, seed)| fly(case, *seed, *is_adaptive, minutes))?;
    let runs = args.runs as usize;
    let mut table = markdown_table(["", "gains", "flown"].into_iter().chain(COLUMNS));
    let mut rows: Vec<Value> = Vec::new();
    for (jobs, errors) in jobs.chunks(runs).zip(flown.chunks(runs)) {
        let Some((case, is_adaptive, _)) = jobs.first() else { continue };
        let gains = if *is_adaptive { "adaptive" } else { "fixed" };
        let errors: Vec<[f64; 6]> = errors.iter().flatten().copied().collect();
        let cell = |i: usize| {
            let column: Vec<f64> = errors.iter().map(|errors| errors[i]).collect();
            if column.is_empty() { "no trim".to_owned() } else { with_interval(&column, 3) }
        };
        let flown = format!("{} of {runs}", errors.len());
        table.add_row([case.name.to_owned(), gains.to_owned(), flown].into_iter().chain((0..COLUMNS.len()).map(cell)));
        rows.push(json!({"case": case.name, "gains": gains, "flown": errors.len(), "root_mean_squares": errors}));
    }
    let last = args.first_seed + args.runs - 1;
    let mut page = String::from("# Adaptive control\n\n");
    let _ = writeln!(
        page,
        "Made by `backseat studies adaptive-control --runs {runs} --first-seed {}` (version {}): the lines of the default survey for \
         {minutes:.0} minutes, seeds {} to {last}, steered by the board's controller on the robust filter's estimate without a DVL. \
         Inertia, drag, fins and thrust of the declared vehicle are each too high or too low by the share named; the fin is lost \
         after {LOST_S:.0} s, a different one by seed. Adaptive: every 20 s the controller takes the declared vehicle with the factors \
         that the filter holds. Root mean squares from {FROM_S:.0} s on, on the lines: mean and its 95 % interval over the flights. Flown: a declared \
         vehicle that has no trim at 1 m/s gives no LQR gain, and the board refuses it.\n",
        args.first_seed,
        env!("CARGO_PKG_VERSION"),
        args.first_seed,
    );
    let page = wrapped(&format!("{page}\n{table}\n"));
    if let Some(path) = &args.out {
        std::fs::write(path, &page).with_context(|| path.display().to_string())?;
    }
    let text = if args.json { format!("{}\n", json!({"columns": COLUMNS, "rows": rows})) } else { page };
    console::print(text.as_bytes())
}
