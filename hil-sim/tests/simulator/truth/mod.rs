//! The simulated vehicle against reference numbers, against the backseat's model where the two
//! should agree, and against conservation laws.

mod laws;

use backseat_core::dynamics::{ActuatorInput, VehicleModel, VehicleParameters};
use backseat_logs::VehicleFile;
use hil_sim::rng::{Source, Stream};
use hil_sim::scenario::Scenario;
use hil_sim::truth::{Actuators, Parameters, Plant, State, Vehicle, Water};
use nalgebra::{Vector3, Vector6};
use serde_json::Value;

/// The reference vehicle without what the backseat's model has not.
pub(crate) fn reference() -> Parameters {
    let mut scenario = Scenario::built_in("survey").unwrap();
    scenario.settings.plant.process_noise_factor = 0.0;
    scenario.truth_parameters()
}

fn vectors() -> Value {
    serde_json::from_str(include_str!("../../data/truth_vectors.json")).unwrap()
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    let list = value.as_array().unwrap();
    assert_eq!(list.len(), N);
    core::array::from_fn(|i| list[i].as_f64().unwrap())
}

/// A state from [x y z | φ θ ψ | u v w | p q r].
fn state(x: &[f64; 12]) -> State {
    State::new([x[0], x[1], x[2]], [x[3], x[4], x[5]], [x[6], x[7], x[8]], [x[9], x[10], x[11]])
}

fn actuators(xi: [f64; 5]) -> Actuators {
    Actuators { propeller_radps: xi[0], fins_rad: [xi[1], xi[2], xi[3], xi[4]] }
}

/// `worst` difference of two lists.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn val_accelerations_of_the_reference_vectors() {
    for case in vectors()["process_model"].as_array().unwrap() {
        let mut parameters = reference();
        for (key, value) in case["params_override"].as_object().unwrap() {
            let value = value.as_f64().unwrap();
            match key.as_str() {
                "d26" => parameters.d26 = value,
                "d35" => parameters.d35 = value,
                "bx" => parameters.cb_to_cg_m[0] = value,
                "by" => parameters.cb_to_cg_m[1] = value,
                "lin_surge" => parameters.linear_surge_ns_per_m = value,
                "k_adv" => parameters.advance_n_s2_per_rad_m = value,
                other => panic!("unknown parameter {other}"),
            }
        }
        let mut x: [f64; 12] = numbers(&case["x"]);
        x[2] = 5.0; // the vectors know no surface; nothing else depends on depth
        parameters.fins.iter_mut().for_each(|fin| fin.stall_rad = std::f64::consts::PI); // nor a stall
        let a = Plant::new(&parameters).acceleration(&state(&x), &actuators(numbers(&case["xi"])));
        let f: [f64; 12] = numbers(&case["f_dynamic"]);
        // Moments of 100 N m over 0.2 kg m² in doubles: 1e-12; 1e-9 is what the two models need.
        assert!(difference(&a, &f[6..]) < 1e-9, "{a:?}");
    }
}

#[test]
fn val_open_loop_trajectory_of_the_reference_vectors() {
    let vectors = vectors();
    let trajectory = &vectors["open_loop_trajectory"];
    let input = actuators(numbers(&trajectory["xi"]));
    let mut parameters = reference();
    // The vectors' actuators are where they are told to be from the start.
    parameters.servo_rate_radps = 1e6;
    parameters.propeller_lag_s = 0.0;
    let step_s = trajectory["dt_rk4"].as_f64().unwrap();
    let mut vehicle = Vehicle::new(&parameters, state(&numbers(&trajectory["x0"])), step_s, 0);
    for (second, expected) in trajectory["state_every_1s"].as_array().unwrap().iter().enumerate() {
        if second > 0 {
            (0..100).for_each(|_| vehicle.step(&input, &Water::default()));
        }
        let expected: [f64; 12] = numbers(expected);
        let s = vehicle.state();
        let [x, y, z] = s.position_m();
        let [phi, theta, psi] = s.euler_rad();
        let got = [[x, y, z], [phi, theta, psi], s.velocity_mps(), s.rates_radps()].concat();
        // Quaternion here, Euler angles there: both RK4 at 10 ms, so that they differ by the
        // integration error of the attitude, which is below 1e-8.
        assert!(difference(&got, &expected) < 1e-8, "{second} s: {got:?} {expected:?}");
    }
}

#[test]
fn val_agrees_with_the_backseats_model_where_it_should() {
    let mut declared = VehicleParameters {
        d26: 5.0,
        d35: -4.0,
        advance_n_s2_per_rad_m: 0.003,
        moment_uu: [0.06, -0.3, 0.2],
        z_uw: -25.0,
        torque_arm_m: 0.01,
        ..VehicleParameters::IVER3
    };
    let mut scenario = Scenario::built_in("survey").unwrap();
    declared.fins[0].gain = 0.3;
    scenario.vehicle.parameters = declared;
    let parameters = scenario.truth_parameters();
    let (model, plant) = (VehicleModel::new(&declared).unwrap(), Plant::new(&parameters));
    let mut random = Stream::new(5, Source::Disturbance);
    for _ in 0..500 {
        let [phi, theta, psi] = random.normals(0.4);
        let v: [f64; 3] = random.normals(1.0);
        let omega: [f64; 3] = random.normals(0.3);
        let fins_rad: [f64; 4] = random.normals(0.2);
        let propeller_radps = 100.0 * random.normal();
        let truth = plant.acceleration(
            &State::new([0.0, 0.0, 50.0], [phi, theta, psi], v, omega),
            &Actuators { propeller_radps, fins_rad },
        );
        let filter = model.acceleration(
            &Vector3::new(phi, theta, psi),
            &Vector6::new(v[0], v[1], v[2], omega[0], omega[1], omega[2]),
            &ActuatorInput { propeller_radps, fins_rad },
        );
        // Roll accelerations reach 1e3 rad/s²: 1e-9 is a relative 1e-12.
        assert!(difference(&truth, filter.as_slice()) < 1e-9, "{truth:?} {filter:?}");
    }
}

#[test]
fn val_uniform_current_only_carries_the_vehicle_along() {
    let parameters = Scenario::built_in("survey").unwrap().truth_parameters();
    let start = State::new([0.0, 0.0, 5.0], [0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]);
    let mut still = Vehicle::new(&parameters, start, 0.01, 9);
    let mut carried = still.clone();
    let current = Water { surface_mps: [0.3, -0.2], ..Water::default() };
    let input = actuators([110.0, 0.1, -0.1, 0.0, 0.0]);
    for _ in 0..6000 {
        still.step(&input, &Water::default());
        carried.step(&input, &current);
    }
    let (a, b) = (still.state(), carried.state());
    assert_eq!(a.0[2..], b.0[2..], "all but the track is the same to the bit");
    // 60 s of 0.3 and −0.2 m/s; rounding of 6000 sums.
    assert!((b.0[0] - a.0[0] - 18.0).abs() < 1e-9 && (b.0[1] - a.0[1] + 12.0).abs() < 1e-9);
}

#[test]
fn val_sheared_current_keeps_velocity_over_ground_as_depth_changes() {
    // Without drag, fins, thrust and net weight nothing holds a vehicle to the water.
    let mut parameters = reference();
    parameters.quadratic_drag = [0.0; 6];
    parameters.displaced_mass_kg = parameters.mass_kg;
    parameters.inertia = [40.0, 40.0, 40.0, 1.0, 1.0, 1.0];
    parameters.fins.iter_mut().for_each(|fin| fin.area_m2 = 0.0);
    let water = Water { surface_mps: [0.2, 0.0], shear_mps_per_m: [-0.01, 0.02], ..Water::default() };
    let start = State::new([0.0, 0.0, 2.0], [0.0, -0.4, 0.7], [1.0, 0.0, 0.0], [0.0; 3]);
    let before = start.velocity_ned_mps(&water);
    let mut vehicle = Vehicle::new(&parameters, start, 0.01, 0);
    (0..1000).for_each(|_| vehicle.step(&Actuators::default(), &water));
    assert!(vehicle.state().0[2] > 5.0, "it has changed its depth");
    // Restoring moments turn it meanwhile: RK4 at 10 ms.
    assert!(difference(&vehicle.state().velocity_ned_mps(&water), &before) < 1e-9);
}

/// Kinetic energy with added mass, and potential energy of net weight and righting lever.
pub(crate) fn energy(p: &Parameters, s: &State) -> f64 {
    let kinetic: f64 = (0..6).map(|i| 0.5 * p.inertia[i] * s.0[7 + i] * s.0[7 + i]).sum();
    let m = s.body_to_ned();
    let lever: f64 = (0..3).map(|i| m[2][i] * p.cb_to_cg_m[i]).sum();
    let (weight, buoyancy) = (p.mass_kg * p.g_mps2, p.displaced_mass_kg * p.g_mps2);
    kinetic - (weight - buoyancy) * s.0[2] - buoyancy * lever
}

fn tumbling(parameters: &Parameters) -> Vehicle {
    let start = State::new([0.0, 0.0, 50.0], [0.5, -0.4, 1.0], [1.2, -0.3, 0.4], [0.3, -0.2, 0.25]);
    Vehicle::new(parameters, start, 0.01, 0)
}

#[test]
fn val_energy_is_conserved_without_drag_and_lost_with_it() {
    let mut p = reference();
    let mut with_drag = tumbling(&p);
    let mut last = energy(&p, with_drag.state());
    for _ in 0..2000 {
        with_drag.step(&Actuators::default(), &Water::default());
        let now = energy(&p, with_drag.state());
        assert!(now < last);
        last = now;
    }
    p.quadratic_drag = [0.0; 6];
    p.fins.iter_mut().for_each(|fin| fin.area_m2 = 0.0);
    let mut free = tumbling(&p);
    let before = energy(&p, free.state());
    (0..2000).for_each(|_| free.step(&Actuators::default(), &Water::default()));
    // 60 J through 2000 RK4 steps of a roll pendulum of 5 rad/s.
    assert!((energy(&p, free.state()) - before).abs() < 1e-5, "{}", energy(&p, free.state()) - before);
}

#[test]
fn floats_at_the_surface_and_rises_when_unpowered() {
    let p = reference();
    let start = State::new([0.0, 0.0, 1.0], [0.0; 3], [0.0; 3], [0.0; 3]);
    let mut vehicle = Vehicle::new(&p, start, 0.01, 0);
    (0..12_000).for_each(|_| vehicle.step(&Actuators::default(), &Water::default()));
    // Afloat where the hull displaces its own mass, r (2 m/ρV − 1), with the centre of gravity below its axis.
    let afloat = p.hull_radius_m * (2.0 * p.mass_kg / p.displaced_mass_kg - 1.0) + p.cb_to_cg_m[2];
    assert!((vehicle.state().0[2] - afloat).abs() < 0.01, "{}", vehicle.state().0[2]);
}

#[test]
fn surfaced_hull_lies_level_and_a_hard_nose_down_dives_it() {
    let p = reference();
    let start = State::new([0.0, 0.0, 0.07], [0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]);
    let mut vehicle = Vehicle::new(&p, start, 0.01, 0);
    (0..6000).for_each(|_| vehicle.step(&actuators([106.8, 0.0, 0.0, 0.0, 0.0]), &Water::default()));
    let s = *vehicle.state();
    // A hull that noses up by half a degree would lift its bow by a centimetre.
    assert!((0.05..0.1).contains(&s.0[2]) && s.euler_rad()[1].abs() < 0.01, "{s:?}");
    (0..1500).for_each(|_| vehicle.step(&actuators([106.8, 0.0, 0.0, -0.25, 0.25]), &Water::default()));
    assert!(vehicle.state().0[2] > 2.0);
}

#[test]
fn val_disturbance_has_the_declared_density() {
    // Without any other force the velocity is a random walk of variance PSD · t.
    let mut p = Scenario::built_in("survey").unwrap().truth_parameters();
    p.quadratic_drag = [0.0; 6];
    p.displaced_mass_kg = p.mass_kg;
    p.cb_to_cg_m = [0.0; 3];
    p.inertia = [1.0; 6];
    p.fins.iter_mut().for_each(|fin| fin.area_m2 = 0.0);
    p.disturbance_per_sqrt_hz = [3.0e-3, 0.0, 0.0, 0.0, 0.0, 1.0e-3];
    let start = State::new([0.0, 0.0, 50.0], [0.0; 3], [0.0; 3], [0.0; 3]);
    for step_s in [0.01, 0.005] {
        let (mut surge, mut yaw) = (0.0, 0.0);
        for seed in 0..400 {
            let mut vehicle = Vehicle::new(&p, start, step_s, seed);
            (0..(4.0 / step_s) as usize).for_each(|_| vehicle.step(&Actuators::default(), &Water::default()));
            let s = vehicle.state();
            // Yaw turns surge into sway: the horizontal speed counts.
            surge += (s.0[7] * s.0[7] + s.0[8] * s.0[8]) / (9.0e-6 * 4.0 * 400.0);
            yaw += s.0[12] * s.0[12] / (1.0e-6 * 4.0 * 400.0);
        }
        // χ² of 400: one sigma 0.07, three are 0.21.
        assert!((0.79..1.21).contains(&surge) && (0.79..1.21).contains(&yaw), "{surge} {yaw}");
    }
}

#[test]
fn val_servo_slews_and_propeller_lags() {
    let p = Parameters { servo_rate_radps: 0.5, propeller_lag_s: 0.2, ..reference() };
    let start = State::new([0.0, 0.0, 5.0], [0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]);
    let mut vehicle = Vehicle::new(&p, start, 0.01, 0);
    let wanted = actuators([100.0, 9.0, -0.05, 0.0, 0.1]);
    (0..20).for_each(|_| vehicle.step(&wanted, &Water::default()));
    let got = *vehicle.actuators();
    // 0.2 s at 0.5 rad/s; one time constant of the propeller. Rounding of 20 sums.
    assert!(difference(&got.fins_rad, &[0.1, -0.05, 0.0, 0.1]) < 1e-12);
    assert!((got.propeller_radps - 100.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-9);
    (0..200).for_each(|_| vehicle.step(&wanted, &Water::default()));
    assert_eq!(vehicle.actuators().fins_rad[0], p.fin_max_rad);
}

#[test]
fn built_in_vehicle_is_the_reference_vehicle() {
    assert_eq!(Scenario::built_in("survey").unwrap().vehicle, VehicleFile::reference());
}
