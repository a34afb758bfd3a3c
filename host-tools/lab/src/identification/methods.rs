//! The ensemble table: every method on simulated experiments, errors in cross-validation against the truth.

use super::accelerations::{self, AccelerationErrors};
use super::gtls;
use super::nullspace::nbls;
use crate::ensemble::{PartArgs, all_runs};
use crate::experiment::{Experiment, wrong_prior};
use crate::intervals::short;
use crate::store::{Key, version};
use anyhow::anyhow;
use backseat_core::effects::EffectSet;
use backseat_identify::validation::COLUMNS;
use backseat_identify::{IdentificationData, Method, Options, identify, validate};
use backseat_logs::stats::{mean, mean_ci95, median};
use backseat_report::console;
use backseat_report::markdown::markdown_table;
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;

/// Seeds below this are for reports; methods were tuned on seeds from here on.
const FIRST_TUNING_SEED: u64 = 1000;

/// A method of `backseat identify`, or one that is kept to compare with.
#[derive(Clone, Copy)]
enum Compared {
    Product(Method),
    Nbls,
    Gtls,
}

use Compared::{Gtls, Nbls, Product};

/// One row of the table.
#[derive(Clone, Copy)]
pub struct Condition {
    method: Compared,
    /// Noise of linear velocity, m/s.
    noise_mps: f64,
    /// Share by which the prior is wrong.
    wrong: f64,
    /// [d26, d35] of the true vehicle.
    cross_drag: [f64; 2],
}

const fn condition(method: Compared, noise_mps: f64) -> Condition {
    Condition { method, noise_mps, wrong: 0.3, cross_drag: [0.0; 2] }
}

const fn undeclared(method: Method) -> Condition {
    Condition { cross_drag: [8.0, -8.0], ..condition(Product(method), 0.014) }
}

const fn worse_prior(method: Method) -> Condition {
    Condition { wrong: 0.5, ..condition(Product(method), 0.014) }
}

static CONDITIONS: [Condition; 17] = [
    condition(Product(Method::AidOnline), 0.012),
    condition(Product(Method::AidOnline), 0.014),
    condition(Product(Method::Aid), 0.012),
    condition(Product(Method::Aid), 0.014),
    condition(Nbls, 0.0),
    condition(Nbls, 0.014),
    condition(Gtls, 0.003),
    condition(Gtls, 0.014),
    condition(Product(Method::Iv), 0.014),
    condition(Product(Method::OutputError), 0.014),
    condition(Product(Method::Auto), 0.012),
    condition(Product(Method::Auto), 0.014),
    undeclared(Method::Aid),
    undeclared(Method::OutputError),
    undeclared(Method::Auto),
    worse_prior(Method::Aid),
    worse_prior(Method::Auto),
];

/// Results of the thesis (Table 4.15) and of an independent implementation of its equations.
const PRINTED: [(&str, [f64; 8]); 3] = [
    ("thesis, Table 4.15", [0.78, 0.43, 0.53, 0.13, 0.15, 0.0055, 0.0024, 0.0022]),
    ("independent AID, 1.2 cm/s", [0.017, 0.038, 0.011, 0.006, 0.007, 0.0011, 0.0001, 0.0002]),
    ("independent AID, 1.4 cm/s", [0.017, 0.039, 0.014, 0.006, 0.008, 0.0012, 0.0001, 0.0002]),
];

impl Compared {
    fn name(self) -> &'static str {
        match self {
            Product(method) => method.name(),
            Nbls => "nbls",
            Gtls => "gtls",
        }
    }
}

impl Condition {
    fn name(&self) -> String {
        let cross = if self.cross_drag == [0.0; 2] { "" } else { ", undeclared d26 = 8, d35 = −8" };
        let prior = if self.wrong > 0.3 { ", prior 50 % wrong" } else { "" };
        format!("{}, {:.1} cm/s{cross}{prior}", self.method.name(), 100.0 * self.noise_mps)
    }

    /// Mean absolute errors of one seed, in the order of [`COLUMNS`].
    fn errors(&self, seed: u64) -> anyhow::Result<[f64; 8]> {
        let experiment = Experiment { cross_drag: self.cross_drag, ..Experiment::identification(self.noise_mps) };
        let data = IdentificationData::from_log(&experiment.run(seed).log, &EffectSet::NONE)?;
        let noise = self.noise_mps.max(1.0e-4);
        let [_, _, _, p, q, r] = Options::DEFAULT.velocity_noise;
        let options = Options { velocity_noise: [noise, noise, noise, p, q, r], ..Options::DEFAULT };
        let prior = wrong_prior(self.wrong, seed);
        let vehicle = match self.method {
            Product(method) => identify(method, &data, &prior, &options, &|_| {})?.vehicle,
            Nbls => nbls(&data, &prior, &options)?,
            Gtls => gtls(&data, &prior, &options)?,
        };
        let unseen = Experiment { cross_drag: self.cross_drag, ..Experiment::cross_validation() }.run(seed);
        let unseen = IdentificationData::from_log(&unseen.exact_log(), &EffectSet::NONE)?;
        let validation = validate(&vehicle, &unseen).ok_or_else(|| anyhow!("unusable estimate"))?;
        Ok(validation.mean_absolute)
    }
}

/// What a seed is run for.
#[derive(Clone, Copy)]
enum MethodJob {
    Errors(&'static Condition),
    Accelerations,
}

/// Results of a [`MethodJob`].
#[derive(Clone, Serialize, Deserialize)]
enum MethodRun {
    Errors([f64; 8]),
    Accelerations(Option<AccelerationErrors>),
}

/// Errors of every seed of every condition.
type MethodErrors = [(&'static Condition, Vec<[f64; 8]>)];

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Example:
  cargo lab identification --runs 10")]
pub struct Args {
    /// Seeds of each method
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..))]
    runs: u64,
    #[command(flatten)]
    part: PartArgs,
}

/// Runs the ensemble and prints its table.
///
/// # Errors
/// An identification that fails.
pub fn run(&Args { runs, ref part }: &Args) -> anyhow::Result<()> {
    if !(2..FIRST_TUNING_SEED).contains(&runs) {
        return Err(anyhow!("--runs takes 2 to {} seeds", FIRST_TUNING_SEED - 1));
    }
    let of_condition = |condition: &'static Condition| {
        (1..=runs).map(move |seed| ((condition.name(), seed), MethodJob::Errors(condition)))
    };
    let accelerations = (1..=runs).map(|seed| (("accelerations".to_owned(), seed), MethodJob::Accelerations));
    let jobs: Vec<(Key, MethodJob)> = CONDITIONS.iter().flat_map(of_condition).chain(accelerations).collect();
    let finished = all_runs("experiments", part, version("identification", "")?, &jobs, |seed, job| {
        Ok(match job {
            MethodJob::Errors(condition) => MethodRun::Errors(condition.errors(seed)?),
            MethodJob::Accelerations => MethodRun::Accelerations(accelerations::errors(seed)),
        })
    })?;
    let Some(finished) = finished else { return Ok(()) };
    let (mut errors, mut accelerations) = (Vec::new(), Vec::new());
    for run in finished {
        match run {
            MethodRun::Errors(of_run) => errors.push(of_run),
            MethodRun::Accelerations(of_run) => accelerations.extend(of_run),
        }
    }
    let results: Vec<(&Condition, Vec<[f64; 8]>)> =
        CONDITIONS.iter().zip(errors.chunks(runs as usize).map(<[_]>::to_vec)).collect();
    console::print(markdown(runs, &results, &accelerations).as_bytes())
}

fn column(errors: &[[f64; 8]], index: usize) -> Vec<f64> {
    errors.iter().map(|row| row[index]).collect()
}

fn markdown(runs: u64, results: &MethodErrors, accelerations: &[AccelerationErrors]) -> String {
    let mut out = String::new();
    let _ = writeln!(
        out,
        "Mean absolute error of a 1000 s open-loop prediction against the truth, after 5000 s: mean (95 % interval of the mean) \
         over seeds 1 to {runs}; tuning seeds begin at {FIRST_TUNING_SEED}. Roll, pitch in deg, rates in deg/s, velocities in m/s.\n"
    );
    let header = || [""].into_iter().chain(COLUMNS.map(|name| name.split('_').next().unwrap_or(name)));
    let (mut means, mut medians) = (markdown_table(header()), markdown_table(header()));
    for (name, row) in PRINTED {
        means.add_row([format!("*{name}*")].into_iter().chain(row.map(|value| value.to_string())));
    }
    for (condition, errors) in results {
        let columns: Vec<Vec<f64>> = (0..8).map(|index| column(errors, index)).collect();
        let of_mean = columns.iter().map(|values| {
            let [center, low, high] = interval(values).map(short);
            format!("{center} ({low} to {high})")
        });
        means.add_row([condition.name()].into_iter().chain(of_mean));
        let of_median = columns.iter().map(|values| short(median(values).unwrap_or(f64::NAN)));
        medians.add_row([condition.name()].into_iter().chain(of_median));
    }
    let _ = writeln!(out, "{means}\n\nMedians over the same seeds:\n\n{medians}");
    let _ = writeln!(out, "\n{}", accelerations::markdown(runs, accelerations));
    out
}

/// Mean and the ends of its 95 % interval.
fn interval(values: &[f64]) -> [f64; 3] {
    let center = mean(values).unwrap_or(f64::NAN);
    let (low, high) = mean_ci95(values).unwrap_or((f64::NAN, f64::NAN));
    [center, low.max(0.0), high]
}
