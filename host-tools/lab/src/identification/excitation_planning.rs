//! Planned missions against the thesis' open-loop inputs and a plain lawnmower, in equal time.

use super::plan_flight::{measured, open_loop, true_vehicle};
use crate::ensemble::{PartArgs, all_runs};
use crate::experiment::{Noise, Programme};
use crate::intervals::with_interval;
use crate::store::{Key, nan, version};
use anyhow::anyhow;
use backseat_core::control::mission::{Lawnmower, Mission, Waypoint};
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_core::identification::theta::{B1, M11, theta_of, with_theta};
use backseat_core::state::{self, VehicleState};
use backseat_identify::plan::{self, Collected, Information, Limits, plan};
use backseat_identify::validation::COLUMNS;
use backseat_identify::{IdentificationData, Method, Options, Sample, identify, parameters, validate};
use backseat_logs::VehicleFile;
use backseat_logs::stats::mean;
use backseat_report::console;
use backseat_report::markdown::markdown_table;
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::Scenario;
use hil_sim::truth::Parameters;
use serde::{Deserialize, Serialize};

/// Noise of linear velocity, m/s.
const NOISE_MPS: f64 = 0.013;
/// Share by which the prior is wrong.
const WRONG: f64 = 0.3;
/// The open-loop inputs start over so deep, m, when nothing limits them.
const DEEP_M: f64 = 1.0e5;

/// How the vehicle is excited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Excitation {
    Planned,
    Lawnmower,
    /// Open loop, started over in the middle of the depths each time it leaves the limits.
    OpenLoopWithin,
    /// Open loop, free to dive.
    OpenLoopFree,
}

impl Excitation {
    const ALL: [Self; 4] = [Self::Planned, Self::Lawnmower, Self::OpenLoopWithin, Self::OpenLoopFree];

    const fn name(self) -> &'static str {
        match self {
            Self::Planned => "planned mission",
            Self::Lawnmower => "lawnmower",
            Self::OpenLoopWithin => "open-loop inputs, started over at the limits",
            Self::OpenLoopFree => "open-loop inputs, no limits",
        }
    }
}

/// Stretches of samples with their depths.
type Stretches = Vec<Vec<(Sample, f64)>>;

#[derive(Clone, Serialize, Deserialize)]
struct PlanResult {
    #[serde(deserialize_with = "nan::one")]
    log_determinant: f64,
    #[serde(deserialize_with = "nan::one")]
    remaining_percent: f64,
    depth_m: [f64; 2],
    pitch_deg: f64,
    starts: usize,
    /// Root mean square of the parameters' errors, relative to their sizes, %.
    #[serde(deserialize_with = "nan::one")]
    error_percent: f64,
    #[serde(deserialize_with = "nan::many")]
    validation: [f64; 8],
}

/// Every parameter but the scale wrong by up to `share`.
fn wrong_prior(share: f64, seed: u64) -> VehicleParameters {
    let declared = VehicleFile::reference().parameters;
    let mut random = Stream::new(seed, Source::Effects);
    let mut theta = theta_of(&declared);
    let scale = parameters::scale(&declared);
    for j in 0..theta.len() {
        let error = share * (2.0 * random.uniform() - 1.0) * scale[j];
        if j != M11 && !(B1..B1 + 2).contains(&j) {
            theta[j] += error;
        }
    }
    with_theta(&declared, &theta)
}

fn leaves(limits: &Limits) -> impl Fn(&VehicleState) -> bool {
    let (depth_m, pitch_rad) = (limits.depth_m, limits.pitch_rad);
    move |x| !(depth_m[0]..=depth_m[1]).contains(&x[state::Z]) || x[state::THETA].abs() > pitch_rad
}

fn fly(
    excitation: Excitation,
    truth: &Parameters,
    prior: &VehicleParameters,
    limits: &Limits,
    duration_s: f64,
    seed: u64,
) -> anyhow::Result<Stretches> {
    let middle = limits.middle_m();
    let steered = |waypoints: &[Waypoint]| -> anyhow::Result<Stretches> {
        let model = VehicleModel::new(prior).map_err(|error| anyhow!("prior: {error}"))?;
        let mut body = true_vehicle(truth, middle, seed);
        Ok(vec![plan::follow(&mut body, &mut *plan::controller(&model)?, waypoints, duration_s)?])
    };
    match excitation {
        // The plan is made with the wrong prior.
        Excitation::Planned => steered(&plan(prior, limits, duration_s, seed)?.waypoints),
        Excitation::Lawnmower => {
            let lines = Lawnmower {
                line_m: 200.0,
                spacing_m: 20.0,
                lines: 20,
                depth_m: middle,
                speed_mps: 0.5 * (limits.speed_mps[0] + limits.speed_mps[1]),
                ..Lawnmower::REFERENCE
            };
            let mission = Mission::lawnmower(&lines).map_err(|error| anyhow!("lawnmower: {error:?}"))?;
            steered(mission.waypoints())
        }
        Excitation::OpenLoopWithin => {
            let (mut flight, mut left_s) = (Vec::new(), duration_s);
            while left_s > 1.0 {
                let mut body = true_vehicle(truth, middle, seed);
                let stretch = open_loop(&mut body, &Programme::IDENTIFICATION, left_s, leaves(limits));
                left_s -= stretch.len() as f64 * backseat_identify::PERIOD_S;
                flight.push(stretch);
            }
            Ok(flight)
        }
        Excitation::OpenLoopFree => {
            let mut body = true_vehicle(truth, DEEP_M, seed);
            Ok(vec![open_loop(&mut body, &Programme::IDENTIFICATION, duration_s, |_| false)])
        }
    }
}

/// Validation data for the estimate: other open-loop inputs, 600 s.
fn unseen(truth: &Parameters) -> IdentificationData {
    let mut body = true_vehicle(truth, DEEP_M, 0);
    measured(&[open_loop(&mut body, &Programme::VALIDATION, 600.0, |_| false)], &Noise::NONE, 0)
}

fn outcome(
    excitation: Excitation,
    truth: &Parameters,
    limits: &Limits,
    duration_s: f64,
    unseen: &IdentificationData,
    seed: u64,
) -> anyhow::Result<PlanResult> {
    let declared = VehicleFile::reference().parameters;
    let model = VehicleModel::new(&declared).map_err(|error| anyhow!("vehicle: {error}"))?;
    let prior = wrong_prior(WRONG, seed);
    let flight = fly(excitation, truth, &prior, limits, duration_s, seed)?;
    let all = || flight.iter().flatten();
    let mut collected = Collected::default();
    Information::new(&model, &declared).add(all().map(|(sample, _)| sample), &mut collected);
    let data = measured(&flight, &Noise::table_4_13(NOISE_MPS), seed);
    let estimate = identify(Method::Iv, &data, &prior, &Options::DEFAULT, &|_| {})?;
    let (value, size) = (parameters::of(&estimate.vehicle), parameters::scale(&declared));
    let errors = parameters::of(&declared) - value;
    let squares: f64 = (0..B1).chain(B1 + 2..21).filter(|j| *j != M11).map(|j| (errors[j] / size[j]).powi(2)).sum();
    let validation = validate(&estimate.vehicle, unseen).map_or([f64::NAN; 8], |v| v.mean_absolute);
    let depths = all().map(|(_, depth_m)| *depth_m);
    let from_m = if excitation == Excitation::OpenLoopFree { DEEP_M - limits.middle_m() } else { 0.0 };
    Ok(PlanResult {
        log_determinant: collected.log_determinant(),
        remaining_percent: collected.remaining_percent(),
        depth_m: [
            depths.clone().fold(f64::INFINITY, f64::min) - from_m,
            depths.fold(f64::NEG_INFINITY, f64::max) - from_m,
        ],
        pitch_deg: all().map(|(sample, _)| sample.attitude.y.abs()).fold(0.0, f64::max).to_degrees(),
        starts: flight.len(),
        error_percent: 100.0 * (squares / 18.0).sqrt(),
        validation,
    })
}

/// Mean and its 95 % interval; estimates that cannot be flown on are counted instead.
fn interval(values: &[f64], digits: usize) -> String {
    let usable: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    if usable.len() < values.len() {
        return format!("unusable in {} of {}", values.len() - usable.len(), values.len());
    }
    with_interval(&usable, digits)
}

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Example:
  cargo lab plan --runs 10 --duration 1800")]
pub struct Args {
    /// Seeds of each mission
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    /// Length of each mission, s
    #[arg(long, value_name = "S", default_value_t = 1800.0)]
    duration: f64,
    #[command(flatten)]
    part: PartArgs,
}

/// Runs the comparison and prints its tables.
///
/// # Errors
/// A plan that is not found, or an identification that fails.
pub fn run(&Args { runs, duration: duration_s, ref part }: &Args) -> anyhow::Result<()> {
    let limits = &Limits::DEFAULT;
    let mut scenario = Scenario::built_in("survey")?;
    scenario.vehicle = VehicleFile::reference();
    let truth = Parameters { disturbance_per_sqrt_hz: [0.0; 6], ..scenario.truth_parameters() };
    let unseen = unseen(&truth);
    let jobs: Vec<(Key, Excitation)> = Excitation::ALL
        .into_iter()
        .flat_map(|excitation| (1..=runs).map(move |seed| ((excitation.name().to_owned(), seed), excitation)))
        .collect();
    let version = version("plan", &format!("{duration_s} s"))?;
    let outcomes = all_runs("experiments", part, version, &jobs, |seed, excitation| {
        outcome(*excitation, &truth, limits, duration_s, &unseen, seed)
    })?;
    let Some(outcomes) = outcomes else { return Ok(()) };
    let mut learned = markdown_table([
        "excitation",
        "log det of the information",
        "Cramér-Rao, rms [%]",
        "error of the parameters, rms [%]",
        "depths [m]",
        "steepest [deg]",
        "starts",
    ]);
    let mut predicted = markdown_table(["excitation"].into_iter().chain(COLUMNS));
    for (excitation, outcomes) in Excitation::ALL.iter().zip(outcomes.chunks(runs as usize)) {
        let of = |pick: &dyn Fn(&PlanResult) -> f64| -> Vec<f64> { outcomes.iter().map(pick).collect() };
        let [shallow, deep, steepest] = [
            of(&|o| o.depth_m[0]).into_iter().fold(f64::INFINITY, f64::min),
            of(&|o| o.depth_m[1]).into_iter().fold(f64::NEG_INFINITY, f64::max),
            of(&|o| o.pitch_deg).into_iter().fold(0.0, f64::max),
        ];
        learned.add_row([
            excitation.name().to_owned(),
            interval(&of(&|o| o.log_determinant), 1),
            interval(&of(&|o| o.remaining_percent), 2),
            interval(&of(&|o| o.error_percent), 2),
            format!("{shallow:.0} to {deep:.0}"),
            format!("{steepest:.0}"),
            format!("{:.0}", mean(&of(&|o| o.starts as f64)).unwrap_or(f64::NAN)),
        ]);
        let errors = (0..8).map(|i| interval(&of(&|o| o.validation[i]), 4));
        predicted.add_row([excitation.name().to_owned()].into_iter().chain(errors));
    }
    console::print(format!("{learned}\n\n{predicted}\n").as_bytes())
}
