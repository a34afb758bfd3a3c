//! The state at the start of a window, from what was measured around it.
//!
//! Attitude and depth are local polynomials through the rows within 1 s, their slopes give the rates; surge is the mean
//! of DVL readings of the last seconds (no later one); sway and heave follow from depth and DVL with their noise. What
//! comes later than 1 s after the start is not used.

use super::recording::Run;
use backseat_core::state::{P, PHI, PSI, Q, R, THETA, U, V, VehicleState, W, Z};

/// Rows within so much of the start make its polynomial, s.
const HALF_S: f64 = 1.05;
/// DVL readings of so many seconds before the start count.
const DVL_HELD_S: f64 = 1.3;

/// Value and slope at zero of a parabola through points (t, y) by least squares; of a line or the mean with fewer.
fn local(points: &[(f64, f64)]) -> [f64; 2] {
    let order = points.len().min(3);
    if order == 0 {
        return [0.0; 2];
    }
    let mut normal = nalgebra::DMatrix::zeros(order, order);
    let mut right = nalgebra::DVector::zeros(order);
    for (t, y) in points {
        for i in 0..order {
            right[i] += t.powi(i as i32) * y;
            for j in 0..order {
                normal[(i, j)] += t.powi((i + j) as i32);
            }
        }
    }
    let solved = normal.cholesky().map(|factor| factor.solve(&right));
    let mean = points.iter().map(|(_, y)| y).sum::<f64>() / points.len() as f64;
    solved.map_or([mean, 0.0], |solved| [solved[0], if order > 1 { solved[1] } else { 0.0 }])
}

/// The state at a sample; `speed_scale` is the DVL's reading over the true speed.
#[must_use]
pub fn measured_state(run: &Run, index: usize, dvl_delay_s: f64) -> VehicleState {
    let at_s = run.samples[index].t_s;
    // rows of the same stretch only
    let near = |half_s: f64| {
        run.samples.iter().filter(move |sample| (sample.t_s - at_s).abs() <= half_s)
    };
    let fit = |of: &dyn Fn(&super::recording::RunSample) -> f64| {
        let points: Vec<(f64, f64)> = near(HALF_S).map(|sample| (sample.t_s - at_s, of(sample))).collect();
        local(&points)
    };
    let [roll, roll_rate] = fit(&|sample| sample.attitude_rad[0]);
    let [pitch, pitch_rate] = fit(&|sample| sample.attitude_rad[1]);
    let [heading, heading_rate] = fit(&|sample| sample.attitude_rad[2]);
    let [depth, depth_rate] = fit(&|sample| sample.depth_m);
    let past = run.samples.iter().filter(|sample| {
        let age_s = at_s - sample.t_s;
        age_s <= DVL_HELD_S + dvl_delay_s && age_s >= -1e-9
    });
    let readings: Vec<[f64; 3]> = past.filter_map(|sample| sample.dvl_mps).collect();
    let mean = |axis: usize| match readings.len() {
        0 => 0.0,
        count => readings.iter().map(|reading| reading[axis]).sum::<f64>() / count as f64,
    };
    let (u, v) = (mean(0), 0.0);
    let (sin_roll, cos_roll) = roll.sin_cos();
    let (sin_pitch, cos_pitch) = pitch.sin_cos();
    // ż = −u sin θ + v sin φ cos θ + w cos φ cos θ
    let w = (depth_rate + u * sin_pitch - v * sin_roll * cos_pitch) / (cos_roll * cos_pitch).max(0.3);
    let mut x = VehicleState::zeros();
    x[Z] = depth;
    (x[PHI], x[THETA], x[PSI]) = (roll, pitch, heading);
    (x[U], x[V], x[W]) = (u, v, w.clamp(-0.5, 0.5));
    x[P] = roll_rate - heading_rate * sin_pitch;
    x[Q] = pitch_rate * cos_roll + heading_rate * sin_roll * cos_pitch;
    x[R] = -pitch_rate * sin_roll + heading_rate * cos_roll * cos_pitch;
    x
}

/// Which states the start leaves open, and one sigma of each.
pub const OPEN: [(usize, f64); 9] = [
    (PHI, 0.03),
    (THETA, 0.015),
    (PSI, 0.02),
    (Z, 0.08),
    (U, 0.05),
    (V, 0.08),
    (W, 0.06),
    (P, 0.20),
    (R, 0.06),
];
