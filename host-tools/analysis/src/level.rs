//! The protection level of a track: its size, and how often the error was beyond it.

use backseat_logs::stats::{median, percentile};
use backseat_report::Table;
use backseat_report::plots::{self, ErrorPlot, Point, Scale};
use serde_json::{Value, json};

/// One time of a track.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stated {
    /// µs.
    pub time_us: u64,
    /// What the error exceeds with the declared probability only, horizontally and in depth, m.
    pub level_m: [f64; 2],
    /// The errors, m; NaN where there is no truth.
    pub error_m: [f64; 2],
}

/// Of one direction.
struct Summary {
    median_m: f64,
    p95_m: f64,
    max_m: f64,
    last_m: f64,
    /// Time with a truth, and that of it in which the error was beyond the level, s; `None` without any truth.
    beyond_s: Option<[f64; 2]>,
}

const NAMES: [&str; 2] = ["horizontal", "depth"];

fn summary(stated: &[Stated], which: usize) -> Option<Summary> {
    let levels: Vec<f64> = stated.iter().map(|at| at.level_m[which]).collect();
    let judged: Vec<[f64; 2]> = stated
        .windows(2)
        .filter(|pair| !pair[0].error_m[which].is_nan())
        .map(|pair| {
            let step_s = pair[1].time_us.saturating_sub(pair[0].time_us) as f64 * 1e-6;
            let beyond = pair[0].error_m[which] > pair[0].level_m[which];
            [step_s, if beyond { step_s } else { 0.0 }]
        })
        .collect();
    let total = |part: usize| judged.iter().map(|pair| pair[part]).sum::<f64>();
    Some(Summary {
        median_m: median(&levels)?,
        p95_m: percentile(&levels, 0.95)?,
        max_m: levels.iter().copied().fold(0.0, f64::max),
        last_m: *levels.last()?,
        beyond_s: (!judged.is_empty()).then(|| [total(0), total(1)]),
    })
}

/// For people; `None` without a level.
pub fn table(stated: &[Stated]) -> Option<Table> {
    let header = ["protection level [m]", "median", "95 %", "max", "at the end", "error beyond it"];
    let summaries = [0, 1].map(|which| summary(stated, which));
    summaries.iter().any(Option::is_some).then(|| {
        NAMES.iter().zip(summaries.iter().flatten()).fold(Table::new("", &header), |table, (name, s)| {
            let cells = [s.median_m, s.p95_m, s.max_m, s.last_m].map(|level_m| format!("{level_m:.1}"));
            let beyond = s.beyond_s.map_or("no truth".to_owned(), |[all, beyond]| format!("{beyond:.0} of {all:.0} s"));
            table.row([(*name).to_owned()].into_iter().chain(cells).chain([beyond]))
        })
    })
}

/// As JSON: an object for each direction, or null.
pub fn json(stated: &[Stated]) -> Value {
    let direction = |which| {
        summary(stated, which).map(|s| {
            json!({"median_m": s.median_m, "p95_m": s.p95_m, "max_m": s.max_m, "last_m": s.last_m,
                "judged_s": s.beyond_s.map(|[all, _]| all), "beyond_s": s.beyond_s.map(|[_, beyond]| beyond)})
        })
    };
    json!({"horizontal": direction(0), "depth": direction(1)})
}

/// Error beside level against time, with captions; none without a level.
pub fn figures(stated: &[Stated]) -> Vec<(String, String)> {
    if stated.is_empty() {
        return Vec::new();
    }
    let line = |value: &dyn Fn(&Stated) -> f64| -> Vec<Point> {
        stated.iter().map(|at| (at.time_us as f64 / 3.6e9, value(at))).collect()
    };
    let figure = |which: usize, y_label: &str, what: &str| {
        let (level, error) = (line(&|at| at.level_m[which]), line(&|at| at.error_m[which]));
        let has_error = error.iter().any(|(_, error_m)| !error_m.is_nan());
        let series: &[plots::Series<'_>] = if has_error { &[("error", &error)] } else { &[] };
        let plot = ErrorPlot { y_label, series, bound: Some(("protection level", &level)), scale: Scale::Log };
        let caption = format!("Protection level{what}: what the error exceeds with the declared probability only.");
        (caption, plots::error_vs_time(&plot))
    };
    vec![figure(0, "horizontal error [m]", ""), figure(1, "depth error [m]", " in depth")]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(second: u64, error_m: [f64; 2]) -> Stated {
        Stated { time_us: second * 1_000_000, level_m: [10.0, 1.0], error_m }
    }

    #[test]
    fn val_time_beyond_is_that_of_the_error() {
        let errors = [[5.0, 0.5], [11.0, 0.5], [12.0, 2.0], [f64::NAN; 2], [3.0, 0.1]];
        let stated: Vec<Stated> = (0..).zip(errors).map(|(second, error_m)| at(second, error_m)).collect();
        let said = json(&stated);
        assert_eq!(said["horizontal"]["judged_s"], 3.0);
        assert_eq!((&said["horizontal"]["beyond_s"], &said["depth"]["beyond_s"]), (&json!(2.0), &json!(1.0)));
        assert_eq!(said["depth"]["max_m"], 1.0);
        assert_eq!(figures(&stated).len(), 2);
    }

    #[test]
    fn without_a_level_or_a_truth_it_says_so() {
        assert_eq!(json(&[]), json!({"horizontal": null, "depth": null}));
        assert!(table(&[]).is_none() && figures(&[]).is_empty());
        let said = json(&[at(0, [f64::NAN; 2]), at(1, [f64::NAN; 2])]);
        assert_eq!((&said["depth"]["beyond_s"], &said["depth"]["last_m"]), (&Value::Null, &json!(1.0)));
    }
}
