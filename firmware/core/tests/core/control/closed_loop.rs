//! Lines, currents and surveys flown on the model.

use super::simulation::{Disturbance, SimulatedSample, fly};
use backseat_core::control::mission::{Lawnmower, Mission, MissionStatus, Waypoint};
use backseat_core::control::{AllocationMethod, ControlConfig, ControlLaw};
use backseat_core::dynamics::VehicleParameters;
use backseat_core::state::{self, VehicleState};

const LAWS: [ControlLaw; 3] = [ControlLaw::Pd, ControlLaw::Lqr, ControlLaw::LqrOnReference];

fn config(law: ControlLaw) -> ControlConfig {
    ControlConfig { law, ..ControlConfig::REFERENCE }
}

fn line(length_m: f64, course_rad: f64) -> Mission {
    let mut mission = Mission::new();
    mission
        .push(Waypoint {
            x_m: length_m * libm::cos(course_rad),
            y_m: length_m * libm::sin(course_rad),
            depth_m: 3.0,
            speed_mps: 1.0,
        })
        .unwrap();
    mission
}

/// At rest at the surface, heading `heading_rad`.
fn at_rest(north_m: f64, east_m: f64, heading_rad: f64) -> VehicleState {
    let mut x = VehicleState::zeros();
    x[state::X] = north_m;
    x[state::Y] = east_m;
    x[state::PSI] = heading_rad;
    x
}

fn largest(samples: &[SimulatedSample], value: impl Fn(&SimulatedSample) -> f64) -> f64 {
    samples.iter().map(|sample| value(sample).abs()).fold(0.0, f64::max)
}

/// The last sample that was still under way: a finished mission has no error.
fn last_on_leg(samples: &[SimulatedSample]) -> &SimulatedSample {
    samples.iter().rev().find(|s| matches!(s.command.status, MissionStatus::Leg(_))).unwrap()
}

fn check_roll(samples: &[SimulatedSample]) {
    let roll = largest(samples, |s| s.x[state::PHI]).to_degrees();
    assert!(roll < 5.0, "roll {roll} degrees");
}

#[test]
fn line_from_rest_at_the_surface() {
    for law in LAWS {
        for course in [0.0, 2.0, -3.0] {
            let mission = line(1000.0, course);
            let samples = fly(&config(law), &mission, at_rest(0.0, 0.0, course), &Disturbance::default(), 1300.0);
            let steady: Vec<_> = samples.iter().filter(|s| s.time_s > 200.0).copied().collect();
            let cross = largest(&steady, |s| s.command.error.cross_m);
            let depth = largest(&steady, |s| s.command.error.depth_m);
            let end = samples.last().unwrap();
            println!("{law:?} course {course}: cross {cross:.1e} m, depth {depth:.1e} m, {:.0} s", end.time_s);
            assert_eq!(end.command.status, MissionStatus::Finished);
            assert!(cross < 0.02 && depth < 0.02, "{law:?}: cross {cross}, depth {depth}");
            check_roll(&samples);
        }
    }
}

#[test]
fn offset_and_heading_error_converge() {
    for law in [ControlLaw::Pd, ControlLaw::Lqr] {
        let mut mission = line(1000.0, 0.0);
        // The leg starts where the vehicle is, so a corner makes the offset: 90 degrees off the next line.
        mission.clear();
        for (x_m, y_m) in [(30.0, 0.0), (30.0, 600.0)] {
            mission.push(Waypoint { x_m, y_m, depth_m: 3.0, speed_mps: 1.0 }).unwrap();
        }
        let samples = fly(&config(law), &mission, at_rest(0.0, 0.0, 0.0), &Disturbance::default(), 900.0);
        let settled = samples.iter().rposition(|s| s.command.error.cross_m.abs() > 0.5).unwrap();
        let overshoot = samples
            .iter()
            .filter(|s| s.command.status == MissionStatus::Leg(1))
            .map(|s| -s.command.error.cross_m)
            .fold(f64::MIN, f64::max);
        println!("{law:?}: within 0.5 m after {:.0} s, overshoot {overshoot:.2} m", samples[settled].time_s);
        assert!(last_on_leg(&samples).command.error.cross_m.abs() < 0.02);
        check_roll(&samples);
    }
}

#[test]
fn known_cross_current_leaves_no_offset() {
    for law in LAWS {
        let disturbance = Disturbance { current_ne_mps: [0.05, 0.2], current_known: true, ..Disturbance::default() };
        let samples = fly(&config(law), &line(1000.0, 0.0), at_rest(0.0, 0.0, 0.0), &disturbance, 1300.0);
        let steady: Vec<_> = samples.iter().filter(|s| s.time_s > 300.0).copied().collect();
        let cross = largest(&steady, |s| s.command.error.cross_m);
        println!("{law:?}: cross {cross:.1e} m in 0.2 m/s");
        assert_eq!(samples.last().unwrap().command.status, MissionStatus::Finished);
        assert!(cross < 0.05, "{law:?}: {cross} m");
    }
}

#[test]
fn unknown_cross_current_leaves_the_stated_offset() {
    // lqr.rs states 0.8 m for 0.1 m/s: heading gain over cross-track gain, 8.2 m/rad, times the crab angle.
    let disturbance = Disturbance { current_ne_mps: [0.0, 0.1], ..Disturbance::default() };
    let samples = fly(&config(ControlLaw::Lqr), &line(500.0, 0.0), at_rest(0.0, 0.0, 0.0), &disturbance, 800.0);
    let cross = last_on_leg(&samples).command.error.cross_m;
    assert!((0.75..0.9).contains(&cross), "{cross}");
}

#[test]
fn bent_fin_leaves_a_bounded_offset() {
    // lqr.rs states 9 cm for 2 degrees.
    let disturbance = Disturbance { fin_bias_rad: [0.035, 0.0, 0.0, 0.0], ..Disturbance::default() };
    let samples = fly(&config(ControlLaw::Lqr), &line(500.0, 0.0), at_rest(0.0, 0.0, 0.0), &disturbance, 800.0);
    let steady: Vec<_> = samples.iter().filter(|s| s.time_s > 300.0).copied().collect();
    let cross = largest(&steady, |s| s.command.error.cross_m);
    println!("cross {cross:.3} m with a bent fin");
    assert!((0.05..0.15).contains(&cross), "{cross}");
}

#[test]
fn lawnmower_completes() {
    let pattern = Lawnmower { line_m: 300.0, lines: 3, ..Lawnmower::REFERENCE };
    let mission = Mission::lawnmower(&pattern).unwrap();
    for law in LAWS {
        for allocation in [AllocationMethod::Decoupled, AllocationMethod::SixDof] {
            let config = ControlConfig { allocation, ..config(law) };
            let samples = fly(&config, &mission, at_rest(-20.0, 0.0, 0.0), &Disturbance::default(), 1800.0);
            let end = samples.last().unwrap();
            assert_eq!(end.command.status, MissionStatus::Finished, "{law:?} {allocation:?}");
            // The path is 1100 m of lines and 20 m of run-in.
            assert!((1000.0..1250.0).contains(&end.time_s), "{}", end.time_s);
            check_roll(&samples);
            // On the lines, once past the turn.
            let on_line: Vec<_> = samples
                .iter()
                .filter(|s| matches!(s.command.status, MissionStatus::Leg(1..)) && s.command.error.along_m > 60.0)
                .copied()
                .collect();
            let cross = largest(&on_line, |s| s.command.error.cross_m);
            let depth = largest(&on_line, |s| s.command.error.depth_m);
            let corner = largest(&samples, |s| s.command.error.cross_m);
            let depth_all = largest(&samples[600..], |s| s.command.error.depth_m);
            let roll = largest(&samples, |s| s.x[state::PHI]).to_degrees();
            println!(
                "{law:?} {allocation:?}: {:.0} s, cross {cross:.3} (corner {corner:.1}) m, depth {depth:.3} \
                 (all {depth_all:.3}) m, roll {roll:.2} deg",
                end.time_s
            );
            assert!(cross < 0.5 && depth < 0.05, "{law:?} {allocation:?}: {cross} {depth}");
        }
    }
}

#[test]
fn speed_changes_on_the_way() {
    // The gain for the new speed is made in slices while under way.
    let mut mission = Mission::new();
    for (x_m, speed_mps) in [(150.0, 1.0), (400.0, 1.6), (500.0, 0.7)] {
        mission.push(Waypoint { x_m, y_m: 0.0, depth_m: 3.0, speed_mps }).unwrap();
    }
    for law in LAWS {
        let samples = fly(&config(law), &mission, at_rest(0.0, 0.0, 0.0), &Disturbance::default(), 900.0);
        for (leg, speed) in [(0, 1.0), (1, 1.6), (2, 0.7)] {
            let last = samples.iter().rev().find(|s| s.command.status == MissionStatus::Leg(leg)).unwrap();
            println!("{law:?} leg {leg}: {:.4} m/s, depth {:.4}", last.x[state::U], last.command.error.depth_m);
            assert!((last.x[state::U] - speed).abs() < 0.02, "{law:?} {leg}: {}", last.x[state::U]);
            assert!(last.command.error.depth_m.abs() < 0.05, "{law:?} {leg}");
        }
    }
}

#[test]
fn every_speed_is_stable() {
    for law in LAWS {
        // 1.88 m/s is what the largest thrust gives the reference vehicle.
        for speed_mps in [0.5, 0.7, 1.0, 1.3, 1.6, 1.8] {
            let mut mission = Mission::new();
            for (x_m, y_m) in [(100.0, 0.0), (100.0, 250.0)] {
                mission.push(Waypoint { x_m, y_m, depth_m: 3.0, speed_mps }).unwrap();
            }
            let samples = fly(&config(law), &mission, at_rest(0.0, 0.0, 0.0), &Disturbance::default(), 1000.0);
            assert_eq!(samples.last().unwrap().command.status, MissionStatus::Finished);
            let last = &samples[samples.len() - 100..];
            let cross = largest(last, |s| s.command.error.cross_m);
            let depth = largest(last, |s| s.command.error.depth_m);
            let speed = largest(last, |s| s.x[state::U] - speed_mps);
            println!("{law:?} {speed_mps} m/s: cross {cross:.4} depth {depth:.4} speed {speed:.4}");
            assert!(cross < 0.02 && depth < 0.02 && speed < 0.01, "{law:?} {speed_mps}: {cross} {depth} {speed}");
            check_roll(&samples);
        }
    }
}

#[test]
fn wrong_parameters_and_noise_are_survived() {
    // The vehicle's drag, lift and inertia are 20 % off the declared ones, the estimate is as noisy as a navigation
    // filter's (0.3 degrees, 0.2 degrees a second, 1 cm/s, 5 cm of depth).
    let mut actual = VehicleParameters::IVER3;
    actual.quadratic_diag = actual.quadratic_diag.map(|d| 1.2 * d);
    actual.m_diag = actual.m_diag.map(|m| 0.8 * m);
    actual.m_diag[0] = VehicleParameters::IVER3.m_diag[0]; // Not below the mass.
    actual.cl[0] *= 0.8;
    let noise = [0.05, 0.05, 0.05, 5e-3, 5e-3, 5e-3, 0.01, 0.01, 0.01, 3.5e-3, 3.5e-3, 3.5e-3];
    for law in LAWS {
        let disturbance = Disturbance { vehicle: actual, noise, ..Disturbance::default() };
        let samples = fly(&config(law), &line(600.0, 0.0), at_rest(0.0, 0.0, 0.5), &disturbance, 800.0);
        let steady: Vec<_> = samples.iter().filter(|s| s.time_s > 200.0).copied().collect();
        let cross = largest(&steady, |s| s.x[state::Y]);
        let depth = largest(&steady, |s| s.x[state::Z] - 3.0);
        println!("{law:?}: cross {cross:.3} depth {depth:.3}");
        assert!(cross < 0.3 && depth < 0.3, "{law:?}: {cross} {depth}");
        check_roll(&samples);
    }
}

#[test]
fn starts_from_any_heading() {
    for law in LAWS {
        for heading in [0.0, 1.5, 3.1, -3.1, -1.5] {
            let samples =
                fly(&config(law), &line(400.0, 0.0), at_rest(0.0, 0.0, heading), &Disturbance::default(), 700.0);
            let end = samples.last().unwrap();
            let cross = last_on_leg(&samples).command.error.cross_m;
            println!("{law:?} {heading}: {:.0} s, cross {cross:.3}", end.time_s);
            assert_eq!(end.command.status, MissionStatus::Finished);
            assert!(cross.abs() < 0.05);
            check_roll(&samples);
        }
    }
}

#[test]
fn surfaces_and_dives() {
    let mut mission = Mission::new();
    for (x_m, depth_m) in [(60.0, 0.0), (160.0, 10.0), (300.0, 0.0)] {
        mission.push(Waypoint { x_m, y_m: 0.0, depth_m, speed_mps: 1.0 }).unwrap();
    }
    for law in LAWS {
        let samples = fly(&config(law), &mission, at_rest(0.0, 0.0, 0.0), &Disturbance::default(), 500.0);
        let deepest = largest(&samples, |s| s.x[state::Z]);
        let highest = samples.iter().map(|s| s.x[state::Z]).fold(f64::MAX, f64::min);
        let end = samples.last().unwrap();
        let pitch = largest(&samples, |s| s.x[state::THETA]).to_degrees();
        println!("{law:?}: depth {highest:.2} to {deepest:.2}, end {:.3}, pitch {pitch:.1} degrees", end.x[state::Z]);
        assert_eq!(end.command.status, MissionStatus::Finished);
        assert!((9.9..10.5).contains(&deepest) && highest > -0.5 && end.x[state::Z].abs() < 0.05, "{law:?}");
        // Guided to 30 degrees from trim at most.
        assert!(pitch < 40.0, "{law:?}: {pitch}");
    }
}

#[test]
fn low_yaw_damping_gives_a_limit_cycle() {
    // pd.rs warns of it: the fins' own damping is cancelled by the allocation.
    for (kd_r, cycles) in [(10.0, true), (30.0, false), (60.0, false)] {
        let mut config = config(ControlLaw::Pd);
        config.pd.kd_r = kd_r;
        let samples = fly(&config, &line(400.0, 0.0), at_rest(0.0, 0.0, 0.3), &Disturbance::default(), 600.0);
        let yaw_rate = largest(&samples[samples.len() - 1000..], |s| s.x[state::R]);
        println!("Kd {kd_r}: yaw rate {yaw_rate:.4} rad/s");
        assert!(if cycles { yaw_rate > 0.1 } else { yaw_rate < 1e-3 }, "{kd_r}: {yaw_rate}");
    }
}

#[test]
fn a_lone_vertical_fin_is_enough_when_it_is_known_to_be_alone() {
    for law in [ControlLaw::Pd, ControlLaw::Lqr] {
        for fin in 0..2 {
            // Known only once the vehicle swings.
            let mut x = at_rest(0.0, 0.0, 2.0);
            (x[state::U], x[state::V], x[state::R]) = (1.1, -0.16, 0.2);
            let error = |fins_known: bool| {
                let mut fin_shares = [1.0; 4];
                fin_shares[fin] = 0.0;
                // Less lift and more inertia than declared.
                let mut vehicle = VehicleParameters::IVER3;
                vehicle.cl[0] *= 0.85;
                vehicle.m_diag[5] *= 1.15;
                let disturbance = Disturbance { vehicle, fin_shares, fins_known, ..Disturbance::default() };
                let mut mission = Mission::new();
                for (x_m, y_m) in [(60.0, 0.0), (60.0, 80.0), (80.0, 80.0), (80.0, 0.0), (100.0, 0.0), (100.0, 80.0)] {
                    mission.push(Waypoint { x_m, y_m, depth_m: 3.0, speed_mps: 1.3 }).unwrap();
                }
                let samples = fly(&config(law), &mission, x, &disturbance, 600.0);
                // The last halves of the long lines, where a turn is to be over.
                let on_line = |s: &&SimulatedSample| {
                    matches!(s.command.status, MissionStatus::Leg(1 | 3 | 5)) && s.command.error.along_m > 40.0
                };
                let squares: Vec<f64> =
                    samples.iter().filter(on_line).map(|s| s.command.error.cross_m * s.command.error.cross_m).collect();
                let finished = samples.last().unwrap().command.status == MissionStatus::Finished;
                (finished, libm::sqrt(squares.iter().sum::<f64>() / squares.len() as f64))
            };
            let ((_, unknown_m), (finished, known_m)) = (error(false), error(true));
            println!("{law:?}, fin {fin}: across {unknown_m:.2} m, known {known_m:.2} m");
            // Without that knowledge it swings by metres; the PD's approach to the line is slow (a distance of 20 m)
            // and leaves decimetres.
            assert!(finished && known_m < 0.3 && unknown_m > 2.0, "{law:?} {fin}: {unknown_m} m, known {known_m} m");
        }
    }
}
