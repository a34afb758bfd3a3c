//! The page of `cargo lab judge`: one table by class, one list of what was broken, one picture.

use super::classes::CLASSES;
use super::watch::{Bound, Judged};
use super::{Args, Which};
use crate::wrap::wrapped;
use backseat_logs::stats::{median, wilson_ci95};
use backseat_report::markdown::markdown_table;
use backseat_report::plots;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// A bound is broken by an error that is beyond it for longer, s.
const BROKEN_S: f64 = 60.0;

fn is_broken(bound: &Bound) -> bool {
    bound.beyond_s > BROKEN_S
}

/// Error against level, one point a minute of every flight: horizontal, and depth below it.
pub fn picture(judged: &[Judged]) -> String {
    let draw = |pick: fn(&Judged) -> &Bound, what: &str| {
        let group = |wanted: fn(usize) -> bool| -> Vec<(f64, f64)> {
            let flights = judged.iter().filter(|flight| wanted(troubles(flight)));
            let points = flights.flat_map(|flight| &pick(flight).points_m);
            points.map(|point| (f64::from(point[0]), f64::from(point[1]))).collect()
        };
        let [healthy, one, more] = [group(|n| n == 0), group(|n| n == 1), group(|n| n > 1)];
        plots::stanford(
            &format!("{what} error [m]"),
            "protection level [m]",
            &[("nothing wrong", &healthy), ("one class", &one), ("two or three", &more)],
        )
    };
    plots::sheet(&[&[draw(|flight| &flight.horizontal, "horizontal")], &[draw(|flight| &flight.depth, "depth")]])
}

fn troubles(flight: &Judged) -> usize {
    flight.classes.iter().filter(|name| CLASSES.iter().any(|class| class.name == **name)).count()
}

/// The page in Markdown.
pub fn page(judged: &[Judged], args: &Args) -> String {
    let last = args.seed + args.runs - 1;
    let mut text = format!(
        "# Does the bound hold?\n\nMade by `cargo lab judge --runs {} --seed {} --classes {} --hours {}`: {} flights drawn by \
         seeds {} to {last}, {:.1} hours in all.\n\n",
        args.runs,
        args.seed,
        match args.classes {
            Which::Work => "work",
            Which::Held => "held",
            Which::All => "all",
        },
        args.hours,
        judged.len(),
        args.seed,
        judged.iter().map(|flight| flight.hours).sum::<f64>(),
    );
    for (what, pick) in DIRECTIONS {
        let broken = judged.iter().filter(|flight| is_broken(pick(flight))).count();
        let (low, high) = wilson_ci95(broken as u64, judged.len() as u64).unwrap_or((f64::NAN, f64::NAN));
        let _ = writeln!(
            text,
            "- {what}: the error was beyond the level for more than {BROKEN_S:.0} s in {broken} of {} flights ({:.1} %, 95 % {:.1} \
             to {:.1} %).",
            judged.len(),
            100.0 * broken as f64 / judged.len().max(1) as f64,
            100.0 * low,
            100.0 * high,
        );
    }
    let sigmas = judged.iter().filter(|flight| flight.beyond_sigmas_s > BROKEN_S).count();
    let deep = judged.iter().filter(|flight| flight.too_deep_m > 6.0).count();
    let _ = writeln!(
        text,
        "- For comparison: beyond three of the board's own sigmas for longer than that in {sigmas} flights.\n- Deeper than the \
         mission's depth by more than 6 m (limit and 1 m) under way: {deep} flights.\n"
    );
    let ratios: Vec<f64> = judged.iter().map(level_over_error).collect();
    let _ = writeln!(
        text,
        "The level is conservative: in the median of these {} flights it is {:.0} times the 95 % error. It bounds the error and does \
         not say how good a position is. Alert limits on it are off by default. The sizes of what may be wrong are taken from \
         the sources that the lists name; these are still to be checked.\n",
        judged.len(),
        median(&ratios).unwrap_or(f64::NAN),
    );
    text += &args.picture.shown("Error against level, one point a minute");
    let mut rows: BTreeMap<&str, Vec<&Judged>> = BTreeMap::new();
    for flight in judged {
        for name in &flight.classes {
            rows.entry(name).or_default().push(flight);
        }
    }
    let mut table = markdown_table([
        "class",
        "flights",
        "beyond, horizontal",
        "beyond, depth",
        "largest error / level",
        "in depth",
        "median level [m]",
        "level / 95 % error",
        "level at most 25 m under ranges",
    ]);
    for (name, flights) in rows {
        table.add_row(row(name, &flights));
    }
    table.add_row(row("all", &judged.iter().collect::<Vec<_>>()));
    let _ = writeln!(
        text,
        "A flight counts in each of its classes. Level, its ratio to the 95 % error and the share of the time: medians over the \
         flights.\n\n{table}"
    );
    let broken: Vec<String> = judged
        .iter()
        .zip(args.seed..)
        .flat_map(|(flight, seed)| DIRECTIONS.map(|(what, pick)| (seed, flight, what, pick(flight))))
        .filter(|(.., bound)| is_broken(bound))
        .map(|(seed, flight, what, bound)| {
            let [error_m, level_m] = bound.worst_m;
            format!(
                "- seed {seed} ({}), {what}: {:.0} s beyond; at worst {error_m:.1} m where {level_m:.1} m were stated, at \
                 {:.0} s.",
                flight.classes.join(", "),
                bound.beyond_s,
                bound.worst_s
            )
        })
        .collect();
    if !broken.is_empty() {
        let _ = writeln!(text, "\n## Broken\n\n{}", broken.join("\n"));
    }
    text += "\n## Classes, and where their sizes come from\n\n";
    for class in CLASSES {
        let _ = writeln!(text, "- {}: {}.", class.name, class.source);
    }
    wrapped(&text)
}

type Pick = fn(&Judged) -> &Bound;
const DIRECTIONS: [(&str, Pick); 2] = [("horizontal", |flight| &flight.horizontal), ("depth", |flight| &flight.depth)];

/// Median level over the error's 95 % quantile, horizontally.
fn level_over_error(flight: &Judged) -> f64 {
    flight.horizontal.level_m / flight.horizontal.error_p95_m.max(1.0e-3)
}

fn row(name: &str, flights: &[&Judged]) -> Vec<String> {
    let middle = |value: &dyn Fn(&Judged) -> f64| {
        median(&flights.iter().map(|flight| value(flight)).collect::<Vec<f64>>()).unwrap_or(f64::NAN)
    };
    let largest = |pick: Pick| flights.iter().map(|flight| pick(flight).ratio).fold(0.0, f64::max);
    let broken = |pick: Pick| flights.iter().filter(|flight| is_broken(pick(flight))).count();
    let [(_, horizontal), (_, depth)] = DIRECTIONS;
    vec![
        name.to_owned(),
        flights.len().to_string(),
        broken(horizontal).to_string(),
        broken(depth).to_string(),
        format!("{:.2}", largest(horizontal)),
        format!("{:.2}", largest(depth)),
        format!("{:.1}", middle(&|flight| flight.horizontal.level_m)),
        format!("{:.1}", middle(&level_over_error)),
        format!("{:.0} %", 100.0 * middle(&|flight| flight.tight)),
    ]
}
