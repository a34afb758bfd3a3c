//! `cargo lab naming --using CAUSE --ask`: what is gained where the board flies a manoeuvre to tell two causes apart.
//!
//! Each flight is flown twice, with the same seed: without manoeuvres and with those that stay on the line.

use super::Args;
use super::using::{self, Change};
use crate::closed_loop::across_m;
use crate::ensemble::all_runs;
use crate::flights::fly_with;
use crate::intervals::{Share, with_interval};
use crate::store::{Key, version};
use crate::wrap::wrapped;
use backseat_core::navigation::naming::Cause;
use backseat_link::named::asked;
use backseat_logs::stats::rms;
use backseat_report::markdown::markdown_table;
use backseat_wire::hostlink::Question;
use serde::{Deserialize, Serialize};

/// Values of `app.separate`.
const FORMS: [(&str, f64); 2] = [("never", 0.0), ("on legs", 1.0)];
/// From this probability on a cause is sure.
const SURE: f32 = 0.9;

#[derive(Clone, Debug, Serialize, Deserialize)]
struct AskedFlight {
    what: String,
    /// When the right cause was first named in front, and when it was first sure, minutes after the change.
    right_min: Option<f64>,
    sure_min: Option<f64>,
    /// The last statement names it in front.
    ends_right: bool,
    /// Across the lines since the change, true, RMS and largest, m.
    across_m: Option<[f64; 2]>,
    ended_min: f64,
    /// Each manoeuvre, as it was told last.
    questions: Vec<Question>,
}

fn fly(drawn: &using::Drawn, separate: f64) -> anyhow::Result<AskedFlight> {
    let flight = fly_with(&drawn.scenario, &[("app.separate".to_owned(), separate)])?;
    let is_right = |cause: u8| Cause::from_number(cause) == drawn.cause && drawn.cause.is_some();
    let first = |least: f32| {
        let right = flight.naming.iter().find(|naming| {
            naming.time_us as f64 * 1e-6 > drawn.time_s
                && naming.named.first().is_some_and(|named| is_right(named.cause) && named.probability >= least)
        })?;
        Some((right.time_us as f64 * 1e-6 - drawn.time_s) / 60.0)
    };
    let lines = drawn.scenario.settings.lines();
    let later = flight.samples.iter().filter(|sample| sample.truth.time_us as f64 * 1e-6 > drawn.time_s);
    let across: Vec<f64> = later.filter_map(|sample| across_m(&lines, &sample.truth.state)).collect();
    let mut questions: Vec<Question> = Vec::new();
    for question in flight.naming.iter().filter_map(|naming| naming.question) {
        match questions.last_mut().filter(|last| last.time_us == question.time_us) {
            Some(last) => *last = question,
            None => questions.push(question),
        }
    }
    Ok(AskedFlight {
        what: drawn.what.clone(),
        right_min: first(0.0),
        sure_min: first(SURE),
        ends_right: flight.naming.last().and_then(|naming| naming.named.first()).is_some_and(|own| is_right(own.cause)),
        across_m: rms(&across).map(|rms| [rms, across.iter().fold(0.0, |most, own| own.abs().max(most))]),
        ended_min: flight.simulated_s / 60.0,
        questions,
    })
}

/// Runs it.
///
/// # Errors
/// A flight that fails, a file that cannot be written.
pub fn run(args: &Args, change: Change) -> anyhow::Result<()> {
    let seeds = args.seed..args.seed + args.runs;
    let jobs: Vec<(Key, f64)> =
        seeds.clone().flat_map(|seed| FORMS.map(|(name, separate)| ((name.to_owned(), seed), separate))).collect();
    let version = version("naming-ask", &format!("{change:?} {} min", args.minutes))?;
    let flown = all_runs("flights", &args.part, version, &jobs, |seed, separate| {
        fly(&using::drawn(seed, change, args.minutes)?, *separate)
    })?;
    let Some(flown) = flown else { return Ok(()) };
    let sets = [0, 1].map(|form| flown.iter().skip(form).step_by(2).collect::<Vec<&AskedFlight>>());
    let mut table = markdown_table([
        "",
        "right at the end",
        "right and sure at some time",
        "first right after [min]",
        "sure after [min]",
        "across, RMS [m]",
        "across, largest [m]",
    ]);
    let numbers: [fn(&AskedFlight) -> Option<f64>; 4] = [
        |flight| flight.right_min,
        |flight| flight.sure_min,
        |flight| flight.across_m.map(|[rms, _]| rms),
        |flight| flight.across_m.map(|[_, most]| most),
    ];
    for (set, (name, _)) in sets.iter().zip(FORMS) {
        let shares = [Share::of(set, |own| own.ends_right), Share::of(set, |own| own.sure_min.is_some())];
        let means =
            numbers.map(|number| with_interval(&set.iter().filter_map(|own| number(own)).collect::<Vec<_>>(), 2));
        table.add_row([name.to_owned()].into_iter().chain(shares.map(Share::text)).chain(means));
    }
    let differences = numbers.map(|number| {
        let pairs = sets[0].iter().zip(&sets[1]).filter_map(|(without, with)| Some(number(with)? - number(without)?));
        with_interval(&pairs.collect::<Vec<_>>(), 2)
    });
    let front = ["on legs less never, of pairs that have both".to_owned(), String::new(), String::new()];
    table.add_row(front.into_iter().chain(differences));
    let mut each = markdown_table(["seed", "changed", "sure after [min]: never", "on legs", "manoeuvres"]);
    for ((seed, without), with) in seeds.clone().zip(&sets[0]).zip(&sets[1]) {
        let minutes = |own: &AskedFlight| {
            let sure = own.sure_min.map_or("-".to_owned(), |time| format!("{time:.1}"));
            format!("{sure}{} ({:.0})", if own.ends_right { "" } else { ", not right at the end" }, own.ended_min)
        };
        let told = with.questions.iter().map(asked).collect::<Vec<_>>().join("; ");
        each.add_row([seed.to_string(), with.what.clone(), minutes(without), minutes(with), told]);
    }
    let (name, last) = (using::name_of(change), args.seed + args.runs - 1);
    let command = format!(
        "cargo lab naming --using {name} --ask --runs {} --seed {} --minutes {}",
        args.runs, args.seed, args.minutes
    );
    let page = wrapped(&format!(
        "# What a manoeuvre tells\n\nMade by `{command}`: seeds {} to {last}, means and shares with 95 % intervals.\n\n\
         {table}\n\n{each}\n",
        args.seed
    ));
    args.page.show(&page)
}
