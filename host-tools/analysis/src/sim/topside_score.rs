//! How well topside on the ship, and the companions, knew where they and the vehicle were.

use backseat_logs::stats::ErrorSummary;
use hil_sim::flight::{FlightLog, ShipSide};
use serde_json::{Value, json};

/// Median and 95 % of an error, m.
type Error = Option<[f64; 2]>;

/// Rows of the score table: topside's knowledge of ship and vehicle, and the companions'.
pub fn rows(flight: &FlightLog, companions: &[FlightLog]) -> Vec<(String, [f64; 2])> {
    let mut rows = vec![
        ("topside: the ship".to_owned(), error(flight, |side| side.ship)),
        ("topside: the vehicle".to_owned(), error(flight, |side| side.vehicle)),
    ];
    for (companion, number) in companions.iter().zip(1..) {
        let name = if companions.len() > 1 { format!("companion {number}") } else { "companion".to_owned() };
        rows.push((format!("{name}: its backseat"), own_error(companion)));
        rows.push((format!("topside: the {name}"), error(companion, |side| side.vehicle)));
    }
    rows.into_iter().filter_map(|(name, error)| Some((name, error?))).collect()
}

/// What became of a companion.
pub fn companion_json(flight: &FlightLog) -> Value {
    json!({"backseat": json_of(own_error(flight)), "topside": json(flight), "finished": flight.finished})
}

/// How well topside knew ship and vehicle, m; the mean of the vehicle's normalised squared error is 2 where its ellipse
/// is right.
pub fn json(flight: &FlightLog) -> Value {
    if flight.ship_side.is_empty() {
        return Value::Null;
    }
    let squares: Vec<f64> = flight.ship_side.iter().filter_map(|side| side.vehicle).map(|[_, square]| square).collect();
    json!({
        "ship": json_of(error(flight, |side| side.ship)),
        "vehicle": json_of(error(flight, |side| side.vehicle)),
        "vehicle_mean_square": (!squares.is_empty()).then(|| squares.iter().sum::<f64>() / squares.len() as f64),
        "vehicle_seconds": squares.len(),
    })
}

fn json_of(error: Error) -> Value {
    error.map_or(Value::Null, |[median, p95]| json!({"median_m": median, "p95_m": p95}))
}

fn error(flight: &FlightLog, pick: fn(&ShipSide) -> Option<[f64; 2]>) -> Error {
    quantiles(flight.ship_side.iter().filter_map(pick).map(|[error_m, _]| error_m))
}

/// A companion's own error, as its board reports it.
fn own_error(flight: &FlightLog) -> Error {
    let known = flight.samples.iter().filter(|sample| sample.telemetry.sigma[0] > 0.0);
    quantiles(known.map(|sample| {
        let (truth, state) = (&sample.truth.state, &sample.telemetry.state);
        f64::hypot(truth[0] - state[0], truth[1] - state[1])
    }))
}

fn quantiles(values: impl Iterator<Item = f64>) -> Error {
    let summary = ErrorSummary::of(&values.collect::<Vec<f64>>())?;
    Some([summary.median_m, summary.p95_m])
}
