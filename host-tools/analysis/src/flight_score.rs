//! A flight judged: the backseat's own estimate, and the same measurements through other filters.

use crate::track_score::TrackScore;
use crate::undeclared::undeclared;
use backseat_core::navigation::{ProcessModel, Sensor};
use backseat_estimation::dead_reckoning;
use backseat_estimation::filter::{self, FilterOptions, FilterRun};
use backseat_link::ReportedFusion;
use backseat_logs::stats::ErrorSummary;
use backseat_logs::{DataError, Log, Truth, TruthRow, VehicleFile};
use hil_sim::flight::FlightLog;
use hil_sim::scenario::Scenario;
use std::collections::BTreeMap;

/// Mean normalised innovation squared of one sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Nis {
    /// Sum over the scalars fused.
    pub sum: f64,
    /// Scalars fused.
    pub count: u64,
    /// Scalars rejected.
    pub rejected: u64,
}

impl Nis {
    /// The mean; 1 if consistent.
    pub fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }
}

/// Per sensor, by its name.
pub type NisBySensor = BTreeMap<&'static str, Nis>;

/// An estimate at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Time, µs.
    pub time_us: u64,
    /// North, east, m.
    pub position_m: [f64; 2],
    /// Covariance xx, xy, yy, m²; `None` for a method without one.
    pub covariance_m2: Option<[f64; 3]>,
    /// Distance from the true position, m.
    pub error_m: f64,
}

/// One way to navigate, judged.
#[derive(Clone, Debug)]
pub struct Configuration {
    /// Name in tables.
    pub name: &'static str,
    /// Once a second.
    pub track: Vec<Estimate>,
    /// Horizontal error.
    pub error: ErrorSummary,
    /// The filter's own root of the mean summed variance of x and y, m.
    pub drms_m: Option<f64>,
    /// Consistency per sensor.
    pub nis: NisBySensor,
}

impl Configuration {
    /// Root mean square of the error over the filter's own DRMS: above 1, the filter is overconfident.
    pub fn rms_over_drms(&self) -> Option<f64> {
        self.drms_m.map(|drms_m| self.error.rms_m / drms_m)
    }

    fn new(name: &'static str, track: Vec<Estimate>, nis: NisBySensor) -> Option<Self> {
        let errors: Vec<f64> = track.iter().map(|estimate| estimate.error_m).collect();
        let variances: Option<Vec<f64>> =
            track.iter().map(|estimate| estimate.covariance_m2.map(|[xx, _, yy]| xx + yy)).collect();
        let drms_m = variances.and_then(|v| backseat_logs::stats::mean(&v)).map(f64::sqrt);
        Some(Self { name, error: ErrorSummary::of(&errors)?, track, drms_m, nis })
    }
}

/// The whole judgement.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The backseat first, then the comparisons that the measurements allow.
    pub configurations: Vec<Configuration>,
    /// The true track against the mission's lines.
    pub track: Option<TrackScore>,
    /// Truth at 1 Hz.
    pub truth: Truth,
}

/// Judges a flight.
///
/// # Errors
/// If a comparison cannot run on its measurements at all.
pub fn analyse(scenario: &Scenario, flight: &FlightLog) -> Result<Analysis, DataError> {
    let truth = truth_of(flight);
    let track = track_of(scenario, flight);
    let mut configurations: Vec<Configuration> = backseat(backseat_name(scenario), flight).into_iter().collect();
    let comparisons: [(&'static str, ProcessModel, bool); 3] = [
        ("dynamic, no DVL, centralized", ProcessModel::Dynamic, false),
        ("kinematic, no DVL", ProcessModel::Kinematic, false),
        ("kinematic + DVL", ProcessModel::Kinematic, true),
    ];
    for (name, model, use_dvl) in comparisons {
        let mut options = FilterOptions::new(&scenario.vehicle, model);
        options.use_dvl = use_dvl;
        if scenario.settings.backseat.current_state && model == ProcessModel::Dynamic {
            options.navigation.effect_states = FilterOptions::water_current();
        }
        let run = filter::run(&flight.log, &scenario.vehicle, &options)?;
        configurations.extend(of_run(name, &run, &truth));
    }
    let robust = |vehicle: &VehicleFile| FilterOptions { use_dvl: false, ..FilterOptions::robust(vehicle) };
    let run = filter::run(&flight.log, &scenario.vehicle, &robust(&scenario.vehicle))?;
    configurations.extend(of_run("robust, no DVL: exact", &run, &truth));
    let (log, moved, declared) = undeclared(scenario, flight, &truth);
    let run = filter::run(&log, &declared, &robust(&declared))?;
    configurations.extend(of_run("robust, no DVL: 10 % wrong + current + heading undeclared", &run, &moved));
    configurations.extend(compass_and_dvl(&flight.log, &truth));
    Ok(Analysis { configurations, track, truth })
}

/// The true track against the mission's lines.
#[must_use]
pub fn track_of(scenario: &Scenario, flight: &FlightLog) -> Option<TrackScore> {
    let places = flight.samples.iter().map(|sample| {
        let [x, y, z, ..] = sample.truth.state;
        [x, y, z]
    });
    TrackScore::of(places, &scenario.settings.lines())
}

/// The truth of a flight as a table.
#[must_use]
pub fn truth_of(flight: &FlightLog) -> Truth {
    let rows = flight.samples.iter().map(|sample| TruthRow {
        time_us: sample.truth.time_us,
        state: sample.truth.state.into(),
        current_mps: sample.truth.current_mps,
    });
    Truth { rows: rows.collect(), notes: Vec::new() }
}

/// The backseat as tables name it.
fn backseat_name(scenario: &Scenario) -> &'static str {
    if scenario.settings.backseat.dvl {
        "backseat: dynamic + DVL, packets"
    } else {
        "backseat: dynamic, no DVL, packets"
    }
}

/// What the backseat itself reported, from its first fix on.
#[must_use]
pub fn backseat(name: &'static str, flight: &FlightLog) -> Option<Configuration> {
    let known = flight.samples.iter().filter(|sample| sample.telemetry.sigma[0] > 0.0);
    let track = known.map(|sample| {
        let telemetry = &sample.telemetry;
        let [x, y, ..] = telemetry.state;
        let [true_x, true_y, ..] = sample.truth.state;
        Estimate {
            time_us: telemetry.time_us,
            position_m: [x, y],
            covariance_m2: Some([telemetry.sigma[0].powi(2), telemetry.cov_xy_m2, telemetry.sigma[1].powi(2)]),
            error_m: (x - true_x).hypot(y - true_y),
        }
    });
    Configuration::new(name, track.collect(), nis_of(&flight.fusions))
}

fn nis_of(fusions: &[ReportedFusion]) -> NisBySensor {
    let mut nis = NisBySensor::new();
    for record in fusions {
        let entry = nis.entry(record.sensor.name()).or_default();
        if record.fused {
            entry.sum += record.innovation.powi(2) / record.variance;
            entry.count += 1;
        } else {
            entry.rejected += 1;
        }
    }
    nis
}

/// Judges a filter's run over a log.
#[must_use]
pub fn of_run(name: &'static str, run: &FilterRun, truth: &Truth) -> Option<Configuration> {
    let track = run.track.iter().filter_map(|sample| {
        let at = truth.at(sample.time_us)?;
        let (x, y) = (sample.state[0], sample.state[1]);
        Some(Estimate {
            time_us: sample.time_us,
            position_m: [x, y],
            covariance_m2: Some([sample.sigma[0].powi(2), sample.cov_xy_m2, sample.sigma[1].powi(2)]),
            error_m: (x - at.state[0]).hypot(y - at.state[1]),
        })
    });
    let sensors = run.sensors.iter().map(|summary| {
        let count = summary.fused;
        let sum = summary.nis.unwrap_or(0.0) * count as f64;
        (summary.sensor.name(), Nis { sum, count, rejected: summary.rejected })
    });
    Configuration::new(name, track.collect(), sensors.collect())
}

fn compass_and_dvl(log: &Log, truth: &Truth) -> Option<Configuration> {
    let positions =
        dead_reckoning::run(log, dead_reckoning::Method::CompassDvl, &backseat_core::effects::EffectSet::NONE).ok()?;
    let mut track: Vec<Estimate> = Vec::new();
    for position in positions {
        // The truth stands at whole seconds; the DVL's next sample is less than its period away.
        let due_us = track.last().map_or(0, |last| last.time_us + 1_000_000);
        if position.time_us < due_us {
            continue;
        }
        let Some(at) = truth.at(position.time_us) else { continue };
        let [x, y] = position.position_m;
        track.push(Estimate {
            time_us: position.time_us,
            position_m: [x, y],
            covariance_m2: None,
            error_m: (x - at.state[0]).hypot(y - at.state[1]),
        });
    }
    Configuration::new("compass + DVL dead reckoning", track, NisBySensor::new())
}

/// Sensors in the order of tables.
#[must_use]
pub fn sensor_names(configurations: &[Configuration]) -> Vec<&'static str> {
    let present = |sensor: &Sensor| configurations.iter().any(|c| c.nis.contains_key(sensor.name()));
    Sensor::ALL.iter().filter(|sensor| present(sensor)).map(|sensor| sensor.name()).collect()
}
