//! What must hold for any vehicle: energy, rest, mirror symmetry, invariance to place and heading.

use super::support::{Random, assert_close, full_parameters, model};
use backseat_core::dynamics::{ActuatorInput, Attitude, VehicleModel, VehicleParameters, cross_drag_limit};
use backseat_core::state::{PSI, VehicleState, attitude, velocity};
use nalgebra::{Matrix3, Vector3, Vector6};

/// ½ vᵀ M v plus the potential of weight and buoyancy, J.
fn energy(model: &VehicleModel, x: &VehicleState) -> f64 {
    let v = velocity(x);
    let kinetic = 0.5 * v.component_mul(&v).dot(&Vector6::from(model.parameters().m_diag));
    kinetic + model.restoring().potential_j(x[2], &Attitude::new(&attitude(x)).down())
}

#[test]
fn val_no_energy_without_thrust() {
    // d26 and d35 as large as they may be.
    let d = full_parameters().quadratic_diag;
    let parameters = VehicleParameters {
        d26: 0.999_999 * cross_drag_limit(d[1], d[5]),
        d35: -0.999_999 * cross_drag_limit(d[2], d[4]),
        ..full_parameters()
    };
    let model = model(&parameters);
    let mut random = Random(4);
    for _ in 0..2000 {
        let x = random.state();
        let input = ActuatorInput { propeller_radps: 0.0, ..random.input() };
        // dE/dt by the chain rule over a step so short that only rounding is added: the rate itself is
        // exact in the model, E is some 1e3 J.
        let (x_dot, h) = (model.derivative(&x, &input), 1.0e-5);
        let rate = (energy(&model, &(x + x_dot * h)) - energy(&model, &(x - x_dot * h))) / (2.0 * h);
        assert!(rate <= 1.0e-6, "energy grows by {rate} W at {:?}", x.as_slice());
    }
}

#[test]
fn val_energy_falls_along_a_free_trajectory() {
    let model = model(&full_parameters());
    let mut random = Random(5);
    for _ in 0..20 {
        let mut x = random.state();
        x[6] = x[6].abs() + 0.5;
        let limit = model.parameters().delta_max_rad;
        let input = ActuatorInput { propeller_radps: 0.0, fins_rad: [(); 4].map(|()| random.within(limit)) };
        let mut before = energy(&model, &x);
        for _ in 0..2000 {
            let half = x + model.derivative(&x, &input) * 0.0005;
            x += model.derivative(&half, &input) * 0.001;
            let after = energy(&model, &x);
            // Dissipation outweighs the midpoint rule's own error on these motions; rounding of some 200 J.
            assert!(after <= before + 1.0e-9, "energy rose from {before} to {after} J");
            before = after;
            // The step resolves Euler angles only away from the vertical.
            if libm::cos(x[4]).abs() < 0.2 {
                break;
            }
        }
    }
}

#[test]
fn val_coriolis_does_no_work() {
    let model = model(&full_parameters());
    let mut random = Random(6);
    for _ in 0..1000 {
        let v = velocity(&random.state());
        // Cancellation of terms of some 100 W.
        assert!(v.dot(&model.coriolis(&v)).abs() < 1.0e-12 * 100.0);
    }
}

#[test]
fn val_cross_drag_limit_is_where_drag_stops_being_dissipative() {
    // Quoted for the reference vehicle by the independent implementation: "about 99".
    let limit = cross_drag_limit(170.0, 60.0);
    assert!((limit - 99.0).abs() < 0.5, "{limit}");
    for (d_a, d_b) in [(170.0, 60.0), (1.0, 1.0), (60.0, 170.0), (1.0e6, 1.0e-3), (1.0e-3, 1.0e7)] {
        let limit = cross_drag_limit(d_a, d_b);
        // Smallest power over the ratio t of the speeds, by a fine logarithmic scan.
        let smallest = |d_ab: f64| {
            (-60_000..=60_000)
                .map(|i| libm::exp(f64::from(i) * 2.5e-4))
                .map(|t| (d_a * t * t * t + d_b - d_ab * (t * t + t)) / (t * t + t))
                .fold(f64::INFINITY, f64::min)
        };
        assert!(smallest(0.999 * limit) > 0.0, "{d_a} {d_b}");
        assert!(smallest(1.001 * limit) < 0.0, "{d_a} {d_b}");
    }
    // d_a = d_b = d: t = 1, limit d.
    assert!((cross_drag_limit(7.0, 7.0) - 7.0).abs() < 1.0e-14 * 7.0);
}

#[test]
fn val_rest_stays_rest_when_neutrally_trimmed() {
    let model = model(&VehicleParameters { displaced_mass_kg: 38.0, ..VehicleParameters::IVER3 });
    for heading in [0.0, 1.0, -2.5] {
        let mut x = VehicleState::zeros();
        x[PSI] = heading;
        let input = ActuatorInput { propeller_radps: 0.0, fins_rad: [0.3, -0.2, 0.1, 0.4] };
        assert_eq!(model.derivative(&x, &input), VehicleState::zeros());
    }
}

#[test]
fn val_mirror_image_flies_the_mirror_track() {
    // y, φ, ψ, v, p, r change sign; so do vertical fins; port and starboard swap with changed sign.
    let mirror = |x: &VehicleState| {
        let signs = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
        x.component_mul(&VehicleState::from(signs))
    };
    let parameters = full_parameters();
    let mut mirrored = parameters;
    mirrored.b_cb_to_cg_m[1] *= -1.0;
    let (model, mirrored) = (model(&parameters), super::support::model(&mirrored));
    let mut random = Random(7);
    for _ in 0..500 {
        let (x, input) = (random.state(), random.input());
        let [top, bottom, port, starboard] = input.fins_rad;
        let image = ActuatorInput { fins_rad: [-top, -bottom, -starboard, -port], ..input };
        // The fins' φ are rounded multiples of π/2: 1e-16 times accelerations of some 1e3 rad/s².
        let ours = mirrored.derivative(&mirror(&x), &image);
        assert_close(&ours, &mirror(&model.derivative(&x, &input)), 1.0e-12, "mirror image");
    }
}

#[test]
fn val_place_and_heading_only_turn_the_track() {
    let model = model(&full_parameters());
    let mut random = Random(8);
    for _ in 0..100 {
        let (x, input) = (random.state(), random.input());
        let turn = random.within(3.0);
        let mut moved = x;
        moved[0] += 500.0;
        moved[1] -= 300.0;
        moved[2] += 20.0;
        moved[PSI] += turn;
        let (here, there) = (model.derivative(&x, &input), model.derivative(&moved, &input));
        let (sin, cos) = libm::sincos(turn);
        let turned = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0) * here.fixed_rows::<3>(0);
        // One more rotation: rounding of numbers near 1.
        assert_close(&there.fixed_rows::<3>(0).into_owned(), &turned, 1.0e-14, "velocity over ground");
        assert_eq!(here.fixed_rows::<9>(3), there.fixed_rows::<9>(3));
    }
}

#[test]
fn val_euler_rates_turn_the_rotation_matrix() {
    // Ṙ = R J(ω), by the derivative of R along the Euler rates.
    let mut random = Random(9);
    for _ in 0..100 {
        let x = random.state();
        let (euler, omega) = (attitude(&x), Vector3::new(x[9], x[10], x[11]));
        let attitude = Attitude::new(&euler);
        let rates = attitude.euler_rate_matrix() * omega;
        for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let moved = attitude.rotated_by_attitude(&axis) * rates;
            // Cancellation of terms up to 1 / cos 1.4 = 6.
            assert_close(&moved, &(attitude.rotation() * omega.cross(&axis)), 1.0e-13, "rotation rate");
        }
    }
}

#[test]
fn val_fins_turn_the_vehicle_as_documented() {
    let model = model(&VehicleParameters::IVER3);
    let mut v = Vector6::zeros();
    v[0] = 1.0;
    let wrench = |fins_rad: [f64; 4]| -> Vector6<f64> { model.fin_wrenches(&v, &fins_rad).iter().sum() };
    assert!(wrench([0.1, 0.0, 0.0, 0.0])[5] > 0.1, "+top: nose to starboard");
    assert!(wrench([0.0, 0.1, 0.0, 0.0])[5] < -0.1, "+bottom: nose to port");
    assert!(wrench([0.0, 0.0, 0.1, 0.0])[4] > 0.1, "+port: nose up");
    assert!(wrench([0.0, 0.0, 0.0, 0.1])[4] < -0.1, "+starboard: nose down");
    assert!(wrench([0.1; 4])[3] < -0.1, "all four +: negative roll");
}
