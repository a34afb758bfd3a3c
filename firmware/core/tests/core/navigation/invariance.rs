//! Worlds that are the same one seen otherwise: drifting along with the water, turned, in a mirror. The whole filter,
//! with every sensor that takes part in the change, must come to the same answer.

use super::support::*;
use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_core::navigation::*;
use backseat_core::state::{VehicleState, wrap_angle};
use nalgebra::{SMatrix, SVector};

/// First mirrored at the north axis, then turned, then drifting.
#[derive(Clone, Copy)]
struct World {
    mirrored: bool,
    turn_rad: f64,
    current_mps: [f64; 2],
}

const HOME: World = World { mirrored: false, turn_rad: 0.0, current_mps: [0.0; 2] };

impl World {
    /// Sign of what a mirror turns round.
    fn sign(&self) -> f64 {
        if self.mirrored { -1.0 } else { 1.0 }
    }

    fn horizontal(&self, [north, east]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn_rad.sin_cos();
        let east = self.sign() * east;
        [cos * north - sin * east, sin * north + cos * east]
    }

    fn velocity(&self, velocity: [f64; 2]) -> [f64; 2] {
        let [north, east] = self.horizontal(velocity);
        [north + self.current_mps[0], east + self.current_mps[1]]
    }

    fn position(&self, position: [f64; 2], t_s: f64) -> [f64; 2] {
        let [north, east] = self.horizontal(position);
        [north + t_s * self.current_mps[0], east + t_s * self.current_mps[1]]
    }

    fn heading(&self, heading: f64) -> f64 {
        wrap_angle(self.sign() * heading + self.turn_rad)
    }

    /// Roll and heading, sway, roll and yaw rate.
    fn lateral(&self, values: [f64; 3], lateral: [usize; 2]) -> [f64; 3] {
        core::array::from_fn(|i| if lateral.contains(&i) { self.sign() * values[i] } else { values[i] })
    }

    fn euler(&self, [roll, pitch, heading]: [f64; 3]) -> [f64; 3] {
        [self.sign() * roll, pitch, self.heading(heading)]
    }

    fn vehicle(&self, x: &VehicleState) -> VehicleState {
        let three = |at: usize| [x[at], x[at + 1], x[at + 2]];
        let ([north, east], [phi, theta, psi]) = (self.horizontal([x[0], x[1]]), self.euler(three(3)));
        let ([u, v, w], [p, q, r]) = (self.lateral(three(6), [1, 1]), self.lateral(three(9), [0, 2]));
        VehicleState::from([north, east, x[2], phi, theta, psi, u, v, w, p, q, r])
    }

    fn ship(&self, ship: [f64; 4], t_s: f64) -> [f64; 4] {
        let ([x, y], [vx, vy]) = (self.position([ship[0], ship[1]], t_s), self.velocity([ship[2], ship[3]]));
        [x, y, vx, vy]
    }

    fn input(&self, input: &ActuatorInput) -> ActuatorInput {
        let [top, bottom, port, starboard] = input.fins_rad;
        let fins_rad = if self.mirrored { [-top, -bottom, -starboard, -port] } else { input.fins_rad };
        ActuatorInput { fins_rad, ..*input }
    }

    /// Which state of home each state comes from: vehicle, current, ship.
    fn jacobian(&self) -> SMatrix<f64, 20, 20> {
        let mut t = SMatrix::identity();
        for lateral in [3, 5, 7, 9, 11, 16, 19] {
            t[(lateral, lateral)] = self.sign();
        }
        for pair in [0, 12, 14, 17] {
            for (j, unit) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
                let column = self.horizontal(unit);
                t[(pair, pair + j)] = column[0];
                t[(pair + 1, pair + j)] = column[1];
            }
        }
        t
    }
}

/// Five minutes of a survey at home, seen from a world.
fn fly(world: &World, estimate_current: bool) -> Box<Navigator> {
    let [north, east] = world.current_mps;
    let config = NavigationConfig {
        effects: backseat_core::effects::EffectSet::NONE.with("water_current", &[north, east]).unwrap(),
        effect_states: if estimate_current { EffectStates::water_current(0.3, 1.0e-4) } else { EffectStates::NONE },
        surface: None,
        ..NavigationConfig::REFERENCE
    };
    let sensors = config.sensors;
    let mut navigator = navigator(&config);
    let home = initial();
    navigator.initialise(0, &InitialState { state: world.vehicle(&home.state), sigma: home.sigma }).unwrap();
    let ship = [200.0, 150.0, -0.5, 1.0];
    let [x, y, vx, vy] = world.ship(ship, 0.0);
    let sigma = [0.5, 0.5, 0.1, 0.2, 0.2, 0.01];
    let ship_heading = world.sign() * 0.4 + world.turn_rad;
    navigator.initialise_ship(&InitialShip { state: [x, y, ship_heading, vx, vy, 0.0], sigma }).unwrap();

    let mut noise = Noise(3);
    let mut truth = Truth::new(home.state, [0.0; 2], ship);
    for k in 1..=3000_u64 {
        let t_s = 0.1 * k as f64;
        let rudder = if (k / 400) % 2 == 0 { 0.06 } else { -0.04 };
        let input = ActuatorInput { propeller_radps: 106.8, fins_rad: [rudder, -0.7 * rudder, 0.012, -0.004] };
        (0..10).for_each(|_| truth.tick(&input, &config, &mut noise));
        navigator.predict(k * 100_000, &world.input(&input)).unwrap();
        let x = truth.x;
        let three = |at: usize| [x[at], x[at + 1], x[at + 2]];
        let mut all = vec![
            Measurement::Depth { z_m: x[2] + sensors.depth_m * noise.normal() },
            Measurement::Attitude { euler_rad: world.euler(noise.normals(three(3), sensors.attitude_rad)) },
            Measurement::Rates { rates_radps: world.lateral(noise.normals(three(9), sensors.rates_radps), [0, 2]) },
        ];
        if k % 7 == 0 {
            let velocity_mps = world.lateral(noise.normals(three(6), sensors.dvl_mps), [1, 1]);
            all.push(Measurement::WaterTrack { velocity_mps });
        }
        if k % 50 == 0 {
            let position_m = world.position(noise.normals([x[0], x[1]], sensors.gnss_m), t_s);
            all.push(Measurement::VehicleGnss { position_m });
        }
        if k % 10 == 0 {
            let position_m = world.position(noise.normals([truth.ship[0], truth.ship[1]], sensors.ship_gnss_m), t_s);
            all.push(Measurement::ShipGnss { position_m });
        }
        if k % 100 == 0 {
            // The vehicle asks, the ship answers at once; and the ship tells where it is.
            let clone = navigator.clone_vehicle().unwrap();
            let (range, rate) = range_and_rate(truth.position(), truth.velocity(), truth.ship);
            let [x, y, vx, vy] = world.ship(truth.ship, t_s);
            let report = ShipReport {
                position_m: [x, y],
                velocity_mps: [vx, vy],
                position_sigma_m: 0.5,
                velocity_sigma_mps: 0.05,
            };
            let vehicle = VehicleEnd::Delayed { clone, bridge_s: 0.0 };
            for path in [
                AcousticPath { vehicle, ship: ShipEnd::Now },
                AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Reported(report) },
            ] {
                all.push(Measurement::Range { path, range_m: range + sensors.range_m * noise.normal() });
                let range_rate_mps = rate + sensors.range_rate_mps * noise.normal();
                all.push(Measurement::RangeRate { path, range_rate_mps });
            }
            for measurement in all.drain(..) {
                assert!(navigator.fuse(&measurement).iter().all(|record| record.outcome == FusionOutcome::Fused));
            }
            navigator.drop_clone(clone);
        }
        for measurement in &all {
            assert!(navigator.fuse(measurement).iter().all(|record| record.outcome == FusionOutcome::Fused));
        }
    }
    navigator
}

/// State and covariance in a world are those of home, seen from there.
fn assert_same(world: &World, estimate_current: bool) {
    const END_S: f64 = 300.0;
    let (home, there) = (fly(&HOME, estimate_current), fly(world, estimate_current));
    // Without a current among the states its two places are left out.
    let places: Vec<usize> = (0..20).filter(|i| estimate_current || !(12..14).contains(i)).collect();
    assert_eq!((home.main().dimension(), there.main().dimension()), (places.len(), places.len()));
    let t = world.jacobian();
    let (mut expected, mut expected_p) = (SVector::<f64, 20>::zeros(), SMatrix::<f64, 20, 20>::zeros());
    for (i, row) in places.iter().enumerate() {
        expected[*row] = home.state_at(i);
        for (j, column) in places.iter().enumerate() {
            expected_p[(*row, *column)] = home.covariance(i, j);
        }
    }
    (expected, expected_p) = (t * expected, t * expected_p * t.transpose());
    for i in 0..20 {
        expected[i] += match i {
            0 | 1 => END_S * world.current_mps[i],
            14 | 15 => END_S * world.current_mps[i - 14],
            12 | 13 => world.current_mps[i - 12],
            17 | 18 => world.current_mps[i - 17],
            5 | 16 => world.turn_rad,
            _ => 0.0,
        };
    }
    for (i, row) in places.iter().enumerate() {
        let off = there.state_at(i) - expected[*row];
        let off = if [5, 16].contains(row) { wrap_angle(off) } else { off };
        // Positions of some 300 m, rounded 3000 times, and what that does to the rest: 1e-10 of a sigma.
        assert!(off.abs() < 1.0e-9 * there.variance(i).sqrt(), "state {row}: {off:e}");
        for (j, column) in places.iter().enumerate() {
            let scale = (there.variance(i) * there.variance(j)).sqrt();
            let off = (there.covariance(i, j) - expected_p[(*row, *column)]) / scale;
            assert!(off.abs() < 1.0e-9, "covariance {row} {column}: {off:e}");
        }
    }
}

#[test]
fn val_a_steady_current_carries_the_whole_problem_along() {
    for estimate_current in [false, true] {
        assert_same(&World { current_mps: [0.4, -0.25], ..HOME }, estimate_current);
    }
}

#[test]
fn val_a_turned_world_is_turned_and_nothing_else() {
    assert_same(&World { turn_rad: 2.1, ..HOME }, true);
}

#[test]
fn val_a_mirrored_world_is_mirrored_and_nothing_else() {
    assert_same(&World { mirrored: true, ..HOME }, true);
}

#[test]
fn val_all_at_once() {
    assert_same(&World { mirrored: true, turn_rad: -1.3, current_mps: [-0.3, 0.2] }, true);
}

#[test]
fn val_rest_stays_rest_in_the_filter() {
    let neutral = VehicleParameters { displaced_mass_kg: 38.0, ..VehicleParameters::IVER3 };
    let mut navigator = Box::new(Navigator::new());
    navigator.configure(&NavigationConfig::REFERENCE, &VehicleModel::new(&neutral).unwrap()).unwrap();
    let mut start = initial();
    start.state.fill(0.0);
    start.state[2] = 12.0;
    navigator.initialise(0, &start).unwrap();
    let input = ActuatorInput { propeller_radps: 0.0, fins_rad: [0.3, -0.2, 0.1, 0.4] };
    for k in 1..=36_000 {
        navigator.predict(k * 100_000, &input).unwrap();
    }
    assert_eq!(navigator.state(), &start.state);
}
