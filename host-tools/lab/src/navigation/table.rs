//! The tables: all rows of all cases over their seeds.

use super::Args;
use super::cases::MissionCase;
use super::run::{EstimateScore, MissionRun};
use crate::intervals::with_interval;
use backseat_logs::stats::mean;
use backseat_report::markdown::markdown_table;
use std::fmt::Write as _;

type Results<'a> = [(&'a MissionCase, Vec<MissionRun>)];

/// One row over all seeds.
struct FilterRow<'a> {
    name: &'a str,
    runs: Vec<(u64, &'a EstimateScore)>,
}

impl FilterRow<'_> {
    fn all(&self, of: impl Fn(&EstimateScore) -> f64) -> Vec<f64> {
        self.runs.iter().map(|(_, measured)| of(measured)).collect()
    }

    /// Root mean square error of all runs over the one that the filter expects.
    fn rms_over_drms(&self) -> Option<f64> {
        Some(mean(&self.all(|m| m.rms_m * m.rms_m))?.sqrt() / self.drms_m()?)
    }

    /// Expected by the filter.
    fn drms_m(&self) -> Option<f64> {
        let squares: Option<Vec<f64>> = self.runs.iter().map(|(_, m)| m.drms_m.map(|drms| drms * drms)).collect();
        mean(&squares?).map(f64::sqrt)
    }

    fn anees(&self) -> Option<f64> {
        let anees: Option<Vec<f64>> = self.runs.iter().map(|(_, m)| m.anees).collect();
        mean(&anees?)
    }

    /// The run with the largest 95th percentile.
    fn worst(&self) -> Option<(u64, &EstimateScore)> {
        self.runs.iter().copied().max_by(|a, b| a.1.p95_m.total_cmp(&b.1.p95_m))
    }

    fn refused(&self) -> (u64, u64) {
        let sum = |of: fn(&EstimateScore) -> u64| self.runs.iter().map(|(_, m)| of(m)).sum();
        (sum(|m| m.refused), sum(|m| m.fused + m.refused))
    }
}

/// The rows of one case, in the order in which they were run.
fn rows<'a>(runs: &[(u64, &'a MissionRun)]) -> Vec<FilterRow<'a>> {
    let mut rows: Vec<FilterRow<'a>> = Vec::new();
    for (seed, run) in runs {
        for (name, measured) in &run.rows {
            match rows.iter_mut().find(|row| row.name == name.as_str()) {
                Some(row) => row.runs.push((*seed, measured)),
                None => rows.push(FilterRow { name, runs: vec![(*seed, measured)] }),
            }
        }
    }
    rows
}

/// The tables with their explanation.
pub fn markdown(arguments: &Args, results: &Results<'_>) -> String {
    let seeds = arguments.ensemble.seeds();
    let (runs, first_seed) = (seeds.end - seeds.start, seeds.start);
    let mut options = format!("--runs {runs} --first-seed {first_seed}");
    if !arguments.cases.is_empty() {
        let _ = write!(options, " --cases {}", arguments.cases.join(","));
    }
    if let Some(minutes) = arguments.minutes {
        let _ = write!(options, " --minutes {minutes}");
    }
    let mut text = format!(
        "# Navigation with undeclared vehicles, sensors and water\n\n\
         Made by `cargo lab navigation {options}` (version {}, seeds {first_seed} to {}).\n\n\
         Ten 1 km lines 100 m apart at 3 m depth, 1 m/s unless a case says otherwise, three hours. Depth 7 Hz with 0.06 m, attitude 3 Hz\n\
         with 1 degree, no gyro rates unless a case says so, no DVL. A packet every 30 s: its range has 1 m, its range rate is not\n\
         used. GNSS only while surfaced at either end. The ship circles at 600 m; its packets hold its own GNSS position (0.5 m).\n\n\
         Horizontal error: mean over the seeds of each run's median and 95th percentile, with the 95 % interval of that mean. Worst: the\n\
         run with the largest 95th percentile. DRMS: root mean square error that the filter expects. ANEES: mean of\n\
         eᵀ P⁻¹ e / 2 of the position, 1 if the covariance is right. RMS / DRMS: the error over what the filter expects. Bound: DRMS of\n\
         a filter over measurements without noise, which keep it at the truth: no estimator errs less on average over the same prior.\n\
         Refused: share of the measurements, all of them good, that were not used.\n\
         `closed loop` is the backseat's own estimate in flight, on which the LQR steers. The other filters run over the\n\
         same measurements afterwards; the same wrong vehicle is declared to all.\n",
        env!("CARGO_PKG_VERSION"),
        seeds.end - 1
    );
    for (case, runs) in results {
        let runs: Vec<(u64, &MissionRun)> = seeds.clone().zip(runs).collect();
        let _ = write!(text, "\n## {}\n\n{}. Runs: {}.\n\n", case.name, capitalised(case.about), runs.len());
        let mut table = markdown_table([
            "filter",
            "median [m]",
            "95 % [m]",
            "worst run: median, 95 % [m] (seed)",
            "DRMS [m]",
            "ANEES",
            "RMS / DRMS",
            "refused",
        ]);
        for row in rows(&runs) {
            let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.2}"));
            let worst =
                row.worst().map_or(String::new(), |(seed, m)| format!("{:.2}, {:.2} ({seed})", m.median_m, m.p95_m));
            let refused = match row.refused() {
                (_, 0) => String::new(),
                (refused, all) => format!("{:.3} %", 100.0 * refused as f64 / all as f64),
            };
            table.add_row([
                row.name.to_owned(),
                with_interval(&row.all(|m| m.median_m), 2),
                with_interval(&row.all(|m| m.p95_m), 2),
                worst,
                number(row.drms_m()),
                number(row.anees()),
                number(row.rms_over_drms()),
                refused,
            ]);
        }
        let _ = writeln!(text, "{table}");
        let cut =
            runs.iter().flat_map(|(seed, run)| run.cut_short.iter().map(move |how| format!("seed {seed}, {how}")));
        let cut: Vec<String> = cut.collect();
        if !cut.is_empty() {
            let _ = writeln!(text, "\nNot flown to the end: {}.", cut.join("; "));
        }
    }
    text
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}
