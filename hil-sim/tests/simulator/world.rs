//! The world's observations: repeatable, independent of one another, and right.

use hil_sim::observation::{Observation, ObservationKind, OneWay, TwoWay};
use hil_sim::scenario::{Effect, Exchange, Scenario, Slot};
use hil_sim::truth::{Actuators, VehicleTruth};
use hil_sim::world::World;

/// Straight and level at about 1 m/s.
const CRUISE: Actuators = Actuators { propeller_radps: 106.8, fins_rad: [0.0, 0.0, 0.008, -0.008] };

/// The survey, starting at depth.
fn submerged() -> Scenario {
    let mut scenario = Scenario::built_in("survey").unwrap();
    scenario.settings.start.depth_m = 10.0;
    scenario
}

/// No noise, wander or disturbance anywhere.
fn noiseless() -> Scenario {
    let mut scenario = submerged();
    let settings = &mut scenario.settings;
    settings.plant.process_noise_factor = 0.0;
    settings.ship.wander_m = 0.0;
    settings.sensors.depth.sigma_m = Some(0.0);
    settings.sensors.ahrs.attitude_sigma_rad = Some(0.0);
    settings.sensors.ahrs.rates_sigma_radps = Some(0.0);
    settings.sensors.dvl.sigma_mps = Some(0.0);
    settings.sensors.dvl.altitude_sigma_m = 0.0;
    settings.acoustics.range_sigma_m = Some(0.0);
    settings.acoustics.range_rate_sigma_mps = Some(0.0);
    scenario
}

/// All observations of some seconds, advanced at a step.
fn observations(scenario: &Scenario, seconds: u64, step_us: u64) -> Vec<Observation> {
    let mut world = World::new(scenario);
    world.set_actuator_targets(0, CRUISE);
    let mut all = Vec::new();
    for time_us in (0..=seconds * 1_000_000).step_by(step_us as usize) {
        world.advance(time_us, &mut |observation| all.push(*observation));
    }
    all
}

/// Observations with the truth at every integration step.
fn flown(scenario: &Scenario, seconds: u64) -> (Vec<Observation>, Vec<VehicleTruth>, World) {
    let mut world = World::new(scenario);
    world.set_actuator_targets(0, CRUISE);
    let (mut all, mut truth) = (Vec::new(), Vec::new());
    for time_us in (0..=seconds * 1_000_000).step_by(10_000) {
        world.advance(time_us, &mut |observation| all.push(*observation));
        truth.push(world.truth());
    }
    (all, truth, world)
}

fn downlinks(observations: &[Observation]) -> Vec<(u64, OneWay)> {
    let packet = |o: &Observation| match o.kind {
        ObservationKind::Downlink(downlink) => Some((o.time_us, downlink)),
        _ => None,
    };
    observations.iter().filter_map(packet).collect()
}

fn at(truth: &[VehicleTruth], time_us: u64) -> &VehicleTruth {
    &truth[(time_us / 10_000) as usize]
}

/// True position at any time, by interpolation between steps.
fn place(truth: &[VehicleTruth], time_us: u64) -> [f64; 3] {
    let (before, after) = (at(truth, time_us), at(truth, time_us + 10_000));
    let share = (time_us - before.time_us) as f64 / 10_000.0;
    core::array::from_fn(|i| before.state[i] + share * (after.state[i] - before.state[i]))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Where the ship of the survey is without its wander.
fn ship(time_s: f64) -> ([f64; 3], [f64; 2]) {
    let (sin, cos) = (time_s * 2.0 / 600.0).sin_cos();
    ([500.0 + 600.0 * cos, 450.0 + 600.0 * sin, 0.0], [-2.0 * sin, 2.0 * cos])
}

#[test]
fn one_seed_gives_the_same_bits_however_the_world_is_advanced() {
    let scenario = submerged();
    let text = |observations: &[Observation]| format!("{observations:?}"); // round-trips every bit
    let once = observations(&scenario, 130, 100_000);
    assert_eq!(text(&once), text(&observations(&scenario, 130, 1_000_000)));
    assert!(once.is_sorted_by_key(|observation| observation.time_us));
    let mut other = scenario;
    other.settings.seed = 2;
    assert_ne!(text(&once), text(&observations(&other, 130, 100_000)));
}

#[test]
fn a_sensor_that_is_off_leaves_the_others_as_they_were() {
    let scenario = submerged();
    let mut without = scenario.clone();
    without.settings.sensors.dvl.fitted = false;
    without.settings.sensors.depth.rate_hz = 4.0;
    let others = |scenario| {
        let mut all = observations(scenario, 130, 100_000);
        all.retain(|o| !matches!(o.kind, ObservationKind::Dvl { .. } | ObservationKind::Depth { .. }));
        all
    };
    assert_eq!(others(&scenario), others(&without));
    assert!(observations(&without, 10, 100_000).iter().all(|o| !matches!(o.kind, ObservationKind::Dvl { .. })));
}

#[test]
fn val_rates_and_noise_of_the_sensors() {
    let (all, truth, _) = flown(&submerged(), 600);
    let mut errors: [Vec<f64>; 4] = Default::default();
    for observation in &all {
        let true_now = at(&truth, observation.time_us);
        match observation.kind {
            ObservationKind::Depth { depth_m } => errors[0].push((depth_m - true_now.state[2]) / 0.06),
            ObservationKind::Ahrs { euler_rad, rates_radps } => {
                for i in 0..3 {
                    errors[1].push((euler_rad[i] - true_now.state[3 + i]) / 1.0_f64.to_radians());
                    errors[2].push((rates_radps[i] - true_now.state[9 + i]) / 0.5_f64.to_radians());
                }
            }
            ObservationKind::Dvl { velocity_mps: Some(velocity), .. } => {
                for i in 0..3 {
                    errors[3].push((velocity[i] - true_now.velocity_over_ground_mps[i]) / 0.01);
                }
            }
            _ => {}
        }
    }
    for (errors, count) in errors.iter().zip([7.0 * 600.0, 9.0 * 600.0, 9.0 * 600.0, 15.0 * 600.0]) {
        assert!((errors.len() as f64 - count).abs() <= 3.0, "{}", errors.len());
        let mean_square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        // χ² over n: one sigma √(2/n) is at most 0.022, four are allowed.
        assert!((mean_square - 1.0).abs() < 4.0 * (2.0 / errors.len() as f64).sqrt(), "{mean_square}");
    }
}

#[test]
fn val_downlink_travels_from_where_the_ship_was_to_where_the_vehicle_is() {
    let (all, truth, _) = flown(&noiseless(), 200);
    let packets = downlinks(&all);
    assert_eq!(packets.iter().map(|p| p.1.tol_us / 1_000_000).collect::<Vec<_>>(), [60, 90, 120, 150, 180]);
    for (time_us, packet) in packets {
        let (from, ship_velocity) = ship(packet.tol_us as f64 * 1e-6);
        let to = place(&truth, time_us);
        let range = distance(to, from);
        assert!(range > 500.0);
        // The µs to which the arrival is rounded, at 1 m/s, and chord against arc within a step.
        assert!((packet.range_m - range).abs() < 5e-6, "{} {range}", packet.range_m);
        let travel_us = (time_us - packet.tol_us) as f64;
        assert!((travel_us - range / 1500.0 * 1e6).abs() < 1.0);
        assert_eq!(packet.toa_us, time_us);
        assert_eq!(packet.end_us, time_us + 3_600_000);
        let v = at(&truth, time_us + 10_000).velocity_ned_mps;
        let relative = [v[0] - ship_velocity[0], v[1] - ship_velocity[1], v[2]];
        let rate = (0..3).map(|i| (to[i] - from[i]) * relative[i]).sum::<f64>() / range;
        assert!((packet.range_rate_mps - rate).abs() < 1e-6, "{} {rate}", packet.range_rate_mps);
        // The report is the ship's estimate: near the truth, and it says how near.
        assert!(distance([packet.ship.position_m[0], packet.ship.position_m[1], 0.0], from) < 1.5);
        assert!((0.1..0.5).contains(&packet.ship.position_sigma_m));
    }
}

#[test]
fn val_range_noise_and_loss() {
    let mut scenario = submerged();
    scenario.settings.acoustics.first_s = 5;
    scenario.settings.acoustics.period_s = 1.try_into().unwrap();
    scenario.settings.ship.wander_m = 0.0;
    let (all, truth, _) = flown(&scenario, 600);
    let packets = downlinks(&all);
    assert_eq!(packets.len(), 595);
    let errors: Vec<f64> = packets
        .iter()
        .map(|(time_us, packet)| {
            packet.range_m - distance(place(&truth, *time_us), ship(packet.tol_us as f64 * 1e-6).0)
        })
        .collect();
    let mean_square = errors.iter().map(|e| e * e).sum::<f64>() / 595.0;
    // χ² over 595: one sigma 0.058.
    assert!((0.8..1.2).contains(&mean_square), "{mean_square}");

    scenario.settings.acoustics.loss_share = 0.25;
    let (lossy, ..) = flown(&scenario, 600);
    let kept = downlinks(&lossy);
    // Binomial: 446 with a sigma of 11.
    assert!((410..483).contains(&kept.len()), "{}", kept.len());
    assert!(kept.iter().all(|packet| packets.contains(packet)), "losses change no other packet");
}

#[test]
fn val_uplink_and_two_way_paths() {
    let mut scenario = noiseless();
    scenario.settings.acoustics.slots = vec![
        Slot { offset_s: 0, exchange: Exchange::Uplink, companion: None },
        Slot { offset_s: 10, exchange: Exchange::TwoWay, companion: None },
    ];
    let (all, truth, _) = flown(&scenario, 120);
    let (mut uplinks, mut pings) = (0, 0);
    for observation in &all {
        match observation.kind {
            ObservationKind::Uplink(OneWay { tol_us, range_m, .. }) => {
                uplinks += 1;
                let from = place(&truth, tol_us);
                // The arrival is rounded to 1 µs, in which the ship moves 2 µm.
                assert!((range_m - distance(from, ship(observation.time_us as f64 * 1e-6).0)).abs() < 5e-6);
            }
            ObservationKind::TwoWay(TwoWay { tol_us, reply_us, one_way_time_s, range_m }) => {
                pings += 1;
                assert_eq!(tol_us % 30_000_000, 10_000_000);
                let reply = ship(reply_us as f64 * 1e-6).0;
                let heard = ship(reply_us as f64 * 1e-6 - 1.0).0;
                let out = distance(place(&truth, tol_us), heard);
                let back = distance(place(&truth, observation.time_us), reply);
                assert!((range_m - 0.5 * (out + back)).abs() < 1e-5, "{range_m} {out} {back}");
                assert!((range_m - 1500.0 * one_way_time_s).abs() < 1e-9);
            }
            _ => {}
        }
    }
    assert_eq!((uplinks, pings), (2, 2));
}

#[test]
fn val_effects_do_what_their_definitions_say() {
    let clean = noiseless();
    let mut scenario = clean.clone();
    for (name, values) in [
        ("heading_bias", &[("const_rad", 0.01), ("cos_rad", 0.02)][..]),
        ("dvl_scale", &[("ratio", 0.01)]),
        ("dvl_misalignment", &[("yaw_rad", 0.02)]),
        ("sound_speed", &[("ratio", 0.005)]),
        ("clock_offset", &[("s", 2.0e-3)]),
        ("clock_drift", &[("ppm", 10.0)]),
    ] {
        scenario.settings.effects.push(Effect::new(name, values).unwrap());
    }
    let (all, truth, _) = flown(&scenario, 70);
    for observation in &all {
        let now = at(&truth, observation.time_us);
        match observation.kind {
            ObservationKind::Ahrs { euler_rad, .. } => {
                let bias = 0.01 + 0.02 * now.state[5].cos();
                assert!((euler_rad[2] - now.state[5] - bias).abs() < 1e-12);
            }
            ObservationKind::Dvl { velocity_mps: Some(got), .. } => {
                let [u, v, w] = now.velocity_over_ground_mps;
                let (sin, cos) = 0.02_f64.sin_cos();
                let expected = [1.01 * (cos * u + sin * v), 1.01 * (cos * v - sin * u), 1.01 * w];
                assert!(distance(got, expected) < 1e-12);
            }
            ObservationKind::Downlink(packet) => {
                let range = distance(place(&truth, observation.time_us), ship(60.0).0);
                let expected = 1.005 * range + 1500.0 * (2.0e-3 + 1.0e-5 * observation.time_us as f64 * 1e-6);
                assert!((packet.range_m - expected).abs() < 1e-5, "{} {expected}", packet.range_m);
            }
            _ => {}
        }
    }
    assert_eq!(downlinks(&all).len(), 1);
}

#[test]
fn val_bottom_track_feels_the_current_and_loses_the_bottom() {
    let mut scenario = noiseless();
    scenario.settings.environment.current.north_mps = 0.15;
    let velocity = |scenario: &Scenario| {
        observations(scenario, 20, 100_000).iter().rev().find_map(|o| match o.kind {
            ObservationKind::Dvl { velocity_mps, altitude_m } => Some((velocity_mps, altitude_m)),
            _ => None,
        })
    };
    let (with, without) = (velocity(&scenario).unwrap(), velocity(&noiseless()).unwrap());
    let gained = with.0.unwrap()[0] - without.0.unwrap()[0];
    // It heads north, pitched by some hundredths of a radian.
    assert!((0.149..=0.15).contains(&gained), "{gained}");
    scenario.settings.sensors.dvl.max_altitude_m = 5.0;
    assert_eq!(velocity(&scenario), Some((None, None)));
}

#[test]
fn gnss_only_at_the_surface() {
    let fixes = |scenario: &Scenario| {
        let all = observations(scenario, 10, 100_000);
        all.iter().filter(|o| matches!(o.kind, ObservationKind::VehicleGnss { fix: Some(_) })).count()
    };
    assert_eq!(fixes(&Scenario::built_in("survey").unwrap()), 11);
    assert_eq!(fixes(&submerged()), 0);
}

#[test]
fn actuator_targets_take_effect_at_their_time() {
    let mut world = World::new(&noiseless());
    world.set_actuator_targets(50_000, CRUISE);
    world.advance(50_000, &mut |_| {});
    assert_eq!(world.truth().actuators.propeller_radps, 0.0);
    world.advance(60_000, &mut |_| {});
    assert!(world.truth().actuators.propeller_radps > 0.0);
}
