//! A log as runs: samples of each run, and the stretches of it that a model can be compared with.

use backseat_core::dynamics::ActuatorInput;
use backseat_core::state::wrap_angle;
use backseat_logs::log::{Column, Log, LogRow};

/// Rows further apart belong to two stretches, s.
const PAUSE_S: f64 = 1.5;
/// A motor that turns slower does not drive, rad/s.
const POWERED_RADPS: f64 = 10.0;
/// Deeper than this a vehicle has left the surface, m.
const DIVED_M: f64 = 0.5;
/// Steeper than this no torpedo is driven, and roll and heading are hardly told apart, rad.
const STEEPEST_RAD: f64 = 1.2;
/// Samples closer together than this are thinned out, s: no mode of a torpedo needs more, and the fit costs less.
const THIN_S: f64 = 0.18;

/// One row that has attitude, depth and what is commanded.
#[derive(Clone, Debug, PartialEq)]
pub struct RunSample {
    /// Since the start of the run, s.
    pub t_s: f64,
    /// Roll, pitch, heading, rad; heading without jumps.
    pub attitude_rad: [f64; 3],
    /// m.
    pub depth_m: f64,
    /// A fresh reading of the DVL, m/s.
    pub dvl_mps: Option<[f64; 3]>,
    /// What the row holds of propeller and fins.
    pub input: ActuatorInput,
}

impl RunSample {
    /// Whether the propeller drives.
    pub fn is_powered(&self) -> bool {
        self.input.propeller_radps.abs() > POWERED_RADPS
    }
}

/// One run.
#[derive(Clone, Debug)]
pub struct Run {
    /// Its name.
    pub label: String,
    /// Settings of the run.
    pub facts: Vec<(String, String)>,
    /// Configuration that it belongs to.
    pub configuration: usize,
    /// In order of time.
    pub samples: Vec<RunSample>,
}

/// The runs of a log that have what a comparison needs; a log without runs is one.
#[must_use]
pub fn runs(log: &Log) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let whole = [(String::from("log"), 0)];
    let labels = if log.runs.is_empty() { &whole[..] } else { &log.runs[..] };
    for (place, (label, _)) in labels.iter().enumerate() {
        let number = (place + 1) as f64;
        let is_of = |row: &&LogRow| log.runs.is_empty() || row.get(Column::Run) == Some(number);
        let samples = samples(log.rows.iter().filter(is_of));
        let facts = log.run_facts.get(place).cloned().unwrap_or_default();
        runs.push(Run { label: label.clone(), facts, configuration: 0, samples });
    }
    runs
}

/// Samples of rows; attitude, depth and commands that a row lacks are those of the last row within a second.
fn samples<'a>(rows: impl Iterator<Item = &'a LogRow>) -> Vec<RunSample> {
    let mut samples: Vec<RunSample> = Vec::new();
    let mut start_us = None;
    let (mut attitude, mut depth, mut input): (Held<[f64; 3]>, Held<f64>, Held<ActuatorInput>) = Default::default();
    let mut dvl: Option<[f64; 3]> = None;
    for row in rows {
        let t_s = (row.time_us - *start_us.get_or_insert(row.time_us)) as f64 * 1e-6;
        attitude.take(t_s, row.attitude_rad());
        depth.take(t_s, row.get(Column::Depth));
        input.take(t_s, row.actuators());
        dvl = row.dvl_mps().or(dvl);
        let (Some(mut attitude_rad), Some(depth_m), Some(input)) = (attitude.at(t_s), depth.at(t_s), input.at(t_s))
        else {
            continue;
        };
        // the attitude is what has to be fresh
        if attitude.time_s != t_s || samples.last().is_some_and(|last| t_s - last.t_s < THIN_S) {
            continue;
        }
        if let Some(last) = samples.last() {
            attitude_rad[2] = last.attitude_rad[2] + wrap_angle(attitude_rad[2] - last.attitude_rad[2]);
        }
        samples.push(RunSample { t_s, attitude_rad, depth_m, dvl_mps: dvl.take(), input });
    }
    samples
}

/// A value that is held for a second.
#[derive(Default)]
struct Held<T> {
    value: Option<T>,
    time_s: f64,
}

impl<T: Copy> Held<T> {
    fn take(&mut self, t_s: f64, value: Option<T>) {
        if value.is_some() {
            (self.value, self.time_s) = (value, t_s);
        }
    }

    fn at(&self, t_s: f64) -> Option<T> {
        self.value.filter(|_| t_s - self.time_s <= 1.0)
    }
}

/// Rows of a log from the first to the last under water, if it was driven there: before and after it the vehicle floats or
/// is carried.
#[must_use]
pub fn dive(log: &Log) -> Option<core::ops::Range<usize>> {
    let is_under = |row: &LogRow| row.get(Column::Depth).is_some_and(|depth_m| depth_m > DIVED_M);
    let is_driven = |row: &LogRow| row.actuators().is_some_and(|input| input.propeller_radps.abs() > POWERED_RADPS);
    let first = log.rows.iter().position(|row| is_under(row) && is_driven(row))?;
    let last = log.rows.iter().rposition(is_under)?;
    Some(first..last + 1)
}

/// What a stretch has to be.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// Least depth of every sample, m.
    pub depth_m: f64,
    /// Whether the propeller drives at every sample.
    pub powered: bool,
    /// Least speed by the last DVL reading, m/s; 0: any.
    pub speed_mps: f64,
}

/// First and last sample (inclusive) of each stretch without a pause that is as wanted.
#[must_use]
pub fn stretches(run: &Run, wanted: Wanted) -> Vec<(usize, usize)> {
    let mut stretches: Vec<(usize, usize)> = Vec::new();
    let mut open: Option<usize> = None;
    let mut speed_mps = 0.0;
    for (index, sample) in run.samples.iter().enumerate() {
        speed_mps = sample.dvl_mps.map_or(speed_mps, |dvl| dvl[0].abs());
        let fits = sample.depth_m > wanted.depth_m
            && sample.attitude_rad[1].abs() < STEEPEST_RAD
            && (!wanted.powered || sample.is_powered())
            && speed_mps >= wanted.speed_mps;
        let paused = index > 0 && sample.t_s - run.samples[index - 1].t_s > PAUSE_S;
        if let Some(first) = open.filter(|_| !fits || paused) {
            stretches.push((first, index - 1));
            open = None;
        }
        if fits && open.is_none() {
            open = Some(index);
        }
    }
    if let Some(first) = open {
        stretches.push((first, run.samples.len() - 1));
    }
    stretches
}

/// A stretch of a run that is predicted from its start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Place of the run.
    pub run: usize,
    /// First sample, where the prediction starts.
    pub first: usize,
    /// Last sample.
    pub last: usize,
}

/// Windows of a length that overlap by half within the stretches; a shorter stretch gives one if `least_s` fits.
#[must_use]
pub fn windows(runs: &[Run], wanted: Wanted, length_s: f64, least_s: f64) -> Vec<Window> {
    let mut windows = Vec::new();
    for (place, run) in runs.iter().enumerate() {
        for (first, last) in stretches(run, wanted) {
            let time = |index: usize| run.samples[index].t_s;
            let mut from = first;
            loop {
                // half a sample's time: rows are not quite regular
                let to = (from..=last).take_while(|&index| time(index) - time(from) <= length_s + 0.26).last();
                let to = to.unwrap_or(from);
                let is_whole = time(to) - time(from) >= length_s - 0.7;
                if !is_whole && (from != first || time(to) - time(from) < least_s) {
                    break;
                }
                windows.push(Window { run: place, first: from, last: to });
                if !is_whole {
                    break;
                }
                let next = (from..=last).find(|&index| time(index) - time(from) >= 0.5 * length_s);
                match next {
                    Some(next) if next > from => from = next,
                    _ => break,
                }
            }
        }
    }
    windows
}
