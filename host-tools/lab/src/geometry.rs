//! `cargo lab geometry`: where the ship is, against the error of the vehicle's position and its observability.

use crate::ensemble::{PageArgs, PartArgs, SeedArgs, all_runs};
use crate::flights;
use crate::store::{Key, nan, version};
use crate::wrap::wrapped;
use backseat_analysis::flight_score;
use backseat_core::navigation::ProcessModel;
use backseat_estimation::filter::{self, FilterOptions};
use backseat_logs::Truth;
use backseat_logs::stats::{ErrorSummary, mean, median};
use backseat_report::markdown::markdown_table;
use hil_sim::flight::FlightLog;
use hil_sim::scenario::{Scenario, Ship, ShipTrack};
use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write as _;

/// Command line.
#[derive(clap::Args, Clone, Debug)]
pub struct Args {
    #[command(flatten)]
    ensemble: SeedArgs,
    /// End each mission after this simulated time
    #[arg(long, default_value_t = MINUTES)]
    minutes: f64,
    #[command(flatten)]
    page: PageArgs,
    #[command(flatten)]
    part: PartArgs,
}

/// Time over which position information is added up, s.
const WINDOW_S: f64 = 600.0;
/// Flights end here unless asked otherwise: four of the ten lines.
const MINUTES: f64 = 80.0;

/// Name and ship. Lines run north and south, from (0, 0) to (1000, 900) m; the centre is (500, 450).
fn geometries() -> Vec<(&'static str, Ship)> {
    let base = Ship::default();
    let station = Ship { track: ShipTrack::Station, ..base };
    let swing = Ship { wander_m: 10.0, wander_period_s: 900.0, ..station };
    vec![
        ("circle of 600 m about the survey, 2 m/s", base),
        ("circle of 300 m about the survey, 0.77 m/s", Ship { radius_m: 300.0, speed_mps: 0.77, ..base }),
        (
            "line of 1 km across the vehicle's, 1 m/s",
            Ship {
                track: ShipTrack::Line,
                centre_m: [500.0, 0.0],
                radius_m: 1.0e-3,
                course_rad: FRAC_PI_2,
                speed_mps: 1.0,
                ..base
            },
        ),
        (
            "line of 1 km beside the vehicle's, 300 m off, 1 m/s",
            Ship { track: ShipTrack::Line, centre_m: [0.0, -300.0], radius_m: 1.0e-3, speed_mps: 1.0, ..base },
        ),
        (
            "drifting east through the survey, 0.3 m/s",
            Ship {
                track: ShipTrack::Drift,
                centre_m: [500.0, -300.0],
                radius_m: 1.0e-3,
                course_rad: FRAC_PI_2,
                speed_mps: 0.3,
                ..base
            },
        ),
        ("keeping station in the middle", Ship { radius_m: 1.0e-3, ..station }),
        ("keeping station 700 m west of the middle", Ship { radius_m: 700.0, bearing_rad: -FRAC_PI_2, ..station }),
        ("moored buoy 700 m south of the middle, 10 m of swing", Ship { radius_m: 700.0, bearing_rad: PI, ..swing }),
        ("moored buoy 2 km south of the middle, 10 m of swing", Ship { radius_m: 2000.0, bearing_rad: PI, ..swing }),
    ]
}

/// Filters over the measurements of each flight.
const FILTERS: [(&str, ProcessModel, bool); 3] = [
    ("dynamic, no DVL", ProcessModel::Dynamic, false),
    ("kinematic + DVL", ProcessModel::Kinematic, true),
    ("kinematic, no DVL", ProcessModel::Kinematic, false),
];

/// One flight.
#[derive(Clone, Serialize, Deserialize)]
struct GeometryFlight {
    /// Smallest eigenvalue of the position information over ten minutes, 1/m²: median and least of the flight.
    #[serde(deserialize_with = "nan::many")]
    information: [f64; 2],
    /// Median, 95 % and RMS over own DRMS of each filter; none of one that failed.
    errors: [Option<[f64; 3]>; FILTERS.len()],
}

/// Flies, and shows the measurements to the filters.
fn fly(ship: &Ship, seed: u64, minutes: f64) -> anyhow::Result<GeometryFlight> {
    let mut scenario = Scenario::built_in("survey")?;
    let settings = &mut scenario.settings;
    settings.seed = seed;
    settings.duration_s = settings.duration_s.min(60.0 * minutes);
    settings.ship = *ship;
    // Steered with a DVL, so that the vehicle keeps its lines whatever the ship does.
    settings.backseat.robust = false;
    settings.backseat.dvl = true;
    let flight = flights::fly(&scenario)?;
    let truth = flight_score::truth_of(&flight);
    let information = information(&flight, &scenario);
    let errors = FILTERS.map(|(_, model, use_dvl)| {
        let options = FilterOptions {
            use_dvl,
            use_rates: false,
            use_range_rate: false,
            ..FilterOptions::new(&scenario.vehicle, model)
        };
        error(&flight, &truth, &scenario, &options)
    });
    Ok(GeometryFlight { information, errors })
}

fn error(flight: &FlightLog, truth: &Truth, scenario: &Scenario, options: &FilterOptions) -> Option<[f64; 3]> {
    let run = filter::run(&flight.log, &scenario.vehicle, options).ok()?;
    let errors = run.track.iter().filter_map(|s| truth.horizontal_error_m(s.time_us, s.state[0], s.state[1]));
    let summary = ErrorSummary::of(&errors.collect::<Vec<f64>>())?;
    let variances: Vec<f64> = run.track.iter().map(|sample| sample.drms_m().powi(2)).collect();
    Some([summary.median_m, summary.p95_m, summary.rms_m / mean(&variances)?.sqrt()])
}

/// Smallest eigenvalue of what ten minutes of ranges say of the position at their beginning, the way between them
/// known: Σ u uᵀ / σ², u the unit vector from the ship to the vehicle. Median and least over the flight, 1/m².
fn information(flight: &FlightLog, scenario: &Scenario) -> [f64; 2] {
    let period_s = f64::from(scenario.settings.acoustics.period_s.get());
    let in_window = (WINDOW_S / period_s) as usize;
    let variance = scenario.vehicle.sensors.range_m.powi(2);
    let smallest = flight.packets.windows(in_window).map(|packets| {
        let sum: Matrix2<f64> = packets.iter().map(|([vx, vy], [sx, sy])| towards([vx - sx, vy - sy])).sum();
        (sum / variance).symmetric_eigenvalues().min()
    });
    let smallest: Vec<f64> = smallest.collect();
    [median(&smallest).unwrap_or(f64::NAN), smallest.iter().copied().reduce(f64::min).unwrap_or(f64::NAN)]
}

/// u uᵀ of a direction.
fn towards([x, y]: [f64; 2]) -> Matrix2<f64> {
    let u = Vector2::new(x, y).normalize();
    u * u.transpose()
}

/// Runs the study.
///
/// # Errors
/// A flight that fails; a page that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let geometries = geometries();
    let minutes = args.minutes;
    let jobs: Vec<(Key, &Ship)> = geometries
        .iter()
        .flat_map(|(name, ship)| args.ensemble.seeds().map(move |seed| (((*name).to_owned(), seed), ship)))
        .collect();
    let version = version("geometry", &format!("{minutes} min"))?;
    let flown = all_runs("geometry", &args.part, version, &jobs, |seed, ship| fly(ship, seed, minutes))?;
    let Some(flown) = flown else { return Ok(()) };
    let rows: Vec<(&str, &[GeometryFlight])> =
        geometries.iter().map(|(name, _)| *name).zip(flown.chunks(flown.len() / geometries.len())).collect();
    args.page.show(&page(&rows, args, minutes))
}

fn median_of(runs: &[GeometryFlight], value: impl Fn(&GeometryFlight) -> Option<f64>) -> f64 {
    median(&runs.iter().filter_map(value).collect::<Vec<f64>>()).unwrap_or(f64::NAN)
}

fn page(rows: &[(&str, &[GeometryFlight])], args: &Args, minutes: f64) -> String {
    let header = ["ship", "smallest eigenvalue [1/m²], median", "least", "as sigma [m]"];
    let mut table = markdown_table(header.into_iter().chain(FILTERS.map(|(name, ..)| name)));
    for (name, runs) in rows {
        let [usual, least] = [0, 1].map(|i| median_of(runs, |flown| Some(flown.information[i])));
        let mut cells = vec![(*name).to_owned(), format!("{usual:.3}"), format!("{least:.4}")];
        cells.push(format!("{:.2}", 1.0 / usual.sqrt()));
        for filter in 0..FILTERS.len() {
            let [middle, p95, ratio] = [0, 1, 2].map(|i| median_of(runs, |f| f.errors[filter].map(|e| e[i])));
            cells.push(format!("{middle:.2} / {p95:.2} / {ratio:.1}"));
        }
        table.add_row(cells);
    }
    let mut out = String::from("# Geometry of ship and vehicle\n\n");
    let seeds = args.ensemble.seeds();
    let _ = writeln!(
        out,
        "Made by `cargo lab geometry --runs {} --first-seed {} --minutes {minutes}` (version {}): the default survey's first {minutes:.0} minutes, \
         seeds {} to {}, a one-way range of 1 m every 30 s without range rate, attitude of 1 degree without rates, still water; \
         the vehicle steered with a DVL, its measurements through each filter. Medians over the flights.\n",
        seeds.end - seeds.start,
        seeds.start,
        env!("CARGO_PKG_VERSION"),
        seeds.start,
        seeds.end - 1,
    );
    let _ = writeln!(
        out,
        "Observability is the smallest eigenvalue of what ten minutes of ranges say of the position at their beginning, the way in \
         between known: Σ u uᵀ / σ², u the unit vector from ship to vehicle. As sigma: its inverse root, the accuracy of the \
         worst direction without any other knowledge. Each filter's column: median / 95 % of the horizontal error in metres / RMS \
         over the filter's own DRMS, which is above 1 where the filter believes too much. Every flight starts from a fix in still \
         water with right parameters: what an hour of dead reckoning on the dynamic model or a DVL drifts is less than what even \
         the poor geometries leave open.\n"
    );
    let _ = writeln!(out, "{table}");
    wrapped(&out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_information_is_of_the_directions() {
        // Two ranges at right angles of 2 m: 1/4 in each direction. Two in one direction: nothing across it.
        let scenario = |period_s: u32| {
            let mut scenario = Scenario::built_in("survey").unwrap();
            scenario.vehicle.sensors.range_m = 2.0;
            scenario.settings.acoustics.period_s = period_s.try_into().unwrap();
            scenario
        };
        let flight = |packets| FlightLog { packets, ..FlightLog::default() };
        let across = flight(vec![([10.0, 0.0], [0.0; 2]), ([0.0, 7.0], [0.0; 2])]);
        let along = flight(vec![([10.0, 0.0], [0.0; 2]), ([30.0, 0.0], [0.0; 2])]);
        assert!((information(&across, &scenario(300))[0] - 0.25).abs() < 1e-12);
        assert!(information(&along, &scenario(300))[0].abs() < 1e-12);
    }
}
