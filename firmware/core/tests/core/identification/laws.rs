//! What the laws promise, on random states: the sparse forms, the Lyapunov identity, the conserved norm, the signs.

use super::simulation::{EXCITATION, advance, start, wrong};
use super::support::{Random, VEHICLE, model};
use backseat_core::dynamics::{Attitude, VehicleParameters};
use backseat_core::identification::aid::{AidState, Instant, gradient, heun, interval, model_acceleration, rates};
use backseat_core::identification::regressor::{Regressor, known_wrench, regressor};
use backseat_core::identification::theta::{B1, BETA1, BETA5, D11, M11, PARAMETERS, Theta, W, theta_of};
use backseat_core::identification::{DriftMonitor, ParameterBox};
use backseat_core::state;
use nalgebra::{SMatrix, Vector3, Vector6};

/// Everything on that is zero on the reference vehicle: h is not zero.
const FULL: VehicleParameters = VehicleParameters {
    d26: 6.0,
    d35: -4.0,
    linear_surge_ns_per_m: 0.7,
    advance_n_s2_per_rad_m: 0.004,
    moment_uu: [0.06, -0.3, 0.2],
    z_uw: -25.0,
    torque_arm_m: 0.02,
    b_cb_to_cg_m: [0.003, -0.002, 0.015],
    ..VEHICLE
};

/// Gains of different sizes, as large in proportion as real ones.
fn gains(random: &mut Random) -> Theta {
    theta_of(&VEHICLE).map(|value| (0.2 + value * value) * (1.0 + random.within(0.5)) * 1.0e-3)
}

#[test]
fn val_regressor_times_theta_is_what_the_model_lacks() {
    // Y(v̇, …) θ = h at the acceleration of the model, whose terms are written elsewhere.
    let mut random = Random(1);
    let vehicle = model(&FULL);
    let theta = theta_of(&FULL);
    for _ in 0..200 {
        let (v, attitude, input) = (random.velocity(), random.attitude(), random.inputs());
        let at = Instant::new(&vehicle, &v, &Attitude::new(&attitude).down(), &input);
        let a = vehicle.acceleration(&attitude, &v, &input);
        let mut y = Regressor::zeros();
        regressor(&a, &v, &at.down, &at.actuators, &mut y);
        // Terms of hundreds of newtons.
        assert!((y * theta - known_wrench(&FULL, &v, &input)).amax() < 1.0e-11);
        assert!((model_acceleration(&theta, &at) - a).amax() < 1.0e-11);
    }
}

#[test]
fn val_sparse_gradient_is_the_transposed_regressor() {
    let mut random = Random(2);
    let vehicle = model(&VEHICLE);
    for _ in 0..200 {
        let (v, input) = (random.velocity(), random.inputs());
        let at = Instant::new(&vehicle, &v, &Attitude::new(&random.attitude()).down(), &input);
        let (a, error) = (random.velocity(), random.velocity());
        let mut y = Regressor::zeros();
        regressor(&a, &v, &at.down, &at.actuators, &mut y);
        let expected = y.tr_mul(&error);
        assert!((gradient(&a, &error, &at) - expected).amax() <= 1.0e-13 * (1.0 + expected.amax()));
    }
}

#[test]
fn val_lyapunov_function_falls_as_it_should() {
    // V̇ = Δvᵀ M Δv̇ + θ̃ᵀ Γ⁻¹ dθ̂/dt = −α Δvᵀ M Δv along the true motion, also with h.
    let mut random = Random(3);
    let vehicle = model(&FULL);
    let theta = theta_of(&FULL);
    let mass = Vector6::from(FULL.m_diag);
    let alpha = 0.3;
    for _ in 0..1000 {
        let (v, attitude, input) = (random.velocity(), random.attitude(), random.inputs());
        let at = Instant::new(&vehicle, &v, &Attitude::new(&attitude).down(), &input);
        let estimate = theta.map(|value| value * (1.0 + random.within(0.5)));
        let x = AidState { velocity: v + random.velocity(), theta: estimate };
        let rates = rates(&x, alpha, &at);
        let error = x.velocity - v;
        let error_rate = rates.velocity - vehicle.acceleration(&attitude, &v, &input);
        let [kinetic, parametric] = [
            error.component_mul(&mass).dot(&error_rate),
            // θ̃ᵀ Γ⁻¹ Γ Yᵀ Δv: the gains cancel.
            (estimate - theta).dot(&rates.gradient),
        ];
        let expected = -alpha * error.component_mul(&mass).dot(&error);
        let size = 1.0 + kinetic.abs() + parametric.abs();
        assert!((kinetic + parametric - expected).abs() <= 1.0e-12 * size, "{kinetic} + {parametric} != {expected}");
    }
}

#[test]
fn val_norm_of_theta_is_conserved_over_a_run() {
    // θ̂ᵀ Γ⁻¹ θ̂ is constant but for Heun's error of order dt²: ten times finer, a hundred times better.
    let vehicle = model(&VEHICLE);
    let drift = |refine: u32| {
        let mut random = Random(4);
        let prior = theta_of(&wrong(0.3, &mut random));
        // A hundredth: at full strength Heun's step of 0.1 s is not stable on this motion.
        let gains = 0.01 * gains(&mut random);
        let norm = |theta: &Theta| theta.component_div(&gains).dot(theta);
        let mut motion = start();
        let (mut x, dt) = (AidState { velocity: state::velocity(&motion), theta: prior }, 0.1 / f64::from(refine));
        for step in 0..300_u32 {
            let input = EXCITATION.input(f64::from(step) * 0.1);
            let after = advance(&vehicle, &motion, &input);
            // Any smooth signal will do between the samples: the norm does not ask whose motion it is.
            let at = |k: u32| {
                let share = f64::from(k) / f64::from(refine);
                let between = motion * (1.0 - share) + after * share;
                let down = Attitude::new(&state::attitude(&between)).down();
                Instant::new(&vehicle, &state::velocity(&between), &down, &input)
            };
            for k in 0..refine {
                let first = rates(&x, 0.3, &at(k));
                x = heun(&x, &first, &gains, 0.3, &at(k + 1), dt);
            }
            motion = after;
        }
        assert!((x.theta - prior).norm() > 1.0e-2, "it adapted");
        (norm(&x.theta) / norm(&prior) - 1.0).abs()
    };
    let (coarse, fine) = (drift(1), drift(10));
    assert!(coarse < 1.0e-3, "{coarse:e}");
    assert!(fine < 0.02 * coarse || fine < 1.0e-12, "{fine:e} after {coarse:e}");
}

#[test]
fn val_a_perfect_model_explains_what_happens_between_samples() {
    // Inputs held from sample to sample; the true motion by Runge-Kutta steps of half a period.
    let vehicle = model(&VEHICLE);
    let theta = theta_of(&VEHICLE);
    let dt = 0.1;
    let mut x = start();
    let (mut missed, mut plain, mut all) = (Vector6::zeros(), Vector6::zeros(), Vector6::zeros());
    for step in 0..2000_u32 {
        let input = EXCITATION.input(f64::from(step) * dt);
        let after = advance(&vehicle, &x, &input);
        let [then, now] = [x, after].map(|x| (state::velocity(&x), Attitude::new(&state::attitude(&x)).down()));
        let ends = [(&then.0, &then.1), (&now.0, &now.1)];
        let mean =
            |ends: [Instant; 2]| ends.iter().map(|at| model_acceleration(&theta, at)).sum::<Vector6<f64>>() * 0.5;
        let truth = (now.0 - then.0) / dt;
        let square = |error: Vector6<f64>| error.component_mul(&error);
        missed += square(mean(interval(&vehicle, &theta, ends, &input, dt)) - truth);
        plain += square(mean(ends.map(|(v, down)| Instant::new(&vehicle, v, down, &input))) - truth);
        all += square(truth);
        x = after;
    }
    for axis in 0..6 {
        let share = |squares: Vector6<f64>| libm::sqrt(squares[axis] / all[axis]);
        // Seen: 1e-5 (surge) to 5e-4 (roll), half of which is the Runge-Kutta steps' own.
        assert!(share(missed) < 1.0e-3, "{axis}: {}", share(missed));
        assert!(share(missed) < 0.1 * share(plain), "{axis}: {} of {}", share(missed), share(plain));
    }
    assert!(libm::sqrt(plain[3] / all[3]) > 0.05, "roll is what the correction is for");
}

/// dθ̂/dt of parameter j when v̂ is `error` too fast along an axis.
fn response(parameter: usize, velocity: Vector6<f64>, down: Vector3<f64>, axis: usize, error: f64) -> f64 {
    let mut actuators = SMatrix::zeros();
    actuators[(0, 4)] = 100.0 * 100.0;
    actuators[(0, 0)] = -1.0;
    let at = Instant { velocity, down, actuators, known: Vector6::zeros() };
    let mut delta = Vector6::zeros();
    delta[axis] = error;
    gradient(&Vector6::repeat(0.0), &delta, &at)[parameter]
}

#[test]
fn signs_are_those_of_common_sense() {
    let level = Vector3::z();
    let ahead = Vector6::new(1.5, 0.0, 0.0, 0.0, 0.0, 0.0);
    // The model is too fast: more drag, less thrust, more fin drag.
    assert!(response(D11, ahead, level, 0, 0.1) > 0.0);
    assert!(response(BETA5, ahead, level, 0, 0.1) < 0.0);
    assert!(response(BETA1, ahead, level, 0, 0.1) > 0.0);
    // It goes astern, and the model goes astern less: less drag.
    assert!(response(D11, -ahead, level, 0, 0.1) < 0.0);
    // It sinks too fast: less weight.
    assert!(response(W, ahead, level, 2, 0.1) < 0.0);
    // Rolled to starboard and rolling back too fast (p < 0): less righting moment; the same nose up (q < 0).
    let starboard = Attitude::new(&Vector3::new(0.3, 0.0, 0.0)).down();
    assert!(response(B1 + 2, ahead, starboard, 3, -0.1) < 0.0);
    let nose_up = Attitude::new(&Vector3::new(0.0, 0.3, 0.0)).down();
    assert!(response(B1 + 2, ahead, nose_up, 4, -0.1) < 0.0);
    // Speeding up, and the model does so too much: more mass.
    let at = Instant { velocity: ahead, down: level, actuators: SMatrix::zeros(), known: Vector6::zeros() };
    let axis = Vector6::x();
    assert!(gradient(&axis, &(axis * 0.1), &at)[M11] > 0.0);
}

#[test]
fn the_box_keeps_its_contents() {
    let prior = theta_of(&VEHICLE);
    let bounds = ParameterBox::around(&VEHICLE, [0.3, 3.0]);
    let mut inside = prior;
    assert_eq!(bounds.project(&mut inside), 0);
    assert_eq!(inside, prior);

    let mut below = prior.map(|_| -1.0e9);
    assert_eq!(bounds.project(&mut below), (1 << PARAMETERS) - 1);
    let mut above = prior.map(|_| 1.0e9);
    assert_eq!(bounds.project(&mut above), (1 << PARAMETERS) - 1);
    for j in 0..PARAMETERS {
        assert!(below[j] < prior[j] && prior[j] < above[j], "{j}");
        match j {
            W => assert!(above[j] > 0.0 && below[j] < -10.0, "two litres of water"),
            j if j == B1 || j == B1 + 1 => assert_eq!([below[j], above[j]], [-prior[B1 + 2], prior[B1 + 2]]),
            j => {
                let [mut a, mut b] = [0.3 * prior[j], 3.0 * prior[j]];
                if a > b {
                    (a, b) = (b, a);
                }
                assert_eq!([below[j], above[j]], [a, b]);
            }
        }
    }
}

#[test]
fn drift_is_seen_against_noise_and_no_drift_is_not() {
    let mut random = Random(5);
    let mut monitor = DriftMonitor::new();
    let gains = Theta::repeat(1.0);
    let mut wander = 0.0;
    let mut observe = |monitor: &mut DriftMonitor, mean: f64, random: &mut Random| {
        // First-order noise with a correlation of 20 s, as estimates have.
        wander += -0.005 * wander + 0.01 * random.normal();
        let mut theta = Theta::repeat(1.0 + wander);
        theta[W] += mean;
        monitor.observe(&theta, &gains, 0.1);
    };
    for _ in 0..200_000 {
        observe(&mut monitor, 0.0, &mut random);
        assert_eq!(monitor.drifted(), 0, "no change in 20 000 s");
    }
    for _ in 0..2000 {
        observe(&mut monitor, 2.0, &mut random);
    }
    assert_eq!(monitor.drifted(), 1 << W, "twenty sigma in 200 s, {}", monitor.scores()[W]);
    assert!(monitor.scores()[W] > 0.0);
}
