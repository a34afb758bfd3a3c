//! The page of `cargo lab alone`, and its picture.

use super::Args;
use super::aids::Aid;
use super::run::{Alone, Point};
use super::worlds::{Way, World};
use crate::intervals::with_interval;
use crate::wrap::wrapped;
use backseat_logs::stats::{median, rms};
use backseat_report::markdown::markdown_table;
use backseat_report::plots::{self, ErrorPlot, Scale};
use std::fmt::Write as _;

/// The flights of one world.
pub struct FlownWorld {
    /// Where.
    pub world: World,
    /// One a seed.
    pub runs: Vec<Alone>,
}

impl FlownWorld {
    fn tracks(&self, name: &str) -> Vec<&[Point]> {
        let rows = self.runs.iter().filter_map(|run| run.rows.iter().find(|row| row.name == name));
        rows.map(|row| &row.points[..]).collect()
    }

    /// Of an estimate's last points.
    fn ends(&self, name: &str, of: fn(&Point) -> f64) -> Vec<f64> {
        self.tracks(name).iter().filter_map(|track| track.last()).map(of).collect()
    }

    /// Root mean square over the flights at each point.
    fn over_time(&self, name: &str, of: fn(&Point) -> f64) -> Vec<(f64, f64)> {
        let tracks = self.tracks(name);
        let points = tracks.iter().map(|track| track.len()).min().unwrap_or(0);
        let at = |k: usize| {
            let all: Vec<f64> = tracks.iter().filter_map(|track| track.get(k)).map(of).collect();
            Some((tracks.first()?.get(k)?.time_s / 3600.0, rms(&all)?))
        };
        (0..points).filter_map(at).collect()
    }

    /// Error over what is stated, root mean squares over the flights, at each point.
    fn honesty(&self, name: &str) -> Vec<(f64, f64)> {
        let stated = self.over_time(name, |point| point.drms_m);
        self.over_time(name, |point| point.error_m)
            .iter()
            .zip(stated)
            .map(|((at, error), (_, drms))| (*at, error / drms))
            .collect()
    }

    fn bound_m(&self, which: usize) -> Option<f64> {
        let ends: Vec<f64> = self.runs.iter().filter_map(|run| run.bounds_m.get(which).copied()).collect();
        rms(&ends)
    }

    /// Errors at the end, in per cent of the distance.
    fn shares(&self, name: &str) -> Vec<f64> {
        let distances = self.runs.iter().map(|run| run.distance_m);
        self.ends(name, |point| point.error_m)
            .into_iter()
            .zip(distances)
            .map(|(error, distance)| 100.0 * error / distance)
            .collect()
    }
}

const ESTIMATES: [(&str, &str); 4] = [
    ("kinematic", "kinematic"),
    ("nominal", "nominal"),
    ("robust", "robust"),
    ("board", "the board in flight: robust, σ stated"),
];

/// The page in Markdown.
pub fn page(flown: &[FlownWorld], args: &Args) -> String {
    let seeds = args.ensemble.seeds();
    let (runs, first_seed, last) = (seeds.end - seeds.start, seeds.start, seeds.end - 1);
    let worlds = if args.worlds.is_empty() { String::new() } else { format!(" --worlds {}", args.worlds.join(",")) };
    let mut text = format!(
        "# Five hours alone\n\nMade by `cargo lab alone --runs {runs} --first-seed {first_seed}{worlds}`: {} flights, seeds {first_seed} to \
         {last}.\n\n{ABOUT}\n",
        flown.iter().map(|flown| flown.runs.len()).sum::<usize>()
    );
    text +=
        &args.picture.shown("The lawnmower: root mean square error against time, and what the robust filter states");
    for flown in flown {
        let _ = writeln!(text, "## {}\n\n{}.\n", flown.world.name, flown.world.about());
        let _ = writeln!(text, "{}", estimates(flown));
        let beyond = flown.runs.iter().filter(|run| run.level_ratio > 1.0).count();
        let largest = flown.runs.iter().map(|run| run.level_ratio).fold(0.0, f64::max);
        let _ = writeln!(
            text,
            "\nProtection level of the board: the error was beyond it in {beyond} of {} flights; largest error over level {largest:.2}.\n",
            flown.runs.len()
        );
    }
    text += "## Is the stated error honest all the way?\n\nRoot mean square error of the flights over the root mean square of what is \
             stated (RMS/DRMS), by hours since the ship left; 1.1 at most is asked for.\n\n";
    text += &over_time(flown);
    text += "\n\n## What would help most next\n\nThe same flights, and what else is measured one, two, three and four hours after the ship has left, or once \
             after two and a half, as if it had been there: the vehicle flies as it did without. Error of the robust filter \
             at the end, root mean square of the flights, in metres and in per cent of the distance, and the largest of \
             points ten minutes apart.\n\n";
    text += &help(flown);
    wrapped(&(text + "\n"))
}

const ABOUT: &str = "A packet every 30 s brings a range of 1 m for the first twenty minutes; then five hours at 1 m/s without ship, DVL or fixes. Depth \
7 Hz with 0.06 m, attitude 3 Hz with 1 degree, no gyro rates. Inertia, drag, fins and thrust are each 10 % off, a compass is \
off by 2 degrees, and there is a current of 0.15 m/s: steady, or a rotary tide of 12.4 h. None of it is declared; signs, \
direction and phase are drawn. The flight ends under way. `app.lost_sigma_m` is 100 km instead of 300 m, because \
otherwise the board ends the mission where it states more than that.

Error at the end: mean over the flights with its 95 % interval. Stated: root mean square error that the filter expects (DRMS), \
root mean square over the flights. Over bound: root mean square error over the bound.

**Bound**: the posterior Cramér-Rao bound of the plane problem along the true track (`host-tools/lab/src/alone/bound.rs`). \
Unknown are start, speed, constant of the compass and current, with the priors of the draws; ranges and fixes are measured. It \
leaves out what depth and attitude tell of the speed in dives and turns, so that a filter that learns the speed from them may \
err less: it is what positions alone allow. Water as drawn: steady, or a tide of known period about no mean. Both: a mean \
current and a tide at once, 0.11 m/s each per axis, as a navigator must assume who does not know the water.\n";

fn estimates(flown: &FlownWorld) -> String {
    let mut table = markdown_table([
        "estimate",
        "error at the end [m]",
        "largest [m]",
        "share of the distance [%]",
        "stated [m]",
        "RMS/DRMS",
        "over bound",
    ]);
    let bound = flown.bound_m(0);
    for (name, shown) in ESTIMATES {
        let ends = flown.ends(name, |point| point.error_m);
        let (error, stated) = (rms(&ends), rms(&flown.ends(name, |point| point.drms_m)));
        let over = |by: Option<f64>| error.zip(by).map_or(String::new(), |(error, by)| format!("{:.2}", error / by));
        table.add_row([
            shown.to_owned(),
            with_interval(&ends, 0),
            ends.iter().copied().reduce(f64::max).map_or(String::new(), |largest| format!("{largest:.0}")),
            with_interval(&flown.shares(name), 2),
            stated.map_or(String::new(), |stated| format!("{stated:.0}")),
            over(stated),
            over(bound),
        ]);
    }
    let distance = median(&flown.runs.iter().map(|run| run.distance_m).collect::<Vec<_>>());
    for (which, name) in ["bound, water as drawn", "bound, both"].into_iter().enumerate() {
        let bound = flown.bound_m(which);
        let share =
            bound.zip(distance).map_or(String::new(), |(bound, distance)| format!("{:.2}", 100.0 * bound / distance));
        let metres = bound.map_or(String::new(), |bound| format!("{bound:.0}"));
        table.add_row([name.to_owned(), String::new(), String::new(), share, metres, String::new(), String::new()]);
    }
    table.to_string()
}

fn over_time(flown: &[FlownWorld]) -> String {
    let mut table = markdown_table(["world", "estimate", "1 h", "2 h", "3 h", "4 h", "5 h"]);
    for flown in flown {
        for (name, shown) in ESTIMATES.into_iter().skip(1) {
            let ratios = flown.honesty(name);
            let hours = (1..=5).map(|hour| {
                let at = ratios.iter().find(|(time_h, _)| (time_h - f64::from(hour)).abs() < 0.01);
                at.map_or(String::new(), |(_, ratio)| format!("{ratio:.2}"))
            });
            table.add_row([flown.world.name.to_owned(), shown.to_owned()].into_iter().chain(hours));
        }
    }
    table.to_string()
}

fn help(flown: &[FlownWorld]) -> String {
    let header =
        ["world", "what is measured after the ship has left", "at the end [m]", "[%]", "largest [m]", "RMS/DRMS"];
    let mut table = markdown_table(header);
    for flown in flown {
        for aid in Aid::ALL {
            let name = aid.name();
            let error = flown.ends(name, |point| point.error_m);
            if error.is_empty() {
                continue;
            }
            let all = flown.tracks(name).into_iter().flatten().map(|point| point.error_m);
            let number =
                |value: Option<f64>, digits: usize| value.map_or(String::new(), |value| format!("{value:.digits$}"));
            table.add_row([
                flown.world.name.to_owned(),
                aid.about().to_owned(),
                number(rms(&error), 0),
                number(rms(&flown.shares(name)), 2),
                number(all.reduce(f64::max), 0),
                number(flown.honesty(name).last().map(|(_, ratio)| *ratio), 2),
            ]);
        }
    }
    table.to_string()
}

/// Errors against time, one diagram for each water of the lawnmower.
pub fn picture(flown: &[FlownWorld]) -> String {
    let lawnmowers = flown.iter().filter(|flown| flown.world.way == Way::Lawnmower);
    let diagrams: Vec<[String; 1]> = lawnmowers
        .map(|flown| {
            let lines =
                ["kinematic", "nominal", "robust"].map(|name| (name, flown.over_time(name, |point| point.error_m)));
            let series: Vec<(&str, &[(f64, f64)])> = lines.iter().map(|(name, line)| (*name, &line[..])).collect();
            let stated = flown.over_time("robust", |point| point.drms_m);
            let label = format!("{}: error [m]", flown.world.name.trim_start_matches("lawnmower-"));
            let bound = Some(("robust, stated", &stated[..]));
            [plots::error_vs_time(&ErrorPlot { y_label: &label, series: &series, bound, scale: Scale::Log })]
        })
        .collect();
    let columns: Vec<&[String]> = diagrams.iter().map(|diagram| &diagram[..]).collect();
    plots::sheet(&columns)
}
