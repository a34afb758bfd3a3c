//! Mean and variance that the filter expects of a range and a range rate against those of samples of its own Gaussian.

#![allow(clippy::disallowed_methods)] // the tests' own arithmetic need not have the same bits on every machine

extern crate std;

use crate::dynamics::{VehicleModel, VehicleParameters};
use crate::navigation::filter::cekf::Filter;
use crate::navigation::*;
use crate::random::Random;
use crate::state::{U, V, VehicleState, X, Y};
use std::boxed::Box;

/// North of the ship, m.
const RANGE_M: f64 = 400.0;
/// One sigma across the path, m, and of both velocities, m/s.
const ACROSS_M: f64 = 40.0;
const SPEED_SIGMA_MPS: f64 = 0.02;
/// Away from the ship, m/s.
const SPEED_MPS: f64 = 2.0;
const SAMPLES: usize = 100_000;

/// A vehicle on the heading north, at [`RANGE_M`], whose position across is known badly. `correlation`: of the position
/// and the velocity across.
fn filter(range_curvature: f64, correlation: f64) -> Box<Filter> {
    let mut filter = Box::new(Filter::new());
    let config = NavigationConfig {
        range_curvature,
        surface: None,
        ship_transducer_depth_m: 0.0,
        gate_sigma: 1000.0,
        ..NavigationConfig::REFERENCE
    };
    filter.configure(&config, &VehicleModel::new(&VehicleParameters::IVER3).expect("valid")).expect("valid");
    let (mut state, mut sigma) = (VehicleState::zeros(), VehicleState::repeat(1.0e-6));
    (state[X], state[U]) = (RANGE_M, SPEED_MPS);
    (sigma[X], sigma[Y], sigma[U], sigma[V]) = (1.0, ACROSS_M, SPEED_SIGMA_MPS, SPEED_SIGMA_MPS);
    filter.initialise(0, &InitialState { state, sigma }).expect("finite");
    filter.initialise_ship(&InitialShip { state: [0.0; 6], sigma: [1.0e-6; 6] }).expect("finite");
    filter.p.add(V, Y, correlation * ACROSS_M * SPEED_SIGMA_MPS);
    filter
}

/// Mean and variance that it expects of a measurement, without the noise of the sensor.
fn expected(filter: &mut Filter, measurement: &Measurement, noise: f64) -> [f64; 2] {
    let fused = filter.fuse(measurement);
    let record = fused.iter().next().expect("one scalar");
    assert_eq!(record.outcome, FusionOutcome::Fused);
    [-record.innovation, record.variance - noise * noise]
}

/// The same of samples, [range, range rate].
fn sampled(correlation: f64) -> [[f64; 2]; 2] {
    let mut random = Random(7);
    let mut sums = [[0.0; 2]; 2];
    for _ in 0..SAMPLES {
        let across = random.normal();
        let v = correlation * across + (1.0 - correlation * correlation).sqrt() * random.normal();
        let (x, y) = (RANGE_M + random.normal(), ACROSS_M * across);
        let (u, v) = (SPEED_MPS + SPEED_SIGMA_MPS * random.normal(), SPEED_SIGMA_MPS * v);
        let range = x.hypot(y);
        for (sum, value) in sums.iter_mut().zip([range, (x * u + y * v) / range]) {
            sum[0] += value;
            sum[1] += value * value;
        }
    }
    sums.map(|[sum, squares]| {
        let mean = sum / SAMPLES as f64;
        [mean, squares / SAMPLES as f64 - mean * mean]
    })
}

#[test]
fn val_ranges_and_range_rates_have_the_moments_of_samples() {
    let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Now };
    let SensorNoise { range_m, range_rate_mps, .. } = NavigationConfig::REFERENCE.sensors;
    let measurements = [
        (Measurement::Range { path, range_m: 0.0 }, range_m),
        (Measurement::RangeRate { path, range_rate_mps: 0.0 }, range_rate_mps),
    ];
    for correlation in [-0.8, 0.0, 0.8] {
        for ((measurement, noise), [mean, variance]) in measurements.iter().zip(sampled(correlation)) {
            let [second, first] =
                [0.0, 1.0e6].map(|curvature| expected(&mut filter(curvature, correlation), measurement, *noise));
            let shift = mean - first[0];
            // The fourth order takes 9/4 (sigma/r)², 2 %, from the shift of the mean, and more from the variance.
            assert!(
                (mean - second[0]).abs() < 0.15 * shift.abs(),
                "{measurement:?}: mean {mean}, {second:?}, {first:?}"
            );
            let [neglected, left] = [first, second].map(|of| (variance - of[1]).abs());
            assert!(left < 0.5 * neglected, "{measurement:?}: variance {variance}, {second:?}, {first:?}");
        }
    }
}
