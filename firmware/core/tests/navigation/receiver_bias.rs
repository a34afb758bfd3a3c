//! What the receivers' biases make of the estimate, against the difference between flights with and without them.

use super::support::*;
use backseat_core::navigation::*;

/// A second of noise and Jacobians that depend on the place a little: the sensitivity is that of a linear filter.
const TOLERANCE: f64 = 0.05;

/// Two minutes with fixes for the first twenty seconds and a delayed range every twenty, from a vehicle whose receiver
/// is off by the first two numbers and a ship whose receiver is off by the others, m.
fn flown(bias_m: [f64; 4]) -> Box<Navigator> {
    let mut config = NavigationConfig { surface: None, receiver_bias_m: 1.5, ..NavigationConfig::REFERENCE };
    config.make_robust();
    config.bank = false;
    let mut navigator = navigator(&config);
    let mut initial = initial();
    let mut truth = Truth::new(initial.state, [0.0; 2], [0.0; 4]);
    (0..2).for_each(|i| initial.state[i] += bias_m[i]);
    navigator.initialise(0, &initial).unwrap();
    let mut noise = Noise(3);
    let mut clone = None;
    for step in 1..=1200_u64 {
        (0..10).for_each(|_| truth.tick(&CRUISE, &config, &mut noise));
        navigator.predict(100_000 * step, &CRUISE).unwrap();
        let (x, sensors) = (truth.x, &config.sensors);
        navigator.fuse(&Measurement::Depth { z_m: x[2] + sensors.depth_m * noise.normal() });
        let euler_rad = noise.normals([x[3], x[4], x[5]], sensors.attitude_rad);
        navigator.fuse(&Measurement::Attitude { euler_rad });
        let fix = noise.normals([x[0] + bias_m[0], x[1] + bias_m[1]], sensors.gnss_m);
        if step <= 200 && step % 10 == 0 {
            navigator.fuse(&Measurement::VehicleGnss { position_m: fix });
        }
        if step % 200 == 150 {
            let angle = step as f64 / 300.0;
            let ship = [x[0] + 400.0 * angle.cos(), x[1] + 400.0 * angle.sin()];
            let range_m = (x[0] - ship[0]).hypot(x[1] - ship[1]).hypot(x[2]) + noise.normal();
            clone = Some((navigator.clone_vehicle().unwrap(), ship, range_m));
        }
        if step % 200 == 180 {
            let (id, ship, range_m) = clone.take().unwrap();
            let ship = ShipReport {
                position_m: [ship[0] + bias_m[2], ship[1] + bias_m[3]],
                velocity_mps: [0.0; 2],
                position_sigma_m: 0.5,
                velocity_sigma_mps: 0.1,
            };
            let path = AcousticPath {
                vehicle: VehicleEnd::Delayed { clone: id, bridge_s: 0.0 },
                ship: ShipEnd::Reported(ship),
            };
            let fusions = navigator.fuse(&Measurement::Range { path, range_m });
            assert!(fusions.iter().all(|record| record.outcome == FusionOutcome::Fused));
            navigator.drop_clone(id);
        }
    }
    navigator
}

#[test]
fn val_stated_covariance_is_that_of_flights_with_biased_receivers() {
    let without = flown([0.0; 4]);
    let size_m = 1.0e-3;
    let mut expected = [0.0; 3];
    for bias in 0..4 {
        let mut bias_m = [0.0; 4];
        bias_m[bias] = size_m;
        let with = flown(bias_m);
        let [x, y] = [0, 1].map(|i| (with.state()[i] - without.state()[i]) / size_m);
        [x * x, x * y, y * y].into_iter().zip(&mut expected).for_each(|(product, sum)| *sum += 2.25 * product);
    }
    let found = [(0, 0), (0, 1), (1, 1)].map(|(i, j)| without.stated_covariance(i, j) - without.covariance(i, j));
    // both receivers count: more than one bias alone, and not the sum of two independent places
    assert!(expected[0] > 1.0 && expected[0] < 10.0, "{expected:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < TOLERANCE * 2.25, "{found} is not {expected}");
    }
    assert!(without.stated_variance(0) >= without.stated_covariance(0, 0));
}
