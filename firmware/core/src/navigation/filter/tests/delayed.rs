//! Delayed states of six against the plain filter with full delayed copies (dense, vehicle 12 + current 2 + ship 6,
//! twice), on the same Φ and Q_d.

#![allow(clippy::disallowed_methods)] // the tests' own arithmetic need not have the same bits on every machine

extern crate std;

use crate::dynamics::{ActuatorInput, Attitude, VehicleModel, VehicleParameters};
use crate::navigation::filter::cekf::Filter;
use crate::navigation::*;
use crate::state::{PHI, PSI, U, VEHICLE_STATES, VehicleState, X, wrap_angle};
use nalgebra::{SMatrix, SVector, Vector3};
use std::boxed::Box;

/// Live states; the copies stand behind them.
const LIVE: usize = 20;
const CURRENT: usize = 12;
const SHIP: usize = 14;
const ALL: usize = 2 * LIVE;

type Vector = SVector<f64, ALL>;
type Matrix = SMatrix<f64, ALL, ALL>;

struct Plain {
    x: Box<Vector>,
    p: Box<Matrix>,
    /// Where R ν + c of the copy is linearised: at the clone, or `None` for its present estimate.
    velocity_at: Option<SVector<f64, LIVE>>,
}

/// R ν + c of twenty states from `at` on, and its Jacobian.
fn ground_velocity(x: &[f64]) -> (Vector3<f64>, SMatrix<f64, 3, LIVE>) {
    let attitude = Attitude::new(&Vector3::from_column_slice(&x[PHI..PHI + 3]));
    let nu = Vector3::from_column_slice(&x[U..U + 3]);
    let mut jacobian = SMatrix::<f64, 3, LIVE>::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, PHI).copy_from(&attitude.rotated_by_attitude(&nu));
    jacobian.fixed_view_mut::<3, 3>(0, U).copy_from(&attitude.rotation());
    jacobian[(0, CURRENT)] = 1.0;
    jacobian[(1, CURRENT + 1)] = 1.0;
    (attitude.rotation() * nu + Vector3::new(x[CURRENT], x[CURRENT + 1], 0.0), jacobian)
}

impl Plain {
    fn of(navigator: &Filter) -> Self {
        let mut plain = Self { x: Box::new(Vector::zeros()), p: Box::new(Matrix::zeros()), velocity_at: None };
        for j in 0..LIVE {
            plain.x[j] = navigator.state_at(j);
            for i in 0..LIVE {
                plain.p[(i, j)] = navigator.covariance(i, j);
            }
        }
        plain
    }

    fn predict(
        &mut self,
        step: &crate::navigation::algebra::discretisation::Discretisation,
        config: &NavigationConfig,
        h: f64,
    ) {
        let mut phi = Box::new(Matrix::identity());
        let mut q = Box::new(Matrix::zeros());
        for j in 0..VEHICLE_STATES {
            let mut unit = [0.0; VEHICLE_STATES];
            unit[j] = 1.0;
            for (i, value) in step.times(&unit).into_iter().enumerate() {
                phi[(i, j)] = value;
                q[(i, j)] = step.q[i.min(j)][i.max(j)];
            }
        }
        let walk = config.effect_states.current().expect("on").random_walk_per_sqrt_s;
        let ship = [config.ship_noise.linear_mps2_per_sqrt_hz; 2];
        let pairs = [
            (X, CURRENT, walk),
            (X + 1, CURRENT + 1, walk),
            (SHIP, SHIP + 3, ship[0]),
            (SHIP + 1, SHIP + 4, ship[1]),
            (SHIP + 2, SHIP + 5, config.ship_noise.angular_radps2_per_sqrt_hz),
        ];
        for (position, velocity, root) in pairs {
            let psd = root * root;
            phi[(position, velocity)] = h;
            q[(position, position)] += psd * h.powi(3) / 3.0;
            q[(position, velocity)] += psd * h.powi(2) / 2.0;
            q[(velocity, position)] += psd * h.powi(2) / 2.0;
            q[(velocity, velocity)] += psd * h;
            self.x[position] += h * self.x[velocity];
        }
        for i in 0..VEHICLE_STATES {
            self.x[i] += step.increment[i];
        }
        *self.p = *phi * *self.p * phi.transpose() + *q;
    }

    fn clone_all(&mut self) {
        let mut copy = Box::new(Matrix::zeros());
        for i in 0..LIVE {
            copy[(i, i)] = 1.0;
            copy[(LIVE + i, i)] = 1.0;
        }
        *self.x = *copy * *self.x;
        *self.p = *copy * *self.p * copy.transpose();
        self.velocity_at = Some(self.x.fixed_rows::<LIVE>(LIVE).into_owned());
    }

    /// Ends of a path: index offset of the vehicle's and of the ship's twenty states.
    fn range(&self, vehicle: usize, ship: usize, depth_m: f64) -> (f64, Vector) {
        let dp = self.dp(vehicle, ship, depth_m);
        let mut row = Vector::zeros();
        self.push_position(&mut row, vehicle, ship, &dp.normalize());
        (dp.norm(), row)
    }

    fn range_rate(&self, vehicle: usize, ship: usize, depth_m: f64) -> (f64, Vector) {
        let dp = self.dp(vehicle, ship, depth_m);
        let present = self.x.fixed_rows::<LIVE>(vehicle).into_owned();
        let at = self.velocity_at.filter(|_| vehicle > 0).unwrap_or(present);
        let (velocity, jacobian) = ground_velocity(at.as_slice());
        let velocity = velocity + jacobian * (present - at);
        let dv = velocity - Vector3::new(self.x[ship + SHIP + 3], self.x[ship + SHIP + 4], 0.0);
        let direction = dp.normalize();
        let rate = direction.dot(&dv);
        let mut row = Vector::zeros();
        self.push_position(&mut row, vehicle, ship, &((dv - direction * rate) / dp.norm()));
        let by_state = jacobian.tr_mul(&direction);
        for i in 0..LIVE {
            row[vehicle + i] += by_state[i];
        }
        for i in 0..2 {
            row[ship + SHIP + 3 + i] -= direction[i];
        }
        (rate, row)
    }

    fn dp(&self, vehicle: usize, ship: usize, depth_m: f64) -> Vector3<f64> {
        let x = &self.x;
        Vector3::new(x[vehicle] - x[ship + SHIP], x[vehicle + 1] - x[ship + SHIP + 1], x[vehicle + 2] - depth_m)
    }

    fn push_position(&self, row: &mut Vector, vehicle: usize, ship: usize, by: &Vector3<f64>) {
        for i in 0..3 {
            row[vehicle + i] += by[i];
        }
        for i in 0..2 {
            row[ship + SHIP + i] -= by[i];
        }
    }

    fn update(&mut self, z: f64, predicted: f64, h: &Vector, variance: f64) {
        let g = *self.p * h;
        let gain = g / (h.dot(&g) + variance);
        let joseph = Box::new(Matrix::identity() - gain * h.transpose());
        *self.x += gain * (z - predicted);
        *self.p = *joseph * *self.p * joseph.transpose() + gain * gain.transpose() * variance;
    }

    fn update_state(&mut self, z: f64, i: usize, sigma: f64) {
        let mut row = Vector::zeros();
        row[i] = 1.0;
        self.update(z, self.x[i], &row, sigma * sigma);
    }

    /// Largest deviation of live state and correlation.
    fn deviation(&self, navigator: &Filter) -> f64 {
        let mut worst: f64 = 0.0;
        for j in 0..LIVE {
            let difference = self.x[j] - navigator.state_at(j);
            worst = worst.max(if j == PSI { wrap_angle(difference).abs() } else { difference.abs() });
            for i in 0..LIVE {
                let scale = (self.p[(i, i)] * self.p[(j, j)]).sqrt();
                worst = worst.max((self.p[(i, j)] - navigator.covariance(i, j)).abs() / scale);
            }
        }
        worst
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Case {
    Downlink,
    Uplink,
    TwoWay,
}

/// Turns for half a minute with sensors, clones in between; the deviation at the end.
fn run(case: Case, linearise_again: bool) -> f64 {
    let config = NavigationConfig {
        effect_states: EffectStates::water_current(0.3, 1.0e-3),
        ship_transducer_depth_m: 2.0,
        gate_sigma: 1.0e3,
        range_curvature: 1.0e6, // to first order, as the plain copy
        ..NavigationConfig::REFERENCE
    };
    let model = VehicleModel::new(&VehicleParameters::IVER3).expect("valid");
    let mut navigator = Box::new(Filter::new());
    navigator.configure(&config, &model).expect("valid");
    let state = VehicleState::from([0.0, 0.0, 3.0, 0.0, -0.03, 0.4, 1.0, 0.0, -0.03, 0.0, 0.0, 0.0]);
    let sigma = VehicleState::from([3.0, 3.0, 0.1, 0.02, 0.02, 0.02, 0.1, 0.05, 0.05, 0.02, 0.02, 0.02]);
    navigator.initialise(0, &InitialState { state, sigma }).expect("valid");
    let ship = InitialShip { state: [150.0, 80.0, 0.0, 1.0, -1.5, 0.0], sigma: [0.5, 0.5, 0.1, 0.2, 0.2, 0.01] };
    navigator.initialise_ship(&ship, &mut ()).expect("valid");
    let mut plain = Plain::of(&navigator);
    let input = ActuatorInput { propeller_radps: 106.8, fins_rad: [0.15, -0.15, 0.02, -0.02] };
    let (mut vehicle_clone, mut ship_clone) = (None, None);
    for k in 1..=300_u64 {
        navigator.predict(k * 100_000, &input, &mut ()).expect("healthy");
        plain.predict(&navigator.step, &config, 0.1);
        let wobble = |i: usize| 0.01 * wrap_angle((k as f64 + 1.3) * (1.7 + i as f64));
        if k % 3 == 0 {
            let z = plain.x[2] + wobble(0);
            navigator.fuse(&Measurement::Depth { z_m: z }, &mut ());
            plain.update_state(z, 2, config.sensors.depth_m);
            let euler = core::array::from_fn(|i| plain.x[PHI + i] + wobble(i));
            navigator.fuse(&Measurement::Attitude { euler_rad: euler }, &mut ());
            (0..3).for_each(|i| plain.update_state(euler[i], PHI + i, config.sensors.attitude_rad));
        }
        if k % 10 == 0 {
            let fix = core::array::from_fn(|i| plain.x[SHIP + i] + 20.0 * wobble(i));
            navigator.fuse(&Measurement::ShipGnss { position_m: fix }, &mut ());
            (0..2).for_each(|i| plain.update_state(fix[i], SHIP + i, config.sensors.ship_gnss_m));
        }
        if k == 100 {
            vehicle_clone = (case != Case::Downlink).then(|| navigator.clone_vehicle(&mut ()).expect("free"));
            ship_clone = (case == Case::Downlink).then(|| navigator.clone_ship(&mut ()).expect("free"));
            plain.clone_all();
            if linearise_again {
                plain.velocity_at = None;
            }
        }
        if k == 120 || k == 140 {
            let depth_m = config.ship_transducer_depth_m;
            let path = AcousticPath {
                vehicle: vehicle_clone.map_or(VehicleEnd::Now, |clone| VehicleEnd::Delayed { clone, bridge_s: 0.0 }),
                ship: ship_clone.map_or(ShipEnd::Now, ShipEnd::Delayed),
            };
            let (vehicle, ship) = if case == Case::Downlink { (0, LIVE) } else { (LIVE, 0) };
            let variance = config.sensors.range_m * config.sensors.range_m;
            if case == Case::TwoWay {
                let back = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Now };
                let (out, out_row) = plain.range(LIVE, 0, depth_m);
                let (home, home_row) = plain.range(0, 0, depth_m);
                let predicted = 0.5 * (out + home);
                navigator.fuse(&Measurement::TwoWayRange { outward: path, back, range_m: predicted + 1.5 }, &mut ());
                plain.update(predicted + 1.5, predicted, &((out_row + home_row) * 0.5), variance);
            } else {
                let (predicted, row) = plain.range(vehicle, ship, depth_m);
                navigator.fuse(&Measurement::Range { path, range_m: predicted + 1.5 }, &mut ());
                plain.update(predicted + 1.5, predicted, &row, variance);
                let (predicted, row) = plain.range_rate(vehicle, ship, depth_m);
                let variance = config.sensors.range_rate_mps * config.sensors.range_rate_mps;
                navigator.fuse(&Measurement::RangeRate { path, range_rate_mps: predicted - 0.05 }, &mut ());
                plain.update(predicted - 0.05, predicted, &row, variance);
            }
        }
        if k == 160 {
            vehicle_clone.into_iter().chain(ship_clone).for_each(|id| navigator.drop_clone(id, &mut ()));
        }
    }
    assert_eq!(navigator.dimension(), LIVE);
    plain.deviation(&navigator)
}

#[test]
fn val_small_clones_equal_full_delayed_copies() {
    for case in [Case::Downlink, Case::Uplink, Case::TwoWay] {
        // Rounding of 300 steps in 20 to 40 states, positions near 1e2.
        let deviation = run(case, false);
        assert!(deviation < 1e-10, "{case:?} {deviation:e}");
    }
}

#[test]
fn val_relinearising_the_delayed_velocity_is_second_order() {
    // Attitude at the clone moves by some 0.01 rad until the uplink's range rate is fused: 1e-4 of the velocity, and
    // the range rate moves nothing by more than a sigma.
    let deviation = run(Case::Uplink, true);
    assert!(deviation < 2e-3 && deviation > 0.0, "{deviation:e}");
}
