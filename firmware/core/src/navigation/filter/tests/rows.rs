//! h and every row of H against dual numbers through a second derivation of every measurement, effects and all.

#![allow(clippy::disallowed_methods)] // the tests' own arithmetic need not have the same bits on every machine

extern crate std;

#[allow(dead_code)] // the dynamics need more functions of it than sensors do
#[path = "../../../../tests/core/dynamics/dual.rs"]
mod dual;

use crate::dynamics::{VehicleModel, VehicleParameters};
use crate::effects::{EffectSet, ParameterId};
use crate::navigation::algebra::layout::{CLONE_VELOCITY, CloneKind, EFFECTS, N_MAX, SHIP_VELOCITY};
use crate::navigation::filter::cekf::Filter;
use crate::navigation::filter::vertical::is_steep;
use crate::navigation::*;
use crate::random::Random;
use crate::state::{P, PHI, PSI, THETA, U, VEHICLE_STATES, X, Z, wrap_angle};
use dual::{Dual, Scalar};
use std::boxed::Box;
use std::vec;
use std::vec::Vec;

type Vec3<S> = [S; 3];

/// What the sensors' effects are, as the catalogue defines them.
const FIXED: [(&str, &[f64]); 9] = [
    ("water_current", &[0.12, -0.07]),
    ("heading_bias", &[0.04, 0.03, -0.02]),
    ("pitch_sensor", &[0.02, 0.05]),
    ("gyro_bias", &[0.004, -0.003, 0.002]),
    ("depth_bias", &[0.4]),
    ("dvl_scale", &[0.03]),
    ("dvl_misalignment", &[0.04, -0.03]),
    ("sound_speed", &[0.01]),
    ("clock_offset", &[0.002]),
];
/// s since the epoch.
const TIME_S: f64 = 1000.0;
/// ppm.
const DRIFT: f64 = 1.5;

/// Which of the effects' parameters are states: four at a time, until each was one.
const STATES: [&[(&str, &str)]; 5] = [
    &[
        ("water_current", "north_mps"),
        ("water_current", "east_mps"),
        ("dvl_scale", "ratio"),
        ("dvl_misalignment", "yaw_rad"),
    ],
    &[
        ("heading_bias", "const_rad"),
        ("heading_bias", "sin_rad"),
        ("heading_bias", "cos_rad"),
        ("dvl_misalignment", "pitch_rad"),
    ],
    &[("pitch_sensor", "bias_rad"), ("pitch_sensor", "scale"), ("gyro_bias", "p_radps"), ("gyro_bias", "q_radps")],
    &[("gyro_bias", "r_radps"), ("depth_bias", "m"), ("sound_speed", "ratio"), ("clock_offset", "s")],
    &[("water_current", "north_mps"), ("water_current", "east_mps"), ("clock_drift", "ppm")],
];

/// A filter in no particular state, and which effects are states in it.
struct Scene {
    navigator: Box<Filter>,
    states: &'static [(&'static str, &'static str)],
    vehicle_clone: CloneId,
    ship_clone: CloneId,
}

impl Scene {
    fn new(states: &'static [(&'static str, &'static str)], random: &mut Random) -> Self {
        let mut effects = EffectSet::NONE.with("clock_drift", &[DRIFT]).expect("catalogued");
        for (effect, values) in FIXED {
            effects = effects.with(effect, values).expect("catalogued");
        }
        let effect_states = states.iter().fold(EffectStates::NONE, |all, (effect, parameter)| {
            all.with(effect, parameter, 1.0e-3, 0.0).expect("may be a state")
        });
        let config = NavigationConfig {
            effects,
            effect_states,
            ship_transducer_depth_m: 2.0,
            surface: None,
            ..NavigationConfig::REFERENCE
        };
        let mut navigator = Box::new(Filter::new());
        let model = VehicleModel::new(&VehicleParameters::IVER3).expect("valid");
        navigator.configure(&config, &model).expect("valid");
        let sigma = crate::state::VehicleState::repeat(1.0);
        let scales = [300.0, 300.0, 50.0, 3.0, 1.4, 3.0, 2.0, 1.0, 1.0, 1.0, 1.0, 1.0];
        let state = crate::state::VehicleState::from(scales.map(|scale| scale * random.within(1.0)));
        navigator.initialise((TIME_S * 1.0e6) as u64, &InitialState { state, sigma }).expect("finite");
        let ship = core::array::from_fn(|i| if i < 2 { 500.0 } else { 2.0 } * random.within(1.0));
        navigator.initialise_ship(&InitialShip { state: ship, sigma: [1.0; 6] }, &mut ()).expect("finite");
        let ship_clone = navigator.clone_ship(&mut ()).expect("room");
        let vehicle_clone = navigator.clone_vehicle(&mut ()).expect("room");
        // The clones are of another time.
        for at in navigator.dimension() - 12..navigator.dimension() {
            navigator.x.add_tail(at, 3.0 * random.within(1.0));
        }
        // Gains are zero where nothing is uncertain: fusing then only evaluates h and H.
        navigator.p.clear();
        Self { navigator, states, vehicle_clone, ship_clone }
    }

    /// A parameter of an effect, the state if it is one.
    fn effect<S: Scalar>(&self, x: &[S], effect: &str, parameter: &str) -> S {
        let slot = self
            .navigator
            .config
            .effect_states
            .iter()
            .position(|state| state.parameter.group() == effect && state.parameter.name() == parameter);
        let fixed = ParameterId::find(effect, parameter).map(|id| self.navigator.config.effects.get(id));
        assert_eq!(slot.is_some(), self.states.contains(&(effect, parameter)));
        slot.map_or(S::from(fixed.expect("catalogued")), |slot| x[EFFECTS + slot])
    }

    /// Velocity over ground of the vehicle, NED.
    fn ground_velocity<S: Scalar>(&self, x: &[S]) -> Vec3<S> {
        let [north, east, down] = to_ned(x, [x[U], x[U + 1], x[U + 2]]);
        let current = |axis| self.effect(x, "water_current", axis);
        [north + current("north_mps"), east + current("east_mps"), down]
    }

    /// dp and dv of a path.
    fn ends<S: Scalar>(&self, x: &[S], path: &AcousticPath) -> (Vec3<S>, Vec3<S>) {
        let layout = &self.navigator.x.layout;
        let three = |at: usize| [x[at], x[at + 1], x[at + 2]];
        let (p, v) = match path.vehicle {
            VehicleEnd::Now => (three(X), self.ground_velocity(x)),
            VehicleEnd::Delayed { clone, bridge_s } => {
                let at = layout.clone_at(clone, CloneKind::Vehicle).expect("held");
                let (p, v) = (three(at), three(at + CLONE_VELOCITY));
                ([0, 1, 2].map(|i| p[i] + v[i] * S::from(bridge_s)), v)
            }
        };
        let of_state = |at: usize| ([x[at], x[at + 1]], [x[at + SHIP_VELOCITY], x[at + SHIP_VELOCITY + 1]]);
        let mut depth = S::from(self.navigator.config.ship_transducer_depth_m);
        let (ship_p, ship_v) = match path.ship {
            ShipEnd::Now => of_state(layout.ship().expect("known")),
            ShipEnd::Delayed(id) => of_state(layout.clone_at(id, CloneKind::Ship).expect("held")),
            ShipEnd::Reported(report) => (report.position_m.map(S::from), report.velocity_mps.map(S::from)),
            ShipEnd::Transponder([north, east, down]) => {
                depth = S::from(down);
                ([north, east].map(S::from), [S::from(0.0); 2])
            }
            ShipEnd::Peer(peer) => {
                let [north, east, down] = peer.position_m;
                depth = S::from(down);
                let at = layout.peer(peer.address).expect("known");
                ([S::from(north) - x[at], S::from(east) - x[at + 1]], [S::from(0.0); 2])
            }
        };
        ([p[0] - ship_p[0], p[1] - ship_p[1], p[2] - depth], [v[0] - ship_v[0], v[1] - ship_v[1], v[2]])
    }

    fn distance<S: Scalar>(&self, x: &[S], path: &AcousticPath) -> S {
        let (dp, _) = self.ends(x, path);
        dot(dp, dp).sqrt()
    }

    /// h(x): what the sensors would show.
    fn predicted<S: Scalar>(&self, x: &[S], measurement: &Measurement) -> Vec<S> {
        let of = |effect, parameter| self.effect(x, effect, parameter);
        let one = S::from(1.0);
        let dvl = |velocity: Vec3<S>| {
            let (yaw, pitch) = (of("dvl_misalignment", "yaw_rad"), of("dvl_misalignment", "pitch_rad"));
            let scale = one + of("dvl_scale", "ratio");
            about_y(-pitch, about_z(-yaw, velocity)).map(|axis| scale * axis).to_vec()
        };
        let speed = S::from(self.navigator.config.sound_speed_mps);
        match measurement {
            Measurement::Depth { .. } => vec![x[Z] + of("depth_bias", "m")],
            Measurement::Attitude { .. } => {
                let [constant, sine, cosine] = ["const_rad", "sin_rad", "cos_rad"].map(|part| of("heading_bias", part));
                let heading = x[PSI] + constant + sine * x[PSI].sin() + cosine * x[PSI].cos();
                let pitch = (one + of("pitch_sensor", "scale")) * x[THETA] + of("pitch_sensor", "bias_rad");
                vec![x[PHI], pitch, heading]
            }
            Measurement::Rates { .. } => {
                let bias = ["p_radps", "q_radps", "r_radps"].map(|axis| of("gyro_bias", axis));
                (0..3).map(|i| x[P + i] + bias[i]).collect()
            }
            Measurement::WaterTrack { .. } => dvl([x[U], x[U + 1], x[U + 2]]),
            Measurement::BottomTrack { .. } => dvl(to_body(x, self.ground_velocity(x))),
            Measurement::VehicleGnss { .. } => x[X..X + 2].to_vec(),
            Measurement::ShipGnss { .. } => {
                let at = self.navigator.x.layout.ship().expect("known");
                x[at..at + 2].to_vec()
            }
            Measurement::Range { path, .. } => {
                let clock = of("clock_offset", "s") + of("clock_drift", "ppm") * S::from(1.0e-6 * TIME_S);
                vec![self.distance(x, path) * (one + of("sound_speed", "ratio")) + speed * clock]
            }
            Measurement::RangeRate { path, .. } => {
                let (dp, dv) = self.ends(x, path);
                vec![dot(dp, dv) / dot(dp, dp).sqrt()]
            }
            Measurement::TwoWayRange { outward, back, .. } => {
                let half = S::from(0.5) * (self.distance(x, outward) + self.distance(x, back));
                vec![half * (one + of("sound_speed", "ratio"))]
            }
            Measurement::Usbl { path, fix } => {
                let (dp, _) = self.ends(x, path);
                let m = usbl_vector(x, fix);
                // the triad belongs to the reading, and stands while the state varies
                let along = usbl_vector(&seeded(&self.navigator, N_MAX), fix).map(|axis| axis.value / fix.range_m);
                let [n, e, d] = along;
                let along = nalgebra::Vector3::from(along);
                let right = nalgebra::Vector3::new(-e, n, 0.0).normalize();
                let down = nalgebra::Vector3::new(-d * n, -d * e, 1.0 - d * d).normalize();
                let off = |axis: nalgebra::Vector3<f64>| {
                    dot([axis.x, axis.y, axis.z].map(S::from), [0, 1, 2].map(|i| m[i] - dp[i]))
                };
                let range = (S::from(fix.range_m) - off(along)) * (one + of("sound_speed", "ratio"));
                vec![range, -off(right), -off(down)]
            }
        }
    }

    /// Everything that can be measured, at values near what is predicted.
    fn measurements(&self, random: &mut Random) -> Vec<Measurement> {
        let report = ShipReport {
            position_m: [400.0 * random.within(1.0), 400.0 * random.within(1.0)],
            velocity_mps: [random.within(1.0), random.within(1.0)],
            position_sigma_m: 0.5,
            velocity_sigma_mps: 0.05,
        };
        let bridged = |bridge_s| VehicleEnd::Delayed { clone: self.vehicle_clone, bridge_s };
        let mut all = vec![
            Measurement::Depth { z_m: 20.0 },
            Measurement::Attitude { euler_rad: [0.1, 0.2, 0.3] },
            Measurement::Rates { rates_radps: [0.1, 0.2, 0.3] },
            Measurement::WaterTrack { velocity_mps: [1.0, 0.1, 0.2] },
            Measurement::BottomTrack { velocity_mps: [1.0, 0.1, 0.2] },
            Measurement::VehicleGnss { position_m: [10.0, -20.0] },
            Measurement::ShipGnss { position_m: [10.0, -20.0] },
        ];
        let place_m = [200.0, 300.0 * random.within(1.0), 60.0];
        let ships =
            [ShipEnd::Now, ShipEnd::Delayed(self.ship_clone), ShipEnd::Reported(report), ShipEnd::Transponder(place_m)];
        let mut fix = UsblFix {
            axes: UsblAxes::Level,
            range_m: 250.0,
            bearing_rad: 3.0 * random.within(1.0),
            elevation_rad: 1.4 * random.within(1.0),
            range_sigma_m: 1.0,
            angle_sigma_rad: 0.01,
        };
        for vehicle in [VehicleEnd::Now, bridged(0.0), bridged(-0.3), bridged(1.2)] {
            for ship in ships {
                let path = AcousticPath { vehicle, ship };
                let back = AcousticPath { vehicle: VehicleEnd::Now, ship };
                all.push(Measurement::Range { path, range_m: 300.0 });
                all.push(Measurement::RangeRate { path, range_rate_mps: 0.4 });
                all.push(Measurement::TwoWayRange { outward: path, back, range_m: 300.0 });
                all.push(Measurement::Usbl { path, fix });
                fix.bearing_rad += 0.1;
                all.push(Measurement::Usbl { path: back, fix: UsblFix { axes: UsblAxes::Body, ..fix } });
            }
        }
        // Ship's ends that differ.
        let (outward, back) = (
            AcousticPath { vehicle: bridged(0.5), ship: ShipEnd::Delayed(self.ship_clone) },
            AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Now },
        );
        all.push(Measurement::TwoWayRange { outward, back, range_m: 300.0 });
        all
    }
}

fn dot<S: Scalar>(a: Vec3<S>, b: Vec3<S>) -> S {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn about_x<S: Scalar>(angle: S, [x, y, z]: Vec3<S>) -> Vec3<S> {
    [x, angle.cos() * y - angle.sin() * z, angle.sin() * y + angle.cos() * z]
}

fn about_y<S: Scalar>(angle: S, [x, y, z]: Vec3<S>) -> Vec3<S> {
    [angle.cos() * x + angle.sin() * z, y, angle.cos() * z - angle.sin() * x]
}

fn about_z<S: Scalar>(angle: S, [x, y, z]: Vec3<S>) -> Vec3<S> {
    [angle.cos() * x - angle.sin() * y, angle.sin() * x + angle.cos() * y, z]
}

/// R a.
fn to_ned<S: Scalar>(x: &[S], a: Vec3<S>) -> Vec3<S> {
    about_z(x[PSI], about_y(x[THETA], about_x(x[PHI], a)))
}

/// Rᵀ a.
fn to_body<S: Scalar>(x: &[S], a: Vec3<S>) -> Vec3<S> {
    about_x(-x[PHI], about_y(-x[THETA], about_z(-x[PSI], a)))
}

/// What a USBL measured, as the vehicle minus the other end, NED.
fn usbl_vector<S: Scalar>(x: &[S], fix: &UsblFix) -> Vec3<S> {
    let [b, e] = [fix.bearing_rad, fix.elevation_rad];
    let m = [e.cos() * b.cos(), e.cos() * b.sin(), -e.sin()].map(|axis| S::from(fix.range_m * axis));
    if fix.axes == UsblAxes::Body { to_ned(x, m).map(|axis| -axis) } else { m }
}

/// The filter's states with a slope of one in one of them.
fn seeded(navigator: &Filter, direction: usize) -> Vec<Dual> {
    let slope = |i: usize| f64::from(u8::from(i == direction));
    navigator.x.iter().enumerate().map(|(i, value)| Dual { value, slope: slope(i) }).collect()
}

#[test]
fn val_rows_of_every_measurement_match_dual_numbers() {
    let mut random = Random(1);
    for states in STATES {
        for _ in 0..20 {
            let mut scene = Scene::new(states, &mut random);
            for measurement in scene.measurements(&mut random) {
                // a steep attitude is measured as a rotation vector: `super::vertical`
                if measurement.sensor() == Sensor::Attitude && is_steep(scene.navigator.state()) {
                    continue;
                }
                scene.navigator.fuse(&measurement, &mut ());
                let (n, sensor) = (scene.navigator.dimension(), measurement.sensor());
                let values: Vec<f64> =
                    scene.predicted(&seeded(&scene.navigator, N_MAX), &measurement).iter().map(|h| h.value).collect();
                assert_eq!(values.len(), scene.navigator.observations.as_slice().len());
                let mut rows = vec![vec![0.0; n]; values.len()];
                for (row, item) in rows.iter_mut().zip(scene.navigator.observations.as_slice()) {
                    item.row.iter().for_each(|(i, value)| row[i] += value);
                }
                for (axis, (h, z)) in values.iter().zip(measurement.readings()).enumerate() {
                    let off = scene.navigator.observations.innovation(axis) - (z - h);
                    // Ranges of some 1000 m; headings by whole turns.
                    let off = if sensor == Sensor::Attitude { wrap_angle(off) } else { off };
                    assert!(off.abs() < 1.0e-12 * 1000.0, "{measurement:?} {axis}: {off:e}");
                }
                for direction in 0..n {
                    let expected = scene.predicted(&seeded(&scene.navigator, direction), &measurement);
                    for (axis, (row, h)) in rows.iter().zip(expected).enumerate() {
                        // Both exact; entries up to the range times an angle: 1000 m of 1e-16, some terms.
                        let off = (row[direction] - h.slope).abs() / (1.0 + h.slope.abs());
                        assert!(off < 1.0e-12, "{measurement:?} {axis} by {direction}: {} {}", row[direction], h.slope);
                    }
                }
            }
        }
    }
}

#[test]
fn val_clones_depend_on_the_present_as_dual_numbers_say() {
    let mut random = Random(2);
    for states in STATES {
        let mut scene = Scene::new(states, &mut random);
        for id in [scene.vehicle_clone, scene.ship_clone] {
            scene.navigator.drop_clone(id, &mut ());
        }
        let n = scene.navigator.dimension();
        // With P = I the cross covariance is the Jacobian.
        scene.navigator.p.set_diagonal(0, &[1.0; N_MAX][..n]);
        let ship = scene.navigator.x.layout.ship().expect("known");
        scene.navigator.clone_vehicle(&mut ()).expect("room");
        scene.navigator.clone_ship(&mut ()).expect("room");
        for direction in 0..n {
            let x = seeded(&scene.navigator, direction);
            let expected = [&x[X..X + 3], &scene.ground_velocity(&x), &x[ship..ship + 6]].concat();
            for (i, expected) in (n..).zip(&expected) {
                assert_eq!(scene.navigator.state_at(i), scene.navigator.x.get(i));
                // Both exact up to rounding of numbers near 1.
                assert!((scene.navigator.x.get(i) - expected.value).abs() < 1.0e-13 * (1.0 + expected.value.abs()));
                assert!((scene.navigator.covariance(i, direction) - expected.slope).abs() < 1.0e-14, "{i} {direction}");
            }
        }
        assert!(n >= VEHICLE_STATES + 6);
    }
}
