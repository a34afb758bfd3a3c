//! The fault study: simulated vehicles with a fault under way, and the diagnosis of the fault monitor.
//!
//! Each run identifies the vehicle first, with the board's identifier from a wrong prior on a log of its own; the
//! monitor then runs with those parameters over another log, in which something breaks at a time that is not declared.

use super::compensation::{self, FaultyPair, PairJob};
use super::identified_vehicle::identified;
use crate::ensemble::{PartArgs, all_runs};
use crate::store::{Key, version};
use anyhow::{Context, anyhow};
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_core::effects::EffectSet;
use backseat_core::identification::{FaultCause, FaultMonitor, FaultState};
use backseat_identify::IdentificationData;
use backseat_logs::VehicleFile;
use backseat_logs::stats::{median, percentile, wilson_ci95};
use backseat_report::console;
use backseat_report::markdown::markdown_table;
use hil_sim::dataset::{Dataset, Shape, Spec, simulate};
use hil_sim::scenario::Request;
use serde::{Deserialize, Serialize};

/// Faults by their names in the simulator.
const FAULTS: [&str; 4] = ["flooding", "entanglement", "fin_lost", "fouling"];
/// Length of a log with a fault, s; it breaks in 20 to 80 % of it.
const FAULT_S: f64 = 2400.0;
/// Length of a log without fault, s.
const SOUND_S: f64 = 7200.0;
/// A diagnosis is evaluated again after this time, s: its magnitude improves.
const LATER_S: f64 = 120.0;

/// How the vehicle moves when it breaks.
const SHAPES: [(Shape, &str); 2] = [(Shape::Excite, "dives, turns, speeds"), (Shape::Lawnmower, "lawnmower")];

/// Diagnoses of the monitor over a log.
struct Watch {
    /// First diagnosis: time, s, cause, alternative.
    diagnosed: Option<(f64, FaultCause, Option<FaultCause>)>,
    /// The same [`LATER_S`] later: time, s, cause, alternative, magnitude.
    later: Option<(f64, FaultCause, Option<FaultCause>, f64)>,
    /// Diagnoses in all; after each it learns anew.
    diagnoses: u32,
    suspicions: u32,
    hours: f64,
}

/// One flight with a fault.
#[derive(Clone, Serialize, Deserialize)]
struct FaultFlight {
    /// A diagnosis before the onset.
    is_false_alarm: bool,
    /// First diagnosis from the onset on: time since then, s.
    found: Option<(f64, Isolation)>,
    /// The same [`LATER_S`] later; with the right cause the relative error of the magnitude.
    later: Option<(Isolation, Option<f64>)>,
}

/// One flight without.
#[derive(Clone, Serialize, Deserialize)]
struct SoundFlight {
    diagnoses: u32,
    suspicions: u32,
    hours: f64,
}

/// What a seed is flown for.
#[derive(Clone, Copy)]
enum FaultJob {
    /// Every fault in either motion, and without one, with the same identified vehicle.
    Monitor { with: bool, without: bool },
    /// A fault that is compensated.
    Compensation(PairJob),
}

/// Results of a [`FaultJob`].
#[derive(Clone, Serialize, Deserialize)]
enum FaultRuns {
    Monitor {
        /// By fault, then by motion.
        broken: Vec<FaultFlight>,
        /// By motion.
        sound: Vec<SoundFlight>,
    },
    Compensation(FaultyPair),
}

impl FaultJob {
    fn run(self, seed: u64) -> anyhow::Result<FaultRuns> {
        let (with, without) = match self {
            Self::Compensation(pair) => return Ok(FaultRuns::Compensation(pair.run(seed)?)),
            Self::Monitor { with, without } => (with, without),
        };
        let vehicle = identified(seed)?;
        let (mut broken, mut sound) = (Vec::new(), Vec::new());
        for fault in FAULTS.iter().filter(|_| with) {
            for (shape, _) in SHAPES {
                broken.push(broken_in(fault, shape, seed, &vehicle)?);
            }
        }
        for (shape, _) in SHAPES.iter().filter(|_| without) {
            let watch = watch(&vehicle, &simulate(&spec(*shape, SOUND_S), seed))?;
            sound.push(SoundFlight { diagnoses: watch.diagnoses, suspicions: watch.suspicions, hours: watch.hours });
        }
        Ok(FaultRuns::Monitor { broken, sound })
    }
}

fn spec(shape: Shape, duration_s: f64) -> Spec {
    Spec { shape, duration_s, ranges: false, ..Spec::new(VehicleFile::reference()) }
}

fn watch(vehicle: &VehicleParameters, dataset: &Dataset) -> anyhow::Result<Watch> {
    let model = VehicleModel::new(vehicle).map_err(|error| anyhow!("identified vehicle: {error}"))?;
    let data = IdentificationData::from_log(&dataset.log, &EffectSet::NONE)?;
    let mut monitor = Box::new(FaultMonitor::new());
    let mut watch =
        Watch { diagnosed: None, later: None, diagnoses: 0, suspicions: 0, hours: data.duration_s() / 3600.0 };
    let mut before = FaultState::Learning;
    let mut diagnosed_s = 0.0;
    for samples in data.stretches() {
        monitor.interrupt();
        for pair in samples.windows(2) {
            let [last, now] = pair else { continue };
            let state = monitor.sample(&model, now.time_us, &now.attitude, &now.velocity, &last.input.mean());
            let time_s = now.time_us as f64 * 1e-6;
            let diagnosis = monitor.diagnosis();
            if state != before {
                match state {
                    FaultState::Suspicious => watch.suspicions += 1,
                    FaultState::Diagnosed => {
                        watch.diagnoses += 1;
                        diagnosed_s = time_s;
                        watch.diagnosed = watch.diagnosed.or(diagnosis.map(|d| (time_s, d.cause, d.rival)));
                    }
                    FaultState::Learning | FaultState::Quiet => {}
                }
                before = state;
            }
            if let Some(diagnosis) = diagnosis
                && time_s > diagnosed_s + LATER_S
            {
                watch.later.get_or_insert((time_s, diagnosis.cause, diagnosis.rival, diagnosis.magnitude));
                monitor.restart();
            }
        }
    }
    Ok(watch)
}

fn broken_in(fault: &'static str, shape: Shape, seed: u64, vehicle: &VehicleParameters) -> anyhow::Result<FaultFlight> {
    let request = Request::named(fault).map_err(|error| anyhow!(error))?;
    let dataset = simulate(&Spec { effects: vec![request], ..spec(shape, FAULT_S) }, seed);
    let effect = dataset.effects.first().context("an effect was asked for")?;
    let get = |name: &str| effect.get(name).unwrap_or(f64::NAN);
    let (fault, magnitude) = match fault {
        "flooding" => (FaultCause::Flooding, get("kg")),
        "entanglement" => (FaultCause::Entanglement, get("factor") - 1.0),
        "fin_lost" => (FaultCause::Fin(get("fin") as u8 - 1), 1.0 - get("share")),
        _ => (FaultCause::Fouling, 1.0 - get("share")),
    };
    // Rate at which it grows to its size, 1/s.
    let (onset_s, rate_per_s) = (get("time_s"), effect.get("kg_per_s").unwrap_or(f64::INFINITY));
    let isolation = |cause: FaultCause, rival: Option<FaultCause>| match rival {
        None if cause == fault => Isolation::Right,
        Some(rival) if cause == fault || rival == fault => Isolation::OneOfTwo,
        _ => Isolation::Wrong,
    };
    let watch = watch(vehicle, &dataset)?;
    let found = watch.diagnosed.filter(|(time_s, ..)| *time_s >= onset_s);
    let later = watch.later.filter(|_| found.is_some()).map(|(time_s, cause, rival, size)| {
        let true_size = magnitude.min(rate_per_s * (time_s - onset_s));
        (isolation(cause, rival), (cause == fault).then(|| (size / true_size - 1.0).abs()))
    });
    Ok(FaultFlight {
        is_false_alarm: watch.diagnosed.is_some() && found.is_none(),
        found: found.map(|(time_s, cause, rival)| (time_s - onset_s, isolation(cause, rival))),
        later,
    })
}

/// A share with Wilson's 95 % interval.
fn share(hits: usize, of: usize) -> [f64; 3] {
    let (low, high) = wilson_ci95(hits as u64, of as u64).unwrap_or((f64::NAN, f64::NAN));
    [hits as f64 / of as f64, low, high]
}

fn percent([share, low, high]: [f64; 3]) -> String {
    format!("{:.1} % ({:.1} – {:.1})", 100.0 * share, 100.0 * low, 100.0 * high)
}

/// Correctness of a diagnosis.
#[derive(Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Isolation {
    /// The cause, and no other.
    Right,
    /// The cause is one of the two that are named.
    OneOfTwo,
    Wrong,
}

/// Shares of right, one of two and wrong.
fn shares(all: &[Isolation]) -> [[f64; 3]; 3] {
    [Isolation::Right, Isolation::OneOfTwo, Isolation::Wrong]
        .map(|kind| share(all.iter().filter(|isolation| **isolation == kind).count(), all.len().max(1)))
}

/// One line of the table.
struct FaultRow {
    fault: &'static str,
    shape: &'static str,
    runs: usize,
    early: usize,
    detected: [f64; 3],
    isolated: [[f64; 3]; 3],
    isolated_later: [[f64; 3]; 3],
    median_s: f64,
    p95_s: f64,
    magnitude_error: f64,
}

fn row(fault: &'static str, shape: &'static str, all: &[&FaultFlight]) -> FaultRow {
    let runs: Vec<&FaultFlight> = all.iter().copied().filter(|flight| !flight.is_false_alarm).collect();
    let (delays, first): (Vec<f64>, Vec<Isolation>) = runs.iter().filter_map(|flight| flight.found).unzip();
    let (later, errors): (Vec<Isolation>, Vec<Option<f64>>) = runs.iter().filter_map(|flight| flight.later).unzip();
    let errors: Vec<f64> = errors.into_iter().flatten().collect();
    FaultRow {
        fault,
        shape,
        runs: all.len(),
        early: all.len() - runs.len(),
        detected: share(delays.len(), runs.len()),
        isolated: shares(&first),
        isolated_later: shares(&later),
        median_s: median(&delays).unwrap_or(f64::NAN),
        p95_s: percentile(&delays, 0.95).unwrap_or(f64::NAN),
        magnitude_error: median(&errors).unwrap_or(f64::NAN),
    }
}

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Example:
  cargo lab fault-detection --runs 200")]
pub struct Args {
    /// Flights with each fault
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(2..))]
    runs: u64,
    /// Hours of flights without a fault
    #[arg(long, value_name = "H", default_value_t = 204.0, value_parser = positive)]
    hours: f64,
    /// First seed
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    part: PartArgs,
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite()).ok_or("a positive number".to_owned())
}

/// Runs the study and prints its tables: every fault `runs` times, half of them in either motion, `hours` without
/// fault, and a tenth of the runs with compensation.
///
/// # Errors
/// A flight or an identification that fails.
pub fn run(&Args { runs, hours, seed: first_seed, ref part }: &Args) -> anyhow::Result<()> {
    let seeds = first_seed..first_seed + runs.div_ceil(2);
    let quiet_seeds = first_seed..first_seed + (0.5 * hours * 3600.0 / SOUND_S).ceil() as u64;
    let compensated = runs.div_ceil(10).max(2);
    let monitored = (first_seed..seeds.end.max(quiet_seeds.end)).map(|seed| {
        let job = FaultJob::Monitor { with: seeds.contains(&seed), without: quiet_seeds.contains(&seed) };
        (("monitor".to_owned(), seed), job)
    });
    let compensation = compensation::jobs(first_seed..first_seed + compensated).into_iter();
    let jobs: Vec<(Key, FaultJob)> =
        monitored.chain(compensation.map(|(key, pair)| (key, FaultJob::Compensation(pair)))).collect();
    let version = version("fault-detection", &format!("{} to {}, {}", first_seed, seeds.end, quiet_seeds.end))?;
    let finished = all_runs("flights", part, version, &jobs, |seed, job| job.run(seed))?;
    let Some(finished) = finished else { return Ok(()) };
    let (mut broken, mut sound, mut pairs) = (Vec::new(), Vec::new(), Vec::new());
    for runs in finished {
        match runs {
            FaultRuns::Monitor { broken: with, sound: without } => {
                broken.extend((!with.is_empty()).then_some(with));
                sound.extend((!without.is_empty()).then_some(without));
            }
            FaultRuns::Compensation(pair) => pairs.push(pair),
        }
    }
    let mut rows = Vec::new();
    for (number, fault) in FAULTS.into_iter().enumerate() {
        let of = |motion: usize| broken.iter().map(move |flights| &flights[number * SHAPES.len() + motion]);
        for (motion, (_, name)) in SHAPES.iter().enumerate() {
            rows.push(row(fault, name, &of(motion).collect::<Vec<_>>()));
        }
        rows.push(row(fault, "both", &(0..SHAPES.len()).flat_map(of).collect::<Vec<_>>()));
    }
    let of_motion = |(motion, (_, name)): (usize, &(Shape, &'static str))| {
        (*name, sound.iter().map(|flights| flights[motion].clone()).collect())
    };
    let quiet: Vec<(&str, Vec<SoundFlight>)> = SHAPES.iter().enumerate().map(of_motion).collect();
    let text = markdown(&rows, &quiet) + "\n" + &compensation::markdown(&pairs, compensated as usize);
    console::print(text.as_bytes())
}

fn sums(watches: &[SoundFlight]) -> (f64, u32, u32) {
    let hours = watches.iter().map(|watch| watch.hours).sum();
    let diagnoses = watches.iter().map(|watch| watch.diagnoses).sum();
    (hours, diagnoses, watches.iter().map(|watch| watch.suspicions).sum())
}

fn markdown(rows: &[FaultRow], quiet: &[(&'static str, Vec<SoundFlight>)]) -> String {
    let mut faults = markdown_table([
        "fault",
        "motion",
        "runs",
        "detected",
        "of those: right cause / one of two named / wrong",
        "the same 2 min later",
        "delay, median [s]",
        "delay, 95 % [s]",
        "error of the magnitude, median",
        "alarms before",
    ]);
    for row in rows {
        faults.add_row([
            row.fault.to_owned(),
            row.shape.to_owned(),
            row.runs.to_string(),
            percent(row.detected),
            row.isolated.map(percent).join(" / "),
            row.isolated_later.map(percent).join(" / "),
            format!("{:.0}", row.median_s),
            format!("{:.0}", row.p95_s),
            format!("{:.0} %", 100.0 * row.magnitude_error),
            row.early.to_string(),
        ]);
    }
    let mut alarms = markdown_table([
        "no fault",
        "hours",
        "logs with an alarm",
        "false alarms",
        "per hour",
        "suspicions that were dropped, per hour",
    ]);
    for (shape, watches) in quiet {
        let (hours, diagnoses, suspicions) = sums(watches);
        let logs = watches.iter().filter(|watch| watch.diagnoses > 0).count();
        alarms.add_row([
            (*shape).to_owned(),
            format!("{hours:.0}"),
            percent(share(logs, watches.len())),
            diagnoses.to_string(),
            format!("{:.4}", f64::from(diagnoses) / hours),
            format!("{:.3}", f64::from(suspicions - diagnoses) / hours),
        ]);
    }
    format!("{faults}\n\n{alarms}\n")
}
