//! One survey flown a seed, its measurements through every filter of chapters 2 and 3.

use super::Measured;
use super::Study;
use super::steering::{self, Flown};
use anyhow::Context;
use backseat_core::navigation::{InitialState, ProcessModel};
use backseat_core::state::{U, V, VehicleState, X, Y};
use backseat_data::dead_reckoning::{self, Method};
use backseat_data::filter::{self, FilterOptions, FilterRun, Start};
use backseat_data::stats::{ErrorSummary, mean, percentile};
use backseat_data::{Column, Log, Truth, VehicleFile};
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::perturbed;

/// The survey under every filter.
pub const SURVEY: Study = Study { name: "survey", run };

/// Standard deviation of the initial position in 2.6.2, and how far off it is, m.
const OFF_M: f64 = 150.0;
/// Standard deviation of the coarse ranges of 2.6.2, m.
const COARSE_RANGE_M: f64 = 20.0;
/// Converged: within this of the truth from then on, m.
const CONVERGED_M: f64 = 10.0;
/// Where the vehicle is under way and deep: between these depths there is no fix and no surface, m.
const SUBMERGED_M: f64 = 2.0;
/// Time between points of a curve, s.
const CURVE_S: usize = 60;

fn run(seed: u64) -> anyhow::Result<Measured> {
    let Flown { scenario, flight, truth } = steering::fly(seed, &steering::LQR_DYNAMIC)?;
    let vehicle = &scenario.vehicle;
    let mut study = Survey { log: &flight.log, truth: &truth, measured: Measured::default() };

    let dynamic = options(vehicle, ProcessModel::Dynamic, false);
    let kinematic = options(vehicle, ProcessModel::Kinematic, false);
    let with_dvl = options(vehicle, ProcessModel::Kinematic, true);
    let alone = |options: FilterOptions| FilterOptions { use_range: false, ..options };
    let mut stiff = kinematic;
    stiff.navigation.process_noise.linear_mps2_per_sqrt_hz = [1.0e-3, 1.0e-3, 1.0e-2];
    let with_rate = |options: FilterOptions| FilterOptions { use_range_rate: true, ..options };

    let first = study.filter("dynamic, no DVL", vehicle, &dynamic)?;
    let aided = study.filter("kinematic + DVL", vehicle, &with_dvl)?;
    let loose = study.filter("kinematic, no DVL", vehicle, &kinematic)?;
    let unaided = study.filter("dynamic, no DVL, no ranges", vehicle, &alone(dynamic))?;
    let drifting = study.filter("kinematic, no DVL, no ranges", vehicle, &alone(kinematic))?;
    study.filter("kinematic + DVL, no ranges", vehicle, &alone(with_dvl))?;
    study.filter("kinematic, no DVL, q = 1e-3", vehicle, &stiff)?;
    study.filter("dynamic, range rate", vehicle, &with_rate(dynamic))?;
    study.filter("kinematic, no DVL, range rate", vehicle, &with_rate(kinematic))?;
    study.filter("dynamic, doubled Q", vehicle, &doubled(dynamic))?;
    let wrong = VehicleFile { parameters: perturbed(&vehicle.parameters, 0.05, seed), ..vehicle.clone() };
    study.filter("dynamic, parameters 5 % wrong", &wrong, &dynamic)?;
    study.filter("dynamic, parameters 5 % wrong, doubled Q", &wrong, &doubled(dynamic))?;
    study.filter("dynamic, parameters 5 % wrong, range rate", &wrong, &with_rate(dynamic))?;
    study.dead_reckoning("compass + DVL dead reckoning")?;

    study.claims("kinematic + DVL", &aided);
    study.claims("kinematic, no DVL", &loose);
    study.claims("dynamic, no DVL", &first);
    study.claims("kinematic, no DVL, no ranges", &drifting);
    study.claims("dynamic, no DVL, no ranges", &unaided);

    let submerged = submerged(study.log, study.truth);
    let mut random = Stream::new(seed, Source::Outliers);
    let bearing = std::f64::consts::TAU * random.uniform();
    for (row, options) in [("kinematic + DVL", with_dvl), ("dynamic, no DVL", dynamic)] {
        study.started_afar(row, vehicle, &options, &submerged, bearing)?;
    }
    let coarse = coarse(study.log, &mut random, vehicle.sensors.range_m);
    for (row, mut options) in [
        ("kinematic + DVL", with_dvl),
        ("dynamic, no DVL", dynamic),
        ("dynamic, range rate", with_rate(dynamic)),
        ("kinematic, no DVL", kinematic),
    ] {
        options.navigation.sensors.range_m = COARSE_RANGE_M;
        let run = filter::run(&coarse, vehicle, &options)?;
        study.keep(&format!("{row}, 20 m ranges"), &run);
    }
    Ok(study.measured)
}

/// As in the independent implementation's table: attitude without rates, ranges without range rates.
fn options(vehicle: &VehicleFile, model: ProcessModel, use_dvl: bool) -> FilterOptions {
    FilterOptions { use_dvl, use_rates: false, use_range_rate: false, ..FilterOptions::new(vehicle, model) }
}

/// Twice the power of the process noise.
fn doubled(mut options: FilterOptions) -> FilterOptions {
    let noise = &mut options.navigation.process_noise;
    for root in noise.linear_mps2_per_sqrt_hz.iter_mut().chain(&mut noise.angular_radps2_per_sqrt_hz) {
        *root *= std::f64::consts::SQRT_2;
    }
    options
}

/// Rows while the vehicle is deep, so that there is no fix among them.
fn submerged(log: &Log, truth: &Truth) -> Log {
    let deep = |row: &&backseat_data::TruthRow| row.state[2] > SUBMERGED_M;
    let from = truth.rows.iter().find(deep).map_or(0, |row| row.time_us);
    let to = truth.rows.iter().rfind(deep).map_or(0, |row| row.time_us);
    let rows = log.rows.iter().filter(|row| (from..=to).contains(&row.time_us)).copied().collect();
    Log { rows, notes: Vec::new(), ..log.clone() }
}

/// The log with noise added to its ranges.
fn coarse(log: &Log, random: &mut Stream, present_m: f64) -> Log {
    let added = (COARSE_RANGE_M * COARSE_RANGE_M - present_m * present_m).sqrt();
    let mut log = log.clone();
    for row in &mut log.rows {
        if let Some(range) = row.get(Column::Range) {
            row.set(Column::Range, range + added * random.normal());
        }
    }
    log
}

struct Survey<'a> {
    log: &'a Log,
    truth: &'a Truth,
    measured: Measured,
}

impl Survey<'_> {
    fn filter(&mut self, row: &str, vehicle: &VehicleFile, options: &FilterOptions) -> anyhow::Result<FilterRun> {
        let run = filter::run(self.log, vehicle, options).with_context(|| row.to_owned())?;
        self.keep(row, &run);
        Ok(run)
    }

    fn errors(&self, run: &FilterRun) -> Vec<(u64, f64)> {
        let error = |s: &filter::TrackSample| {
            Some((s.time_us, self.truth.horizontal_error_m(s.time_us, s.state[X], s.state[Y])?))
        };
        run.track.iter().filter_map(error).collect()
    }

    fn keep(&mut self, row: &str, run: &FilterRun) {
        let errors = self.errors(run);
        let drms: Vec<f64> = run.track.iter().map(|sample| sample.drms_m().powi(2)).collect();
        let drms = mean(&drms).map_or(f64::NAN, f64::sqrt);
        self.summary(row, &errors, Some(drms));
        let sigma = run.track.iter().map(|s| (s.time_us as f64 / 3.6e9, s.drms_m()));
        self.measured.curve("sigma", row, sigma.step_by(CURVE_S));
    }

    fn dead_reckoning(&mut self, row: &str) -> anyhow::Result<()> {
        let positions = dead_reckoning::run(self.log, Method::CompassDvl)?;
        let mut errors = dead_reckoning::errors_against_truth(&positions, self.truth);
        // As often as the filters' tracks: once a second.
        errors.dedup_by_key(|(time_us, _)| *time_us / 1_000_000);
        self.summary(row, &errors, None);
        Ok(())
    }

    fn summary(&mut self, row: &str, errors: &[(u64, f64)], drms: Option<f64>) {
        let magnitudes: Vec<f64> = errors.iter().map(|(_, error)| *error).collect();
        let Some(summary) = ErrorSummary::of(&magnitudes) else { return };
        self.measured.set(row, "median_m", summary.median_m);
        self.measured.set(row, "p95_m", summary.p95_m);
        self.measured.set(row, "max_m", summary.max_m);
        if let Some(drms) = drms {
            self.measured.set(row, "drms_m", drms);
            self.measured.set(row, "rms_over_drms", summary.rms_m / drms);
        }
        let points = errors.iter().map(|(time_us, error)| (*time_us as f64 / 3.6e9, *error));
        self.measured.curve("error", row, points.step_by(CURVE_S));
    }

    /// 3.2.4: the velocity covariances of vehicle and ship while the vehicle is deep.
    fn claims(&mut self, row: &str, run: &FilterRun) {
        let deep = |time_us: u64| self.truth.at(time_us).is_some_and(|at| at.state[2] > SUBMERGED_M);
        let vehicle: Vec<(u64, f64)> = run
            .track
            .iter()
            .filter(|sample| deep(sample.time_us))
            .map(|sample| (sample.time_us, sample.sigma[U].hypot(sample.sigma[V])))
            .collect();
        let ship: Vec<f64> = run
            .ship_velocity_sigma_mps
            .iter()
            .filter(|(time_us, _)| deep(*time_us))
            .map(|(_, [north, east])| north.hypot(*east))
            .collect();
        let sigmas: Vec<f64> = vehicle.iter().map(|(_, sigma)| *sigma).collect();
        let (early, late) = sigmas.split_at(sigmas.len() / 2);
        let at = |values: &[f64], q| percentile(values, q).unwrap_or(f64::NAN);
        let row = format!("velocity: {row}");
        self.measured.set(&row, "vehicle_mps", at(&sigmas, 0.5));
        self.measured.set(&row, "ship_mps", at(&ship, 0.5));
        self.measured.set(&row, "ship_below", f64::from(u8::from(at(&ship, 0.5) < at(&sigmas, 0.5))));
        self.measured.set(&row, "largest_mps", at(&sigmas, 1.0));
        // Bounded: the second half of the mission has no larger covariance than the first.
        let growth = at(late, 0.95) / at(early, 0.95);
        self.measured.set(&row, "growth", growth);
        self.measured.set(&row, "bounded", f64::from(u8::from(growth < 1.1)));
        let squared_errors = run.track.iter().filter(|sample| deep(sample.time_us)).filter_map(|sample| {
            let truth = self.truth.at(sample.time_us)?.state;
            Some((sample.state[U] - truth[U]).powi(2) + (sample.state[V] - truth[V]).powi(2))
        });
        let squared_errors: Vec<f64> = squared_errors.collect();
        let squares: Vec<f64> = sigmas.iter().map(|sigma| sigma * sigma).collect();
        let ratio = mean(&squared_errors).zip(mean(&squares)).map_or(f64::NAN, |(error, own)| (error / own).sqrt());
        self.measured.set(&row, "rms_over_sigma", ratio);
        let points = vehicle.iter().map(|(time_us, sigma)| (*time_us as f64 / 3.6e9, *sigma));
        self.measured.curve("velocity", &row, points.step_by(CURVE_S));
    }

    /// 2.6.2: started under way, 150 m off on a bearing that the seed picks, without a fix until the end.
    fn started_afar(
        &mut self,
        row: &str,
        vehicle: &VehicleFile,
        options: &FilterOptions,
        submerged: &Log,
        bearing: f64,
    ) -> anyhow::Result<()> {
        let start_us = submerged.rows.first().map_or(0, |row| row.time_us);
        let at = self.truth.at(start_us).context("no truth at the start")?;
        let mut state = at.state;
        state[X] += OFF_M * bearing.cos();
        state[Y] += OFF_M * bearing.sin();
        let sensors = &options.navigation.sensors;
        let (attitude, rates) = (sensors.attitude_rad, sensors.rates_radps);
        let sigma =
            VehicleState::from([OFF_M, OFF_M, 0.1, attitude, attitude, attitude, 0.1, 0.1, 0.1, rates, rates, rates]);
        let start = Start { vehicle: InitialState { state, sigma }, ship: None };
        let run = filter::run(submerged, vehicle, &FilterOptions { start: Some(start), ..*options })?;
        let errors = self.errors(&run);
        let row = format!("{row}, 150 m off");
        let first_s = errors.first().map_or(0.0, |(time_us, _)| *time_us as f64 * 1e-6);
        let since = |time_us: u64| time_us as f64 * 1e-6 - first_s;
        let settled = match errors.iter().rposition(|(_, error)| *error > CONVERGED_M) {
            None => 0.0,
            Some(last) => errors.get(last + 1).map_or(f64::NAN, |(time_us, _)| since(*time_us)),
        };
        self.measured.set(&row, "converged_s", settled);
        let half = errors.last().map_or(0.0, |(time_us, _)| 0.5 * since(*time_us));
        let late: Vec<f64> = errors.iter().filter(|(t, _)| since(*t) > half).map(|(_, error)| *error).collect();
        if let Some(summary) = ErrorSummary::of(&late) {
            self.measured.set(&row, "median_m", summary.median_m);
            self.measured.set(&row, "p95_m", summary.p95_m);
        }
        let rejected = run.sensors.iter().find(|s| s.sensor.name() == "range").map_or(0, |s| s.rejected);
        self.measured.set(&row, "rejected", rejected as f64);
        let points = errors.iter().map(|(time_us, error)| (since(*time_us) / 3600.0, *error));
        self.measured.curve("error", &row, points.step_by(CURVE_S));
        Ok(())
    }
}
