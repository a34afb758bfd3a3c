//! The thesis' choice of 4.2: acceleration from a differentiated DVL or from an AHRS's specific force.
//!
//! The accelerometer itself is perfect here and its lever arm known. Gravity is removed by a measured roll and pitch,
//! with noise or with a constant error. Both accelerations pass the same low-pass filter.

use super::acceleration::{Mounting, body_acceleration, specific_force};
use crate::experiment::Experiment;
use crate::intervals::with_interval;
use backseat_core::dynamics::Attitude;
use backseat_core::effects::EffectSet;
use backseat_identify::PERIOD_S;
use backseat_identify::simulation::{OUTPUTS, Output};
use backseat_identify::{IdentificationData, Sample, smoothing};
use backseat_report::markdown::markdown_table;
use nalgebra::{Vector3, Vector6};

/// Noise of linear velocity, m/s (Table 4.13).
const DVL_MPS: f64 = 0.013;
/// Constant error of roll and pitch in the third row, rad.
const TILT_RAD: f64 = 0.25 * std::f64::consts::PI / 180.0;
/// Cut-off of all, Hz.
const CUTOFF_HZ: f64 = 0.5;
const GRAVITY: f64 = 9.81;
/// Samples at the ends, where filters see less.
const MARGIN: usize = 50;

/// Rows of the table.
const NAMES: [&str; 3] =
    ["differentiated DVL, 1.3 cm/s", "AHRS, roll and pitch with 0.25° of noise", "AHRS, the same and 0.25° off"];

fn slope(samples: &[Sample], k: usize) -> Vector6<f64> {
    (samples[k + 1].velocity - samples[k - 1].velocity) / (2.0 * PERIOD_S)
}

/// Specific force of a perfect accelerometer, m/s².
fn felt(truth: &[Sample], k: usize, mounting: &Mounting) -> Vector3<f64> {
    let (x, slope) = (&truth[k], slope(truth, k));
    let part = |v: &Vector6<f64>, from: usize| Vector3::new(v[from], v[from + 1], v[from + 2]);
    let down = Attitude::new(&x.attitude).down();
    let (velocity, rates) = (part(&x.velocity, 0), part(&x.velocity, 3));
    specific_force(&part(&slope, 0), mounting, GRAVITY, &down, &velocity, &rates, &part(&slope, 3))
}

/// Root mean square errors of u̇, v̇, ẇ of every row, m/s².
pub type AccelerationErrors = [[f64; 3]; 3];

/// Those of a seed.
pub fn errors(seed: u64) -> Option<AccelerationErrors> {
    let experiment = Experiment { duration_s: 1000.0, ..Experiment::identification(DVL_MPS) };
    let run = experiment.run(seed);
    let truth = IdentificationData::from_log(&run.exact_log(), &EffectSet::NONE).ok()?;
    let measured = IdentificationData::from_log(&run.log, &EffectSet::NONE).ok()?;
    let (truth, measured) = (&truth.samples, &measured.samples);
    let mounting = Mounting { lever_m: Vector3::new(0.4, 0.0, -0.05), ..Mounting::ideal() };
    let part = |v: &Vector6<f64>, from: usize| Vector3::new(v[from], v[from + 1], v[from + 2]);
    let ahrs = |k: usize, tilt: f64| {
        let x = &measured[k];
        let down = Attitude::new(&(x.attitude + Vector3::new(tilt, tilt, 0.0))).down();
        let turning = part(&slope(measured, k), 3);
        let (velocity, rates) = (part(&x.velocity, 0), part(&x.velocity, 3));
        body_acceleration(&felt(truth, k, &mounting), &mounting, GRAVITY, &down, &velocity, &rates, &turning)
    };
    let filtered = |value: &dyn Fn(usize) -> Vector3<f64>| {
        let values: Vec<Output> = (1..truth.len() - 1)
            .map(|k| {
                let mut output = Output::zeros();
                output.fixed_rows_mut::<3>(0).copy_from(&value(k));
                output
            })
            .collect();
        smoothing::low_pass(&values, &[CUTOFF_HZ; OUTPUTS])
    };
    let reference = filtered(&|k| part(&slope(truth, k), 0));
    let rms = |values: Vec<Output>| {
        let inside = MARGIN..values.len() - MARGIN;
        let mut sum = Output::zeros();
        for k in inside.clone() {
            let error = values[k] - reference[k];
            sum += error.component_mul(&error);
        }
        core::array::from_fn(|axis| (sum[axis] / inside.len() as f64).sqrt())
    };
    Some([
        rms(filtered(&|k| part(&slope(measured, k), 0))),
        rms(filtered(&|k| ahrs(k, 0.0))),
        rms(filtered(&|k| ahrs(k, TILT_RAD))),
    ])
}

/// The table over so many seeds.
pub fn markdown(runs: u64, all: &[AccelerationErrors]) -> String {
    let out = format!(
        "Root mean square error of acceleration in m/s², all low-passed at {CUTOFF_HZ} Hz: mean (95 % interval of the mean) over \
         seeds 1 to {runs}.\n\n"
    );
    let mut table = markdown_table(["", "surge", "sway", "heave"]);
    for (row, name) in NAMES.iter().enumerate() {
        let of_axis = |axis: usize| all.iter().map(|errors| errors[row][axis]).collect::<Vec<f64>>();
        let cells = (0..3).map(|axis| with_interval(&of_axis(axis), 4));
        table.add_row([(*name).to_owned()].into_iter().chain(cells));
    }
    format!("{out}{table}\n")
}
