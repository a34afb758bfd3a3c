//! How well runs of a torpedo are navigated without their DVL, as a table and in the JSON.

use backseat_diagnose::torpedo::carry::{Drift, WAYS};
use backseat_diagnose::torpedo::t_quantile;
use backseat_report::Table;
use serde_json::{Value, json};

/// A row a run, and all together.
pub(super) fn drift_table(drifts: &[(String, Drift)]) -> Table {
    let header = ["run", "way [m]", "textbook", "found", "speed per rpm", "found ahead", "found to the right"];
    let caption =
        "Navigation without the DVL, whose readings judge: where the way ends, off the DVL's by percent of the way";
    let percent = |metres: f64, drift: &Drift| format!("{:.1}", 100.0 * metres / drift.distance_m);
    let row = |label: &str, drift: &Drift| {
        let ways = drift.drift_m.map(|metres| percent(metres, drift));
        let components = [drift.ahead_m[1], drift.right_m[1]].map(|metres| percent(metres, drift));
        [label.to_owned(), format!("{:.0}", drift.distance_m)].into_iter().chain(ways).chain(components)
    };
    let table = drifts.iter().fold(Table::new(caption, &header), |table, (label, drift)| table.row(row(label, drift)));
    let all = total(drifts);
    let shares = (0..WAYS).map(|way| share(drifts, |drift| drift.drift_m[way]));
    let components = [|drift: &Drift| drift.ahead_m[1], |drift: &Drift| drift.right_m[1]].map(|of| share(drifts, of));
    let cell = |share: Option<[f64; 3]>| {
        share.map_or_else(
            || "-".to_owned(),
            |all| {
                let [share, low, high] = all.map(|part| 100.0 * part);
                format!("{share:.1} ({low:.1} to {high:.1})")
            },
        )
    };
    let start = ["all, 95 % over runs".to_owned(), format!("{:.0}", all.distance_m)];
    table.row(start.into_iter().chain(shares.chain(components).map(cell)))
}

fn total(drifts: &[(String, Drift)]) -> Drift {
    drifts.iter().fold(Drift::default(), |sum, (_, drift)| sum.plus(drift))
}

/// Share of the way of all runs, with the 95 % interval by leaving each run out; `None`: fewer than three runs.
fn share(drifts: &[(String, Drift)], of: impl Fn(&Drift) -> f64) -> Option<[f64; 3]> {
    let all = total(drifts);
    let count = drifts.len() as f64;
    let without: Vec<f64> =
        drifts.iter().map(|(_, one)| (of(&all) - of(one)) / (all.distance_m - one.distance_m)).collect();
    let mean = without.iter().sum::<f64>() / count;
    let squares: f64 = without.iter().map(|share| (share - mean).powi(2)).sum();
    let half = t_quantile(drifts.len().checked_sub(1)?) * ((count - 1.0) / count * squares).sqrt();
    let share = of(&all) / all.distance_m;
    (drifts.len() > 2).then_some([share, share - half, share + half])
}

/// The shares of all runs.
pub(super) fn drift_value(drifts: &[(String, Drift)]) -> Value {
    let value = |of: &dyn Fn(&Drift) -> f64| {
        share(drifts, of).map(|[share, low, high]| json!({"value": share, "ci95": [low, high]}))
    };
    let way = |way: usize| {
        json!({"share": value(&|drift| drift.drift_m[way]), "ahead": value(&|drift| drift.ahead_m[way]),
            "right": value(&|drift| drift.right_m[way])})
    };
    let distance_m = total(drifts).distance_m;
    json!({"distance_m": distance_m, "textbook": way(0), "found": way(1), "speed_per_rpm": way(2)})
}
