//! One seed of one world: the flight, and the filters over its measurements.

use super::bound::{Prior, bound};
use super::worlds::{SHIP_LEAVES_S, Water, World};
use crate::flights;
use anyhow::Context;
use backseat_analysis::flight_score;
use backseat_core::navigation::ProcessModel;
use backseat_estimation::filter::{self, FilterOptions, ShipSource};
use backseat_logs::VehicleFile;
use backseat_logs::log::{Column, Log, LogRow};
use backseat_core::state::{X, Y};
use hil_sim::flight::{FlightLog, FlightSample};
use hil_sim::rng::{Source, Stream};
use serde::{Deserialize, Serialize};

/// Stored result of a seed.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Alone {
    /// How far it went through the water since the ship left, m.
    pub distance_m: f64,
    /// Each estimate, by its name.
    pub rows: Vec<(String, Vec<Point>)>,
    /// The bound for the water as drawn, and for both a mean current and a tide, m, at the times of the points.
    pub bounds_m: Vec<[f64; 2]>,
    /// Largest horizontal error over the protection level.
    pub level_ratio: f64,
}

/// Times between points, s.
pub const POINT_S: u64 = 600;

/// An estimate at one time.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Point {
    /// s since the ship left.
    pub time_s: f64,
    /// North and east, m.
    pub error_m: [f64; 2],
    /// Expected (DRMS), m.
    pub drms_m: f64,
}

impl Point {
    /// Horizontal error, m.
    pub fn error(&self) -> f64 {
        self.error_m[0].hypot(self.error_m[1])
    }
}

/// What is measured after the ship has left.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Aid {
    Nothing,
    /// Bottom track for the first minute of each hour.
    Dvl,
    /// A range at each hour, to a ship 300 m away, at a bearing that turns by a quarter each time.
    Range,
    /// Fixes of a minute at these hours and halves of hours.
    Fixes(&'static [f64]),
}

const AIDS: [(&str, Aid); 5] = [
    ("robust", Aid::Nothing),
    ("DVL", Aid::Dvl),
    ("range", Aid::Range),
    ("fix-2.5h", Aid::Fixes(&[2.5])),
    ("fix-1h", Aid::Fixes(&[1.0, 2.0, 3.0, 4.0])),
];

/// Flies and filters one seed.
pub fn run(world: &World, seed: u64) -> anyhow::Result<Alone> {
    let scenario = world.scenario(seed)?;
    // The board ends a mission whose position is lost.
    let flight = flights::fly_with(&scenario, &[("app.lost_sigma_m".to_owned(), 1.0e5)])?;
    let declared = scenario.declared_vehicle();
    let mut out = Alone::default();
    let alone = || flight.samples.iter().filter(|sample| is_due(sample.truth.time_us));
    let of_board = alone().map(|sample| {
        let (estimate, truth) = (&sample.telemetry, &sample.truth);
        point(truth.time_us, [0, 1].map(|i| estimate.state[i] - truth.state[i]), estimate.sigma[0].hypot(estimate.sigma[1]))
    });
    out.rows.push(("board".to_owned(), of_board.collect()));
    out.level_ratio = level_ratio(&flight.samples);
    out.distance_m = distance_m(&flight.samples);
    let truth = flight_score::truth_of(&flight);
    let mut filters = vec![("kinematic", options(&declared, ProcessModel::Kinematic), Aid::Nothing), ("nominal", options(&declared, ProcessModel::Dynamic), Aid::Nothing)];
    for (name, aid) in AIDS {
        let mut robust = options(&declared, ProcessModel::Dynamic);
        robust.navigation.make_robust();
        robust.use_dvl = aid == Aid::Dvl;
        filters.push((name, robust, aid));
    }
    for (name, options, aid) in filters {
        let log = aided(&flight, aid, seed);
        let run = filter::run(&log, &declared, &options).with_context(|| format!("{name}, seed {seed}"))?;
        let due = run.track.iter().filter(|sample| is_due(sample.time_us));
        let points = due.filter_map(|sample| {
            let at = truth.at(sample.time_us)?;
            Some(point(sample.time_us, [X, Y].map(|i| sample.state[i] - at.state[i]), sample.drms_m()))
        });
        out.rows.push((name.to_owned(), points.collect()));
        if std::env::var_os("ALONE_DEBUG").is_some() {
            eprintln!("{name}: weights {:?} rate {:.0}", run.weights, flight.simulated_s / run.wall.as_secs_f64());
            for s in run.track.iter().filter(|s| is_due(s.time_us)).step_by(3) { 
                let at = truth.at(s.time_us).unwrap();
                eprintln!("   {:6.0} err {:8.1} {:8.1} drms {:7.1} cur {:7.4} {:7.4} true {:7.4} {:7.4}  u {:.4} {:.4} psi err {:.4}", s.time_us as f64*1e-6, s.state[X]-at.state[X], s.state[Y]-at.state[Y], s.drms_m(), s.current_mps[0], s.current_mps[1], at.current_mps[0], at.current_mps[1], s.state[6], at.state[6], s.state[5]-at.state[5]);
            }
            for e in &run.estimates { eprintln!("   {e:?}"); }
        }
    }
    let priors = [Prior::drawn(world.water), Prior::both()];
    let [drawn, both] = priors.map(|prior| bound(&flight.samples, &flight.log, prior));
    let bounds = flight.samples.iter().zip(drawn.into_iter().zip(both)).filter(|(sample, _)| is_due(sample.truth.time_us));
    out.bounds_m = bounds.map(|(_, (drawn, both))| [drawn, both]).collect();
    let _ = Water::Tide;
    Ok(out)
}

fn is_due(time_us: u64) -> bool {
    time_us as f64 * 1e-6 >= SHIP_LEAVES_S && time_us.is_multiple_of(POINT_S * 1_000_000)
}

fn point(time_us: u64, error_m: [f64; 2], drms_m: f64) -> Point {
    Point { time_s: time_us as f64 * 1e-6 - SHIP_LEAVES_S, error_m, drms_m }
}

fn is_alone(sample: &FlightSample) -> bool {
    sample.truth.time_us as f64 * 1e-6 >= SHIP_LEAVES_S
}

fn level_ratio(samples: &[FlightSample]) -> f64 {
    let ratios = samples.iter().filter(|sample| is_alone(sample)).map(|sample| {
        let (estimate, truth) = (&sample.telemetry, &sample.truth.state);
        (estimate.state[0] - truth[0]).hypot(estimate.state[1] - truth[1]) / f64::from(estimate.level_m[0])
    });
    ratios.fold(0.0, f64::max)
}

fn distance_m(samples: &[FlightSample]) -> f64 {
    let speed = |sample: &FlightSample| {
        let [.., u, v, w, _, _, _] = sample.truth.state;
        u.hypot(v).hypot(w)
    };
    samples.iter().filter(|sample| is_alone(sample)).map(speed).sum()
}

/// The log of a flight with what an aid measures, as if it had been there: the vehicle flies as it did without.
fn aided(flight: &FlightLog, aid: Aid, seed: u64) -> Log {
    let mut log = flight.log.clone();
    let since_s = |time_us: u64| time_us as f64 * 1e-6 - SHIP_LEAVES_S;
    let mut random = Stream::new(seed, Source::Study);
    let in_minute = |time_s: f64, from_s: f64| (from_s..from_s + 60.0).contains(&time_s);
    for row in &mut log.rows {
        let time_s = since_s(row.time_us);
        if aid != Aid::Dvl || time_s < 3600.0 || !in_minute(time_s.rem_euclid(3600.0), 0.0) {
            row.set_all(Column::DvlU, &[f64::NAN; 3]);
        }
    }
    let due = flight.samples.iter().map(|sample| (since_s(sample.truth.time_us), sample));
    let mut more = Vec::new();
    for (time_s, sample) in due {
        let [north, east, down, ..] = sample.truth.state;
        let mut row = LogRow::new(sample.truth.time_us);
        match aid {
            Aid::Range if time_s > 0.0 && time_s.rem_euclid(3600.0) < 0.5 => {
                let (sin, cos) = libm::sincos(std::f64::consts::FRAC_PI_2 * (time_s / 3600.0).round());
                let ship = [north + 300.0 * cos, east + 300.0 * sin];
                let range_m = 300.0_f64.hypot(down) + random.normal();
                let toa_s = sample.truth.time_us as f64 * 1e-6;
                row.set(Column::Range, range_m).set(Column::Tol, toa_s - range_m / 1500.0).set(Column::Toa, toa_s).set_all(Column::ShipX, &ship);
            }
            Aid::Fixes(hours) if hours.iter().any(|hour| in_minute(time_s, 3600.0 * hour)) => {
                let [a, b] = random.normals::<2>(1.5);
                row.set_all(Column::GpsX, &[north + a, east + b]);
            }
            _ => continue,
        }
        more.push(row);
    }
    log.rows.extend(more);
    log.rows.sort_by_key(|row| row.time_us);
    log
}

fn options(declared: &VehicleFile, model: ProcessModel) -> FilterOptions {
    let mut options = FilterOptions::new(declared, model);
    options.ship = ShipSource::Packet;
    options.use_dvl = false;
    options.use_rates = false;
    options.use_range_rate = false;
    options
}
