//! Gain of a fault diagnosis: the same flight with a fault, steered on the old model and on the model with the fault.
//!
//! The true vehicle is the simulator's, steered by the board's controller on its true state, so that only control is
//! compared; the monitor sees noisy measurements. Both flights are the same until the diagnosis.

use super::faults::identified;
use crate::intervals::with_interval;
use anyhow::anyhow;
use backseat_analysis::ensemble::run_all;
use backseat_core::control::mission::{Mission, Waypoint};
use backseat_core::control::{ControlConfig, ControlLaw, Controller};
use backseat_core::dynamics::{ActuatorInput, VehicleModel};
use backseat_core::identification::{FaultCause, FaultMonitor};
use backseat_core::state::{self, VehicleState};
use backseat_logs::VehicleFile;
use backseat_logs::stats::mean;
use backseat_report::markdown::markdown_table;
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::{Plant, Scenario};
use hil_sim::truth::{Actuators, Faults, State, Step, Undeclared, Vehicle, Water};
use nalgebra::{Vector3, Vector6};
use std::fmt::Write as _;

/// The board's step, s.
const STEP_S: f64 = 0.1;
/// Steps of the true vehicle in one of the board's.
const SUBSTEPS: u32 = 5;
/// Length of a flight, s.
const FLIGHT_S: f64 = 1800.0;
/// When it breaks, s.
const ONSET_S: f64 = 700.0;
/// From this long after the diagnosis on the flights are compared, s.
const SETTLED_S: f64 = 60.0;
/// Time between two updates of the diagnosed magnitude, which improves with time, steps.
const RENEWAL: u64 = 200;

/// The fault.
#[derive(Clone, Copy, Debug)]
enum Broken {
    /// A whole fin, picked by the seed.
    Fin,
    /// Drag doubles.
    Drag,
}

/// Root mean squares of the control errors.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    cross_m: f64,
    depth_m: f64,
    speed_mps: f64,
    roll_deg: f64,
}

impl Errors {
    const NAMES: [&'static str; 4] = ["across [m]", "depth [m]", "speed [m/s]", "roll [deg]"];

    fn values(&self) -> [f64; 4] {
        [self.cross_m, self.depth_m, self.speed_mps, self.roll_deg]
    }
}

/// Sum of squares.
#[derive(Clone, Copy, Debug, Default)]
struct Squares([f64; 4], f64);

impl Squares {
    fn add(&mut self, errors: [f64; 4]) {
        for (sum, error) in self.0.iter_mut().zip(errors) {
            *sum += error * error;
        }
        self.1 += 1.0;
    }

    fn errors(&self) -> Errors {
        let [cross_m, depth_m, speed_mps, roll] = self.0.map(|sum| (sum / self.1).sqrt());
        Errors { cross_m, depth_m, speed_mps, roll_deg: roll.to_degrees() }
    }
}

/// One flight, or two that differ after the diagnosis.
struct Flight {
    /// Time of the diagnosis, s.
    diagnosed_s: Option<f64>,
    right: bool,
    /// Before the fault.
    sound: Errors,
    /// From [`SETTLED_S`] after the diagnosis on.
    after: Errors,
}

/// Short lines at two speeds and depths.
fn mission() -> anyhow::Result<Mission> {
    let mut mission = Mission::new();
    for line in 0..24_u32 {
        let (x_m, depth_m, speed_mps) =
            (f64::from(line) * 20.0, [4.0, 6.0][line as usize / 2 % 2], [1.0, 1.3][line as usize % 2]);
        let ends = if line % 2 == 0 { [0.0, 80.0] } else { [80.0, 0.0] };
        for y_m in ends {
            let waypoint = Waypoint { x_m, y_m, depth_m, speed_mps };
            mission.push(waypoint).map_err(|error| anyhow!("mission: {error:?}"))?;
        }
    }
    Ok(mission)
}

fn vehicle_state(state: &State) -> VehicleState {
    let parts = [state.position_m(), state.euler_rad(), state.velocity_mps(), state.rates_radps()];
    VehicleState::from_iterator(parts.into_iter().flatten())
}

/// Flies with or without compensation; without, the errors after are those after `diagnosed_s`.
fn fly(
    broken: Broken,
    law: ControlLaw,
    seed: u64,
    compensate: bool,
    diagnosed_s: Option<f64>,
) -> anyhow::Result<Flight> {
    let file = VehicleFile::reference();
    let mut scenario = Scenario::built_in("survey")?;
    scenario.vehicle = file.clone();
    scenario.settings.plant =
        Plant { servo_rate_radps: 1.0e6, propeller_lag_s: 0.0, surface: false, ..Plant::default() };
    let mut faults = Faults::default();
    let fin = (seed % 4) as u8;
    let fault = match broken {
        Broken::Fin => {
            faults.fins[usize::from(fin)] = Step { factor: 0.0, time_s: ONSET_S };
            FaultCause::Fin(fin)
        }
        Broken::Drag => {
            faults.drag = Step { factor: 2.0, time_s: ONSET_S };
            FaultCause::Entanglement
        }
    };
    let undeclared = Undeclared { faults, no_surface: true, ..Undeclared::default() };
    let start = State::new([0.0, 0.0, 4.0], [0.0, 0.0, std::f64::consts::FRAC_PI_2], [1.0, 0.0, 0.0], [0.0; 3]);
    let parameters = scenario.truth_parameters();
    let mut vehicle = Vehicle::with(&parameters, &undeclared, start, STEP_S / f64::from(SUBSTEPS), seed);
    let declared = identified(seed)?;
    let model = VehicleModel::new(&declared).map_err(|error| anyhow!("identified vehicle: {error}"))?;
    let mut controller = Box::new(Controller::new());
    let config = ControlConfig { law, ..ControlConfig::REFERENCE };
    controller.configure(&config, &model).map_err(|error| anyhow!("controller: {error:?}"))?;
    controller.set_mission(&mission()?);
    let mut x = vehicle_state(vehicle.state());
    controller.start(&x).map_err(|error| anyhow!("start: {error:?}"))?;

    let mut monitor = Box::new(FaultMonitor::new());
    let (mut ahrs, mut dvl) = (Stream::new(seed, Source::Ahrs), Stream::new(seed, Source::Dvl));
    // The power densities of a 3 Hz AHRS and a 5 Hz DVL, at 10 Hz.
    let (angle, rate) =
        (file.sensors.attitude_rad * (10.0_f64 / 3.0).sqrt(), file.sensors.rates_radps * (10.0_f64 / 3.0).sqrt());
    let speed = file.sensors.dvl_mps * 2.0_f64.sqrt();
    let mut input = ActuatorInput::default();
    let (mut sound, mut after) = (Squares::default(), Squares::default());
    let mut found = None;
    let mut right = false;
    for step in 0..(FLIGHT_S / STEP_S) as u64 {
        let (time_us, time_s) = (step * 100_000, step as f64 * STEP_S);
        let attitude = state::attitude(&x) + Vector3::from(ahrs.normals::<3>(angle));
        let ([u, v, w], [p, q, r]) = (dvl.normals::<3>(speed), ahrs.normals::<3>(rate));
        let velocity = state::velocity(&x) + Vector6::new(u, v, w, p, q, r);
        monitor.sample(&model, time_us, &attitude, &velocity, &input);
        if let Some(diagnosis) = monitor.diagnosis() {
            let since = *found.get_or_insert(step);
            right = diagnosis.cause == fault;
            if compensate && (step - since) % RENEWAL == 0 && step - since <= 6 * RENEWAL {
                let (parameters, fins) = diagnosis.compensated(&model);
                if let Ok(mut repaired) = VehicleModel::new(&parameters) {
                    repaired.set_fin_effectiveness(&fins);
                    controller.set_model(&repaired);
                }
            }
        }
        let command = controller.command(time_us, &x, [0.0; 2]);
        input = command.input;
        if let Some(helm) = command.helm {
            let errors = [command.error.cross_m, command.error.depth_m, x[state::U] - helm.speed_mps, x[state::PHI]];
            if (300.0..ONSET_S).contains(&time_s) {
                sound.add(errors);
            }
            let since = if compensate { found.map(|step| step as f64 * STEP_S) } else { diagnosed_s };
            if since.is_some_and(|since| time_s > since + SETTLED_S && since > ONSET_S) {
                after.add(errors);
            }
        }
        let targets = Actuators { propeller_radps: input.propeller_radps, fins_rad: input.fins_rad };
        for _ in 0..SUBSTEPS {
            vehicle.step(&targets, &Water::default());
        }
        x = vehicle_state(vehicle.state());
    }
    let diagnosed_s = found.map(|step| step as f64 * STEP_S);
    Ok(Flight { diagnosed_s, right, sound: sound.errors(), after: after.errors() })
}

/// Both flights of every seed as a table.
pub fn markdown(runs: u64, first_seed: u64) -> anyhow::Result<String> {
    let mut table = markdown_table(["fault", "law", ""].into_iter().chain(Errors::NAMES));
    let mut notes = String::new();
    let seeds: Vec<u64> = (first_seed..first_seed + runs).collect();
    for (broken, name) in [(Broken::Fin, "fin lost"), (Broken::Drag, "drag doubled")] {
        for (law, law_name) in [(ControlLaw::Lqr, "LQR"), (ControlLaw::Pd, "PD")] {
            let pairs = run_all(format!("{name}, {law_name}"), &seeds, |seed| {
                let with = fly(broken, law, *seed, true, None)?;
                let without = fly(broken, law, *seed, false, with.diagnosed_s)?;
                Ok((with, without))
            })?;
            let good: Vec<&(Flight, Flight)> =
                pairs.iter().filter(|(with, _)| with.diagnosed_s.is_some_and(|s| s > ONSET_S)).collect();
            let mut line = |what: &str, errors: &dyn Fn(&(Flight, Flight)) -> [f64; 4]| {
                let of_column = |i: usize| good.iter().map(|pair| errors(pair)[i]).collect::<Vec<f64>>();
                let cells = (0..4).map(|i| with_interval(&of_column(i), 3));
                table.add_row([name, law_name, what].map(str::to_owned).into_iter().chain(cells));
            };
            line("before the fault", &|(with, _)| with.sound.values());
            line("with it, not compensated", &|(_, without)| without.after.values());
            line("with it, compensated", &|(with, _)| with.after.values());
            line("change by compensation", &|(with, without)| {
                let (with, without) = (with.after.values(), without.after.values());
                core::array::from_fn(|i| with[i] - without[i])
            });
            let delays: Vec<f64> = good.iter().filter_map(|(with, _)| Some(with.diagnosed_s? - ONSET_S)).collect();
            let right = good.iter().filter(|(with, _)| with.right).count();
            let _ = writeln!(
                notes,
                "- {name}, {law_name}: diagnosed in {} of {runs} flights, after {:.0} s on average, the right cause in {right} at the end.",
                good.len(),
                mean(&delays).unwrap_or(f64::NAN)
            );
        }
    }
    Ok(format!("{table}\n\n{notes}"))
}
