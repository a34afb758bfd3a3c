//! One seed of one world: the flight, and the filters over its measurements.

use super::aids::{Aid, aided};
use super::bound::{Prior, bound};
use super::worlds::{Way, World, since_s};
use crate::flights;
use anyhow::Context;
use backseat_analysis::flight_score;
use backseat_core::navigation::ProcessModel;
use backseat_core::state::{X, Y};
use backseat_estimation::filter::{self, FilterOptions, ShipSource};
use backseat_logs::VehicleFile;
use hil_sim::flight::FlightSample;
use serde::{Deserialize, Serialize};

/// Stored result of a seed.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Alone {
    /// How far it went through the water since the ship left, m.
    pub distance_m: f64,
    /// Each estimate.
    pub rows: Vec<Row>,
    /// The bound for the water as drawn, and for both a mean current and a tide (DRMS), m, at the end.
    pub bounds_m: [f64; 2],
    /// Largest horizontal error of the board over its protection level.
    pub level_ratio: f64,
}

/// An estimate since the ship left.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    /// As in [`ESTIMATES`](super::page) and [`Aid::ALL`].
    pub name: String,
    /// One each ten minutes.
    pub points: Vec<Point>,
}

/// Time between points, s.
const POINT_S: f64 = 600.0;

/// An estimate at one time.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Point {
    /// s since the ship left.
    pub time_s: f64,
    /// Horizontal error, m.
    pub error_m: f64,
    /// Expected (DRMS), m.
    pub drms_m: f64,
}

/// Flies and filters one seed.
///
/// # Errors
/// A flight or a filter that fails.
pub fn run(world: World, seed: u64) -> anyhow::Result<Alone> {
    let scenario = world.scenario(seed)?;
    // The board ends a mission whose position is lost.
    let flight = flights::fly_with(&scenario, &[("app.lost_sigma_m".to_owned(), 1.0e5)])?;
    let declared = scenario.declared_vehicle();
    let truth = flight_score::truth_of(&flight);
    let of_board = flight.samples.iter().map(|sample| {
        let [sigma_x, sigma_y, ..] = sample.telemetry.sigma;
        Point { error_m: error_m(sample), drms_m: sigma_x.hypot(sigma_y), time_s: since_s(sample.truth.time_us) }
    });
    let mut rows = vec![row("board", of_board)];
    let dynamic = options(&declared, ProcessModel::Dynamic);
    let mut filters = vec![
        ("kinematic", options(&declared, ProcessModel::Kinematic), Aid::Nothing),
        ("nominal", dynamic, Aid::Nothing),
    ];
    let aids = if world.way == Way::Lawnmower { &Aid::ALL[..] } else { &Aid::ALL[..1] };
    for &aid in aids {
        let mut robust = dynamic;
        robust.navigation.make_robust();
        robust.use_dvl = aid == Aid::Dvl;
        filters.push((aid.name(), robust, aid));
    }
    for (name, options, aid) in filters {
        let log = aided(&flight, aid, seed);
        let run = filter::run(&log, &declared, &options).with_context(|| format!("{name}, seed {seed}"))?;
        let points = run.track.iter().filter_map(|sample| {
            let at = truth.at(sample.time_us)?;
            let error_m = (sample.state[X] - at.state[X]).hypot(sample.state[Y] - at.state[Y]);
            Some(Point { error_m, drms_m: sample.drms_m(), time_s: since_s(sample.time_us) })
        });
        rows.push(row(name, points));
    }
    let priors = [Prior::drawn(world.water), Prior::BOTH];
    let bounds_m = priors.map(|prior| bound(&flight.samples, &flight.log, prior));
    let alone = || flight.samples.iter().filter(|sample| since_s(sample.truth.time_us) >= 0.0);
    let speed_mps = |sample: &FlightSample| {
        let [.., u, v, w, _, _, _] = sample.truth.state;
        u.hypot(v).hypot(w)
    };
    // samples are a second apart
    let distance_m = alone().map(speed_mps).sum();
    let level_ratio =
        alone().map(|sample| error_m(sample) / f64::from(sample.telemetry.level_m[0])).fold(0.0, f64::max);
    Ok(Alone { distance_m, rows, bounds_m, level_ratio })
}

/// The board's horizontal error, m.
fn error_m(sample: &FlightSample) -> f64 {
    let ([x, y, ..], [true_x, true_y, ..]) = (sample.telemetry.state, sample.truth.state);
    (x - true_x).hypot(y - true_y)
}

/// The first point at or after every ten minutes.
fn row(name: &str, track: impl Iterator<Item = Point>) -> Row {
    let mut points: Vec<Point> = Vec::new();
    for point in track.filter(|point| point.time_s >= 0.0) {
        if point.time_s >= POINT_S * points.len() as f64 {
            points.push(point);
        }
    }
    Row { name: name.to_owned(), points }
}

fn options(declared: &VehicleFile, model: ProcessModel) -> FilterOptions {
    let mut options = FilterOptions::new(declared, model);
    options.ship = ShipSource::Packet;
    options.use_dvl = false;
    options.use_rates = false;
    options.use_range_rate = false;
    options
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alone::worlds::SHIP_LEAVES_S;

    #[test]
    fn a_point_each_ten_minutes_from_the_ships_leaving() {
        let track = (-5..1300).map(|time_s| Point { time_s: f64::from(time_s), ..Point::default() });
        let times: Vec<f64> = row("", track).points.iter().map(|point| point.time_s).collect();
        assert_eq!(times, [0.0, 600.0, 1200.0]);
        assert_eq!(since_s((SHIP_LEAVES_S * 1e6) as u64), 0.0);
    }
}
