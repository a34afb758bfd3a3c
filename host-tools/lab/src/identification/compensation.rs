//! Gain of a fault diagnosis: the same flight with a fault, steered on the old model and on the model with the fault.
//!
//! The true vehicle is the simulator's, steered by the board's controller on its true state, so that only control is
//! compared; the monitor sees noisy measurements. Both flights are the same until the diagnosis.

use super::identified_vehicle::identified;
use crate::closed_loop::{self, STEP_US, TrueVehicle};
use crate::intervals::with_interval;
use crate::store::{Key, nan};
use anyhow::{Context, anyhow};
use backseat_core::control::mission::{Mission, Waypoint};
use backseat_core::control::{ControlConfig, ControlLaw};
use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::identification::{FaultCause, FaultMonitor};
use backseat_core::state;
use backseat_identify::plan::Body as _;
use backseat_logs::VehicleFile;
use backseat_logs::stats::mean;
use backseat_report::markdown::markdown_table;
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::{Plant, Scenario};
use hil_sim::truth::{Faults, State, Step, Undeclared};
use nalgebra::{Vector3, Vector6};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use std::ops::Range;

/// Length of a flight, µs.
const FLIGHT_US: u64 = 1_800_000_000;
/// When it breaks, s.
const ONSET_S: f64 = 700.0;
/// From this long after the diagnosis on the flights are compared, s.
const SETTLED_S: f64 = 60.0;
/// Time between two updates of the diagnosed magnitude, which improves with time, µs.
const RENEWAL_US: u64 = 20_000_000;

/// The fault.
#[derive(Clone, Copy, Debug)]
enum Broken {
    /// A whole fin, picked by the seed.
    Fin,
    /// Drag doubles.
    Drag,
}

/// Root mean squares of the control errors.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct ControlErrors {
    #[serde(deserialize_with = "nan::one")]
    cross_m: f64,
    #[serde(deserialize_with = "nan::one")]
    depth_m: f64,
    #[serde(deserialize_with = "nan::one")]
    speed_mps: f64,
    #[serde(deserialize_with = "nan::one")]
    roll_deg: f64,
}

impl ControlErrors {
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

    fn errors(&self) -> ControlErrors {
        let [cross_m, depth_m, speed_mps, roll] = self.0.map(|sum| (sum / self.1).sqrt());
        ControlErrors { cross_m, depth_m, speed_mps, roll_deg: roll.to_degrees() }
    }
}

/// One flight, or two that differ after the diagnosis.
#[derive(Clone, Serialize, Deserialize)]
struct FaultyFlight {
    /// Time of the diagnosis, s.
    diagnosed_s: Option<f64>,
    right: bool,
    /// Before the fault.
    sound: ControlErrors,
    /// From [`SETTLED_S`] after the diagnosis on.
    after: ControlErrors,
}

/// The flight with compensation and the one without.
#[derive(Clone, Serialize, Deserialize)]
pub struct FaultyPair {
    with: FaultyFlight,
    without: FaultyFlight,
}

/// Short lines at two speeds and depths.
fn mission() -> anyhow::Result<Mission> {
    closed_loop::mission((0..24_u32).flat_map(|line| {
        let (x_m, depth_m, speed_mps) =
            (f64::from(line) * 20.0, [4.0, 6.0][line as usize / 2 % 2], [1.0, 1.3][line as usize % 2]);
        let ends = if line % 2 == 0 { [0.0, 80.0] } else { [80.0, 0.0] };
        ends.map(|y_m| Waypoint { x_m, y_m, depth_m, speed_mps })
    }))
}

/// Flies with or without compensation; without, the errors after are those after `diagnosed_s`.
fn fly(
    broken: Broken,
    law: ControlLaw,
    declared: &VehicleParameters,
    seed: u64,
    compensate: bool,
    diagnosed_s: Option<f64>,
) -> anyhow::Result<FaultyFlight> {
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
    let undeclared = Undeclared { faults, ..Undeclared::default() };
    let start = State::new([0.0, 0.0, 4.0], [0.0, 0.0, std::f64::consts::FRAC_PI_2], [1.0, 0.0, 0.0], [0.0; 3]);
    let mut vehicle = TrueVehicle::new(&scenario.truth_parameters(), undeclared, start, seed);
    let model = VehicleModel::new(declared).map_err(|error| anyhow!("identified vehicle: {error}"))?;
    let config = ControlConfig { law, ..ControlConfig::REFERENCE };
    let controller = closed_loop::controller(&config, &model, &mission()?, &vehicle.state())?;
    let mut controller = controller.context("the identified vehicle has no trim")?;

    let mut monitor = Box::new(FaultMonitor::new());
    let (mut ahrs, mut dvl) = (Stream::new(seed, Source::Ahrs), Stream::new(seed, Source::Dvl));
    // The power densities of a 3 Hz AHRS and a 5 Hz DVL, at 10 Hz.
    let (angle, rate) =
        (file.sensors.attitude_rad * (10.0_f64 / 3.0).sqrt(), file.sensors.rates_radps * (10.0_f64 / 3.0).sqrt());
    let speed = file.sensors.dvl_mps * 2.0_f64.sqrt();
    let mut input = ActuatorInput::default();
    let (mut sound, mut after) = (Squares::default(), Squares::default());
    let mut found_us: Option<u64> = None;
    let mut right = false;
    let seconds = |time_us: u64| time_us as f64 * 1e-6;
    closed_loop::fly(&mut vehicle, 0..=FLIGHT_US - STEP_US, |time_us, vehicle| {
        let (x, time_s) = (vehicle.state(), seconds(time_us));
        let attitude = state::attitude(&x) + Vector3::from(ahrs.normals::<3>(angle));
        let ([u, v, w], [p, q, r]) = (dvl.normals::<3>(speed), ahrs.normals::<3>(rate));
        let velocity = state::velocity(&x) + Vector6::new(u, v, w, p, q, r);
        monitor.sample(&model, time_us, &attitude, &velocity, &input);
        if let Some(diagnosis) = monitor.diagnosis() {
            let since_us = time_us - *found_us.get_or_insert(time_us);
            right = diagnosis.cause == fault;
            if compensate && since_us.is_multiple_of(RENEWAL_US) && since_us <= 6 * RENEWAL_US {
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
            let since = if compensate { found_us.map(seconds) } else { diagnosed_s };
            if since.is_some_and(|since| time_s > since + SETTLED_S && since > ONSET_S) {
                after.add(errors);
            }
        }
        Ok(Some(input))
    })?;
    let diagnosed_s = found_us.map(seconds);
    Ok(FaultyFlight { diagnosed_s, right, sound: sound.errors(), after: after.errors() })
}

const FAULTS: [(Broken, &str); 2] = [(Broken::Fin, "fin lost"), (Broken::Drag, "drag doubled")];
const LAWS: [(ControlLaw, &str); 2] = [(ControlLaw::Lqr, "LQR"), (ControlLaw::Pd, "PD")];

/// Fault, law and name of each block of the table.
fn blocks() -> impl Iterator<Item = (Broken, ControlLaw, [&'static str; 2])> {
    FAULTS.into_iter().flat_map(|(broken, fault)| LAWS.map(|(law, name)| (broken, law, [fault, name])))
}

/// What is flown for the table, in the order of its blocks.
pub fn jobs(seeds: Range<u64>) -> Vec<(Key, PairJob)> {
    let of_block = |(broken, law, names): (Broken, ControlLaw, [&'static str; 2])| {
        seeds.clone().map(move |seed| ((names.join(", "), seed), PairJob { broken, law }))
    };
    blocks().flat_map(of_block).collect()
}

/// A fault, and the law that steers with it.
#[derive(Clone, Copy)]
pub struct PairJob {
    broken: Broken,
    law: ControlLaw,
}

impl PairJob {
    /// Flies both.
    pub fn run(self, seed: u64) -> anyhow::Result<FaultyPair> {
        let declared = identified(seed)?;
        let with = fly(self.broken, self.law, &declared, seed, true, None)?;
        let without = fly(self.broken, self.law, &declared, seed, false, with.diagnosed_s)?;
        Ok(FaultyPair { with, without })
    }
}

/// The pairs of [`jobs`] of so many seeds as a table.
pub fn markdown(pairs: &[FaultyPair], runs: usize) -> String {
    let mut table = markdown_table(["fault", "law", ""].into_iter().chain(ControlErrors::NAMES));
    let mut notes = String::new();
    for ((_, _, names), pairs) in blocks().zip(pairs.chunks(runs)) {
        let good: Vec<&FaultyPair> =
            pairs.iter().filter(|pair| pair.with.diagnosed_s.is_some_and(|s| s > ONSET_S)).collect();
        let mut line = |what: &str, errors: &dyn Fn(&FaultyPair) -> [f64; 4]| {
            let of_column = |i: usize| good.iter().map(|pair| errors(pair)[i]).collect::<Vec<f64>>();
            let cells = (0..4).map(|i| with_interval(&of_column(i), 3));
            table.add_row([names[0], names[1], what].map(str::to_owned).into_iter().chain(cells));
        };
        line("before the fault", &|pair| pair.with.sound.values());
        line("with it, not compensated", &|pair| pair.without.after.values());
        line("with it, compensated", &|pair| pair.with.after.values());
        line("change by compensation", &|pair| {
            let (with, without) = (pair.with.after.values(), pair.without.after.values());
            core::array::from_fn(|i| with[i] - without[i])
        });
        let delays: Vec<f64> = good.iter().filter_map(|pair| Some(pair.with.diagnosed_s? - ONSET_S)).collect();
        let right = good.iter().filter(|pair| pair.with.right).count();
        let _ = writeln!(
            notes,
            "- {}: diagnosed in {} of {runs} flights, after {:.0} s on average, the right cause in {right} at the end.",
            names.join(", "),
            good.len(),
            mean(&delays).unwrap_or(f64::NAN)
        );
    }
    format!("{table}\n\n{notes}")
}
