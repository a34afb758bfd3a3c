//! Gaps, absurd input, missing excitation.

use super::simulation::{EXCITATION, PERIOD_S, advance, start};
use super::support::{Random, VEHICLE, model};
use backseat_core::dynamics::{ActuatorInput, VehicleParameters};
use backseat_core::identification::theta::{B1, M11, NAMES, theta_of};
use backseat_core::identification::{
    ConfigError, DELAY, IdentificationConfig, Identifier, PARAMETERS, SampleOutcome, Scale, Visibility,
};
use backseat_core::state;
use nalgebra::{Vector3, Vector6};

const CONFIG: IdentificationConfig = IdentificationConfig { warm_up_s: 5.0, ..IdentificationConfig::DEFAULT };

fn identifier() -> Identifier {
    let mut identifier = Identifier::new();
    identifier.configure(&CONFIG, &VEHICLE).expect("a usable prior");
    identifier
}

/// A steady sample, and its outcome.
fn steady(identifier: &mut Identifier, time_us: u64) -> SampleOutcome {
    let velocity = Vector6::new(1.5, 0.01, 0.02, 0.001, -0.002, 0.003);
    let input = ActuatorInput { propeller_radps: 120.0, fins_rad: [0.01, -0.01, 0.02, -0.02] };
    identifier.sample(time_us, &Vector3::new(0.02, -0.03, 1.0), &velocity, &input).outcome
}

#[test]
fn nothing_happens_before_it_is_configured() {
    let mut identifier = Identifier::new();
    assert_eq!(steady(&mut identifier, 0), SampleOutcome::NotConfigured);
    assert_eq!(identifier.estimate(), None);
    assert_eq!(identifier.parameters(), None);
    assert!(identifier.excitation().iter().all(|parameter| parameter.visibility == Visibility::Frozen));
}

#[test]
fn a_gap_empties_the_filter_and_keeps_the_estimate() {
    let mut identifier = identifier();
    let window = 2 * DELAY as u64 + 1;
    let mut time_us = 0;
    let outcomes = |identifier: &mut Identifier, time_us: &mut u64, count: u64| {
        let mut last = SampleOutcome::NotConfigured;
        for _ in 0..count {
            last = steady(identifier, *time_us);
            *time_us += 100_000;
        }
        last
    };
    assert_eq!(outcomes(&mut identifier, &mut time_us, window), SampleOutcome::Filling);
    assert_eq!(outcomes(&mut identifier, &mut time_us, 1), SampleOutcome::WarmingUp);
    assert_eq!(outcomes(&mut identifier, &mut time_us, 60), SampleOutcome::Adapting);
    let estimate = identifier.estimate();

    // One lost sample is a gap; one late by 30 ms is not.
    time_us += 100_000;
    assert_eq!(outcomes(&mut identifier, &mut time_us, 1), SampleOutcome::Filling);
    assert_eq!(identifier.restarts(), 1);
    assert_eq!(outcomes(&mut identifier, &mut time_us, window - 1), SampleOutcome::Filling);
    assert_eq!(identifier.estimate(), estimate);
    time_us += 30_000;
    assert_eq!(outcomes(&mut identifier, &mut time_us, 1), SampleOutcome::Adapting);
    assert_eq!(identifier.restarts(), 1);

    // Time that stands still or runs back is refused and changes nothing.
    assert_eq!(steady(&mut identifier, time_us - 100_000), SampleOutcome::OutOfOrder);
    assert_eq!(steady(&mut identifier, 0), SampleOutcome::OutOfOrder);
    assert_eq!(outcomes(&mut identifier, &mut time_us, 1), SampleOutcome::Adapting);
}

#[test]
fn absurd_values_are_refused_and_leave_no_trace() {
    let (mut disturbed, mut clean) = (identifier(), identifier());
    let mut random = Random(6);
    let absurd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1.0e300, -1.0e9];
    for step in 0..400_u64 {
        assert_eq!(steady(&mut disturbed, step * 100_000), steady(&mut clean, step * 100_000));
        let mut values: [f64; 14] = [0.1; 14];
        values[(random.within(7.0) + 7.0) as usize] = absurd[(random.within(2.5) + 2.5) as usize];
        let input =
            ActuatorInput { propeller_radps: values[9], fins_rad: [values[10], values[11], values[12], values[13]] };
        let velocity = Vector6::from_column_slice(&values[3..9]);
        let attitude = Vector3::from_column_slice(&values[..3]);
        assert_eq!(
            disturbed.sample(step * 100_000 + 50_000, &attitude, &velocity, &input).outcome,
            SampleOutcome::Refused
        );
    }
    assert_eq!(disturbed.state(), clean.state());
    assert_eq!(disturbed.estimate(), clean.estimate());
}

#[test]
fn wild_motion_leaves_theta_in_its_box() {
    // White noise of a vehicle's full range: no motion at all, so every limit is met.
    let mut identifier = identifier();
    let mut random = Random(7);
    let (mut limited, mut projected) = (0, 0);
    for step in 0..5000_u64 {
        let velocity = Vector6::from([30.0, 30.0, 30.0, 10.0, 10.0, 10.0].map(|scale| random.within(scale)));
        let report = identifier.sample(step * 100_000, &random.attitude(), &velocity, &random.inputs());
        assert!(!matches!(report.outcome, SampleOutcome::Refused | SampleOutcome::Diverged));
        limited += u32::from(report.limited);
        projected |= report.projected;
    }
    assert!(limited > 0 && projected != 0, "{limited} {projected:b}");
    let prior = theta_of(&VEHICLE);
    for (j, (&value, &prior)) in identifier.state().theta.iter().zip(&prior).enumerate() {
        assert!(value.is_finite() && (value * prior > 0.0 || (12..15).contains(&j)), "{}", NAMES[j]);
    }
}

#[test]
fn what_is_not_excited_is_frozen_and_said_so() {
    // Half an hour straight ahead with the noise of Table 4.13: no turns, so nothing that turns is seen.
    let vehicle = model(&VEHICLE);
    let mut identifier = Identifier::new();
    let prior = VehicleParameters { quadratic_diag: [4.0, 200.0, 150.0, 0.15, 40.0, 60.0], ..VEHICLE };
    // The usual warm-up: within 5 s noise can look like motion.
    identifier.configure(&IdentificationConfig::DEFAULT, &prior).expect("a usable prior");
    let input = ActuatorInput { propeller_radps: 120.0, fins_rad: [0.0, 0.0, 0.02, -0.02] };
    let mut x = start();
    for _ in 0..3000 {
        x = advance(&vehicle, &x, &input);
    }
    let mut random = Random(8);
    for step in 0..18_000_u64 {
        let (mut velocity, mut attitude) = (state::velocity(&x), state::attitude(&x));
        for axis in 0..3 {
            velocity[axis] += 0.013 * random.normal();
            velocity[3 + axis] += 1.75e-4 * random.normal();
        }
        for axis in 0..2 {
            attitude[axis] += 4.36e-3 * random.normal();
        }
        identifier.sample(step * 100_000, &attitude, &velocity, &input);
        x = advance(&vehicle, &x, &input);
    }
    let excitation = identifier.excitation();
    let (before, after) = (theta_of(&prior), identifier.estimate().expect("configured"));
    let state = |name: &str| {
        let j = NAMES.iter().position(|&other| other == name).expect("a name");
        (excitation[j].visibility, before[j] == after[j])
    };
    assert_eq!(state("m11"), (Visibility::Known, true));
    for name in ["m22", "m44", "m66", "d22", "d44", "d55", "d66"] {
        assert_eq!(state(name), (Visibility::Frozen, true), "{name}");
    }
    // Frozen too, but not from the first: the wrong prior's model pitches where the vehicle does not.
    assert_eq!(state("m55").0, Visibility::Frozen);
    // Drag and thrust are seen, but not one from the other at one speed.
    for name in ["d11", "beta5"] {
        assert_eq!(state(name), (Visibility::Collinear, false), "{name}");
    }
}

#[test]
fn a_turning_vehicle_shows_its_parameters() {
    let vehicle = model(&VEHICLE);
    let mut identifier = identifier();
    let mut x = start();
    for step in 0..6000_u64 {
        let input = EXCITATION.input(step as f64 * PERIOD_S);
        identifier.sample(step * 100_000, &state::attitude(&x), &state::velocity(&x), &input);
        x = advance(&vehicle, &x, &input);
    }
    let excitation = identifier.excitation();
    assert_eq!(excitation[M11].visibility, Visibility::Known);
    for (name, parameter) in NAMES.iter().zip(&excitation).skip(1) {
        assert_ne!(parameter.visibility, Visibility::Frozen, "{name}: {parameter:?}");
        assert!((0.0..=1.0).contains(&parameter.independent), "{name}: {parameter:?}");
    }
    assert_eq!(excitation[B1 + 2].visibility, Visibility::Separate);
}

#[test]
fn the_known_parameter_is_held() {
    for scale in [Scale::M11, Scale::Beta5] {
        let mut identifier = Identifier::new();
        identifier.configure(&IdentificationConfig { scale, ..CONFIG }, &VEHICLE).expect("a usable prior");
        let mut random = Random(9);
        for step in 0..2000_u64 {
            identifier.sample(step * 100_000, &random.attitude(), &random.velocity(), &random.inputs());
        }
        let moved = identifier.state().theta - theta_of(&VEHICLE);
        for j in 0..PARAMETERS {
            assert_eq!(moved[j] == 0.0, j == scale.parameter(), "{}", NAMES[j]);
        }
    }
}

#[test]
fn unusable_settings_are_named() {
    let refuse = |config: IdentificationConfig, vehicle: &VehicleParameters| {
        Identifier::new().configure(&config, vehicle).expect_err("unusable")
    };
    let noise = f64::NAN;
    assert_eq!(refuse(IdentificationConfig { roll_pitch_noise_rad: noise, ..CONFIG }, &VEHICLE), ConfigError::Noise);
    assert_eq!(refuse(IdentificationConfig { box_ratio: [1.5, 3.0], ..CONFIG }, &VEHICLE), ConfigError::Box);
    let upside_down = VehicleParameters { b_cb_to_cg_m: [0.0, 0.0, -0.01], ..VEHICLE };
    assert_eq!(refuse(CONFIG, &upside_down), ConfigError::Unstable);
    let massless = VehicleParameters { m_diag: [0.0; 6], ..VEHICLE };
    assert!(matches!(refuse(CONFIG, &massless), ConfigError::Vehicle(error) if error.key == "inertia.m_diag"));
}
