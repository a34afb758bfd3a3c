//! 4.3.2.1, the first NBLS study: its experiment, and which of Table 4.7's noises NBLS bears.

use super::{Kind, Measured, Study};
use crate::experiment::{Between, Experiment, Motion, Noise, References, declared, wrong_prior};
use crate::identification::nullspace::{self, ORDER};
use backseat_core::dynamics::VehicleParameters;
use backseat_core::effects::EffectSet;
use backseat_core::identification::theta::M11;
use backseat_core::state::{P, U};
use backseat_identify::{IdentificationData, Method, Options, identify, parameters};
use backseat_logs::Truth;
use backseat_logs::stats::median;
use hil_sim::rng::{Source, Stream};
use nalgebra::Vector6;

/// Noise by noise.
pub const FIRST_NBLS: Study = Study { name: "first nbls", kind: Kind::Own(run) };

/// Table 4.7: velocity, m/s; rates, rad/s; attitude, rad; accelerations, m/s² and rad/s².
const VELOCITY_MPS: f64 = 0.05;
const RATES_DEGPS: f64 = 0.36;
const ATTITUDE_DEG: f64 = 0.1;
const ACCELERATIONS: [f64; 2] = [0.001, 0.05 * std::f64::consts::PI / 180.0];
/// Cut-off of all signals, which the thesis does not give, Hz.
const CUTOFF_HZ: f64 = 0.3;
/// Share by which the prior of the other method is wrong at most; NBLS has none but the scale.
const WRONG: f64 = 0.3;

/// How much of each noise of Table 4.7 there is.
#[derive(Clone, Copy, Debug)]
struct Shares {
    velocity: f64,
    rates: f64,
    attitude: f64,
    accelerations: f64,
}

const NONE: Shares = Shares { velocity: 0.0, rates: 0.0, attitude: 0.0, accelerations: 0.0 };
const ALL: Shares = Shares { velocity: 1.0, rates: 1.0, attitude: 1.0, accelerations: 1.0 };

const ROWS: [(&str, Shares); 10] = [
    ("no noise", NONE),
    ("accelerations alone", Shares { accelerations: 1.0, ..NONE }),
    ("attitude alone", Shares { attitude: 1.0, ..NONE }),
    ("rates alone", Shares { rates: 1.0, ..NONE }),
    ("velocity alone", Shares { velocity: 1.0, ..NONE }),
    ("velocity alone, a tenth", Shares { velocity: 0.1, ..NONE }),
    ("all", ALL),
    ("all, velocity a tenth", Shares { velocity: 0.1, ..ALL }),
    ("all, rates a tenth", Shares { rates: 0.1, ..ALL }),
    ("all, velocity and rates a tenth", Shares { velocity: 0.1, rates: 0.1, ..ALL }),
];

/// Log and measured accelerations of the references of Table 4.6, 30 minutes.
fn experiment(seed: u64, shares: Shares) -> anyhow::Result<(IdentificationData, Vec<Vector6<f64>>)> {
    let noise = Noise {
        linear_mps: VELOCITY_MPS * shares.velocity,
        angular_radps: RATES_DEGPS.to_radians() * shares.rates,
        roll_pitch_rad: ATTITUDE_DEG.to_radians() * shares.attitude,
    };
    let motion = Motion::References(References::TABLE_4_6);
    let run =
        Experiment { motion, duration_s: 1800.0, noise, cross_drag: [0.0; 2], between: Between::default() }.run(seed);
    let data = IdentificationData::from_log(&run.log, &EffectSet::NONE)?;
    let mut random = Stream::new(seed, Source::Disturbance);
    let sigma = Vector6::from_fn(|i, _| ACCELERATIONS[i / 3] * shares.accelerations);
    let noisy = |a: &[f64; 6]| Vector6::from(*a) + sigma.map(|sigma| sigma * random.normal());
    Ok((data, run.accelerations.iter().map(noisy).collect()))
}

fn nbls(seed: u64, shares: Shares) -> anyhow::Result<VehicleParameters> {
    let (data, accelerations) = experiment(seed, shares)?;
    let values = nullspace::unbounded(&data, Some(&accelerations), &declared(), M11, CUTOFF_HZ)?;
    Ok(parameters::with(&declared(), &values))
}

/// NBLS with the whole noise of Table 4.7.
pub fn by_nbls(seed: u64) -> anyhow::Result<VehicleParameters> {
    nbls(seed, ALL)
}

/// Output error on the same log, without its accelerations.
pub fn by_output_error(seed: u64) -> anyhow::Result<VehicleParameters> {
    let options = Options::of_noise(VELOCITY_MPS, RATES_DEGPS.to_radians(), ATTITUDE_DEG.to_radians());
    let data = experiment(seed, ALL)?.0;
    Ok(identify(Method::OutputError, &data, &wrong_prior(WRONG, seed), &options, &|_| {})?.vehicle)
}

/// Lines to and fro in closed loop, without noise.
const LINES: Experiment = Experiment {
    motion: Motion::Lines,
    duration_s: 5000.0,
    noise: Noise::NONE,
    cross_drag: [0.0; 2],
    between: Between { continuous: false, delay_s: 0.0 },
};

/// The true vehicle along the lines.
pub fn lines() -> Truth {
    LINES.run(0).truth
}

/// A vehicle alone, without noise, under the same controller along the same lines: its velocities against the true
/// one's, in the columns of Table 4.8, and whether its simulation completes.
pub fn keep_predicted(measured: &mut Measured, row: &str, vehicle: &VehicleParameters, lines: &Truth) {
    let flown = LINES.run_of(vehicle, 0).truth;
    let completes = flown.rows.iter().all(|row| row.state.iter().all(|value| value.is_finite()));
    let mut errors = [if completes { 0.0 } else { f64::NAN }; 6];
    for (flown, truth) in flown.rows.iter().zip(&lines.rows) {
        for (axis, sum) in errors.iter_mut().enumerate() {
            let error = (flown.state[U + axis] - truth.state[U + axis]).abs() / lines.rows.len() as f64;
            *sum += if U + axis < P { error } else { error.to_degrees() };
        }
    }
    keep_motion(measured, row, &errors);
    measured.set(row, "completes", f64::from(u8::from(completes)));
}

fn run(seed: u64) -> anyhow::Result<Measured> {
    let (mut measured, lines) = (Measured::default(), lines());
    for (row, shares) in ROWS {
        keep(&mut measured, row, &nbls(seed, shares)?, &lines);
    }
    keep(&mut measured, "all, by output error", &by_output_error(seed)?, &lines);
    Ok(measured)
}

fn keep(measured: &mut Measured, row: &str, vehicle: &VehicleParameters, lines: &Truth) {
    let (found, truth) = (parameters::of(vehicle), parameters::of(&declared()));
    let estimated = || ORDER.into_iter().filter(|&j| truth[j] != 0.0 && j != M11);
    measured.set(row, "wrong_sign", estimated().filter(|&j| found[j] * truth[j] < 0.0).count() as f64);
    let errors: Vec<f64> = estimated().map(|j| 100.0 * (found[j] / truth[j] - 1.0).abs()).collect();
    measured.set(row, "median_percent", median(&errors).unwrap_or(f64::NAN));
    keep_predicted(measured, row, vehicle, lines);
}

/// Columns of Table 4.8.
const MOTION: [&str; 6] = ["u_mps", "v_mps", "w_mps", "p_degps", "q_degps", "r_degps"];

/// Keeps the errors of a row of Table 4.8.
pub fn keep_motion(measured: &mut Measured, row: &str, errors: &[f64; 6]) {
    MOTION.iter().zip(errors).for_each(|(column, error)| measured.set(row, column, *error));
}
