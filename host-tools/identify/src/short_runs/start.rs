//! The state at the start of a window, from what was measured around it.
//!
//! Attitude is that of the row, rates are central differences over the rows beside it; depth is a line through the rows
//! within 1 s; surge is the mean of the DVL readings of the last seconds. A torpedo turns about a point ahead of its centre
//! of gravity, which gives sway and heave from the rates: a DVL at 1 Hz knows them worse. With the motor stopped the
//! vehicle rises or sinks by its weight, and heave follows from the depth. What comes later than 1 s after the start is
//! not used.

use super::model::Dvl;
use super::recording::{Run, RunSample};
use backseat_core::state::{P, PHI, PSI, Q, R, THETA, U, V, VehicleState, W, Z};

/// Rows within so much of the start make its depth, s.
const HALF_S: f64 = 1.05;
/// DVL readings of so many seconds before the start count.
const DVL_HELD_S: f64 = 1.3;
/// A DVL whose delay is still being sought may be so late, s.
const DVL_LATE_S: f64 = 0.7;
/// The point that a torpedo turns about lies so far ahead of the centre of gravity, m.
const PIVOT_M: f64 = 0.3;
/// Rows further apart give no rate, s.
const WIDEST_S: f64 = 2.5;

/// The state at a sample, by a DVL that reads so.
#[must_use]
pub fn measured_state(run: &Run, index: usize, dvl: &Dvl) -> VehicleState {
    let here = &run.samples[index];
    let at_s = here.t_s;
    let [before, after] = beside(run, index);
    let [roll, pitch, heading] = here.attitude_rad;
    let [roll_rate, pitch_rate, heading_rate] = rates(before.unwrap_or(here), after.unwrap_or(here));
    let near = |sample: &&RunSample| (sample.t_s - at_s).abs() <= HALF_S;
    let depths: Vec<f64> = run.samples.iter().filter(near).map(|sample| sample.depth_m).collect();
    let is_past = |sample: &&RunSample| {
        let age_s = at_s - sample.t_s;
        age_s <= DVL_HELD_S + dvl.delay_s.max(DVL_LATE_S) && age_s >= -1e-9
    };
    let readings: Vec<f64> = run.samples.iter().filter(is_past).filter_map(|sample| Some(sample.dvl_mps?[0])).collect();
    let mean = |values: &[f64]| {
        if values.is_empty() { None } else { Some(values.iter().sum::<f64>() / values.len() as f64) }
    };
    let (sin_roll, cos_roll) = roll.sin_cos();
    let (sin_pitch, cos_pitch) = pitch.sin_cos();
    let mut x = VehicleState::zeros();
    x[Z] = mean(&depths).unwrap_or(here.depth_m);
    (x[PHI], x[THETA], x[PSI]) = (roll, pitch, heading);
    x[P] = roll_rate - heading_rate * sin_pitch;
    x[Q] = pitch_rate * cos_roll + heading_rate * sin_roll * cos_pitch;
    x[R] = -pitch_rate * sin_roll + heading_rate * cos_roll * cos_pitch;
    x[U] = mean(&readings).unwrap_or(0.0) / (1.0 + dvl.scale);
    (x[V], x[W]) = (-PIVOT_M * x[R], PIVOT_M * x[Q]);
    if !here.is_powered()
        && let Some(sinks_mps) = depth_rate(run.samples.iter().filter(near))
    {
        x[W] = (sinks_mps + x[U] * sin_pitch) / cos_pitch.max(0.5) / cos_roll.max(0.5);
    }
    x
}

/// The rows beside a row, where they are near.
fn beside(run: &Run, index: usize) -> [Option<&RunSample>; 2] {
    let at_s = run.samples[index].t_s;
    let near = |other: usize| run.samples.get(other).filter(|sample| (sample.t_s - at_s).abs() < WIDEST_S / 2.0);
    [index.checked_sub(1).and_then(near), near(index + 1)]
}

/// Mean rates of roll, pitch, heading from one row to another, rad/s.
fn rates(from: &RunSample, to: &RunSample) -> [f64; 3] {
    let span_s = to.t_s - from.t_s;
    let rate = |axis: usize| (to.attitude_rad[axis] - from.attitude_rad[axis]) / span_s;
    if span_s > 0.0 { [rate(0), rate(1), rate(2)] } else { [0.0; 3] }
}

/// Slope of the depth over samples, m/s.
fn depth_rate<'a>(samples: impl Iterator<Item = &'a RunSample>) -> Option<f64> {
    let points: Vec<[f64; 2]> = samples.map(|sample| [sample.t_s, sample.depth_m]).collect();
    let count = points.len() as f64;
    let [t_s, depth_m] = [0_usize, 1].map(|i| points.iter().map(|point| point[i]).sum::<f64>() / count);
    let above: f64 = points.iter().map(|point| (point[0] - t_s) * (point[1] - depth_m)).sum();
    let below: f64 = points.iter().map(|point| (point[0] - t_s).powi(2)).sum();
    (below > 0.0).then(|| above / below)
}

/// States that a start leaves open, and one sigma of each where the motion is steady: loose ones would take up what the
/// model does wrong.
pub const OPEN: [(usize, f64); 10] = [
    (PHI, 0.004),
    (THETA, 0.003),
    (PSI, 0.004),
    (Z, 0.05),
    (U, 0.05),
    (V, 0.03),
    (W, 0.04),
    (P, 0.05),
    (Q, 0.006),
    (R, 0.006),
];

/// Share of the change of a rate from before a row to after it that the rate at the row may be off by.
const UNSTEADY: f64 = 0.5;

/// One sigma of what a measured start leaves open, in the order of [`OPEN`]: more where the vehicle begins to turn or ends
/// to, for a difference over two rows is not its rate at the row between, and where it turns, for it need not turn about
/// the point assumed. A model held to such a start is wrong in its inertia and damping instead.
#[must_use]
pub fn open(run: &Run, index: usize) -> [f64; OPEN.len()] {
    let mut sigmas = OPEN.map(|(_, sigma)| sigma);
    if let [Some(before), Some(after)] = beside(run, index) {
        let here = &run.samples[index];
        let (first, next, mean) = (rates(before, here), rates(here, after), rates(before, after));
        let change = |axis: usize| UNSTEADY * (next[axis] - first[axis]);
        let more = [PIVOT_M * mean[2], PIVOT_M * mean[1], change(0), change(1), change(2)];
        sigmas[5..].iter_mut().zip(more).for_each(|(sigma, more)| *sigma = sigma.hypot(more));
    }
    sigmas
}

/// A start moved by what is open; its surge is that of readings times a factor.
#[must_use]
pub fn moved(start: &VehicleState, surge_factor: f64, by: &[f64]) -> VehicleState {
    let mut moved = *start;
    moved[U] *= surge_factor;
    for ((state, _), value) in OPEN.iter().zip(by) {
        moved[*state] += value;
    }
    moved
}
