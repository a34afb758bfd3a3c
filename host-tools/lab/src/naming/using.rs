//! `cargo lab naming --using CAUSE`: what is gained where the filter, and the controller too, use what is named.
//!
//! Each flight is flown three times, with the same seed: named only, used by the filter, used by both. Errors count from
//! ten minutes after the change on, on the lines.

use super::{Args, draw};
use crate::closed_loop::across_m;
use crate::draw::Draw;
use crate::ensemble::all_runs;
use crate::flights::fly_with;
use crate::intervals::with_interval;
use crate::store::{Key, version};
use crate::wrap::wrapped;
use anyhow::anyhow;
use backseat_core::navigation::naming::Cause;
use backseat_logs::stats::{median, percentile, rms};
use backseat_report::markdown::markdown_table;
use backseat_wire::hostlink::{Naming, UsedFor};
use hil_sim::scenario::{Effect, Scenario};
use serde::{Deserialize, Serialize};

/// What may be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Change {
    /// A fin keeps at most 40 % of its lift and drag.
    FinLost,
    /// A fin stands.
    FinStuck,
    /// The propeller pushes 5 to 40 % less.
    ThrustLost,
    /// Water comes in.
    Flooding,
    /// Nothing.
    None,
}

/// Errors count from so long after the change on, s.
const SETTLED_S: f64 = 600.0;
/// Values of `app.naming`.
const USES: [(&str, f64); 3] = [("named only", 1.0), ("used by the filter", 2.0), ("used by both", 3.0)];
const COLUMNS: [&str; 5] = [
    "across the line, true, RMS [m]",
    "position, median [m]",
    "position, 95 % [m]",
    "depth, true, RMS [m]",
    "roll, RMS [deg]",
];

#[derive(Clone, Debug, Serialize, Deserialize)]
struct UsedFlight {
    what: String,
    /// In the order of [`COLUMNS`]; none of a flight that ended before they count.
    errors: Option<[f64; COLUMNS.len()]>,
    /// When a cause was first used, and when one was taken out, minutes after the change.
    used_min: Option<f64>,
    dropped_min: Option<f64>,
    ended_min: f64,
}

pub(super) struct Drawn {
    pub(super) scenario: Scenario,
    pub(super) what: String,
    pub(super) cause: Option<Cause>,
    pub(super) time_s: f64,
}

pub(super) fn drawn(seed: u64, change: Change, minutes: f64) -> anyhow::Result<Drawn> {
    let mut draw = Draw::new(seed);
    let mut scenario = draw::survey(seed, minutes, "")?;
    let time_s = draw.between(600.0, 1200.0);
    let place = draw.below(4);
    let fin = (1 + place) as f64;
    let effect = match change {
        Change::FinLost => {
            Effect::new("fin_lost", &[("fin", fin), ("share", draw.between(0.0, 0.4)), ("time_s", time_s)])
        }
        Change::FinStuck => {
            Effect::new("fin_stuck", &[("fin", fin), ("rad", draw.signed(0.01, 0.05)), ("time_s", time_s)])
        }
        Change::ThrustLost => Effect::new("fouling", &[("share", draw.between(0.6, 0.95)), ("time_s", time_s)]),
        Change::Flooding => {
            let (kg, x_m) = (draw.between(0.04, 0.14), draw.between(-0.3, 0.3));
            Effect::new("flooding", &[("kg", kg), ("kg_per_s", 0.005), ("x_m", x_m), ("time_s", time_s)])
        }
        Change::None => return Ok(Drawn { scenario, what: "nothing".to_owned(), cause: None, time_s }),
    };
    let effect = effect.map_err(|error| anyhow!(error))?;
    let what = effect.to_string();
    scenario.settings.effects.push(effect);
    let cause = match change {
        Change::FinLost => Some(Cause::FinLost(place as u8)),
        Change::FinStuck => Some(Cause::FinStuck(place as u8)),
        Change::ThrustLost => Some(Cause::ThrustLost),
        Change::Flooding => Some(Cause::WeightChanged),
        Change::None => None,
    };
    Ok(Drawn { scenario, what, cause, time_s })
}

fn fly(drawn: &Drawn, naming: f64) -> anyhow::Result<UsedFlight> {
    let flight = fly_with(&drawn.scenario, &[("app.naming".to_owned(), naming)])?;
    let lines = drawn.scenario.settings.lines();
    let (mut across, mut position, mut depth, mut roll) = (vec![], vec![], vec![], vec![]);
    for sample in &flight.samples {
        let truth = &sample.truth.state;
        let on_line = across_m(&lines, truth).filter(|_| sample.truth.time_us as f64 * 1e-6 > drawn.time_s + SETTLED_S);
        let Some(across_m) = on_line else { continue };
        let state = &sample.telemetry.state;
        across.push(across_m);
        position.push((state[0] - truth[0]).hypot(state[1] - truth[1]));
        depth.push(truth[2] - crate::closed_loop::DEPTH_M);
        roll.push(truth[3].to_degrees());
    }
    let decided = |is: fn(UsedFor) -> bool| {
        let decisions = flight.naming.iter().filter_map(|Naming { decision, .. }| *decision);
        let first = decisions.filter(|decision| is(decision.used_for)).map(|decision| decision.time_us).min();
        first.map(|time_us| (time_us as f64 * 1e-6 - drawn.time_s) / 60.0)
    };
    let errors = || Some([rms(&across)?, median(&position)?, percentile(&position, 0.95)?, rms(&depth)?, rms(&roll)?]);
    Ok(UsedFlight {
        what: drawn.what.clone(),
        errors: errors(),
        used_min: decided(|used| used != UsedFor::Nothing),
        dropped_min: decided(|used| used == UsedFor::Nothing),
        ended_min: flight.simulated_s / 60.0,
    })
}

/// Runs it.
///
/// # Errors
/// A flight that fails, a file that cannot be written.
pub fn run(args: &Args, change: Change) -> anyhow::Result<()> {
    let seeds = args.seed..args.seed + args.runs;
    let jobs: Vec<(Key, f64)> = USES
        .iter()
        .flat_map(|(name, naming)| seeds.clone().map(|seed| (((*name).to_owned(), seed), *naming)))
        .collect();
    let version = version("naming-use", &format!("{change:?} {} min", args.minutes))?;
    let flown = all_runs("flights", &args.part, version, &jobs, |seed, naming| {
        fly(&drawn(seed, change, args.minutes)?, *naming)
    })?;
    let Some(flown) = flown else { return Ok(()) };
    let sets: Vec<&[UsedFlight]> = flown.chunks(args.runs as usize).collect();
    let mut table = markdown_table([""].into_iter().chain(COLUMNS));
    let counts = |place: &usize| sets.iter().all(|set| set[*place].errors.is_some());
    let counted: Vec<usize> = (0..args.runs as usize).filter(counts).collect();
    let column = |set: &[UsedFlight], i: usize| -> Vec<f64> {
        counted.iter().filter_map(|place| set[*place].errors.map(|errors| errors[i])).collect()
    };
    for (set, (name, _)) in sets.iter().zip(USES) {
        let cells = (0..COLUMNS.len()).map(|i| with_interval(&column(set, i), 3));
        table.add_row([name.to_owned()].into_iter().chain(cells));
    }
    for (k, name) in [(1, "filter less named only"), (2, "both less named only"), (2, "both less filter")] {
        let against = if name.ends_with("filter") { 1 } else { 0 };
        let cells = (0..COLUMNS.len()).map(|i| {
            let pairs = column(sets[k], i).into_iter().zip(column(sets[against], i));
            with_interval(&pairs.map(|(with, without)| with - without).collect::<Vec<_>>(), 3)
        });
        table.add_row([name.to_owned()].into_iter().chain(cells));
    }
    let mut each = markdown_table([
        "seed",
        "changed",
        "used after [min]",
        "taken out after [min]",
        "across the line, RMS [m]: named only",
        "filter",
        "both",
    ]);
    for (i, seed) in seeds.clone().enumerate() {
        let minutes = |time: Option<f64>| time.map_or("-".to_owned(), |time| format!("{time:.1}"));
        let both = &sets[2][i];
        let across = sets.iter().map(|set| {
            let metres = set[i].errors.map_or("-".to_owned(), |[across, ..]| format!("{across:.2}"));
            format!("{metres} ({:.0})", set[i].ended_min)
        });
        let first = [seed.to_string(), both.what.clone(), minutes(both.used_min), minutes(both.dropped_min)];
        each.add_row(first.into_iter().chain(across));
    }
    let command = format!(
        "cargo lab naming --using {} --runs {} --seed {} --minutes {}",
        name_of(change),
        args.runs,
        args.seed,
        args.minutes
    );
    let page = wrapped(&format!(
        "# What is gained where a named cause is used\n\nMade by `{command}`: mean and its 95 % interval over the {} of {} flights whose errors count in all three forms; \
         below, the paired differences.\n\n{table}\n\n{each}\n",
        counted.len(),
        args.runs
    ));
    args.page.show(&page)
}

pub(super) fn name_of(change: Change) -> String {
    use clap::ValueEnum as _;
    change.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
}
