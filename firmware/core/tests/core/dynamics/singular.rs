//! Where formulas divide by zero, and what must not bring the firmware down.

use super::support::{Random, full_parameters, model};
use backseat_core::dynamics::{ActuatorInput, MIN_COS_PITCH, kinematic_linearise};
use backseat_core::state::{VehicleState, wrap_angle};
use core::f64::consts::{FRAC_PI_2, PI};

#[test]
fn vertical_vehicle_has_bounded_euler_rates() {
    let model = model(&full_parameters());
    let mut random = Random(10);
    for pitch in [FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2 + 1.0e-9, FRAC_PI_2 - 1.0e-9] {
        for _ in 0..20 {
            let mut x = random.state();
            x[4] = pitch;
            let linearised = model.linearise(&x, &random.input());
            assert!(linearised.f.iter().chain(&linearised.F()).all(|value| value.is_finite()));
            let omega = x.fixed_rows::<3>(9).norm();
            assert!(linearised.f.fixed_rows::<3>(3).amax() <= 2.0 * omega / MIN_COS_PITCH);
            assert!(kinematic_linearise(&x).F().iter().all(|value| value.is_finite()));
        }
    }
}

#[test]
fn val_still_water_gives_no_fin_force_and_no_slope() {
    let model = model(&full_parameters());
    let input = ActuatorInput { propeller_radps: 0.0, fins_rad: [0.3, -0.3, PI, -3.0] };
    // Speeds whose squares vanish, are subnormal and are small.
    for speed in [0.0, -0.0, 1.0e-200, 1.0e-160, 1.0e-100] {
        let mut x = VehicleState::zeros();
        x[6] = speed;
        x[7] = -speed;
        let linearised = model.linearise(&x, &input);
        let slope = &linearised.acceleration_by_velocity;
        assert!(slope.iter().all(|value| value.is_finite()));
        // What remains is linear surge drag.
        assert!((slope[(0, 0)] + 0.7 / 39.3).abs() < 1.0e-15);
        let rest = slope.iter().skip(1).fold(0.0, |largest: f64, value| largest.max(value.abs()));
        assert!(rest < 1.0e-90, "{rest} at {speed}");
        assert!(
            model.fin_wrenches(&backseat_core::state::velocity(&x), &input.fins_rad).iter().all(|w| w.amax() < 1e-90)
        );
    }
}

#[test]
fn absurd_input_never_panics() {
    let model = model(&full_parameters());
    let absurd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE, -1.0e300];
    for value in absurd {
        for i in 0..12 {
            let mut x = VehicleState::zeros();
            x[6] = 1.0;
            x[i] = value;
            let _ = model.linearise(&x, &ActuatorInput::default());
            let _ = kinematic_linearise(&x);
        }
        let mut x = VehicleState::zeros();
        x[6] = 1.0;
        let input = ActuatorInput { propeller_radps: value, fins_rad: [value; 4] };
        let linearised = model.linearise(&x, &input);
        if value.is_nan() {
            assert!(linearised.f[6].is_nan());
        }
        let _ = model.input_jacobian(&x, &input);
        let _ = model.actuator_regressor(&backseat_core::state::velocity(&x), &input);
    }
}

#[test]
fn val_angles_wrap_to_half_open_interval() {
    assert_eq!(wrap_angle(PI), PI);
    assert_eq!(wrap_angle(-PI), PI);
    assert_eq!(wrap_angle(0.5), 0.5);
    // The remainder is exact, 7 − 2π is rounded once.
    assert!((wrap_angle(7.0) - (7.0 - 2.0 * PI)).abs() < 1.0e-15);
    assert!((wrap_angle(-4.0) - (2.0 * PI - 4.0)).abs() < 1.0e-15);
    assert!(wrap_angle(f64::NAN).is_nan());
}
