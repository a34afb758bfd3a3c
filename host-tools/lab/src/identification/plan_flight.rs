//! Flights of the simulator's vehicle: along a mission, or with open-loop inputs, sampled at 10 Hz.

use crate::closed_loop::TrueVehicle;
use crate::experiment::{Noise, Programme};
use backseat_core::state::{self, VehicleState};
use backseat_identify::plan::{Body, exact_sample};
use backseat_identify::{IdentificationData, PERIOD_S, Sample};
use hil_sim::rng::{Source, Stream};
use hil_sim::truth::{Parameters, State, Undeclared};
use nalgebra::{Vector3, Vector6};

/// The simulator's vehicle, to assess a plan: heading north at a depth, at 1 m/s.
pub fn true_vehicle(parameters: &Parameters, depth_m: f64, seed: u64) -> TrueVehicle {
    let start = State::new([0.0, 0.0, depth_m], [0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]);
    TrueVehicle::new(parameters, Undeclared::default(), start, seed)
}

/// The open-loop inputs of a programme of the thesis' experiment for a time, or until `ends` holds.
pub fn open_loop(
    body: &mut impl Body,
    programme: &Programme,
    duration_s: f64,
    ends: impl Fn(&VehicleState) -> bool,
) -> Vec<(Sample, f64)> {
    let mut samples = Vec::new();
    for step in 0..(duration_s / PERIOD_S).round() as u64 {
        let x = body.state();
        if ends(&x) {
            break;
        }
        let input = programme.input(step as f64 * PERIOD_S);
        samples.push((exact_sample(step, &x, &input), x[state::Z]));
        body.step(&input);
    }
    samples
}

/// Exact samples with the noise of the sensors added.
pub fn measured(stretches: &[Vec<(Sample, f64)>], noise: &Noise, seed: u64) -> IdentificationData {
    let (mut ahrs, mut dvl) = (Stream::new(seed, Source::Ahrs), Stream::new(seed, Source::Dvl));
    let mut data = IdentificationData::default();
    for stretch in stretches {
        let from = data.samples.len();
        let offset_us = data.samples.last().map_or(0, |last| last.time_us + 10_000_000);
        for (sample, _) in stretch {
            let [roll, pitch] = ahrs.normals::<2>(noise.roll_pitch_rad);
            let ([u, v, w], [p, q, r]) = (dvl.normals::<3>(noise.linear_mps), ahrs.normals::<3>(noise.angular_radps));
            data.samples.push(Sample {
                time_us: sample.time_us + offset_us,
                attitude: sample.attitude + Vector3::new(roll, pitch, 0.0),
                velocity: sample.velocity + Vector6::new(u, v, w, p, q, r),
                input: sample.input,
            });
        }
        data.stretches.push(from..data.samples.len());
    }
    data
}
