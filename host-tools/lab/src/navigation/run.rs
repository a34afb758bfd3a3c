//! One seed of one case: a flight in closed loop, and the filters over its measurements.

use super::cases::MissionCase;
use super::filters;
use crate::flights;
use anyhow::Context;
use backseat_analysis::flight_score;
use backseat_core::navigation::Learnt;
use backseat_core::state::{X, Y};
use backseat_estimation::filter::{self, FilterRun, TrackSample};
use backseat_link::board::mode_reason;
use backseat_logs::Truth;
use backseat_logs::stats::ErrorSummary;
use hil_sim::ending::Ending;
use hil_sim::flight::FlightLog;
use hil_sim::scenario::Scenario;
use serde::{Deserialize, Serialize};

/// Stored results of a seed: each row of the table.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct MissionRun {
    /// Name and figures, in the order of the table.
    pub rows: Vec<(String, EstimateScore)>,
    /// Flights that did not fly their mission to its end: which, how they ended and why.
    #[serde(default)]
    pub cut_short: Vec<String>,
}

/// One estimate against the truth.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct EstimateScore {
    /// Median of the horizontal error, m.
    pub median_m: f64,
    /// 95th percentile, m.
    pub p95_m: f64,
    /// Largest, m.
    pub max_m: f64,
    /// Root mean square, m.
    pub rms_m: f64,
    /// Expected by the filter (DRMS), m; none without a covariance.
    pub drms_m: Option<f64>,
    /// Mean of eᵀ P⁻¹ e / 2 of the position: 1 if the covariance is right.
    pub anees: Option<f64>,
    /// Scalars fused. All measurements are good ones.
    pub fused: u64,
    /// Scalars refused.
    pub refused: u64,
}

/// An estimate against the truth at one time.
struct PositionError {
    error_m: [f64; 2],
    /// xx, xy, yy, m².
    covariance_m2: [f64; 3],
}

impl EstimateScore {
    fn of(samples: &[PositionError], fused: u64, refused: u64) -> Option<Self> {
        let errors: Vec<f64> = samples.iter().map(|s| s.error_m[0].hypot(s.error_m[1])).collect();
        let count = samples.len() as f64;
        let variance = samples.iter().map(|s| s.covariance_m2[0] + s.covariance_m2[2]).sum::<f64>() / count;
        let nees = |s: &PositionError| {
            let ([x, y], [xx, xy, yy]) = (s.error_m, s.covariance_m2);
            (x * x * yy - 2.0 * x * y * xy + y * y * xx) / (xx * yy - xy * xy)
        };
        let anees = samples.iter().map(nees).sum::<f64>() / (2.0 * count);
        Some(Self {
            drms_m: Some(variance.sqrt()),
            anees: Some(anees),
            fused,
            refused,
            ..ErrorSummary::of(&errors)?.into()
        })
    }
}

impl From<ErrorSummary> for EstimateScore {
    fn from(error: ErrorSummary) -> Self {
        let ErrorSummary { median_m, p95_m, max_m, rms_m, .. } = error;
        Self { median_m, p95_m, max_m, rms_m, ..Self::default() }
    }
}

/// Flies and filters one seed.
///
/// # Errors
/// A flight or a filter that fails.
pub fn run(case: &MissionCase, seed: u64, minutes: Option<f64>) -> anyhow::Result<MissionRun> {
    let mut scenario = case.scenario(seed, minutes)?;
    if case.is_second_dive {
        let learnt = learnt_in(&scenario, case)?;
        scenario = case.second_dive(seed, minutes)?;
        scenario.vehicle.learnt = learnt;
    }
    let mut out = MissionRun::default();
    let flight = out.fly("closed loop", &scenario)?;
    let truth = flight_score::truth_of(&flight);
    let declared = scenario.declared_vehicle();
    out.add("closed loop", of_flight(&flight, case.from_s));
    let steered = flight_score::track_of(&scenario, &flight).map(|track| track.cross_track.into());
    out.add("closed loop, true cross-track error", steered);
    for (name, options) in filters::filters(case, &declared) {
        let run = filter::run(&flight.log, &declared, &options).with_context(|| format!("{name}, seed {seed}"))?;
        out.add(name, of_track(&run, &run.track, &truth, case.from_s));
        if let Some(smoothed) = &run.smoothed {
            out.add(&format!("{name} + smooth"), of_track(&run, smoothed, &truth, case.from_s));
        }
    }
    if case.is_declared {
        let quiet = out.fly("flight without noise", &without_sensor_noise(&scenario))?;
        let truth = flight_score::truth_of(&quiet);
        for (name, options) in filters::bounds(case, &declared) {
            let run = filter::run(&quiet.log, &declared, &options).with_context(|| format!("{name}, seed {seed}"))?;
            out.add(name, of_track(&run, &run.track, &truth, case.from_s));
        }
    }
    Ok(out)
}

/// What a dive teaches of the vehicle.
fn learnt_in(scenario: &Scenario, case: &MissionCase) -> anyhow::Result<Learnt> {
    let flight = flights::fly(scenario)?;
    let declared = scenario.declared_vehicle();
    let run = filter::run(&flight.log, &declared, &filters::robust(case, &declared))?;
    run.learnt.map(|learnt| *learnt).context("the first dive teaches nothing: it is too short")
}

impl MissionRun {
    /// A flight; if it was cut short, that is kept.
    fn fly(&mut self, name: &str, scenario: &Scenario) -> anyhow::Result<FlightLog> {
        let flight = flights::fly(scenario)?;
        let ending = Ending::of(scenario, &flight);
        if !matches!(ending, Ending::Flown | Ending::Unfinished) {
            let stop = flight.modes.last();
            let why = stop.map_or(String::new(), |stop| {
                format!(", {} at {:.0} s", mode_reason(stop.reason), stop.time_us as f64 * 1e-6)
            });
            self.cut_short.push(format!("{name}: {}{why}", ending.name()));
        }
        Ok(flight)
    }

    fn add(&mut self, name: &str, measured: Option<EstimateScore>) {
        if let Some(measured) = measured {
            self.rows.push((name.to_owned(), measured));
        }
    }
}

fn without_sensor_noise(scenario: &Scenario) -> Scenario {
    let mut quiet = scenario.clone();
    let sensors = &mut quiet.settings.sensors;
    sensors.depth.sigma_m = Some(0.0);
    sensors.ahrs.attitude_sigma_rad = Some(0.0);
    sensors.ahrs.rates_sigma_radps = Some(0.0);
    sensors.dvl.sigma_mps = Some(0.0);
    sensors.gnss.sigma_m = Some(0.0);
    sensors.ship_gnss.sigma_m = Some(0.0);
    quiet.settings.acoustics.range_sigma_m = Some(0.0);
    quiet.settings.acoustics.range_rate_sigma_mps = Some(0.0);
    quiet
}

/// Estimates that the backseat reported in flight.
fn of_flight(flight: &FlightLog, from_s: f64) -> Option<EstimateScore> {
    let known = flight
        .samples
        .iter()
        .filter(|sample| sample.telemetry.sigma[0] > 0.0 && sample.truth.time_us as f64 * 1e-6 >= from_s);
    let samples: Vec<PositionError> = known
        .map(|sample| {
            let (estimate, truth) = (&sample.telemetry, &sample.truth.state);
            PositionError {
                error_m: [estimate.state[0] - truth[0], estimate.state[1] - truth[1]],
                covariance_m2: [estimate.sigma[0].powi(2), estimate.cov_xy_m2, estimate.sigma[1].powi(2)],
            }
        })
        .collect();
    let fused = flight.fusions.iter().filter(|record| record.fused).count() as u64;
    EstimateScore::of(&samples, fused, flight.fusions.len() as u64 - fused)
}

fn of_track(run: &FilterRun, track: &[TrackSample], truth: &Truth, from_s: f64) -> Option<EstimateScore> {
    let due = track.iter().filter(|sample| sample.time_us as f64 * 1e-6 >= from_s);
    let samples: Vec<PositionError> = due
        .filter_map(|sample| {
            let at = truth.at(sample.time_us)?;
            Some(PositionError {
                error_m: [sample.state[X] - at.state[X], sample.state[Y] - at.state[Y]],
                covariance_m2: [sample.sigma[X].powi(2), sample.cov_xy_m2, sample.sigma[Y].powi(2)],
            })
        })
        .collect();
    let count = |of: fn(&filter::SensorSummary) -> u64| run.sensors.iter().map(of).sum();
    EstimateScore::of(&samples, count(|sensor| sensor.fused), count(|sensor| sensor.rejected))
}
