//! Faults: the right one is named, with its magnitude; nothing is named where nothing broke.

use super::simulation::{EXCITATION, Noise, PERIOD_S, advance, start};
use super::support::{Random, VEHICLE, model};
use backseat_core::dynamics::{ActuatorInput, FINS, VehicleModel, VehicleParameters};
use backseat_core::identification::{Diagnosis, FaultCause, FaultMonitor, FaultState};
use backseat_core::state;
use nalgebra::{Vector3, Vector6};

const ONSET_S: f64 = 500.0;

/// The vehicle moves as declared, then, if given, as the other; the monitor believes in the declared one.
fn watch(broken: Option<&VehicleModel>, duration_s: f64, seed: u64) -> (Box<FaultMonitor>, Option<f64>) {
    let declared = model(&VEHICLE);
    let mut monitor = Box::new(FaultMonitor::new());
    let mut random = Random(seed);
    let noise = Noise::TABLE_4_13;
    let mut x = start();
    let mut since = ActuatorInput::default();
    let mut diagnosed_s = None;
    for step in 0..(duration_s / PERIOD_S) as u64 {
        let time_s = step as f64 * PERIOD_S;
        let (mut attitude, mut velocity) = (state::attitude(&x), state::velocity(&x));
        for axis in 0..3 {
            velocity[axis] += noise.linear_mps * random.normal();
            velocity[3 + axis] += noise.angular_radps * random.normal();
        }
        for axis in 0..2 {
            attitude[axis] += noise.roll_pitch_rad * random.normal();
        }
        if monitor.sample(&declared, step * 100_000, &attitude, &velocity, &since) == FaultState::Diagnosed {
            diagnosed_s.get_or_insert(time_s);
        }
        since = EXCITATION.input(time_s);
        x = advance(broken.filter(|_| time_s >= ONSET_S).unwrap_or(&declared), &x, &since);
    }
    (monitor, diagnosed_s)
}

fn diagnosis(broken: &VehicleModel) -> Diagnosis {
    let (monitor, diagnosed_s) = watch(Some(broken), ONSET_S + 200.0, 7);
    let diagnosed_s = diagnosed_s.expect("found");
    assert!((ONSET_S..ONSET_S + 60.0).contains(&diagnosed_s), "{diagnosed_s} s");
    let diagnosis = monitor.diagnosis().expect("diagnosed");
    // The gain begins to rise when it breaks, or when the fault first shows.
    assert!((diagnosis.since_us as f64 * 1e-6 - ONSET_S).abs() < 20.0, "{diagnosis:?}");
    assert!(diagnosis.rival.is_none() && diagnosis.confidence > 0.99, "{diagnosis:?}");
    diagnosis
}

/// Magnitudes within this share: a fin's is uncertain by the noise in its incidence, which the 22° of these inputs
/// exceed tenfold.
const TOLERANCE: f64 = 0.15;

#[test]
fn val_each_fault_is_named_with_its_magnitude() {
    let changed = |change: fn(&mut VehicleParameters)| {
        let mut vehicle = VEHICLE;
        change(&mut vehicle);
        model(&vehicle)
    };
    let cases = [
        (changed(|v| v.quadratic_diag[0] *= 2.0), FaultCause::Entanglement, 1.0),
        (changed(|v| v.beta5_n_s2_per_rad2 *= 0.7), FaultCause::Fouling, 0.3),
        (
            changed(|v| {
                v.mass_kg += 0.8;
                v.m_diag[..3].iter_mut().for_each(|m| *m += 0.8);
                v.b_cb_to_cg_m[0] += 0.8 * 0.3 / v.displaced_mass_kg;
            }),
            FaultCause::Flooding,
            0.8,
        ),
    ];
    for (broken, cause, magnitude) in cases {
        let found = diagnosis(&broken);
        assert_eq!(found.cause, cause, "{found:?}");
        assert!((found.magnitude / magnitude - 1.0).abs() < TOLERANCE, "{found:?}");
        if cause == FaultCause::Flooding {
            assert!((found.moment_kgm - 0.24).abs() < 0.05, "{found:?}");
        }
        // What is declared with the fault in it is what moves.
        let (repaired, fins) = found.compensated(&model(&VEHICLE));
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < TOLERANCE;
        assert!(close(repaired.mass_kg, broken.parameters().mass_kg));
        assert!(close(repaired.quadratic_diag[0], broken.parameters().quadratic_diag[0]));
        assert!(close(repaired.beta5_n_s2_per_rad2, broken.parameters().beta5_n_s2_per_rad2));
        assert_eq!(fins, [1.0; FINS]);
    }
}

#[test]
fn val_the_lost_fin_is_distinguished_from_the_others() {
    for fin in 0..4_u8 {
        let mut broken = model(&VEHICLE);
        let mut shares = [1.0; FINS];
        shares[usize::from(fin)] = 0.2;
        broken.set_fin_effectiveness(&shares);
        let found = diagnosis(&broken);
        assert_eq!(found.cause, FaultCause::Fin(fin), "{found:?}");
        assert!((found.magnitude / 0.8 - 1.0).abs() < TOLERANCE, "{found:?}");
        let (vehicle, fins) = found.compensated(&model(&VEHICLE));
        assert_eq!(vehicle, VEHICLE);
        assert!((fins[usize::from(fin)] - 0.2).abs() < 0.08, "{fins:?}");
    }
}

#[test]
fn nothing_is_named_where_nothing_broke() {
    let (monitor, diagnosed_s) = watch(None, 2000.0, 3);
    assert_eq!((monitor.state(), diagnosed_s), (FaultState::Quiet, None));
    assert!(monitor.diagnosis().is_none());
}

#[test]
fn what_is_no_measurement_is_a_gap() {
    let vehicle = model(&VEHICLE);
    let mut monitor = FaultMonitor::new();
    let mut random = Random(1);
    for step in 0..5000_u64 {
        let bits = |random: &mut Random| match step % 3 {
            0 => f64::NAN,
            1 => f64::INFINITY,
            _ => random.within(1e300),
        };
        let velocity = Vector6::from_fn(|_, _| bits(&mut random));
        let attitude = Vector3::from_fn(|_, _| bits(&mut random));
        let input = ActuatorInput { propeller_radps: bits(&mut random), fins_rad: [bits(&mut random); 4] };
        // Time stands still, runs backwards and jumps.
        let time_us = step.wrapping_mul(0x9E37_79B9) % 1_000_000;
        assert_eq!(monitor.sample(&vehicle, time_us, &attitude, &velocity, &input), FaultState::Learning);
    }
}

#[test]
fn it_is_small_and_takes_no_flash() {
    assert!(size_of::<FaultMonitor>() < 1536, "{}", size_of::<FaultMonitor>());
}
