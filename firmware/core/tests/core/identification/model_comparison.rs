//! Which of several parameter sets predicts better, and how sure that is.

use super::simulation::{EXCITATION, PERIOD_S, advance, start};
use super::support::{Random, VEHICLE, assert_close, model};
use backseat_core::dynamics::{ActuatorInput, VehicleParameters};
use backseat_core::identification::theta::theta_of;
use backseat_core::identification::{FEWEST_STRETCHES, HORIZON_STEPS, ModelComparison, ModelRole};
use backseat_core::state;
use nalgebra::{Vector3, Vector6};

const ATTITUDE_NOISE: f64 = 4.0e-3;
const NOISE: [f64; 6] = [0.01, 0.01, 0.01, 2.0e-3, 2.0e-3, 2.0e-3];

/// The vehicle's own motion, measured with noise, before a comparison of these sets.
fn run(
    comparison: &mut ModelComparison,
    sets: &[(ModelRole, VehicleParameters)],
    noise: f64,
    stretches: u16,
    random: &mut Random,
) {
    comparison.configure(ATTITUDE_NOISE, &NOISE, &[0.0; 6], PERIOD_S);
    for (role, set) in sets {
        comparison.enter(*role, Some(&theta_of(set)));
    }
    let vehicle = model(&VEHICLE);
    let mut x = start();
    let mut before = ActuatorInput::default();
    // one sample more a stretch: its start
    for step in 0..u64::from(stretches) * u64::from(HORIZON_STEPS + 1) {
        let (mut attitude, mut velocity) = (state::attitude(&x), state::velocity(&x));
        for axis in 0..2 {
            attitude[axis] += noise * random.normal(ATTITUDE_NOISE);
        }
        for (value, sigma) in velocity.iter_mut().zip(NOISE) {
            *value += noise * random.normal(sigma);
        }
        let ended = comparison.sample(&vehicle, step * 100_000, &attitude, &velocity, &before);
        assert_eq!(ended, (step + 1).is_multiple_of(u64::from(HORIZON_STEPS + 1)));
        before = EXCITATION.input(step as f64 * PERIOD_S);
        x = advance(&vehicle, &x, &before);
    }
}

/// Drag and thrust that let the vehicle be slower by as much.
fn slower(share: f64) -> VehicleParameters {
    let mut set = VEHICLE;
    set.beta5_n_s2_per_rad2 *= 1.0 - share;
    set
}

/// Without noise the true set misses by nothing but the integration of a tenth instead of a twentieth of a second.
#[test]
fn val_the_truth_predicts_itself() {
    let mut comparison = ModelComparison::new();
    run(&mut comparison, &[(ModelRole::Active, VEHICLE), (ModelRole::Candidate, slower(0.1))], 0.0, 3, &mut Random(1));
    let evidence = comparison.evidence(ModelRole::Candidate);
    assert_eq!(evidence.stretches, 3);
    // Seen: 7e-4 of the noise's variance, the error of such a step at roll's 1 Hz.
    assert!(evidence.error[0] < 2.0e-3, "{evidence:?}");
    assert!(evidence.error[1] > 1.0, "{evidence:?}");
    assert!(evidence.gain < 0.0 && !evidence.is_better());
}

/// One-dimensional: a vehicle at rest but for surge, whose prediction is constant, misses by exactly what it is off by.
#[test]
fn val_misses_are_weighed_by_noise_and_process_noise() {
    let vehicle = VehicleParameters { displaced_mass_kg: VEHICLE.mass_kg, ..VEHICLE };
    let model = model(&vehicle);
    let mut comparison = ModelComparison::new();
    let density = [0.01, 0.0, 0.0, 0.0, 0.0, 0.0];
    comparison.configure(ATTITUDE_NOISE, &NOISE, &density, PERIOD_S);
    comparison.enter(ModelRole::Active, Some(&theta_of(&vehicle)));
    comparison.enter(ModelRole::Candidate, Some(&theta_of(&vehicle)));
    let at = |u: f64| Vector6::new(u, 0.0, 0.0, 0.0, 0.0, 0.0);
    let input = ActuatorInput::default();
    assert!(!comparison.sample(&model, 0, &Vector3::zeros(), &at(0.0), &input));
    for step in 1..=u64::from(HORIZON_STEPS) {
        comparison.sample(&model, step * 100_000, &Vector3::new(0.0, 0.0, 1.0), &at(0.05), &input);
    }
    let evidence = comparison.evidence(ModelRole::Candidate);
    // 0.05² over the noise 0.01² and what the process adds until the stretch's middle, a mean over eight channels;
    // equal sets gain nothing.
    let middle_s = 0.5 * f64::from(HORIZON_STEPS) * PERIOD_S;
    let expected = 0.05 * 0.05 / (1.0e-4 + 1.0e-4 * middle_s) / 8.0;
    assert_close(&evidence.error, &[expected; 2], 1e-12, "error");
    assert_eq!((evidence.gain, evidence.is_better()), (0.0, false));
}

#[test]
fn a_better_set_wins_and_a_worse_one_does_not() {
    let mut comparison = ModelComparison::new();
    let sets =
        [(ModelRole::Active, slower(0.05)), (ModelRole::Candidate, slower(0.02)), (ModelRole::Previous, slower(0.1))];
    run(&mut comparison, &sets, 1.0, FEWEST_STRETCHES, &mut Random(2));
    let [candidate, previous] = [ModelRole::Candidate, ModelRole::Previous].map(|role| comparison.evidence(role));
    assert!(candidate.is_better() && !previous.is_better(), "{candidate:?} {previous:?}");
    assert!(candidate.gain > 0.0 && previous.gain < 0.0);
    // Sets that leave, or that are compared with another one, start without evidence.
    comparison.enter(ModelRole::Candidate, None);
    assert_eq!(
        (comparison.evidence(ModelRole::Candidate).stretches, comparison.theta(ModelRole::Candidate)),
        (0, None)
    );
    assert_eq!(comparison.evidence(ModelRole::Previous).stretches, FEWEST_STRETCHES);
    comparison.enter(ModelRole::Active, Some(&theta_of(&VEHICLE)));
    assert_eq!(comparison.evidence(ModelRole::Previous).stretches, 0);
}

/// Sets that are wrong by as much, one too fast and one too slow, and noise: none is better, however often it is asked.
#[test]
fn chance_does_not_win() {
    let mut random = Random(3);
    let mut won = 0;
    for _ in 0..40 {
        let mut comparison = ModelComparison::new();
        run(
            &mut comparison,
            &[(ModelRole::Active, slower(3.0e-4)), (ModelRole::Candidate, slower(-3.0e-4))],
            1.0,
            12,
            &mut random,
        );
        won += u32::from(comparison.evidence(ModelRole::Candidate).is_better());
    }
    // 0.3 % each; three or more of forty have a probability of 1e-4.
    assert!(won < 3, "{won}");
}

#[test]
fn an_interruption_costs_the_stretch_and_a_lost_prediction_is_no_number_that_spreads() {
    let mut comparison = ModelComparison::new();
    let mut wild = VEHICLE;
    wild.m_diag = [1.0e-3; 6];
    let mut random = Random(4);
    run(&mut comparison, &[(ModelRole::Active, wild), (ModelRole::Candidate, VEHICLE)], 1.0, 2, &mut random);
    let evidence = comparison.evidence(ModelRole::Candidate);
    assert!(evidence.error.iter().all(|error| error.is_finite()) && evidence.gain > 1.0, "{evidence:?}");
    comparison.interrupt();
    let vehicle = model(&VEHICLE);
    for step in 1000..1000 + u64::from(HORIZON_STEPS) {
        assert!(!comparison.sample(
            &vehicle,
            step * 100_000,
            &Vector3::zeros(),
            &Vector6::zeros(),
            &ActuatorInput::default()
        ));
    }
    assert_eq!(comparison.evidence(ModelRole::Candidate).stretches, 2);
}
