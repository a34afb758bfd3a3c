//! The page of `cargo lab team`, and its picture.

use super::Args;
use super::run::{LIAR, Liar, Navigated, Point, TeamCase, TeamRun};
use crate::alone::worlds::SHIP_LEAVES_S;
use crate::intervals::with_interval;
use crate::wrap::wrapped;
use backseat_logs::stats::{mean, rms};
use backseat_report::markdown::markdown_table;
use backseat_report::plots::{self, ErrorPlot, Scale};
use std::fmt::Write as _;

/// The flights of one case.
pub struct FlownCase {
    /// How.
    pub case: TeamCase,
    /// One a seed.
    pub runs: Vec<TeamRun>,
}

/// Whether the vehicle at this place is meant.
type Is = fn(usize, TeamCase) -> bool;

/// Whose rows a table has.
const WHO: [(&str, Is); 3] = [
    ("the one that surfaces", |place, case| place == 0 && case.surfaces),
    ("the others", |place, case| !(place == 0 && case.surfaces || lies(place, case))),
    ("the one that lies", lies),
];

fn lies(place: usize, case: TeamCase) -> bool {
    place == LIAR && case.liar != Liar::Nobody
}

impl FlownCase {
    /// Vehicles of each run.
    fn vehicles(&self, is_one: Is) -> impl Iterator<Item = Vec<&Navigated>> {
        self.runs.iter().map(move |run| {
            let vehicles = run.vehicles.iter().enumerate();
            vehicles.filter(|(place, _)| is_one(*place, self.case)).map(|(_, vehicle)| vehicle).collect()
        })
    }

    /// A figure of each run's points in a span of time.
    fn over_runs(&self, is_one: Is, is_then: impl Fn(f64) -> bool, of: impl Fn(&[Point]) -> Option<f64>) -> Vec<f64> {
        let figure = |vehicles: Vec<&Navigated>| {
            let points = vehicles.iter().flat_map(|vehicle| &vehicle.points).filter(|point| is_then(point.time_s));
            of(&points.copied().collect::<Vec<_>>())
        };
        self.vehicles(is_one).filter_map(figure).collect()
    }

    /// Root mean square of an error at one time.
    fn at(&self, is_one: Is, time_s: f64, of: fn(&Point) -> f64) -> Option<f64> {
        let all =
            self.over_runs(is_one, |at_s| at_s == time_s, |points| rms(&points.iter().map(of).collect::<Vec<_>>()));
        rms(&all)
    }

    /// The last time that all have.
    fn end_s(&self) -> f64 {
        let all = self.runs.iter().flat_map(|run| &run.vehicles).filter_map(|vehicle| vehicle.points.last());
        all.map(|point| point.time_s).fold(f64::INFINITY, f64::min)
    }
}

/// The page in Markdown.
pub fn page(flown: &[FlownCase], args: &Args) -> String {
    let seeds = args.ensemble.seeds();
    let (runs, first_seed) = (seeds.end - seeds.start, seeds.start);
    let cases = if args.cases.is_empty() { String::new() } else { format!(" --cases {}", args.cases.join(",")) };
    let mut text = format!(
        "# A team that hears itself\n\nMade by `cargo lab team --runs {runs} --first-seed {first_seed}{cases}`: seeds {first_seed} to {}, \
         {} flights of four boards each.\n\n{ABOUT}\n",
        seeds.end - 1,
        flown.iter().map(|flown| flown.runs.len()).sum::<usize>()
    );
    text += &args.picture.shown("Error of the others against time, by case");
    let _ = writeln!(text, "| case | |\n|---|---|");
    for FlownCase { case, .. } in flown {
        let _ = writeln!(text, "| {} | {} |", case.name, case.about);
    }
    text += "\n## Errors\n\nHorizontal error, root mean square over vehicles and flights, when the ship leaves, midway and at the end; \
             the end with the 95 % interval of the mean over flights of each flight's root mean square. ANEES: mean normalised squared error \
             of the position, 1 where the stated covariance is right, with its 95 % interval over flights, before and after the ship has \
             left.\n\n";
    text += &errors(flown);
    text += "\n\n## What became of the ranges\n\nRanges to other vehicles in a flight and vehicle, and seconds in which the error was beyond \
             the protection level, of all flights.\n\n";
    text += &ranges(flown);
    wrapped(&(text + "\n"))
}

const ABOUT: &str = "Four vehicles fly lines of 600 m side by side, 300 m apart, at 1 m/s, each with a board of its own in closed loop, \
and the ship with topside, in a cycle of 50 s: one packet of the ship and one of each vehicle, with ranges of 1 m. The ship leaves \
after twenty minutes; the flight goes on for forty more. No DVL. Inertia, drag, fins and thrust are each 10 % off, a compass is off by 2 \
degrees, both with signs that are drawn for each vehicle, and there is a current of 0.15 m/s whose direction is drawn; none of it is \
declared. The first vehicle surfaces for fixes behind every second line. `app.lost_sigma_m` is 100 km and half an hour of degraded \
navigation ends no mission.\n";

fn errors(flown: &[FlownCase]) -> String {
    let mut table = markdown_table([
        "case",
        "vehicles",
        "ship leaves [m]",
        "midway [m]",
        "end [m]",
        "mean end [m]",
        "largest [m]",
        "stated at the end [m]",
        "ANEES with the ship",
        "ANEES without",
    ]);
    for flown in flown {
        let end_s = flown.end_s();
        for (who, is_one) in WHO {
            if flown.vehicles(is_one).all(|vehicles| vehicles.is_empty()) {
                continue;
            }
            let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.1}"));
            let error = |time_s| number(flown.at(is_one, time_s, |point| point.error_m));
            let nees = |points: &[Point]| mean(&points.iter().map(|point| point.nees).collect::<Vec<_>>());
            let of_run = |points: &[Point]| rms(&points.iter().map(|point| point.error_m).collect::<Vec<_>>());
            let largest = |points: &[Point]| points.iter().map(|point| point.error_m).reduce(f64::max);
            table.add_row([
                flown.case.name.to_owned(),
                who.to_owned(),
                error(SHIP_LEAVES_S),
                error(0.5 * (SHIP_LEAVES_S + end_s)),
                error(end_s),
                with_interval(&flown.over_runs(is_one, |at_s| at_s == end_s, of_run), 1),
                number(flown.over_runs(is_one, |_| true, largest).into_iter().reduce(f64::max)),
                number(flown.at(is_one, end_s, |point| point.drms_m)),
                with_interval(&flown.over_runs(is_one, |at_s| at_s <= SHIP_LEAVES_S, nees), 2),
                with_interval(&flown.over_runs(is_one, |at_s| at_s > SHIP_LEAVES_S, nees), 2),
            ]);
        }
    }
    table.to_string()
}

fn ranges(flown: &[FlownCase]) -> String {
    let mut table = markdown_table([
        "case",
        "vehicles",
        "used",
        "beyond three sigmas",
        "nothing new, or not believed",
        "beyond the level [s]",
        "of [s]",
    ]);
    for flown in flown {
        for (who, is_one) in WHO {
            let all: Vec<&Navigated> = flown.vehicles(is_one).flatten().collect();
            if all.is_empty() {
                continue;
            }
            let count = |i: usize| mean(&all.iter().map(|vehicle| vehicle.ranges[i] as f64).collect::<Vec<_>>());
            let seconds = |i: usize| all.iter().map(|vehicle| vehicle.beyond_s[i]).sum::<usize>().to_string();
            let counts = [0, 1, 2].map(|i| count(i).map_or(String::new(), |mean| format!("{mean:.1}")));
            let row = [flown.case.name.to_owned(), who.to_owned()].into_iter().chain(counts);
            table.add_row(row.chain([0, 1].map(seconds)));
        }
    }
    table.to_string()
}

/// Errors of the others against time.
pub fn picture(flown: &[FlownCase]) -> String {
    let [_, (_, is_other), _] = WHO;
    let line = |flown: &FlownCase, of: fn(&Point) -> f64| -> Vec<(f64, f64)> {
        let minutes = (0..=(flown.end_s() / 60.0) as u32).map(f64::from);
        minutes.filter_map(|at| Some((at / 60.0, flown.at(is_other, 60.0 * at, of)?))).collect()
    };
    let lines: Vec<_> = flown.iter().map(|flown| (flown.case.name, line(flown, |point| point.error_m))).collect();
    let series: Vec<(&str, &[(f64, f64)])> = lines.iter().map(|(name, line)| (*name, &line[..])).collect();
    let team = flown.iter().find(|flown| flown.case.name == "team").map(|flown| line(flown, |point| point.drms_m));
    let bound = team.as_ref().map(|line| ("team, stated", &line[..]));
    let label = "error of the others [m]";
    plots::sheet(&[&[plots::error_vs_time(&ErrorPlot { y_label: label, series: &series, bound, scale: Scale::Log })]])
}
