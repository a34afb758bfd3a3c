//! Gains, PD and trim against `data/nav_vectors.json` (an independent implementation; data/README.md).

use backseat_core::control::allocation::{AllocationMethod, Datum, allocate};
use backseat_core::control::guidance::GuidanceGains;
use backseat_core::control::lqr::{Lqr, lqr_input_matrix};
use backseat_core::control::pd::PdGains;
use backseat_core::control::riccati::{RiccatiError, RiccatiSolver};
use backseat_core::control::speed::{SpeedGains, propeller_radps};
use backseat_core::control::trackline::Segment;
use backseat_core::control::trim::Trim;
use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::state::{self, VehicleState};
use nalgebra::SMatrix;
use serde_json::Value;

fn vectors() -> Value {
    serde_json::from_str(include_str!("../../data/nav_vectors.json")).unwrap()
}

fn matrix<const R: usize, const C: usize>(value: &Value) -> SMatrix<f64, R, C> {
    SMatrix::from_fn(|i, j| value[i][j].as_f64().unwrap())
}

fn state(value: &Value) -> VehicleState {
    VehicleState::from_fn(|i, _| value[i].as_f64().unwrap())
}

fn model() -> VehicleModel {
    VehicleModel::new(&VehicleParameters::IVER3).unwrap()
}

/// Largest difference relative to the largest entry.
fn relative<const R: usize, const C: usize>(a: &SMatrix<f64, R, C>, b: &SMatrix<f64, R, C>) -> f64 {
    (a - b).amax() / b.amax()
}

/// Solves for [A, Q], B and R.
fn solve<const N: usize, const M: usize>(
    solver: &mut RiccatiSolver<N, M>,
    (a, q): (&SMatrix<f64, N, N>, &SMatrix<f64, N, N>),
    b: &SMatrix<f64, N, M>,
    r: &SMatrix<f64, M, M>,
) -> Result<(), RiccatiError> {
    let (own_a, own_q) = solver.matrices();
    own_a.copy_from(a);
    own_q.copy_from(q);
    solver.begin(b, r)?;
    let complete =
        (0..RiccatiSolver::<N, M>::MAX_STEPS).find_map(|_| solver.step().map(|done| done.then_some(())).transpose());
    complete.unwrap_or(Err(RiccatiError::NotStabilisable))
}

/// P and K, and the residual of the algebraic equation relative to Q.
fn check<const N: usize, const M: usize>(case: &Value) -> [f64; 3] {
    let (a, b) = (matrix::<N, N>(&case["A"]), matrix::<N, M>(&case["B"]));
    let (q, r) = (matrix::<N, N>(&case["Q"]), matrix::<M, M>(&case["R"]));
    let mut solver = Box::new(RiccatiSolver::<N, M>::new());
    solve(&mut solver, (&a, &q), &b, &r).unwrap();
    let p = *solver.cost();
    let mut k = SMatrix::zeros();
    solver.gain_to(&mut k);
    let residual = a.transpose() * p + p * a - k.transpose() * r * k + q;
    [relative(&p, &matrix(&case["P"])), relative(&k, &matrix(&case["K"])), residual.amax() / q.amax()]
}

#[test]
fn val_riccati_vehicle() {
    // The reference states its own residual as 2.6e-12; ours accumulates rounding over about 20 doublings of a 12 x 12
    // system with a condition number of about 1e6.
    let [p, k, residual] = check::<12, 3>(&vectors()["lqr_vehicle"]);
    println!("P {p:.1e} K {k:.1e} residual {residual:.1e}");
    assert!(p < 1e-9 && k < 1e-9 && residual < 1e-9, "P {p:e} K {k:e} residual {residual:e}");
}

#[test]
fn val_riccati_double_integrator() {
    // Closed form P = [[√3, 1], [1, √3]], well conditioned: rounding only.
    let [p, k, residual] = check::<2, 1>(&vectors()["lqr_double_integrator"]);
    assert!(p < 1e-12 && k < 1e-12 && residual < 1e-12, "P {p:e} K {k:e} residual {residual:e}");
}

#[test]
fn val_riccati_scalar_closed_form() {
    // ẋ = x + u, q = r = 1: P = 1 + √2.
    let one = SMatrix::<f64, 1, 1>::new(1.0);
    let mut solver = RiccatiSolver::<1, 1>::new();
    solve(&mut solver, (&one, &one), &one, &one).unwrap();
    assert!((solver.cost()[(0, 0)] - 1.0 - libm::sqrt(2.0)).abs() < 1e-13);
}

#[test]
fn riccati_refuses_what_has_no_solution() {
    let one = SMatrix::<f64, 1, 1>::new(1.0);
    let zero = SMatrix::<f64, 1, 1>::zeros();
    let nan = SMatrix::<f64, 1, 1>::new(f64::NAN);
    let mut solver = RiccatiSolver::<1, 1>::new();
    for (a, b, q, r) in [(&one, &zero, &one, &one), (&one, &one, &one, &zero), (&nan, &one, &one, &one)] {
        assert!(solve(&mut solver, (a, q), b, r).is_err());
    }
}

#[test]
fn val_lqr_input_matrix() {
    let b = lqr_input_matrix(&model());
    // Six products and quotients: exact to a unit in the last place.
    assert!(relative(&b, &matrix(&vectors()["lqr_vehicle"]["B"])) < 1e-15);
}

#[test]
fn val_lqr_at_the_reference_trim() {
    // The reference linearised at a rounded trim (-0.036 rad, 0.008 rad), we at the exact one: the gains agree as far
    // as the trims do.
    let model = model();
    let vectors = vectors();
    let mut lqr = Box::new(Lqr::new());
    lqr.configure(&model, 1.0).unwrap();
    let difference = relative(lqr.gain(), &matrix(&vectors["lqr_vehicle"]["K"]));
    println!("trim {:?}, K {difference:.1e}", lqr.trim());
    assert!((lqr.trim().pitch_rad + 0.036).abs() < 1e-3);
    assert!((lqr.trim().fins_rad[2] - 0.008).abs() < 2e-3);
    assert!((propeller_radps(model.propeller(), lqr.trim().thrust_n, 1.0) - 106.8).abs() < 0.5);
    assert!(difference < 1e-3, "{difference:e}");
}

#[test]
fn val_trim_is_an_equilibrium() {
    let model = model();
    for speed in [0.5, 0.8, 1.0, 1.5, 2.5] {
        let trim = Trim::solve(&model, speed).unwrap();
        let input = ActuatorInput {
            propeller_radps: propeller_radps(model.propeller(), trim.thrust_n, speed),
            fins_rad: trim.fins_rad,
        };
        let mut rate = model.derivative(&trim.state(), &input);
        rate[state::X] = 0.0; // The only thing that moves.
        // Newton stops at 1e-12.
        assert!(rate.amax() < 1e-11, "{speed}: {rate}");
    }
    assert_eq!(Trim::solve(&model, 0.0), None);
    assert_eq!(Trim::solve(&model, f64::NAN), None);
}

#[test]
fn val_trim_is_found_where_drag_across_the_hull_carries_the_vehicle() {
    // fins so weak that they alone would need half a radian: with w |w| a few degrees are enough
    let declared = VehicleParameters::IVER3;
    let displaced_mass_kg = declared.mass_kg + 0.3;
    let b_cb_to_cg_m = [0.0, 0.0, 0.003];
    let weak = VehicleParameters { cl: [0.44, 0.0], displaced_mass_kg, b_cb_to_cg_m, ..declared };
    let trim = Trim::solve(&VehicleModel::new(&weak).unwrap(), 1.0).unwrap();
    assert!((trim.pitch_rad + 0.059).abs() < 0.001, "{trim:?}");
}

#[test]
fn val_pd_kappa() {
    let vectors = vectors();
    let case = &vectors["pd_kappa"];
    let x = state(&case["est"]);
    let number = |key: &str| case["gains"][key].as_f64().unwrap();
    let pair = |value: &Value| [value[0].as_f64().unwrap(), value[1].as_f64().unwrap()];
    let segment = Segment {
        from_ne_m: pair(&case["seg"][0]),
        to_ne_m: pair(&case["seg"][1]),
        depth_m: case["z_d"].as_f64().unwrap(),
        speed_mps: case["u_d"].as_f64().unwrap(),
    };
    let guidance = GuidanceGains {
        kappa_psi: number("kappa_psi"),
        approach_max_rad: number("heading_sat_deg").to_radians(),
        kappa_theta: number("kappa_theta"),
        pitch_max_rad: number("pitch_sat_deg").to_radians(),
    };
    let pd =
        PdGains { kp_psi: number("Kp_psi"), kd_r: number("Kd_r"), kp_theta: number("Kp_theta"), kd_q: number("Kd_q") };
    let speed = SpeedGains { kp_u: number("Kp_u"), thrust_max_n: number("F_max") };
    assert_eq!((pd, speed), (PdGains::DEFAULT, SpeedGains::DEFAULT));
    // A constant and a product round differently.
    assert!((guidance.pitch_max_rad - GuidanceGains::DEFAULT.pitch_max_rad).abs() < 1e-15);

    // The reference holds pitch about zero, without the trim.
    let model = model();
    let error = segment.error(&x);
    let (heading, pitch) = (guidance.heading_rad(&error, 0.0), guidance.pitch_rad(&error, 0.0));
    let moments = pd.moments(&x, heading, pitch, 0.0, f64::INFINITY);
    let v = state::velocity(&x);
    let limit = number("fin_sat_deg").to_radians();
    let fins = allocate(AllocationMethod::Decoupled, &model, &v, &moments, &Datum::Total, limit);
    let propeller =
        propeller_radps(model.propeller(), speed.thrust_n(&model, &x, &fins, segment.speed_mps), x[state::U]);
    let expected: Vec<f64> = case["xi_out"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
    println!("{propeller} {fins:?}\n{expected:?}");
    // Both iterate the same nonlinear equations to convergence.
    assert!((propeller - expected[0]).abs() < 1e-8);
    for (fin, expected) in fins.iter().zip(&expected[1..]) {
        assert!((fin - expected).abs() < 1e-9);
    }
}
