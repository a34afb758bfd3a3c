//! Columns of the augmented states against differences of whole predictions.

extern crate std;

use crate::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use crate::navigation::algebra::layout::EFFECTS;
use crate::navigation::filter::cekf::Filter;
use crate::navigation::*;
use crate::state::VEHICLE_STATES;
use std::boxed::Box;

/// Short: the filter leaves out how F changes along a step, an error of first order in the step.
const STEP_US: u64 = 4_000;

/// A fifth of a second with fins that move, from a turn at cruise.
fn flown(states: EffectStates, value: f64) -> Box<Filter> {
    let mut navigator = Box::new(Filter::new());
    let config = NavigationConfig { effect_states: states, surface: None, ..NavigationConfig::REFERENCE };
    navigator.configure(&config, &VehicleModel::new(&VehicleParameters::IVER3).expect("valid")).expect("valid");
    let at = [10.0, -5.0, 3.0, 0.05, -0.1, 0.7, 1.1, 0.08, -0.05, 0.1, -0.06, 0.12];
    let initial = InitialState { state: at.into(), sigma: [1e-6; VEHICLE_STATES].into() };
    navigator.initialise(0, &initial).expect("finite");
    navigator.x.set_tail(EFFECTS, &[value]);
    for k in 0..50_u64 {
        let turn = 0.01 * (k / 10) as f64;
        let input = ActuatorInput { propeller_radps: 120.0, fins_rad: [0.1 + turn, -0.1, 0.05 - turn, -0.02] };
        navigator.predict((k + 1) * STEP_US, &input, &mut ()).expect("predicts");
    }
    navigator
}

#[test]
fn val_columns_of_the_augmented_states_are_the_differences() {
    for state in EffectStates::robust(&Priors::DEFAULT).iter() {
        let accelerates = match state.parameter {
            StateParameter::Effect(id) => id.effect().hooks.accelerates(),
            StateParameter::LogFactor(_) | StateParameter::FinTrim(_) => true,
            StateParameter::CurrentRate(_) => false,
        };
        if !accelerates {
            continue;
        }
        // A lag of zero is the end of its range.
        let value = if state.parameter.group() == "fin_lag" { 0.1 } else { 0.02 };
        let step = 1e-3 * state.initial_sigma;
        let alone = EffectStates::NONE
            .with_state(EffectState { initial_sigma: step, random_walk_per_sqrt_s: 0.0, ..*state })
            .expect("room");
        let [filter, above, below] = [value, value + step, value - step].map(|value| flown(alone, value));
        let columns: [[f64; 2]; VEHICLE_STATES] = core::array::from_fn(|i| {
            let difference = (above.state_at(i) - below.state_at(i)) / (2.0 * step);
            [filter.covariance(i, EFFECTS) / (step * step), difference]
        });
        let size =
            |rows: core::ops::Range<usize>| columns[rows].iter().fold(1e-9, |most: f64, [_, d]| most.max(d.abs()));
        let name = [state.parameter.group(), state.parameter.name()];
        assert!(size(6..12) > 1e-4, "{name:?} moves nothing");
        for (i, [column, difference]) in columns.iter().enumerate() {
            // How F changes along a step is left out: 5 % of the block where roll is stiff, 1 % through the other axes.
            let tolerance = 0.05 * size(3 * (i / 3)..3 * (i / 3) + 3) + 0.01 * size(6..12);
            assert!((column - difference).abs() < tolerance, "{name:?} {i}: {column} {difference}");
        }
    }
}
