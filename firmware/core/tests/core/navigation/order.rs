//! How fast the filter's step converges on the equations of motion.

use super::support::*;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::navigation::*;
use backseat_core::state::VehicleState;

const SPAN_US: u64 = 800_000;
/// A turn in which no velocity changes its sign: |v| v then has all its derivatives.
const INPUT: ActuatorInput = ActuatorInput { propeller_radps: 120.0, fins_rad: [0.1, -0.1, 0.05, -0.05] };

fn start() -> InitialState {
    let state = VehicleState::from([0.0, 0.0, 20.0, 0.02, 0.05, 0.3, 1.0, 0.05, 0.06, 0.02, 0.02, 0.1]);
    InitialState { state, ..initial() }
}

fn filter(step_us: u64) -> Box<Navigator> {
    let mut navigator = navigator(&NavigationConfig::REFERENCE);
    navigator.initialise(0, &start()).unwrap();
    (1..=SPAN_US / step_us).for_each(|k| navigator.predict(k * step_us, &INPUT).unwrap());
    navigator
}

/// Runge and Kutta's fourth-order rule in steps of 1 ms.
fn exact() -> VehicleState {
    let (model, h) = (model(), 1.0e-3);
    let mut x = start().state;
    for _ in 0..SPAN_US / 1000 {
        let k1 = model.derivative(&x, &INPUT);
        let k2 = model.derivative(&(x + k1 * (0.5 * h)), &INPUT);
        let k3 = model.derivative(&(x + k2 * (0.5 * h)), &INPUT);
        let k4 = model.derivative(&(x + k3 * h), &INPUT);
        x += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
    }
    x
}

#[test]
fn val_the_state_converges_with_the_second_order() {
    let exact = exact();
    let error = |step_us| (filter(step_us).state() - exact).amax();
    let errors = [100_000, 50_000, 25_000, 12_500].map(error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        println!("{:.2e} {order:.3}", pair[0]);
        // Halving a step of second order leaves a quarter; the third order adds a share of the step.
        assert!((1.8..2.2).contains(&order), "{order}");
    }
    // Over a step of the board, 0.1 s, what is left after eight of them.
    assert!(errors[0] < 2.0e-3, "{}", errors[0]);
}

#[test]
fn val_the_covariance_converges_with_the_first_order() {
    // Φ is that of the state at the start of a step.
    let fine = filter(625);
    let error = |step_us| {
        let navigator = filter(step_us);
        let mut largest: f64 = 0.0;
        for i in 0..12 {
            for j in 0..12 {
                let scale = (fine.variance(i) * fine.variance(j)).sqrt();
                largest = largest.max((navigator.covariance(i, j) - fine.covariance(i, j)).abs() / scale);
            }
        }
        largest
    };
    let errors = [40_000, 20_000, 10_000].map(error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        println!("{:.2e} {order:.3}", pair[0]);
        // The fine step itself is off by a sixteenth of the smallest error; the second order adds a share of the step.
        assert!((0.85..1.25).contains(&order), "{order}");
    }
}
