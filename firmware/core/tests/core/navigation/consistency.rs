//! Innovations and errors against simulated truth: as large as the filter says, in every acoustic geometry.

use super::support::*;
use backseat_core::navigation::*;
use backseat_core::state::wrap_angle;

fn config() -> NavigationConfig {
    NavigationConfig {
        effect_states: EffectStates::water_current(0.3, 1e-4),
        surface: None, // nobody holds the depth here, and the truth is as smooth at any
        ..NavigationConfig::REFERENCE
    }
}

/// Ten minutes; every ten seconds a packet: downlink, uplink, two-way ping, delayed report, immediate report.
fn fly(seed: u64, tally: &mut Consistency) -> (f64, Box<Navigator>) {
    let config = config();
    let sensors = config.sensors;
    let mut noise = Noise(seed);
    let initial = initial();
    let mut x = initial.state;
    for i in 0..12 {
        x[i] += initial.sigma[i] * noise.normal();
    }
    let ship_initial =
        InitialShip { state: [200.0, 250.0, 0.0, 1.0, -1.0, 0.0], sigma: [0.5, 0.5, 0.1, 0.2, 0.2, 0.01] };
    let mean = [0, 1, 3, 4].map(|i| ship_initial.state[i]);
    let sigma = [0, 1, 3, 4].map(|i| ship_initial.sigma[i]);
    let ship = core::array::from_fn(|i| mean[i] + sigma[i] * noise.normal());
    let mut truth = Truth::new(x, noise.normals([0.0; 2], 0.3), ship);
    let mut navigator = navigator(&config);
    navigator.initialise(0, &initial).unwrap();
    navigator.initialise_ship(&ship_initial).unwrap();

    let mut clones: [Option<CloneId>; 2] = [None; 2];
    let (mut launch, mut reply) = (([0.0; 3], [0.0; 3]), [0.0; 4]);
    let (mut event, mut bridge_s, mut report) = (([0.0; 3], [0.0; 3]), 0.0, None);
    for k in 1..=60_000_u64 {
        truth.tick(&CRUISE, &config, &mut noise);
        let (tick, packet) = (k % 1000, k / 1000);
        let mut measurements = Vec::new();
        if k % 14 == 0 {
            measurements.push(Measurement::Depth { z_m: truth.x[2] + sensors.depth_m * noise.normal() });
        }
        if k % 33 == 0 {
            let euler_rad = noise.normals([3, 4, 5].map(|i| truth.x[i]), sensors.attitude_rad);
            measurements.push(Measurement::Attitude { euler_rad });
            let rates_radps = noise.normals([9, 10, 11].map(|i| truth.x[i]), sensors.rates_radps);
            measurements.push(Measurement::Rates { rates_radps });
        }
        if k % 100 == 0 {
            let position_m = noise.normals([truth.ship[0], truth.ship[1]], sensors.ship_gnss_m);
            measurements.push(Measurement::ShipGnss { position_m });
        }
        // Where the delayed events of this packet really were.
        if packet % 5 == 3 && tick == 530 {
            bridge_s = 0.2 * (2.0 * noise.uniform() - 1.0);
            let ship = truth.ship;
            report = Some(ShipReport {
                position_m: noise.normals([ship[0], ship[1]], 0.5),
                velocity_mps: noise.normals([ship[2], ship[3]], 0.05),
                position_sigma_m: 0.5,
                velocity_sigma_mps: 0.05,
            });
            reply = ship;
        }
        if packet % 5 == 3 && tick == 560 + (bridge_s * 100.0).round() as u64 {
            event = (truth.position(), truth.velocity());
        }
        let clone_now = [500, 530, 560].contains(&tick);
        if !measurements.is_empty() || clone_now || tick == 900 {
            navigator.predict(k * TICK_US, &CRUISE).unwrap();
        }
        let (here, there) = ((truth.position(), truth.velocity()), truth.ship);
        let mut path = None;
        match (packet % 5, tick) {
            (0, 500) => (clones[0], reply) = (Some(navigator.clone_ship().unwrap()), there),
            (0, 530) => path = Some((VehicleEnd::Now, ShipEnd::Delayed(clones[0].unwrap()), here, reply)),
            (1, 500) => (clones[0], launch) = (Some(navigator.clone_vehicle().unwrap()), here),
            (1, 530) => {
                let vehicle = VehicleEnd::Delayed { clone: clones[0].unwrap(), bridge_s: 0.0 };
                path = Some((vehicle, ShipEnd::Now, launch, there));
            }
            (2, 500) => (clones[0], launch) = (Some(navigator.clone_vehicle().unwrap()), here),
            (2, 530) => (clones[1], reply) = (Some(navigator.clone_ship().unwrap()), there),
            (2, 560) => {
                let ship = ShipEnd::Delayed(clones[1].unwrap());
                let vehicle = VehicleEnd::Delayed { clone: clones[0].unwrap(), bridge_s: 0.0 };
                let half =
                    0.5 * (range_and_rate(launch.0, launch.1, reply).0 + range_and_rate(here.0, here.1, reply).0);
                measurements.push(Measurement::TwoWayRange {
                    outward: AcousticPath { vehicle, ship },
                    back: AcousticPath { vehicle: VehicleEnd::Now, ship },
                    range_m: half + sensors.range_m * noise.normal(),
                });
            }
            (3, 560) => clones[0] = Some(navigator.clone_vehicle().unwrap()),
            (3, 900) => {
                // The simulated event lies on a tick.
                let bridge_s = (bridge_s * 100.0).round() / 100.0;
                let vehicle = VehicleEnd::Delayed { clone: clones[0].unwrap(), bridge_s };
                path = Some((vehicle, ShipEnd::Reported(report.unwrap()), event, reply));
            }
            (4, 530) => {
                let report = ShipReport {
                    position_m: noise.normals([there[0], there[1]], 0.5),
                    velocity_mps: noise.normals([there[2], there[3]], 0.05),
                    position_sigma_m: 0.5,
                    velocity_sigma_mps: 0.05,
                };
                path = Some((VehicleEnd::Now, ShipEnd::Reported(report), here, there));
            }
            _ => {}
        }
        if let Some((vehicle, ship, vehicle_truth, ship_truth)) = path {
            let (range, rate) = range_and_rate(vehicle_truth.0, vehicle_truth.1, ship_truth);
            let path = AcousticPath { vehicle, ship };
            measurements.push(Measurement::Range { path, range_m: range + sensors.range_m * noise.normal() });
            let range_rate_mps = rate + sensors.range_rate_mps * noise.normal();
            measurements.push(Measurement::RangeRate { path, range_rate_mps });
        }
        for measurement in &measurements {
            navigator.fuse(measurement).iter().for_each(|record| tally.add(record));
        }
        if tick == 999 {
            clones.iter_mut().for_each(|id| id.take().into_iter().for_each(|id| navigator.drop_clone(id)));
        }
    }
    navigator.predict(600_000_000, &CRUISE).unwrap();
    let mut error = truth.x - navigator.state();
    error[5] = wrap_angle(error[5]);
    let mut covariance = nalgebra::SMatrix::zeros();
    navigator.vehicle_covariance(&mut covariance);
    (nees_vehicle(&error, &covariance).unwrap(), navigator)
}

#[test]
fn val_innovations_and_errors_are_as_large_as_the_filter_says() {
    let mut tally = Consistency::new();
    let mut nees = 0.0;
    const RUNS: u64 = 8;
    for seed in 0..RUNS {
        nees += fly(1000 + seed, &mut tally).0;
    }
    for sensor in [Sensor::Depth, Sensor::Attitude, Sensor::Rates, Sensor::ShipGnss, Sensor::Range, Sensor::RangeRate] {
        let tally = tally.tally(sensor);
        // Chi-square of n degrees of freedom over n: 1 ± 4 √(2/n). Gating at 5 sigma cuts nothing noticeable.
        let bound = 4.0 * (2.0 / f64::from(tally.count)).sqrt();
        let mean = tally.mean().unwrap();
        println!("{} {mean:.3} ± {bound:.3} ({}, {} rejected)", sensor.name(), tally.count, tally.rejected);
        assert!((mean - 1.0).abs() < bound, "{} {mean} {bound}", sensor.name());
        assert_eq!(tally.invalid, 0);
        assert!(tally.rejected * 1000 <= tally.count, "{}", sensor.name());
    }
    // 12 degrees of freedom per run: mean 12, sigma √(24 / runs); four of them.
    let mean = nees / RUNS as f64;
    println!("NEES {mean:.2}");
    assert!((mean - 12.0).abs() < 4.0 * (24.0 / RUNS as f64).sqrt(), "{mean}");
}

#[test]
fn val_bridge_over_seconds_is_as_uncertain_as_it_says() {
    // White acceleration alike on all axes, a range far better than the bridge, attitude known.
    let mut config = NavigationConfig { process_model: ProcessModel::Kinematic, ..NavigationConfig::REFERENCE };
    config.process_noise = ProcessNoise { linear_mps2_per_sqrt_hz: [0.05; 3], angular_radps2_per_sqrt_hz: [1e-6; 3] };
    config.sensors.range_m = 0.01;
    config.gate_sigma = 100.0;
    let mut initial = initial();
    for i in [3, 4, 5, 9, 10, 11] {
        initial.state[i] = 0.0;
        initial.sigma[i] = 1e-9;
    }
    let mut noise = Noise(5);
    let mut tally = Consistency::new();
    for trial in 0..600 {
        let bridge_s = [-2.0, -1.0, 1.0, 2.0][trial % 4];
        let mut x: [f64; 3] = core::array::from_fn(|i| initial.state[i] + initial.sigma[i] * noise.normal());
        let mut v: [f64; 3] = core::array::from_fn(|i| initial.state[6 + i] + initial.sigma[6 + i] * noise.normal());
        let ship = [300.0, -200.0];
        let mut at_event = 0.0;
        for tick in 0..=500 {
            if tick == (300.0 + bridge_s * 100.0) as i32 {
                at_event = ((x[0] - ship[0]).powi(2) + (x[1] - ship[1]).powi(2) + x[2].powi(2)).sqrt();
            }
            for i in 0..3 {
                x[i] += 0.01 * v[i];
                v[i] += 0.05 * 0.1 * noise.normal();
            }
        }
        let mut navigator = navigator(&config);
        navigator.initialise(0, &initial).unwrap();
        navigator.predict(3_000_000, &CRUISE).unwrap();
        let clone = navigator.clone_vehicle().unwrap();
        navigator.predict(5_000_000, &CRUISE).unwrap();
        let path = AcousticPath { vehicle: VehicleEnd::Delayed { clone, bridge_s }, ..reported(still(ship, [0.0; 2])) };
        let range_m = at_event + config.sensors.range_m * noise.normal();
        let fusions = navigator.fuse(&Measurement::Range { path, range_m });
        // Backwards, the clone's own velocity already holds the noise of the bridge.
        if bridge_s > 0.0 {
            fusions.iter().for_each(|record| tally.add(record));
        } else {
            assert!(fusions.iter().all(|record| record.nis() < 36.0));
        }
    }
    let (mean, count) = (tally.tally(Sensor::Range).mean().unwrap(), tally.tally(Sensor::Range).count);
    assert_eq!(count, 300);
    assert!((mean - 1.0).abs() < 4.0 * (2.0 / f64::from(count)).sqrt(), "{mean}");
}

#[test]
fn bridge_adds_the_variance_of_white_acceleration() {
    let config = NavigationConfig::REFERENCE;
    let variance = |bridge_s: f64| {
        let mut navigator = navigator(&config);
        let mut initial = initial();
        initial.sigma *= 1e-6;
        navigator.initialise(0, &initial).unwrap();
        let clone = navigator.clone_vehicle().unwrap();
        let vehicle = VehicleEnd::Delayed { clone, bridge_s };
        let path = AcousticPath { vehicle, ..reported(still([500.0, 0.0], [0.0; 2])) };
        let range = navigator.fuse(&Measurement::Range { path, range_m: 499.0 });
        range.iter().next().unwrap().variance
    };
    let q = 9.0e-6;
    for bridge_s in [-4.0_f64, 3.0] {
        let expected = 1.0 + q * bridge_s.abs().powi(3) / 3.0;
        // What the tiny initial sigmas leave.
        assert!((variance(bridge_s) - expected).abs() < 1e-9, "{bridge_s}");
    }
}
