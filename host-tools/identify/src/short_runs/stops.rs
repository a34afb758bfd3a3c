//! Stops of the motor: what they say of the propeller's torque.
//!
//! The torque ends with the motor within a row; whatever else rolls the vehicle stays, or fades with its speed in seconds.
//! So each stop under water tells the two apart by itself: the roll of the seconds around it is fitted by the torque's arm,
//! by a moment with u² and a list of that stop alone, and by the roll and roll rate at the start. How late the fins act and
//! the propeller's speed is recorded is common to the stops: an abort moves the fins in the same row. All else is given.

use super::model::{RunModel, common};
use super::recording::{Run, RunSample, Window};
use super::start::measured_state;
use super::unknowns::Draft;
use backseat_core::state::{P, PHI};
use backseat_logs::short_runs::OF_CONFIGURATION;
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

/// Seconds of a run that count before and after a stop.
const BEFORE_S: f64 = 2.1;
const AFTER_S: f64 = 2.1;
/// Fewer rows on a side of the stop say nothing.
const FEWEST: usize = 3;
/// Rows further apart are not of one motion, s.
const PAUSE_S: f64 = 0.9;
/// Least depth at the stop, m: above it the surface rolls the vehicle.
const LEAST_M: f64 = 0.4;
/// One sigma of the model's roll within these seconds, rad, and the share of it that no error counts beyond.
const SIGMA_RAD: f64 = 0.017;
const MOST_SIGMAS: f64 = 4.0;
/// Numbers of a stop: arm (m), moment with u² (N s²/m), list (m), roll (rad) and roll rate (rad/s) at the start.
const COUNT: usize = 5;
/// One sigma of each before the stop is looked at.
const PRIOR: [f64; COUNT] = [0.1, 0.5, 0.001, 0.01, 0.1];
/// Steps of the fit of a stop: roll is nearly linear in its numbers.
const STEPS: usize = 5;
/// Delays of the recorded propeller speed and of the fins that are tried, in steps of [`DELAY_STEP_S`].
const PROPELLER_DELAYS: core::ops::RangeInclusive<i32> = -9..=4;
const FIN_DELAYS: core::ops::RangeInclusive<i32> = -4..=2;
const DELAY_STEP_S: f64 = 0.1;
/// Rudders that move by more around a stop roll the vehicle themselves, rad.
const MOST_RUDDER_RAD: f64 = 0.26;

/// What one stop says.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// Place of the run.
    pub run: usize,
    /// Of the first row with the motor stopped, in the run, s.
    pub time_s: f64,
    /// Arm of the torque, K = −arm T, m.
    pub arm_m: f64,
    /// One sigma by the roll of this stop, m.
    pub sigma_m: f64,
}

/// What all stops say.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stops {
    /// Each of them, by the delay that fits all best.
    pub each: Vec<Stop>,
    /// Delay of the recorded propeller speed, s.
    pub delay_s: f64,
    /// Squared errors of roll over squared sigmas with the torque, and without at the delay best for that.
    pub errors: [f64; 2],
    /// Rows.
    pub rows: usize,
}

impl Stops {
    /// Mean of the arms and its standard error, m; `None` with fewer than three stops.
    pub fn mean(&self) -> Option<[f64; 2]> {
        let count = self.each.len() as f64;
        let mean = self.each.iter().map(|stop| stop.arm_m).sum::<f64>() / count;
        let squares: f64 = self.each.iter().map(|stop| (stop.arm_m - mean).powi(2)).sum();
        (self.each.len() > 2).then(|| [mean, (squares / (count - 1.0) / count).sqrt()])
    }
}

/// Every stop of the motor under water, by a model whose torque, list and moment with u² do not matter.
#[must_use]
pub fn stops(runs: &[Run], draft: &Draft) -> Stops {
    let mut windows = Vec::new();
    for (place, run) in runs.iter().enumerate() {
        for event in 1..run.samples.len() {
            let is_stop = run.samples[event - 1].is_powered() && !run.samples[event].is_powered();
            if is_stop && let Some(window) = around(run, event) {
                windows.push((place, run.samples[event].t_s, window));
            }
        }
    }
    let rows = windows.iter().map(|(_, _, window)| window.last - window.first + 1).sum();
    let delays = FIN_DELAYS.flat_map(|fins| PROPELLER_DELAYS.map(move |propeller| [fins, propeller]));
    let tried: Vec<Tried> =
        delays.collect::<Vec<_>>().into_par_iter().map(|delays| tried(runs, &windows, draft, delays)).collect();
    let mut best = Stops { errors: [f64::INFINITY; 2], rows, ..Stops::default() };
    for tried in tried {
        best.errors[1] = best.errors[1].min(tried.errors[1]);
        if tried.errors[0] < best.errors[0] {
            best = Stops { each: tried.each, delay_s: tried.delay_s, errors: [tried.errors[0], best.errors[1]], rows };
        }
    }
    best
}

struct Tried {
    each: Vec<Stop>,
    delay_s: f64,
    errors: [f64; 2],
}

/// Every stop at one delay of fins and propeller.
fn tried(runs: &[Run], windows: &[(usize, f64, Window)], draft: &Draft, [fins, propeller]: [i32; 2]) -> Tried {
    let [fin_s, delay_s] = [fins, propeller].map(|steps| f64::from(steps) * DELAY_STEP_S);
    let mut draft = draft.clone();
    draft.common[common::FIN_DELAY] = fin_s;
    draft.common[common::PROPELLER_DELAY] = delay_s;
    let of = |has_torque: bool| -> Option<(Vec<Stop>, f64)> {
        let mut sum = 0.0;
        let mut each = Vec::new();
        for (place, time_s, window) in windows {
            let ([arm_m, sigma_m], errors) = one(&runs[*place], *window, &draft, has_torque)?;
            sum += errors;
            each.push(Stop { run: *place, time_s: *time_s, arm_m, sigma_m });
        }
        Some((each, sum))
    };
    let without = of(false).map_or(f64::INFINITY, |(_, errors)| errors);
    let (each, with) = of(true).unwrap_or((Vec::new(), f64::INFINITY));
    Tried { each, delay_s, errors: [with, without] }
}

/// Rows around a stop; `None`: too few, or at the surface.
fn around(run: &Run, event: usize) -> Option<Window> {
    let time = |index: usize| run.samples[index].t_s;
    let is_one_motion = |at: usize| time(at + 1) - time(at) <= PAUSE_S;
    let (mut first, mut last) = (event, event);
    while first > 0 && is_one_motion(first - 1) && time(event) - time(first - 1) <= BEFORE_S {
        first -= 1;
    }
    while last + 1 < run.samples.len() && is_one_motion(last) && time(last + 1) - time(event) <= AFTER_S {
        last += 1;
    }
    let is_deep = run.samples[first..=last].iter().all(|sample| sample.depth_m > LEAST_M);
    let is_driven = run.samples[first..event].iter().all(RunSample::is_powered);
    let is_off = run.samples[event..=last].iter().all(|sample| !sample.is_powered());
    let rudder = |sample: &RunSample| 0.5 * (sample.input.fins_rad[0] - sample.input.fins_rad[1]);
    let rudders: Vec<f64> = run.samples[first..=last].iter().map(rudder).collect();
    let is_held = rudders.iter().copied().fold(f64::MIN, f64::max) - rudders.iter().copied().fold(f64::MAX, f64::min)
        < MOST_RUDDER_RAD;
    let is_long = event - first >= FEWEST && last - event >= FEWEST;
    (is_deep && is_driven && is_off && is_held && is_long).then_some(Window { run: 0, first, last })
}

/// Arm and sigma, and the squared errors that are left.
fn one(run: &Run, window: Window, draft: &Draft, has_torque: bool) -> Option<([f64; 2], f64)> {
    let list = OF_CONFIGURATION.iter().position(|term| term.name == "b_y_m")?;
    let model = |values: &SVector<f64, COUNT>| -> Option<RunModel> {
        let mut draft = draft.clone();
        draft.parameters.torque_arm_m = values[0];
        for terms in &mut draft.configurations {
            terms[0] += values[1];
            terms[list] += values[2];
        }
        draft.models().ok()?.into_iter().nth(run.configuration)
    };
    let start = measured_state(run, window.first, &model(&SVector::zeros())?.dvl());
    let samples = &run.samples[window.first..=window.last];
    let residuals = |values: &SVector<f64, COUNT>| -> Option<Vec<f64>> {
        let mut start = start;
        start[PHI] += values[3];
        start[P] += values[4];
        let readings = model(values)?.predict(run, window, &start);
        let error = |(sample, reading): (&RunSample, _)| {
            let reading: Option<super::model::Reading> = reading;
            Some((sample.attitude_rad[0] - reading?.attitude_rad[0]) / SIGMA_RAD)
        };
        samples.iter().zip(readings).map(error).collect()
    };
    let mut prior = PRIOR;
    if !has_torque {
        prior[0] = 1e-6;
    }
    let weights = SMatrix::<f64, COUNT, COUNT>::from_diagonal(&SVector::from(prior.map(|sigma| sigma.powi(-2))));
    let mut values = SVector::<f64, COUNT>::zeros();
    let mut normal = weights;
    for _ in 0..STEPS {
        let here = residuals(&values)?;
        let mut columns = Vec::with_capacity(COUNT);
        for place in 0..COUNT {
            let mut moved = values;
            let size = 1e-3 * prior[place];
            moved[place] += size;
            let column: Vec<f64> = here.iter().zip(residuals(&moved)?).map(|(a, b)| (a - b) / size).collect();
            columns.push(column);
        }
        let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        normal = weights + SMatrix::<f64, COUNT, COUNT>::from_fn(|i, j| product(&columns[i], &columns[j]));
        let gradient = SVector::<f64, COUNT>::from_fn(|i, _| product(&columns[i], &here)) - weights * values;
        values += normal.cholesky()?.solve(&gradient);
    }
    let errors = residuals(&values)?.iter().map(|error| error.powi(2).min(MOST_SIGMAS.powi(2))).sum();
    let sigma_m = normal.cholesky()?.inverse()[(0, 0)].sqrt();
    Some(([values[0], sigma_m], errors)).filter(|([arm_m, sigma_m], _)| (arm_m + sigma_m).is_finite())
}
