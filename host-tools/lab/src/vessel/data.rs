//! Surge, sway and yaw of a vessel with propellers and rudders: the coefficients of [`ManoeuvringModel`] from a log with
//! or without velocities.
//!
//! A first guess regresses the change of velocity over short windows on the integrals of the terms, of which those are
//! kept that the log tells apart. An output-error fit (`fit`) over segments of some ship's lengths, each with its own
//! start, then compares states with what was measured: velocities where the log has them, heading, and positions.

mod fit;

use super::model::{Coefficient, ManoeuvringModel, separable};
use super::readings::{Reading, SLOWEST_MPS, actuators, drives, integral, longest_step_s, measured, readings};
use backseat_core::state::wrap_angle;
use backseat_identify::IdentifyError;
use backseat_logs::Log;
use backseat_logs::stats::{median, rms};
use fit::Fit;
use nalgebra::{DMatrix, DVector};

/// States and outputs: surge, sway, yaw rate, heading, north, east.
const STATES: usize = 6;
/// How long a segment and a window of the first guess last, in the time that the vessel takes for its own length.
const SEGMENT: f64 = 2.0;
const WINDOW: f64 = 0.5;
/// Bounds of both, s.
const SEGMENT_S: [f64; 2] = [15.0, 120.0];
const WINDOW_S: [f64; 2] = [1.0, 10.0];
/// A window of the first guess has so many steps of the log at least: with one, half of the changes lie between windows.
const FEWEST_STEPS: f64 = 3.0;
/// A term counts if more than this share of it (root mean square) is not in those before it. Thrust and drag of a steady
/// speed are much alike; the fit tells them apart where the vessel turns, or changes its speed.
const OWN_SHARE: f64 = 0.01;
/// Fewer segments say nothing of how much they scatter.
const FEWEST_SEGMENTS: usize = 5;

/// Readings of a vessel under way, cut into stretches without a gap.
#[derive(Clone, Debug)]
pub struct ManoeuvringData {
    actuators: [Vec<backseat_logs::Column>; 2],
    measured: [bool; 3],
    stretches: Vec<Vec<Reading>>,
    length_m: f64,
}

/// A model with how it came about.
#[derive(Clone, Debug)]
pub struct ManoeuvringEstimate {
    /// The model, its intervals by the scatter between segments.
    pub model: ManoeuvringModel,
    /// Root mean square residual within the segments of surge, sway, yaw rate, heading, north, east; `None`: not measured.
    pub residual: [Option<f64>; STATES],
    /// Segments, and their length, s.
    pub segments: (usize, f64),
}

/// Errors at one horizon, root mean square: the model's, and those of a vessel that goes on as it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ManoeuvringPrediction {
    /// Horizon, s.
    pub horizon_s: f64,
    /// Speed over ground, m/s.
    pub speed_mps: [f64; 2],
    /// Heading, rad.
    pub heading_rad: [f64; 2],
    /// Place, m; NaN of a log without positions.
    pub position_m: [f64; 2],
    /// Number of predictions.
    pub count: usize,
}

impl ManoeuvringData {
    /// Takes it from a log; `length_m` of the vessel.
    #[must_use]
    pub fn from_log(log: &Log, length_m: f64) -> Self {
        let runs = readings(log);
        let drives = drives(&runs);
        let mut stretches = Vec::new();
        for (_, run) in runs {
            let longest_s = longest_step_s(&run);
            let goes_on = |a: &Reading, b: &Reading| b.t_s - a.t_s <= longest_s && drives(a) && drives(b);
            stretches.extend(run.chunk_by(goes_on).filter(|part| part.len() > 2).map(<[Reading]>::to_vec));
        }
        Self { actuators: actuators(log), measured: measured(log), stretches, length_m }
    }

    /// The first share of each stretch, and the rest.
    #[must_use]
    pub fn split(&self, share: f64) -> [Self; 2] {
        let cut = |part: fn(&[Reading], usize) -> &[Reading]| Self {
            stretches: self
                .stretches
                .iter()
                .map(|stretch| part(stretch, (stretch.len() as f64 * share) as usize).to_vec())
                .filter(|stretch| stretch.len() > 2)
                .collect(),
            ..self.clone()
        };
        [cut(|stretch, at| &stretch[..at]), cut(|stretch, at| &stretch[at..])]
    }

    /// Which of surge, sway and yaw rate the log measures; the others are the slopes of positions and heading.
    #[must_use]
    pub const fn measured(&self) -> [bool; 3] {
        self.measured
    }

    /// Time in which the vessel moves by its length, s.
    fn length_s(&self) -> f64 {
        let speeds: Vec<f64> = self.stretches.iter().flatten().map(|reading| reading.velocity[0]).collect();
        self.length_m / median(&speeds).unwrap_or(1.0).max(SLOWEST_MPS)
    }

    fn segments(&self, length_s: f64) -> Vec<&[Reading]> {
        let mut segments = Vec::new();
        for stretch in &self.stretches {
            let mut from = 0;
            while from + 2 < stretch.len() {
                let to = stretch.partition_point(|reading| reading.t_s <= stretch[from].t_s + length_s);
                if to == stretch.len() && stretch[to - 1].t_s - stretch[from].t_s < 0.5 * length_s {
                    break;
                }
                // one reading has no change
                if to - from > 1 {
                    segments.push(&stretch[from..to]);
                }
                from = to;
            }
        }
        segments
    }

    /// Terms that the log tells apart, and their coefficients by regression.
    fn first_guess(&self) -> ManoeuvringModel {
        let mut model = ManoeuvringModel { actuators: self.actuators.clone(), coefficients: Vec::new() };
        let steps: Vec<f64> = self
            .stretches
            .iter()
            .flat_map(|stretch| stretch.windows(2))
            .map(|pair| pair[1].t_s - pair[0].t_s)
            .collect();
        let least_s = FEWEST_STEPS * median(&steps).unwrap_or(0.0);
        let windows = self.segments((WINDOW * self.length_s()).clamp(WINDOW_S[0], WINDOW_S[1]).max(least_s));
        for axis in 0..3 {
            let integrals: Vec<Vec<f64>> = windows
                .iter()
                .map(|part| {
                    integral(part, &|reading| model.terms(axis).map(|term| term.value(&reading.manoeuvre())).collect())
                })
                .collect();
            let count = integrals.first().map_or(0, Vec::len);
            let columns: Vec<Vec<f64>> =
                (0..count).map(|term| integrals.iter().map(|integral| integral[term]).collect()).collect();
            let chosen = separable(&columns, OWN_SHARE);
            let a = DMatrix::from_fn(windows.len(), chosen.len(), |i, j| columns[chosen[j].0][i] / chosen[j].1);
            let change = |part: &[Reading]| part[part.len() - 1].velocity[axis] - part[0].velocity[axis];
            let b = DVector::from_iterator(windows.len(), windows.iter().map(|part| change(part)));
            let Some(factor) = (a.transpose() * &a).cholesky() else { continue };
            let theta = factor.solve(&(a.transpose() * b));
            model.coefficients.extend(chosen.iter().zip(theta.iter()).map(|(&(term, size), value)| Coefficient {
                axis,
                term,
                value: value / size,
                ci95: None,
            }));
        }
        model
    }

    /// Fits the model.
    ///
    /// # Errors
    /// If the vessel was under way for too short, or the log does not determine the coefficients.
    pub fn fit(&self) -> Result<ManoeuvringEstimate, IdentifyError> {
        let segment_s = (SEGMENT * self.length_s()).clamp(SEGMENT_S[0], SEGMENT_S[1]);
        let segments = self.segments(segment_s);
        if segments.len() < FEWEST_SEGMENTS {
            let message = format!(
                "manoeuvring: {} stretches of {segment_s:.0} s under way (two ship's lengths); at least {FEWEST_SEGMENTS} \
                 are needed",
                segments.len()
            );
            return Err(IdentifyError::Degenerate(message));
        }
        Fit::new(self, segments, self.first_guess()).run(segment_s)
    }

    /// Predicts over a horizon from every fifth of it, from what was measured until then.
    #[must_use]
    pub fn predict(&self, model: &ManoeuvringModel, horizon_s: f64) -> Option<ManoeuvringPrediction> {
        let mut errors: [Vec<f64>; 6] = Default::default();
        for stretch in &self.stretches {
            let mut next_s = f64::NEG_INFINITY;
            for (from, first) in stretch.iter().enumerate() {
                let until = stretch.partition_point(|reading| reading.t_s <= first.t_s + horizon_s + 1e-6);
                let last = &stretch[until - 1];
                let elapsed_s = last.t_s - first.t_s;
                if first.t_s < next_s || elapsed_s < 0.9 * horizon_s {
                    continue;
                }
                next_s = first.t_s + 0.2 * horizon_s;
                let Some(end) = model.simulate(start(first), &stretch[from..until]).pop() else { continue };
                let goes_on = goes_on(first, elapsed_s);
                let way = last.position_m.zip(first.position_m).map(|(to, from)| [to[0] - from[0], to[1] - from[1]]);
                for (place, [u, v, _, heading_rad, north, east]) in [end, goes_on].into_iter().enumerate() {
                    errors[place].push(u.hypot(v) - last.velocity[0].hypot(last.velocity[1]));
                    errors[2 + place].push(wrap_angle(heading_rad - last.heading_rad));
                    let origin = first.position_m.unwrap_or_default();
                    let missed = way.map(|way| (north - origin[0] - way[0]).hypot(east - origin[1] - way[1]));
                    errors[4 + place].extend(missed);
                }
            }
        }
        let count = errors[0].len();
        let pair = |of: usize| Some([rms(&errors[of])?, rms(&errors[of + 1])?]);
        let position_m = pair(4).unwrap_or([f64::NAN; 2]);
        Some(ManoeuvringPrediction { horizon_s, speed_mps: pair(0)?, heading_rad: pair(2)?, position_m, count })
    }
}

/// The state at a reading.
fn start(reading: &Reading) -> [f64; STATES] {
    let ([u, v, r], [north, east]) = (reading.velocity, reading.position_m.unwrap_or_default());
    [u, v, r, reading.heading_rad, north, east]
}

/// A vessel that keeps its speed and its yaw rate.
fn goes_on(first: &Reading, elapsed_s: f64) -> [f64; STATES] {
    let [u, v, r, heading_rad, north, east] = start(first);
    // the mean direction over an arc, and the chord's share of it
    let half = 0.5 * r * elapsed_s;
    let chord = if half == 0.0 { 1.0 } else { half.sin() / half };
    let (sin, cos) = (heading_rad + half).sin_cos();
    let way = [u * cos - v * sin, u * sin + v * cos].map(|speed| speed * chord * elapsed_s);
    [u, v, r, heading_rad + r * elapsed_s, north + way[0], east + way[1]]
}

#[cfg(test)]
mod tests;
