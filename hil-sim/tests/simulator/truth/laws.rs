//! What must hold for the simulated vehicle whatever its numbers: energy, rest, mirror symmetry, Galileo's and Euler's
//! invariances, and the order of its integrator.

use super::{difference, reference};
use hil_sim::rng::{Source, Stream};
use hil_sim::truth::{Actuators, Fin, Parameters, Plant, State, Undeclared, Vehicle, Water};

/// Sway drag is by this share more to starboard and less to port.
const ASYMMETRY: f64 = 0.4;

/// The reference vehicle with everything that is zero on it switched on, cross drag as large as it may be.
fn full() -> Parameters {
    let p = reference();
    let limit = |a: f64, b: f64| 0.999_999 * backseat_core::dynamics::cross_drag_limit(a, b);
    let [_, sway, heave, _, pitch, yaw] = p.quadratic_drag;
    Parameters {
        cb_to_cg_m: [0.003, -0.002, 0.015],
        inertia: [39.3, 75.0, 73.5, 0.20, 20.0, 21.0],
        d26: limit((1.0 - ASYMMETRY) * sway, yaw),
        d35: -limit(heave, pitch),
        linear_surge_ns_per_m: 0.7,
        advance_n_s2_per_rad_m: 0.004,
        ..p
    }
}

/// What no vehicle file declares, of the kind that is there without thrust.
fn undeclared() -> Undeclared {
    Undeclared {
        sway_drag_asymmetry: ASYMMETRY,
        heave_surge_n_s2_per_m2: 30.0,
        compressibility_kg_per_m: -0.01,
        propeller_torque_m: 0.02,
        ..Undeclared::default()
    }
}

/// Any attitude and motion, at a depth between the two.
fn any_state(random: &mut Stream, depths_m: [f64; 2]) -> State {
    let angles: [f64; 3] = random.normals(1.0);
    let velocity: [f64; 3] = random.normals(1.0);
    let rates: [f64; 3] = random.normals(0.5);
    let share = random.normal().abs() % 1.0;
    let depth = depths_m[0] + share * (depths_m[1] - depths_m[0]);
    State::new([3.0, -4.0, depth], [2.0 * angles[0], 0.5 * angles[1], 2.0 * angles[2]], velocity, rates)
}

/// Fins far beyond their stall.
fn any_actuators(random: &mut Stream) -> Actuators {
    Actuators { propeller_radps: 100.0 * random.normal(), fins_rad: random.normals(0.6) }
}

fn moved(state: &State, slope: &State, by: f64) -> State {
    State(core::array::from_fn(|i| state.0[i] + by * slope.0[i]))
}

/// Kinetic energy with added mass.
fn kinetic_j(p: &Parameters, s: &State) -> f64 {
    (0..6).map(|i| 0.5 * p.inertia[i] * s.0[7 + i] * s.0[7 + i]).sum()
}

/// The down axis in body axes.
fn down(s: &State) -> [f64; 3] {
    s.body_to_ned()[2]
}

/// Potential of weight and of the buoyancy of a hull taken in three sections, each of which is wetted from half a
/// diameter above the water on; `gain` is displaced mass gained per metre.
fn potential_j(p: &Parameters, gain_kg_per_m: f64, s: &State) -> f64 {
    let (down, z) = (down(s), s.0[2]);
    let centre = z - (0..3).map(|i| p.cb_to_cg_m[i] * down[i]).sum::<f64>();
    let reach = 0.5 * p.length_m * 0.6_f64.sqrt();
    let (full, gain) = (p.displaced_mass_kg * p.g_mps2, gain_kg_per_m * p.g_mps2);
    let mut buoyancy = 0.0;
    for (share, place) in [(5.0 / 18.0, -reach), (8.0 / 18.0, 0.0), (5.0 / 18.0, reach)] {
        // ∫ of the wetted part of the diameter over depth.
        let (depth, r) = (centre + place * down[0], p.hull_radius_m);
        let wetted = if depth >= r {
            depth
        } else if depth <= -r {
            0.0
        } else {
            (depth + r) * (depth + r) / (4.0 * r)
        };
        buoyancy += share * full * wetted;
    }
    buoyancy + 0.5 * gain * centre.max(0.0) * centre.max(0.0) - p.mass_kg * p.g_mps2 * z
}

/// Power that a free vehicle gains, W: by differences along its own motion, short enough that only rounding is added.
fn power_w(p: &Parameters, undeclared: &Undeclared, state: &State, fins_rad: [f64; 4]) -> f64 {
    let plant = Plant::with(p, undeclared);
    let actuators = Actuators { propeller_radps: 0.0, fins_rad };
    let slope = plant.derivative(state, &actuators, &Water::default(), &[0.0; 6]);
    let energy = |s: &State| kinetic_j(p, s) + potential_j(p, undeclared.compressibility_kg_per_m, s);
    const H_S: f64 = 1.0e-5;
    (energy(&moved(state, &slope, H_S)) - energy(&moved(state, &slope, -H_S))) / (2.0 * H_S)
}

#[test]
fn val_no_energy_without_thrust() {
    let mut random = Stream::new(11, Source::Disturbance);
    // The hull's compressibility is felt away from the surface; there the emerging sections would need its share of
    // each.
    for (undeclared, depths) in [(undeclared(), [5.0, 50.0]), (Undeclared::default(), [-0.3, 1.5])] {
        for p in [reference(), full()] {
            for _ in 0..2000 {
                let state = any_state(&mut random, depths);
                let power = power_w(&p, &undeclared, &state, any_actuators(&mut random).fins_rad);
                // Energies of 1e4 J in doubles, divided by 1e-5 s.
                assert!(power < 1.0e-6, "{power} W at {state:?}");
            }
        }
    }
}

#[test]
fn val_nothing_but_drag_and_fins_takes_energy() {
    // Coriolis and centripetal forces of rigid body and added mass do no work, and weight and buoyancy have a
    // potential, in and under the surface.
    let mut random = Stream::new(12, Source::Disturbance);
    let mut p = full();
    (p.quadratic_drag, p.d26, p.d35, p.linear_surge_ns_per_m) = ([0.0; 6], 0.0, 0.0, 0.0);
    p.fins = p.fins.map(|fin| Fin { area_m2: 0.0, ..fin });
    for _ in 0..2000 {
        let state = any_state(&mut random, [-0.3, 20.0]);
        let power = power_w(&p, &Undeclared::default(), &state, [0.0; 4]);
        // As above.
        assert!(power.abs() < 1.0e-6, "{power} W at {state:?}");
    }
}

#[test]
fn val_rest_stays_rest_when_neutrally_trimmed() {
    let p = reference();
    let neutral = Parameters { displaced_mass_kg: p.mass_kg, ..p };
    for heading in [0.0, 1.0, -2.5] {
        let start = State::new([0.0, 0.0, 20.0], [0.0, 0.0, heading], [0.0; 3], [0.0; 3]);
        let mut vehicle = Vehicle::new(&neutral, start, 0.01, 0);
        let fins = Actuators { propeller_radps: 0.0, fins_rad: [0.3, -0.2, 0.1, 0.4] };
        (0..10_000).for_each(|_| vehicle.step(&fins, &Water::default()));
        // But for the quaternion, which is brought back to unit length 40 000 times: rounding.
        assert!(difference(&vehicle.state().0, &start.0) < 1.0e-12, "{:?}", vehicle.state());
    }
}

/// y, φ, ψ, v, p, r change sign; of the quaternion what turns about x and z.
fn mirror(s: &State) -> State {
    const SIGNS: [f64; 13] = [1.0, -1.0, 1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
    State(core::array::from_fn(|i| SIGNS[i] * s.0[i]))
}

/// Vertical fins change sign; port and starboard change places and sign.
fn mirror_actuators(a: &Actuators) -> Actuators {
    let [top, bottom, port, starboard] = a.fins_rad;
    Actuators { fins_rad: [-top, -bottom, -starboard, -port], ..*a }
}

fn mirror_water(w: &Water) -> Water {
    let east = |[north, east]: [f64; 2]| [north, -east];
    Water { surface_mps: east(w.surface_mps), shear_mps_per_m: east(w.shear_mps_per_m), ..*w }
}

/// The vehicle seen in a mirror: symmetric but for where its centre of gravity lies, and for what turns one way.
fn mirror_vehicle(p: &Parameters, u: &Undeclared) -> (Parameters, Undeclared) {
    let [x, y, z] = p.cb_to_cg_m;
    let sway_drag_asymmetry = -u.sway_drag_asymmetry;
    let propeller_torque_m = -u.propeller_torque_m;
    (Parameters { cb_to_cg_m: [x, -y, z], ..*p }, Undeclared { sway_drag_asymmetry, propeller_torque_m, ..*u })
}

#[test]
fn val_mirror_image_has_the_mirror_accelerations() {
    let (p, u) = (full(), undeclared());
    let (mirrored_p, mirrored_u) = mirror_vehicle(&p, &u);
    let (plant, mirrored) = (Plant::with(&p, &u), Plant::with(&mirrored_p, &mirrored_u));
    let water = Water { surface_mps: [0.3, -0.2], shear_mps_per_m: [0.01, 0.02], down_mps: 0.1 };
    let mut random = Stream::new(13, Source::Disturbance);
    for _ in 0..1000 {
        let (state, actuators) = (any_state(&mut random, [-0.3, 20.0]), any_actuators(&mut random));
        let slope = plant.derivative(&state, &actuators, &water, &[0.0; 6]);
        let (image, fins) = (mirror(&state), mirror_actuators(&actuators));
        let of_image = mirrored.derivative(&image, &fins, &mirror_water(&water), &[0.0; 6]);
        // The fins' φ are rounded multiples of π/2: 1e-16 of accelerations of some 1e3 rad/s².
        let scale = slope.0.iter().fold(1.0, |a: f64, b| a.max(b.abs()));
        assert!(difference(&of_image.0, &mirror(&slope).0) < 1.0e-13 * scale, "{slope:?} {of_image:?}");
    }
}

#[test]
fn val_mirror_image_flies_the_mirror_track() {
    let (p, u) = (Parameters { disturbance_per_sqrt_hz: [0.0; 6], ..full() }, undeclared());
    let (mirrored_p, mirrored_u) = mirror_vehicle(&p, &u);
    let start = State::new([0.0, 0.0, 8.0], [0.1, 0.05, 0.4], [1.0, 0.05, 0.02], [0.0; 3]);
    let mut vehicle = Vehicle::with(&p, &u, start, 0.01, 1);
    let mut mirrored = Vehicle::with(&mirrored_p, &mirrored_u, mirror(&start), 0.01, 1);
    let water = Water { surface_mps: [0.3, -0.2], shear_mps_per_m: [0.001, 0.002], ..Water::default() };
    for step in 0..6000 {
        let rudder = if step % 2000 < 1000 { 0.1 } else { -0.06 };
        let targets = Actuators { propeller_radps: 107.0, fins_rad: [rudder, -0.8 * rudder, 0.01, -0.02] };
        vehicle.step(&targets, &water);
        mirrored.step(&mirror_actuators(&targets), &mirror_water(&water));
    }
    // Rounding of 6000 steps; the motion is stable.
    assert!(difference(&mirrored.state().0, &mirror(vehicle.state()).0) < 1.0e-9);
}

#[test]
fn val_uniform_current_only_moves_the_position() {
    let plant = Plant::with(&full(), &undeclared());
    let mut random = Stream::new(14, Source::Disturbance);
    for _ in 0..1000 {
        let (state, actuators) = (any_state(&mut random, [-0.3, 20.0]), any_actuators(&mut random));
        let [north, east, down]: [f64; 3] = random.normals(0.5);
        let water = Water { surface_mps: [north, east], down_mps: down, ..Water::default() };
        let still = plant.derivative(&state, &actuators, &Water::default(), &[0.0; 6]);
        let carried = plant.derivative(&state, &actuators, &water, &[0.0; 6]);
        assert_eq!(carried.0[3..], still.0[3..], "fins, propeller and drag see no difference");
        // One rounded sum.
        let drift: [f64; 3] = core::array::from_fn(|i| carried.0[i] - still.0[i]);
        assert!(difference(&drift, &[north, east, down]) < 1.0e-14);
    }
}

#[test]
fn val_place_and_heading_only_turn_the_track() {
    let plant = Plant::with(&full(), &undeclared());
    let mut random = Stream::new(15, Source::Disturbance);
    for _ in 0..1000 {
        let (state, actuators) = (any_state(&mut random, [-0.3, 20.0]), any_actuators(&mut random));
        let turn = 3.0 * random.normal();
        // The quaternion of the turn, times that of the state.
        let ([c, s], [a, b, e, d]) =
            ([(0.5 * turn).cos(), (0.5 * turn).sin()], [state.0[3], state.0[4], state.0[5], state.0[6]]);
        let mut there = state;
        there.0[..2].copy_from_slice(&[500.0, -300.0]);
        there.0[3..7].copy_from_slice(&[c * a - s * d, c * b - s * e, c * e + s * b, c * d + s * a]);
        let slope = plant.derivative(&state, &actuators, &Water::default(), &[0.0; 6]);
        let turned = plant.derivative(&there, &actuators, &Water::default(), &[0.0; 6]);
        let [north, east] = [slope.0[0], slope.0[1]];
        let expected = [turn.cos() * north - turn.sin() * east, turn.sin() * north + turn.cos() * east, slope.0[2]];
        // One more rotation; then accelerations of up to 1e3 from an attitude rounded once.
        assert!(difference(&turned.0[..3], &expected) < 1.0e-13);
        let scale = slope.0.iter().fold(1.0, |a: f64, b| a.max(b.abs()));
        assert!(difference(&turned.0[7..], &slope.0[7..]) < 1.0e-13 * scale, "{slope:?} {turned:?}");
    }
}

/// Where a manoeuvre ends after 0.4 s, integrated at a step. Smooth: no actuator moves, and |v| v, whose second
/// derivative jumps where v changes its sign, is left to surge.
fn manoeuvre(velocity: [f64; 3], rates: [f64; 3], rudder: f64, step_s: f64) -> State {
    let p = reference();
    let parameters = Parameters {
        propeller_lag_s: 0.0,
        servo_rate_radps: 1.0e6,
        quadratic_drag: [p.quadratic_drag[0], 0.0, 0.0, 0.0, 0.0, 0.0],
        ..p
    };
    let start = State::new([0.0, 0.0, 20.0], [0.02, 0.05, 0.3], velocity, rates);
    let mut vehicle = Vehicle::new(&parameters, start, step_s, 0);
    let input = Actuators { propeller_radps: 120.0, fins_rad: [rudder, -rudder, 0.05, -0.05] };
    (0..(0.4 / step_s).round() as usize).for_each(|_| vehicle.step(&input, &Water::default()));
    *vehicle.state()
}

#[test]
fn val_integrator_is_of_fourth_order() {
    let turns = [
        ([1.0, 0.05, 0.06], [0.02, 0.02, 0.1], 0.1),
        ([1.0, -0.05, 0.06], [-0.02, 0.02, -0.1], -0.1),
        ([2.0, 0.3, 0.1], [0.3, 0.1, 0.2], 0.05),
    ];
    for (velocity, rates, rudder) in turns {
        let end = |step_s| manoeuvre(velocity, rates, rudder, step_s);
        let exact = end(0.000_5);
        let errors = [0.02, 0.01, 0.005, 0.002_5].map(|step_s| difference(&end(step_s).0, &exact.0));
        println!("{errors:?} {:?}", errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect::<Vec<_>>());
        // Halving the step leaves a sixteenth; the fifth order adds a share of the step.
        let order = (errors[1] / errors[3]).log2() / 2.0;
        assert!((3.8..4.2).contains(&order), "{order} {errors:?}");
        // At the simulator's step.
        assert!(errors[1] < 1.0e-7, "{errors:?}");
    }
}
