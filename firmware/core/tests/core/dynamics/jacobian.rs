//! Every derivative against dual numbers through the second derivation of the model.

use super::dual::Dual;
use super::support::{Random, assert_close, full_parameters, lopsided_parameters, model};
use super::textbook;
use backseat_core::dynamics::{ActuatorInput, Attitude, VehicleModel, VehicleParameters, kinematic_linearise};
use backseat_core::effects::{CATALOGUE, Motion};
use backseat_core::state::VehicleState;
use nalgebra::{SMatrix, Vector6};

/// Both sides are exact up to rounding. The largest cancellation is the roll row, where terms of some
/// 100 N m are divided by 0.2 kg m², and the growth of L near the vertical (1 / cos² 1.4 = 35); a wrong term
/// would show at 1e-3 or more.
const ROUNDING: f64 = 1.0e-11;

/// f, ∂f/∂x and ∂f/∂ξ of the second derivation.
fn reference(
    parameters: &VehicleParameters,
    x: &VehicleState,
    input: &ActuatorInput,
) -> (VehicleState, SMatrix<f64, 12, 12>, SMatrix<f64, 12, 5>) {
    let [top, bottom, port, starboard] = input.fins_rad;
    let xi = [input.propeller_radps, top, bottom, port, starboard];
    let along = |direction: usize| {
        let seed = |i: usize, value: f64| Dual { value, slope: f64::from(u8::from(i == direction)) };
        let x = core::array::from_fn(|i| seed(i, x[i]));
        let xi = core::array::from_fn(|i| seed(12 + i, xi[i]));
        textbook::derivative(parameters, &x, &xi)
    };
    let f = VehicleState::from(along(usize::MAX).map(|dual| dual.value));
    let by_state = SMatrix::from_fn(|row, column| along(column)[row].slope);
    let by_input = SMatrix::from_fn(|row, column| along(12 + column)[row].slope);
    (f, by_state, by_input)
}

fn assert_agrees(model: &VehicleModel, x: &VehicleState, input: &ActuatorInput) {
    let what = format!("x = {:?}, {input:?}", x.as_slice());
    let (f, by_state, by_input) = reference(model.parameters(), x, input);
    let ours = model.linearise(x, input);
    assert_close(&ours.f, &f, ROUNDING, &what);
    assert_close(&model.derivative(x, input), &f, ROUNDING, &what);
    assert_close(&ours.F(), &by_state, ROUNDING, &what);
    assert_close(&model.input_jacobian(x, input), &by_input, ROUNDING, &what);

    let kinematic = kinematic_linearise(x);
    let (mut f, mut by_state) = (f, by_state);
    f.rows_mut(6, 6).fill(0.0);
    by_state.rows_mut(6, 6).fill(0.0);
    assert_close(&kinematic.f, &f, ROUNDING, &what);
    assert_close(&kinematic.F(), &by_state, ROUNDING, &what);
}

#[test]
fn val_jacobians_match_dual_numbers_at_random_states() {
    let mut random = Random(1);
    for parameters in [VehicleParameters::IVER3, full_parameters(), lopsided_parameters()] {
        let model = model(&parameters);
        for _ in 0..500 {
            assert_agrees(&model, &random.state(), &random.input());
        }
    }
}

#[test]
fn val_jacobians_match_in_reverse_slow_and_one_axis_motion() {
    let model = model(&lopsided_parameters());
    let mut random = Random(2);
    for _ in 0..100 {
        let mut x = random.state();
        x[6] = -x[6].abs();
        assert_agrees(&model, &x, &random.input());
        x.rows_mut(6, 6).scale_mut(1.0e-6);
        assert_agrees(&model, &x, &random.input());
    }
    for axis in 6..12 {
        for speed in [-1.0, 1.0] {
            let mut x = VehicleState::zeros();
            x[axis] = speed;
            assert_agrees(&model, &x, &ActuatorInput { propeller_radps: 50.0, fins_rad: [0.1, -0.2, 0.3, 0.05] });
        }
    }
}

#[test]
fn val_jacobians_match_at_rest() {
    let model = model(&lopsided_parameters());
    let mut x = VehicleState::zeros();
    x[3] = 0.2;
    x[4] = -0.3;
    assert_agrees(&model, &x, &ActuatorInput { propeller_radps: 0.0, fins_rad: [0.3; 4] });
}

#[test]
fn val_actuator_regressor_times_beta_is_the_actuator_wrench() {
    let parameters = VehicleParameters { advance_n_s2_per_rad_m: 0.0, ..lopsided_parameters() };
    let model = model(&parameters);
    let beta = nalgebra::Vector5::new(
        parameters.cd[0],
        parameters.cd[1],
        parameters.cl[0],
        parameters.cl[1],
        parameters.beta5_n_s2_per_rad2,
    );
    let mut random = Random(3);
    for _ in 0..100 {
        let v = backseat_core::state::velocity(&random.state());
        let input = random.input();
        let mut wrench: nalgebra::Vector6<f64> = model.fin_wrenches(&v, &input.fins_rad).iter().sum();
        let thrust = model.propeller().thrust(input.propeller_radps, v[0]);
        wrench[0] += thrust;
        wrench[3] -= parameters.torque_arm_m * thrust;
        // The same sum in another order.
        assert_close(&(model.actuator_regressor(&v, &input) * beta), &wrench, 1e-12, "G_a beta");
    }
}

#[test]
fn val_wrenches_by_effects_are_the_exact_differences() {
    let mut random = Random(11);
    let with_column = CATALOGUE.iter().filter_map(|info| Some((info, info.hooks.plant?, info.hooks.wrench_by?)));
    let mut count = 0;
    for (info, plant, wrench_by) in with_column {
        for _ in 0..100 {
            let (x, input) = (random.state(), random.input());
            let (attitude, v) = (backseat_core::state::attitude(&x), backseat_core::state::velocity(&x));
            let wrench = |values: &[f64]| {
                let mut changed = lopsided_parameters();
                plant(values, 0.0, &mut changed);
                let model = model(&changed);
                model.acceleration(&attitude, &v, &input).component_mul(&Vector6::from(changed.m_diag))
            };
            let (velocity, down) = (v, Attitude::new(&attitude).down());
            let plant = lopsided_parameters();
            let motion = Motion { velocity: &velocity, down: &down, input: &input, plant: &plant };
            for (k, parameter) in info.parameters.iter().enumerate() {
                let step = 1e-3 * parameter.max;
                let at = |value: f64| {
                    let mut values = vec![0.0; info.parameters.len()];
                    values[k] = value;
                    wrench(&values)
                };
                let difference = (at(step) - at(-step)) / (2.0 * step);
                // Rounding of some 100 N; the moment of a pitch trim is a tangent: step²/3 of some 10 N m per rad.
                let curved = if info.name == "pitch_trim" { 10.0 * step * step } else { 0.0 };
                assert_close(&wrench_by(k, &motion), &difference, 1.0e-12 * 100.0 / step + curved, info.name);
                count += 1;
            }
        }
    }
    assert_eq!(count, 400, "linear_drag, thrust_loss, pitch_trim and buoyancy_offset");
}
