//! Sensitivities of the free run against differences.

use backseat_core::dynamics::VehicleModel;
use backseat_core::effects::EffectSet;
use backseat_identify::parameters::{self, EXTENDED};
use backseat_identify::simulation::{COLUMNS, OUTPUT_STATES, Sensitive, free_run, output, start};
use backseat_identify::{IdentificationData, Sample};
use backseat_lab::experiment::{Experiment, declared};

fn samples() -> Vec<Sample> {
    let run = Experiment { duration_s: 120.0, ..Experiment::cross_validation() }.run(1);
    IdentificationData::from_log(&run.exact_log(), &EffectSet::NONE).expect("usable").samples
}

#[test]
fn val_sensitivities_are_the_derivatives_of_the_run() {
    let samples = &samples()[..200];
    let vehicle = declared();
    let model = VehicleModel::new(&vehicle).expect("valid");
    let from = start(&samples[0]);
    let mut run = Sensitive::new(&from);
    for sample in &samples[..samples.len() - 1] {
        run.advance(&model, &sample.input);
    }
    let (values, scale) = (parameters::of(&vehicle), parameters::scale(&vehicle));
    for column in 0..COLUMNS {
        let end = |sign: f64| {
            let (mut values, mut from) = (values, from);
            let mut step = 1.0e-4;
            if column < EXTENDED {
                step *= scale[column];
                values[column] += sign * step;
            } else {
                from[OUTPUT_STATES[column - EXTENDED]] += sign * step;
            }
            let model = VehicleModel::new(&parameters::with(&vehicle, &values)).expect("valid");
            (output(free_run(&model, &from, samples).last().expect("a state")), step)
        };
        let ((above, step), (below, _)) = (end(1.0), end(-1.0));
        let expected = (above - below) / (2.0 * step);
        let found = run.sensitivity.column(column);
        // The Jacobian is taken in the middle of steps of 50 ms, in which roll turns by a third of a radian of its
        // oscillation.
        let error = (found - expected).amax() / expected.amax().max(1.0e-3 / step.max(1.0e-4));
        assert!(error < 0.02, "{column}: {error}");
    }
}
