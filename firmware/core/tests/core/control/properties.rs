//! Commands stay finite and within limits whatever comes in.

use super::simulation::check_limits;
use crate::random::Random;
use backseat_core::control::ControlError::{Gains, OutOfRange};
use backseat_core::control::allocation::{Datum, Moments, allocate, allocate_to};
use backseat_core::control::limits::{ActuatorLimits, Limiter};
use backseat_core::control::mission::{
    Lawnmower, MAX_WAYPOINTS, Mission, MissionError, MissionStatus, Progress, Waypoint,
};
use backseat_core::control::speed::{SpeedGains, propeller_radps};
use backseat_core::control::{AllocationMethod, ControlConfig, ControlLaw, Controller};
use backseat_core::dynamics::{ActuatorInput, Propeller, VehicleModel, VehicleParameters};
use backseat_core::state::{self, VehicleState};
use nalgebra::Vector6;

fn model() -> VehicleModel {
    VehicleModel::new(&VehicleParameters::IVER3).unwrap()
}

/// A controller that has the reference survey to fly.
fn surveying(config: &ControlConfig) -> Box<Controller> {
    let mut controller = Box::new(Controller::new());
    controller.configure(config, &model()).unwrap();
    controller.set_mission(&Mission::lawnmower(&Lawnmower::REFERENCE).unwrap());
    controller
}

#[test]
fn any_state_gives_a_command_within_limits() {
    for law in [ControlLaw::Pd, ControlLaw::Lqr, ControlLaw::LqrOnReference] {
        for allocation in [AllocationMethod::Decoupled, AllocationMethod::SixDof] {
            let mut scatter = Random(7);
            let config = ControlConfig { law, allocation, ..ControlConfig::REFERENCE };
            let mut controller = surveying(&config);
            controller.start(&VehicleState::zeros()).unwrap();
            let mut last = ActuatorInput::default();
            for step in 0..2000u64 {
                let size = [1e-3, 1.0, 30.0, 1e4, 1e150, 1e300][(step % 6) as usize];
                let mut x = VehicleState::from_fn(|_, _| size * scatter.within(1.0));
                // So that the mission is not over at once.
                x[state::X] = x[state::X].min(0.0);
                let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
                if step % 7 == 0 {
                    x[(step / 7 % 12) as usize] = bad[(step % 3) as usize];
                }
                let current = [scatter.within(1.0) * size, if step % 11 == 0 { f64::NAN } else { scatter.within(1.0) }];
                let command = controller.command(step * 100_000, &x, current);
                check_limits(&config.limits, &last, &command.input);
                last = command.input;
            }
        }
    }
}

#[test]
fn nan_state_goes_to_neutral() {
    let mut controller = surveying(&ControlConfig::REFERENCE);
    let mut x = VehicleState::zeros();
    x[state::U] = 1.0;
    x[state::PSI] = 1.0;
    controller.start(&x).unwrap();
    for step in 0..20 {
        controller.command(step * 100_000, &x, [0.0; 2]);
    }
    assert_ne!(controller.command(2_000_000, &x, [0.0; 2]).input, ActuatorInput::default());
    x[state::Q] = f64::NAN;
    let mut command = Default::default();
    for step in 21..80 {
        command = controller.command(step * 100_000, &x, [0.0; 2]);
    }
    assert_eq!(command.input, ActuatorInput::default());
    assert_eq!(command.helm, None);
    // The mission goes on when the state is back.
    x[state::Q] = 0.0;
    assert!(controller.command(8_000_000, &x, [0.0; 2]).helm.is_some());
}

#[test]
fn idle_unconfigured_and_finished_are_neutral() {
    let x = VehicleState::zeros();
    let mut controller = Box::new(Controller::new());
    assert_eq!(controller.start(&x), Err(MissionError::Empty));
    controller.set_mission(&Mission::lawnmower(&Lawnmower::REFERENCE).unwrap());
    controller.start(&x).unwrap();
    assert_eq!(controller.command(0, &x, [0.0; 2]).input, ActuatorInput::default());
    controller.configure(&ControlConfig::REFERENCE, &model()).unwrap();
    controller.stop();
    assert_eq!(controller.command(100_000, &x, [0.0; 2]).status, MissionStatus::Idle);
    assert_eq!(controller.command(200_000, &x, [0.0; 2]).input, ActuatorInput::default());
}

#[test]
fn time_that_stands_still_or_jumps_moves_no_fin_too_far() {
    let mut controller = surveying(&ControlConfig::REFERENCE);
    let mut x = VehicleState::zeros();
    x[state::U] = 1.0;
    x[state::PSI] = 2.0;
    controller.start(&x).unwrap();
    let first = controller.command(1_000_000, &x, [0.0; 2]).input;
    assert_eq!(controller.command(1_000_000, &x, [0.0; 2]).input, first);
    assert_eq!(controller.command(500_000, &x, [0.0; 2]).input, first);
    let late = controller.command(u64::MAX, &x, [0.0; 2]).input;
    for (late, first) in late.fins_rad.iter().zip(&first.fins_rad) {
        assert!((late - first).abs() <= 0.2 * ActuatorLimits::DEFAULT.fin_rate_radps + 1e-12);
    }
}

#[test]
fn wrong_configuration_leaves_the_old_one() {
    let mut controller = Box::new(Controller::new());
    controller.configure(&ControlConfig::REFERENCE, &model()).unwrap();
    let gain = *controller.lqr().gain();
    let mut config = ControlConfig::REFERENCE;
    config.limits.fin_rad = -1.0;
    assert!(matches!(controller.configure(&config, &model()), Err(OutOfRange(e)) if e.key == "app.fin_limit_rad"));
    config = ControlConfig::REFERENCE;
    config.pd.kp_psi = f64::NAN;
    assert_eq!(controller.configure(&config, &model()), Err(Gains));
    config = ControlConfig::REFERENCE;
    config.cruise_speed_mps = 0.0;
    assert!(matches!(controller.configure(&config, &model()), Err(OutOfRange(e)) if e.key == "app.cruise_speed_mps"));
    assert_eq!(*controller.lqr().gain(), gain);
}

#[test]
fn limiter_reaches_the_wanted_input_and_no_further() {
    let limits = ActuatorLimits::DEFAULT;
    let mut limiter = Limiter::new(limits);
    let wanted = ActuatorInput { propeller_radps: 500.0, fins_rad: [1.0, -1.0, 0.1, f64::NAN] };
    for _ in 0..100 {
        limiter.apply(&wanted, 0.1);
    }
    let expected = ActuatorInput { propeller_radps: 200.0, fins_rad: [limits.fin_rad, -limits.fin_rad, 0.1, 0.0] };
    assert_eq!(*limiter.last(), expected);
    assert_eq!(limiter.apply(&ActuatorInput::default(), f64::NAN), expected);
}

#[test]
fn val_allocation_gives_the_moments_asked_for() {
    let model = model();
    let mut scatter = Random(3);
    for round in 0..200 {
        let mut rates = || 0.05 * scatter.within(1.0);
        let v = Vector6::new(1.0 + rates(), rates(), rates(), rates(), rates(), rates());
        let trim = [rates(), rates(), rates(), rates()];
        let wanted = Moments { roll_nm: 2.0 * rates(), pitch_nm: 40.0 * rates(), yaw_nm: 40.0 * rates() };
        for datum in [Datum::Total, Datum::Above(trim)] {
            let sum = |fins: &[f64; 4]| model.fin_wrenches(&v, fins).iter().sum::<Vector6<f64>>();
            let (base, roll_base) = match &datum {
                Datum::Total => (Vector6::zeros(), sum(&[0.0; 4])[3]),
                Datum::Above(fins) => (sum(fins), sum(fins)[3]),
            };
            for method in [AllocationMethod::Decoupled, AllocationMethod::SixDof] {
                let got = sum(&allocate(method, &model, &v, &wanted, &datum, 0.5));
                // Decoupled solves the side force exactly, and leaves moments of drag on the lever of 0.13 m; its roll
                // is linear. The least squares trade moments for forces that do not quite belong to them, one to a
                // hundred.
                let pitch = (got[4] - base[4] - wanted.pitch_nm).abs();
                let yaw = (got[5] - base[5] - wanted.yaw_nm).abs();
                let roll = (got[3] - roll_base - wanted.roll_nm).abs();
                assert!(pitch < 0.05 && yaw < 0.05 && roll < 0.05, "{round} {method:?}: {roll} {pitch} {yaw}");
            }
        }
    }
}

#[test]
fn val_three_fins_give_the_moments_of_four() {
    let model = model();
    let mut scatter = Random(5);
    for round in 0..200 {
        let mut rates = || 0.03 * scatter.within(1.0);
        let v = Vector6::new(1.0 + rates(), rates(), rates(), rates(), rates(), rates());
        let wanted = Moments { roll_nm: 0.0, pitch_nm: 40.0 * rates(), yaw_nm: 40.0 * rates() };
        let trim = [0.0, 0.0, 0.02, -0.02];
        let base: Vector6<f64> = model.fin_wrenches(&v, &trim).iter().sum();
        let broken = round % 4;
        for stands_rad in [None, Some(0.04)] {
            let (mut shares, mut stands) = ([1.0; 4], [None; 4]);
            match stands_rad {
                None => shares[broken] = 0.0,
                Some(_) => stands[broken] = stands_rad,
            }
            let mut actual = model.clone();
            actual.set_fin_effectiveness(&shares);
            actual.set_standing_fins(&stands);
            // what stands is as if it were commanded there, whatever is
            let own = |model: &VehicleModel, angle| model.fin_wrenches(&v, &[angle; 4])[broken];
            let expected = stands_rad.map_or(Vector6::zeros(), |angle| own(&model, angle));
            assert_eq!(own(&actual, -0.1), expected);
            let fins = allocate_to(&actual, &model, &v, &wanted, &Datum::Above(trim), 0.5);
            let got: Vector6<f64> = actual.fin_wrenches(&v, &fins).iter().sum();
            let off = [got[3] - base[3], got[4] - base[4] - wanted.pitch_nm, got[5] - base[5] - wanted.yaw_nm];
            assert!(off.iter().all(|off| off.abs() < 0.06), "{round} {stands_rad:?}: {off:?}");
            assert!((fins[broken] - trim[broken]).abs() < 1e-6, "it is not commanded: {fins:?}");
        }
    }
}

#[test]
fn allocation_out_of_reach_goes_to_the_limit() {
    let v = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let wanted = Moments { roll_nm: 0.0, pitch_nm: 0.0, yaw_nm: 500.0 };
    for method in [AllocationMethod::Decoupled, AllocationMethod::SixDof] {
        let fins = allocate(method, &model(), &v, &wanted, &Datum::Total, 0.3);
        // The least squares are drawn to neutral with a weight of 1e-6.
        assert!((fins[0] - 0.3).abs() < 1e-5 && (fins[1] + 0.3).abs() < 1e-5, "{method:?}: {fins:?}");
        assert!(fins[2].abs() < 1e-5 && fins[3].abs() < 1e-5, "{method:?}: {fins:?}");
    }
}

#[test]
fn val_propeller_inverts_the_thrust() {
    for advance in [0.0, 0.003] {
        let propeller = Propeller { beta5: 3e-4, advance, torque_arm: 0.0 };
        for thrust in [0.0, 0.5, 3.0, 12.0] {
            for surge in [0.0, 1.0, 2.5] {
                let omega = propeller_radps(&propeller, thrust, surge);
                // One square root and one quotient.
                assert!((propeller.thrust(omega, surge) - thrust).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn mission_refuses_what_cannot_be_flown() {
    let good = Waypoint { x_m: 1.0, y_m: 2.0, depth_m: 3.0, speed_mps: 1.0 };
    let mut mission = Mission::new();
    assert_eq!(mission.push(Waypoint { x_m: f64::NAN, ..good }), Err(MissionError::Position));
    assert_eq!(mission.push(Waypoint { y_m: 1e9, ..good }), Err(MissionError::Position));
    assert_eq!(mission.push(Waypoint { depth_m: -1.0, ..good }), Err(MissionError::Depth));
    assert_eq!(mission.push(Waypoint { speed_mps: 0.0, ..good }), Err(MissionError::Speed));
    for _ in 0..MAX_WAYPOINTS {
        mission.push(good).unwrap();
    }
    assert_eq!(mission.push(good), Err(MissionError::TooMany));
    // A mission of one point over and over is over at once.
    let mut progress = Progress::new();
    progress.start(&mission, [1.0, 2.0]).unwrap();
    let mut x = VehicleState::zeros();
    (x[state::X], x[state::Y]) = (1.0, 2.0);
    assert_eq!(progress.update(&mission, &x, 5.0), MissionStatus::Finished);
    assert_eq!(Mission::lawnmower(&Lawnmower { lines: 0, ..Lawnmower::REFERENCE }), Err(MissionError::Empty));
    assert_eq!(Mission::lawnmower(&Lawnmower { lines: 65, ..Lawnmower::REFERENCE }), Err(MissionError::TooMany));
}

#[test]
fn lawnmower_has_the_corners_of_the_survey() {
    let mission = Mission::lawnmower(&Lawnmower::REFERENCE).unwrap();
    let corners: Vec<_> = mission.waypoints().iter().map(|w| (w.x_m, w.y_m)).collect();
    assert_eq!(corners.len(), 20);
    assert_eq!(corners[..5], [(0.0, 0.0), (1000.0, 0.0), (1000.0, 100.0), (0.0, 100.0), (0.0, 200.0)]);
    assert_eq!(corners[19], (0.0, 900.0));
}

#[test]
fn val_the_partner_of_a_lost_fin_gives_the_force_alone() {
    let v = Vector6::new(1.2, 0.02, -0.01, 0.0, 0.03, -0.02);
    let moments = Moments { yaw_nm: 1.0, pitch_nm: -0.8, ..Moments::default() };
    for lost in 0..4 {
        let mut model = model();
        let mut shares = [1.0; 4];
        shares[lost] = 0.0;
        model.set_fin_effectiveness(&shares);
        let fins = allocate(AllocationMethod::Decoupled, &model, &v, &moments, &Datum::Total, 0.4);
        let wrenches = model.fin_wrenches(&v, &fins);
        assert_eq!(wrenches[lost], Vector6::zeros());
        let wrench: Vector6<f64> = wrenches.iter().sum();
        // Y = N/x_fin and Z = −M/x_fin with the lever of the stern, −0.85 m. To a hundredth, which no lift curve is
        // known to; half or twice the force would be what a forgotten share gives.
        let close = |force: f64, wanted: f64| (force / wanted - 1.0).abs() < 0.01;
        assert!(close(wrench[1], 1.0 / -0.85) && close(wrench[2], 0.8 / -0.85), "{lost} {fins:?} {wrench}");
    }
    let mut model = model();
    model.set_fin_effectiveness(&[f64::NAN, -1.0, 0.5, 3.0]);
    assert_eq!(model.fin_effectiveness(), [1.0, 1.0, 0.5, 1.0]);
}

#[test]
fn the_speed_law_grows_with_the_vehicle() {
    let reference = VehicleParameters::IVER3;
    assert_eq!(SpeedGains::DEFAULT.for_vehicle(&reference, 1.0), SpeedGains::DEFAULT);
    let mut heavy = reference;
    heavy.m_diag[0] = 900.0;
    heavy.quadratic_diag[0] = 40.0;
    assert_eq!(SpeedGains::DEFAULT.for_vehicle(&heavy, 1.5), SpeedGains { kp_u: 450.0, thrust_max_n: 360.0 });
}
