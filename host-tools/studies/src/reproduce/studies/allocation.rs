//! 3.1.4: cost and accuracy of the two allocations of moments to fins.

use super::{Measured, Study};
use anyhow::Context;
use backseat_core::control::allocation::{AllocationMethod, Datum, Moments, allocate};
use backseat_core::dynamics::VehicleModel;
use backseat_data::VehicleFile;
use hil_sim::rng::{Source, Stream};
use nalgebra::Vector6;
use std::hint::black_box;
use std::time::Instant;

/// Both allocations on random motions and moments.
pub const ALLOCATION: Study = Study { name: "allocation", run };

/// Motions and moments of a run.
const CASES: usize = 4000;
/// Repetitions, of which the fastest counts.
const REPETITIONS: usize = 10;
/// Largest fin angle, rad.
const LIMIT_RAD: f64 = 0.35;

struct Case {
    velocity: Vector6<f64>,
    moments: Moments,
}

fn run(seed: u64) -> anyhow::Result<Measured> {
    let vehicle = VehicleFile::reference();
    let model = VehicleModel::new(&vehicle.parameters).ok().context("the reference vehicle")?;
    let mut random = Stream::new(seed, Source::Mission);
    let cases: Vec<Case> = (0..CASES).map(|_| case(&mut random)).collect();
    let mut measured = Measured::default();
    for (row, method) in [("decoupled", AllocationMethod::Decoupled), ("6-DOF", AllocationMethod::SixDof)] {
        let give = |case: &Case| allocate(method, &model, &case.velocity, &case.moments, &Datum::Total, LIMIT_RAD);
        let once = || {
            let began = Instant::now();
            for case in &cases {
                black_box(give(black_box(case)));
            }
            began.elapsed().as_secs_f64()
        };
        // Other processes can only make it slower.
        let least_s = (0..REPETITIONS).map(|_| once()).fold(f64::INFINITY, f64::min);
        measured.set(row, "time_us", least_s * 1.0e6 / CASES as f64);
        let (mut wrong, mut wanted, mut within, mut squares) = (0.0, 0.0, 0, 0.0);
        for case in &cases {
            let fins = give(case);
            if fins.iter().any(|fin| fin.abs() > LIMIT_RAD - 1.0e-9) {
                continue;
            }
            let wrench: Vector6<f64> = model.fin_wrenches(&case.velocity, &fins).iter().sum();
            let Moments { pitch_nm, yaw_nm, .. } = case.moments;
            wrong += (wrench[4] - pitch_nm).powi(2) + (wrench[5] - yaw_nm).powi(2);
            wanted += pitch_nm * pitch_nm + yaw_nm * yaw_nm;
            squares += fins.iter().map(|fin| fin * fin).sum::<f64>() / 4.0;
            within += 1;
        }
        measured.set(row, "moment_error_percent", 100.0 * (wrong / wanted).sqrt());
        measured.set(row, "fins_deg", (squares / f64::from(within.max(1))).sqrt().to_degrees());
        measured.set(row, "within_percent", 100.0 * f64::from(within) / CASES as f64);
    }
    let ratio = measured.rows["6-DOF"]["time_us"] / measured.rows["decoupled"]["time_us"];
    measured.set("6-DOF", "time_ratio", ratio);
    measured.set("decoupled", "time_ratio", 1.0);
    Ok(measured)
}

/// Motions and moments of a survey: 0.7 to 1.5 m/s ahead, some sideslip and turning, moments within the fins' reach.
fn case(random: &mut Stream) -> Case {
    let surge = 0.7 + 0.8 * random.uniform();
    let velocity = Vector6::new(
        surge,
        0.05 * random.normal(),
        0.05 * random.normal(),
        0.05 * random.normal(),
        0.05 * random.normal(),
        0.1 * random.normal(),
    );
    // Lift grows with the square of speed.
    let moment = 1.5 * surge * surge;
    let moments = Moments { roll_nm: 0.0, pitch_nm: moment * random.normal(), yaw_nm: moment * random.normal() };
    Case { velocity, moments }
}
