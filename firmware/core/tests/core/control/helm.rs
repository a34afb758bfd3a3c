//! Heading, depth and speed held instead of a leg, and the leg again.

use super::simulation::{Disturbance, SimulatedSample, fly_ordered};
use backseat_core::control::mission::{Mission, MissionStatus, Waypoint};
use backseat_core::control::{ControlConfig, ControlLaw, Controller, HelmCommand};
use backseat_core::dynamics::{VehicleModel, VehicleParameters};
use backseat_core::state::{self, VehicleState};

fn north(length_m: f64) -> Mission {
    let mut mission = Mission::new();
    mission.push(Waypoint { x_m: length_m, y_m: 0.0, depth_m: 3.0, speed_mps: 1.0 }).unwrap();
    mission
}

/// Along a line to the north, but for 200 s from 100 s on.
fn flown(law: ControlLaw, length_m: f64, helm: HelmCommand, disturbance: &Disturbance) -> Vec<SimulatedSample> {
    let config = ControlConfig { law, ..ControlConfig::REFERENCE };
    fly_ordered(&config, &north(length_m), VehicleState::zeros(), disturbance, 2000.0, |time_s, controller| {
        controller.set_helm((100.0..300.0).contains(&time_s).then_some(helm));
    })
}

#[test]
fn heading_depth_and_speed_are_held_and_then_the_line() {
    // a heading, whatever the current does to the course
    let disturbance = Disturbance { current_ne_mps: [0.1, -0.2], current_known: true, ..Disturbance::default() };
    for law in [ControlLaw::Pd, ControlLaw::Lqr] {
        for (heading_deg, depth_m, speed_mps) in [(70.0_f64, 8.0, 1.5), (300.0, 3.0, 0.6), (-175.0, 0.0, 1.0)] {
            let heading_rad = heading_deg.to_radians();
            let samples = flown(law, 1500.0, HelmCommand { heading_rad, depth_m, speed_mps }, &disturbance);
            let mut worst = [0.0_f64; 3];
            for SimulatedSample { time_s, x, command } in samples.iter().filter(|s| s.time_s < 300.0) {
                assert_eq!(command.status, MissionStatus::Leg(0));
                if *time_s < 100.0 {
                    continue;
                }
                let asked = command.helm.unwrap();
                assert!(state::wrap_angle(asked.heading_rad - heading_rad).abs() < 1e-9);
                assert_eq!((asked.depth_m, asked.speed_mps), (depth_m, speed_mps));
                assert!(command.error.cross_m.abs() < 1e-6);
                if *time_s > 160.0 {
                    let off_rad = state::wrap_angle(x[state::PSI] - heading_rad);
                    let off = [off_rad.to_degrees(), x[state::Z] - depth_m, x[state::U] - speed_mps];
                    worst.iter_mut().zip(off).for_each(|(worst, off)| *worst = worst.max(off.abs()));
                }
            }
            println!("{law:?} {heading_deg}: {worst:.3?} degrees, m, m/s");
            let [heading, depth, speed] = worst;
            assert!(heading < 1.0 && depth < 0.1 && speed < 0.05, "{law:?} {heading_deg}: {worst:?}");
            let end = samples.last().unwrap();
            assert_eq!(end.command.status, MissionStatus::Finished);
            let across = end.x[state::Y];
            assert!(across.abs() < 0.5 && (end.x[state::Z] - 3.0).abs() < 0.1, "{law:?} {heading_deg}: {across} m");
        }
    }
}

/// A waypoint that is passed meanwhile counts when the leg is flown again.
#[test]
fn the_mission_stands_still_meanwhile() {
    let ahead = HelmCommand { heading_rad: 0.0, depth_m: 3.0, speed_mps: 1.0 };
    let samples = flown(ControlLaw::Lqr, 150.0, ahead, &Disturbance::default());
    let end = samples.last().unwrap();
    assert!((end.time_s - 300.0).abs() < 0.05 && end.x[state::X] > 250.0, "{} s", end.time_s);
    assert_eq!(end.command.status, MissionStatus::Finished);
}

#[test]
fn a_start_forgets_it_and_what_cannot_be_held_is_not_taken() {
    let model = VehicleModel::new(&VehicleParameters::IVER3).unwrap();
    let east = HelmCommand { heading_rad: 1.5, depth_m: 3.0, speed_mps: 1.0 };
    let x = VehicleState::zeros();
    let heading_rad = |law, helm, restarted: bool| {
        let mut controller = Box::new(Controller::new());
        controller.configure(&ControlConfig { law, ..ControlConfig::REFERENCE }, &model).unwrap();
        controller.set_mission(&north(500.0));
        controller.start(&x).unwrap();
        controller.set_helm(Some(helm));
        if restarted {
            controller.start(&x).unwrap();
        }
        controller.command(0, &x, [0.0; 2]).helm.unwrap().heading_rad
    };
    assert_eq!(heading_rad(ControlLaw::Lqr, east, false), 1.5);
    assert_eq!(heading_rad(ControlLaw::Lqr, east, true), 0.0);
    assert_eq!(heading_rad(ControlLaw::LqrOnReference, east, false), 0.0);
    assert_eq!(heading_rad(ControlLaw::Pd, HelmCommand { speed_mps: f64::NAN, ..east }, false), 0.0);
}
