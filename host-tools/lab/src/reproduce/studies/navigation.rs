//! Navigation of chapters 2 to 4: a flight a seed under printed conditions, its measurements through each filter.

use super::conditions::{self, Conditions};
use super::first_nbls;
use super::steering::{self, PrintedFlight};
use super::{Kind, Measured, Study};
use anyhow::Context;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::navigation::{InitialState, ProcessModel, SurfaceNoise};
use backseat_core::state::{P, U, V, VehicleState, X, Y};
use backseat_estimation::dead_reckoning::{self, Method};
use backseat_estimation::filter::{self, FilterOptions, FilterRun, Start};
use backseat_logs::stats::{ErrorSummary, mean, percentile, standard_deviation};
use backseat_logs::{Column, Log, Truth, VehicleFile};
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::perturbed;

/// 2.6.1.
pub const K_DVL: Study = navigation(
    "K-DVL",
    &conditions::K_DVL,
    &[
        Filter { row: "range", dvl: true, ..KINEMATIC },
        Filter { row: "range + range rate", dvl: true, range_rate: true, ..KINEMATIC },
    ],
);
/// 2.6.2 with the gyrocompass.
pub const K_FOG: Study = navigation(
    "K-FOG",
    &conditions::K_FOG,
    &[
        Filter { row: "range", ..KINEMATIC },
        Filter { row: "range + range rate", range_rate: true, ..KINEMATIC },
        Filter { row: "20 m, range", change: Change::CoarseRanges, ..KINEMATIC },
        Filter { row: "20 m, range + range rate", range_rate: true, change: Change::CoarseRanges, ..KINEMATIC },
        Filter { row: "150 m off, range", change: Change::StartedAfar, ..KINEMATIC },
        Filter { row: "150 m off, range + range rate", range_rate: true, change: Change::StartedAfar, ..KINEMATIC },
        Filter { row: "ours, range", ..OURS },
        Filter { row: "ours, range + range rate", range_rate: true, ..OURS },
        Filter { row: "ours, 20 m, range", change: Change::CoarseRanges, ..OURS },
        Filter { row: "ours, 20 m, range + range rate", range_rate: true, change: Change::CoarseRanges, ..OURS },
        Filter { row: "ours, 150 m off, range", change: Change::StartedAfar, ..OURS },
        Filter { row: "ours, 150 m off, range + range rate", range_rate: true, change: Change::StartedAfar, ..OURS },
    ],
);
/// 2.6.2 with a compass of 1 degree.
pub const K_COMPASS: Study = navigation(
    "K-compass",
    &conditions::K_COMPASS,
    &[
        Filter { row: "range", ..KINEMATIC },
        Filter { row: "range + range rate", range_rate: true, ..KINEMATIC },
        Filter { row: "range, q = 1e-3", change: Change::StiffNoise, ..KINEMATIC },
    ],
);
/// 3.2.1.
pub const D_SURVEY: Study = navigation(
    "D-survey",
    &conditions::D_SURVEY,
    &[
        Filter { row: "dynamic, no DVL", ..DYNAMIC },
        Filter { row: "kinematic + DVL", dvl: true, ..KINEMATIC },
        Filter { row: "kinematic, no DVL", ..KINEMATIC },
        Filter { row: "compass + DVL dead reckoning", change: Change::DeadReckoning, ..KINEMATIC },
        Filter { row: "dynamic, no DVL, no ranges", change: Change::NoRanges, ..DYNAMIC },
        Filter { row: "kinematic, no DVL, no ranges", change: Change::NoRanges, ..KINEMATIC },
        Filter { row: "ours, dynamic, no DVL", ..OURS_DYNAMIC },
    ],
);
/// 3.2.2 and 3.2.4.
pub const D_SEA: Study = navigation(
    "D-sea",
    &conditions::D_SEA,
    &[
        Filter { row: REFERENCE, dvl: true, ..KINEMATIC },
        Filter { row: "dynamic, no DVL", ..DYNAMIC },
        Filter { row: "dynamic, no DVL, range rate", range_rate: true, ..DYNAMIC },
        Filter { row: "doubled noise", change: Change::DoubledNoise, ..DYNAMIC },
        Filter { row: "doubled noise, range rate", range_rate: true, change: Change::DoubledNoise, ..DYNAMIC },
        Filter { row: "mass and drag 5 % wrong", change: Change::WrongMassAndDrag, ..DYNAMIC },
        Filter {
            row: "mass and drag 5 % wrong, range rate",
            range_rate: true,
            change: Change::WrongMassAndDrag,
            ..DYNAMIC
        },
        Filter { row: "kinematic, no DVL", ..KINEMATIC },
        Filter { row: "compass + DVL dead reckoning", change: Change::DeadReckoning, ..KINEMATIC },
    ],
);
/// 4.3.2.1 and 4.3.2.2.
pub const N_NAV: Study = navigation(
    "N-nav",
    &conditions::N_NAV,
    &[
        Filter { row: "true parameters", ..OURS_DYNAMIC },
        Filter { row: "identified by NBLS", change: Change::Nbls, ..OURS_DYNAMIC },
        Filter { row: "identified by output error", change: Change::OutputError, ..OURS_DYNAMIC },
        Filter { row: "10 % wrong", change: Change::AllWrong, ..OURS_DYNAMIC },
    ],
);

/// Distances of 3.2.2 are to this one; it stands before the others.
const REFERENCE: &str = "kinematic + DVL";

const fn navigation(name: &'static str, conditions: &'static Conditions, filters: &'static [Filter]) -> Study {
    Study { name, kind: Kind::Navigation(Navigation { conditions, filters }) }
}

/// A flight and the filters that see its measurements.
#[derive(Clone, Copy, Debug)]
pub struct Navigation {
    conditions: &'static Conditions,
    filters: &'static [Filter],
}

/// One filter over the measurements of a flight.
#[derive(Clone, Copy, Debug)]
struct Filter {
    row: &'static str,
    model: ProcessModel,
    dvl: bool,
    range_rate: bool,
    /// Every measurement is used, to first order.
    as_in_thesis: bool,
    change: Change,
}

const KINEMATIC: Filter = Filter { as_in_thesis: true, ..OURS };
const DYNAMIC: Filter = Filter { as_in_thesis: true, ..OURS_DYNAMIC };
const OURS_DYNAMIC: Filter = Filter { model: ProcessModel::Dynamic, ..OURS };
/// With gates, ranges to second order, range rates near the position alone, and more noise near the surface.
const OURS: Filter = Filter {
    row: "",
    model: ProcessModel::Kinematic,
    dvl: false,
    range_rate: false,
    as_in_thesis: false,
    change: Change::None,
};

/// What else is different about it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Change {
    None,
    /// Ranges of 20 m one sigma, which the filter knows.
    CoarseRanges,
    /// Started under way, 150 m off on a bearing that the seed picks, without a fix until the end.
    StartedAfar,
    /// 1e-3 m/s²/√Hz of surge and sway.
    StiffNoise,
    /// Not a filter: heading and DVL added up.
    DeadReckoning,
    NoRanges,
    /// Twice the power of the process noise.
    DoubledNoise,
    /// Mass and quadratic drag with errors of 5 %, one sigma; fins and propeller are right.
    WrongMassAndDrag,
    /// Every parameter 10 % too high or too low.
    AllWrong,
    /// What NBLS finds in the experiment of 4.3.2.1.
    Nbls,
    /// What output error finds in it.
    OutputError,
}

/// Initial error of 2.6.2, m.
const OFF_M: f64 = 150.0;
/// Standard deviation of the coarse ranges of 2.6.2, m.
const COARSE_RANGE_M: f64 = 20.0;
/// Converged: within this of the truth from then on, m.
const CONVERGED_M: f64 = 10.0;
/// The transient of 2.6.2: this long after the start, s.
const TRANSIENT_S: f64 = 600.0;
/// Where the vehicle is under way and deep: between these depths there is no fix and no surface, m.
const SUBMERGED_M: f64 = 2.0;
/// Time between points of a curve, s.
const CURVE_S: usize = 60;

impl Navigation {
    /// Flies, and shows the measurements to every filter.
    pub fn run(&self, seed: u64) -> anyhow::Result<Measured> {
        let PrintedFlight { scenario, flight, truth } = steering::fly(self.conditions, seed)?;
        let vehicle = &scenario.vehicle;
        let mut random = Stream::new(seed, Source::Outliers);
        let bearing = std::f64::consts::TAU * random.uniform();
        let coarse = coarse(&flight.log, &mut random, vehicle.sensors.range_m);
        let submerged = submerged(&flight.log, &truth);
        let mut survey =
            Survey { log: &flight.log, truth: &truth, measured: Measured::default(), reference: Vec::new() };
        for filter in self.filters {
            if filter.change == Change::DeadReckoning {
                survey.dead_reckoning(filter.row)?;
                continue;
            }
            let mut declared = vehicle.clone();
            declared.parameters = changed(&vehicle.parameters, filter.change, seed)?;
            if matches!(filter.change, Change::Nbls | Change::OutputError) {
                let alone = format!("{}, alone", filter.row);
                first_nbls::keep_predicted(&mut survey.measured, &alone, &declared.parameters, &first_nbls::lines());
            }
            let mut options = FilterOptions {
                use_dvl: filter.dvl,
                use_rates: self.conditions.rates_degps.is_some(),
                use_range: filter.change != Change::NoRanges,
                use_range_rate: filter.range_rate,
                ..FilterOptions::new(&declared, filter.model)
            };
            if filter.as_in_thesis {
                options.navigation.make_as_in_thesis();
            }
            if self.conditions.slow_compass && filter.model == ProcessModel::Kinematic {
                options.navigation.process_noise = SurfaceNoise::KINEMATIC.noise;
            }
            let noise = &mut options.navigation.process_noise;
            match filter.change {
                Change::StiffNoise => noise.linear_mps2_per_sqrt_hz = [1.0e-3, 1.0e-3, 1.0e-2],
                Change::DoubledNoise => {
                    let roots = noise.linear_mps2_per_sqrt_hz.iter_mut().chain(&mut noise.angular_radps2_per_sqrt_hz);
                    roots.for_each(|root| *root *= std::f64::consts::SQRT_2);
                }
                Change::CoarseRanges => options.navigation.sensors.range_m = COARSE_RANGE_M,
                _ => {}
            }
            let run = match filter.change {
                Change::StartedAfar => survey.started_afar(filter.row, &declared, &options, &submerged, bearing),
                Change::CoarseRanges => survey.filter(filter.row, &coarse, &declared, &options),
                _ => survey.filter(filter.row, &flight.log, &declared, &options),
            };
            // A filter that fails has no numbers; the table says how many runs have.
            let Ok(run) = run else { continue };
            survey.claims(filter.row, &run);
            survey.motion(filter.row, &run);
        }
        Ok(survey.measured)
    }
}

/// The filter's parameters.
fn changed(truth: &VehicleParameters, change: Change, seed: u64) -> anyhow::Result<VehicleParameters> {
    let mut parameters = *truth;
    match change {
        Change::WrongMassAndDrag => {
            let mut random = Stream::new(seed, Source::Mission);
            for value in parameters.m_diag.iter_mut().chain(&mut parameters.quadratic_diag) {
                *value *= 1.0 + 0.05 * random.normal();
            }
        }
        Change::AllWrong => parameters = perturbed(truth, 0.10, seed),
        Change::Nbls => parameters = first_nbls::by_nbls(seed)?,
        Change::OutputError => parameters = first_nbls::by_output_error(seed)?,
        _ => {}
    }
    Ok(parameters)
}

/// Rows while the vehicle is deep, so that there is no fix among them.
fn submerged(log: &Log, truth: &Truth) -> Log {
    let deep = |row: &&backseat_logs::TruthRow| row.state[2] > SUBMERGED_M;
    let from = truth.rows.iter().find(deep).map_or(0, |row| row.time_us);
    let to = truth.rows.iter().rfind(deep).map_or(0, |row| row.time_us);
    let rows = log.rows.iter().filter(|row| (from..=to).contains(&row.time_us)).cloned().collect();
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
    /// Track of [`REFERENCE`].
    reference: Vec<(u64, [f64; 2])>,
}

impl Survey<'_> {
    fn filter(
        &mut self,
        row: &str,
        log: &Log,
        vehicle: &VehicleFile,
        options: &FilterOptions,
    ) -> anyhow::Result<FilterRun> {
        let run = filter::run(log, vehicle, options).with_context(|| row.to_owned())?;
        let track: Vec<(u64, [f64; 2])> = run.track.iter().map(|s| (s.time_us, [s.state[X], s.state[Y]])).collect();
        self.distance(row, &track);
        if row == REFERENCE {
            self.reference = track;
        }
        self.keep(row, &run);
        Ok(run)
    }

    /// Largest distance to the reference's track while the vehicle is deep.
    fn distance(&mut self, row: &str, track: &[(u64, [f64; 2])]) {
        if self.reference.is_empty() {
            return;
        }
        let mut largest = f64::NAN;
        for (time_us, [x, y]) in track {
            let after = self.reference.partition_point(|(then_us, _)| then_us <= time_us);
            let is_deep = self.truth.at(*time_us).is_some_and(|at| at.state[2] > SUBMERGED_M);
            let around = after.checked_sub(1).and_then(|before| self.reference.get(before..=after));
            let Some([(from_us, from), (to_us, to)]) = around.filter(|_| is_deep) else { continue };
            let share = (time_us - from_us) as f64 / (to_us - from_us) as f64;
            let [rx, ry] = [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]));
            largest = f64::max(largest, (x - rx).hypot(y - ry));
        }
        self.measured.set(row, "to_reference_m", largest);
    }

    /// Table 4.8: mean absolute errors of the six velocities while the vehicle is deep.
    fn motion(&mut self, row: &str, run: &FilterRun) {
        let (mut sum, mut count) = ([0.0; 6], 0.0);
        for sample in &run.track {
            let Some(truth) = self.truth.at(sample.time_us).filter(|at| at.state[2] > SUBMERGED_M) else { continue };
            for (axis, sum) in sum.iter_mut().enumerate() {
                *sum += (sample.state[U + axis] - truth.state[U + axis]).abs();
            }
            count += 1.0;
        }
        let in_degrees = |axis: usize, error: f64| if U + axis < P { error } else { error.to_degrees() };
        first_nbls::keep_motion(
            &mut self.measured,
            row,
            &core::array::from_fn(|axis| in_degrees(axis, sum[axis] / count)),
        );
    }

    fn errors(&self, run: &FilterRun) -> Vec<(u64, f64)> {
        let error = |s: &filter::TrackSample| {
            Some((s.time_us, self.truth.horizontal_error_m(s.time_us, s.state[X], s.state[Y])?))
        };
        run.track.iter().filter_map(error).collect()
    }

    /// Figures 2.4, 2.5, 2.9 and 2.10: moments of the errors north and east.
    fn moments(&mut self, row: &str, run: &FilterRun) {
        for (axis, name) in [(X, "north"), (Y, "east")] {
            let error = |s: &filter::TrackSample| Some(s.state[axis] - self.truth.at(s.time_us)?.state[axis]);
            let errors: Vec<f64> = run.track.iter().filter_map(error).collect();
            let Some((mean_m, sigma_m)) = mean(&errors).zip(standard_deviation(&errors)) else { return };
            let moment = |order| mean(&errors.iter().map(|e| ((e - mean_m) / sigma_m).powi(order)).collect::<Vec<_>>());
            self.measured.set(row, &format!("mean_{name}_m"), mean_m);
            self.measured.set(row, &format!("sigma_{name}_m"), sigma_m);
            self.measured.set(row, &format!("skewness_{name}"), moment(3).unwrap_or(f64::NAN));
            self.measured.set(row, &format!("kurtosis_{name}"), moment(4).unwrap_or(f64::NAN));
        }
    }

    fn keep(&mut self, row: &str, run: &FilterRun) {
        let errors = self.errors(run);
        self.moments(row, run);
        let drms: Vec<f64> = run.track.iter().map(|sample| sample.drms_m().powi(2)).collect();
        let drms = mean(&drms).map_or(f64::NAN, f64::sqrt);
        self.summary(row, &errors, Some(drms));
        let sigma = run.track.iter().map(|s| (s.time_us as f64 / 3.6e9, s.drms_m()));
        self.measured.curve("sigma", row, sigma.step_by(CURVE_S));
    }

    fn dead_reckoning(&mut self, row: &str) -> anyhow::Result<()> {
        let positions = dead_reckoning::run(self.log, Method::CompassDvl, &backseat_core::effects::EffectSet::NONE)?;
        let mut errors = dead_reckoning::errors_against_truth(&positions, self.truth);
        let track: Vec<(u64, [f64; 2])> = positions.iter().map(|p| (p.time_us, p.position_m)).collect();
        self.distance(row, &track);
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
        let first_us = errors.first().map_or(0, |(time_us, _)| *time_us);
        let transient = errors.iter().take_while(|(time_us, _)| (time_us - first_us) as f64 * 1e-6 < TRANSIENT_S);
        let transient: Vec<f64> = transient.map(|(_, error)| *error).collect();
        self.measured.set(row, "transient_m", percentile(&transient, 0.5).unwrap_or(f64::NAN));
        let quarter = magnitudes.len() / 4;
        for (name, part) in [
            ("first_quarter_m", magnitudes.get(..quarter)),
            ("last_quarter_m", magnitudes.get(magnitudes.len() - quarter..)),
        ] {
            self.measured.set(row, name, part.and_then(|part| percentile(part, 0.5)).unwrap_or(f64::NAN));
        }
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
    ) -> anyhow::Result<FilterRun> {
        let start_us = submerged.rows.first().map_or(0, |row| row.time_us);
        let at = self.truth.at(start_us).context("no truth at the start")?;
        let mut state = at.state;
        state[X] += OFF_M * bearing.cos();
        state[Y] += OFF_M * bearing.sin();
        let sensors = &options.navigation.sensors;
        let ([roll, pitch, heading], rates) = (sensors.angles_rad(), sensors.rates_radps);
        let sigma = VehicleState::from([OFF_M, OFF_M, 0.1, roll, pitch, heading, 0.1, 0.1, 0.1, rates, rates, rates]);
        let start = Start { vehicle: InitialState { state, sigma }, ship: None };
        let run = filter::run(submerged, vehicle, &FilterOptions { start: Some(start), ..*options })?;
        let errors = self.errors(&run);
        let first_s = errors.first().map_or(0.0, |(time_us, _)| *time_us as f64 * 1e-6);
        let since = |time_us: u64| time_us as f64 * 1e-6 - first_s;
        let settled = match errors.iter().rposition(|(_, error)| *error > CONVERGED_M) {
            None => 0.0,
            Some(last) => errors.get(last + 1).map_or(f64::NAN, |(time_us, _)| since(*time_us)),
        };
        self.keep(row, &run);
        self.measured.set(row, "converged_s", settled);
        let rejected = run.sensors.iter().find(|s| s.sensor.name() == "range").map_or(0, |s| s.rejected);
        self.measured.set(row, "rejected", rejected as f64);
        Ok(run)
    }
}
