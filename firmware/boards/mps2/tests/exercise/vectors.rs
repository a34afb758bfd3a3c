//! Computations whose results have to have the same bits on every machine.

use super::cases::CASES;
use super::digest::Digest;
use super::feed::{self, Frames};
use super::motion;
use super::random::Random;
use backseat_app::{App, LocalFrame, STEP_US};
use backseat_core::control::allocation::{AllocationMethod, Datum, Moments, allocate};
use backseat_core::control::mission::{Mission, Waypoint};
use backseat_core::control::{Command, ControlConfig, ControlLaw, Controller};
use backseat_core::dynamics::{
    ActuatorInput, Attitude, Linearisation, VehicleModel, VehicleParameters, kinematic_linearise,
};
use backseat_core::identification::aid::{AidState, Instant, heun, rates};
use backseat_core::identification::{IdentificationConfig, Identifier, Theta, theta};
use backseat_core::navigation::{
    AcousticPath, EffectStates, InitialShip, InitialState, Measurement, NavigationConfig, Navigator, ProcessModel,
    ShipEnd, VehicleEnd,
};
use backseat_core::state::VehicleState;
use backseat_wire::Decimal;
use backseat_wire::calendar::TimeOfDay;
use backseat_wire::hostlink::Port;
use nalgebra::Vector6;

/// What is too big for a stack.
pub struct Objects {
    navigator: Navigator,
    controller: Controller,
    identifier: Identifier,
    app: App,
    frames: Frames,
}

impl Objects {
    pub const fn new() -> Self {
        Self {
            navigator: Navigator::new(),
            controller: Controller::new(),
            identifier: Identifier::new(),
            app: App::new(),
            frames: Frames::new(),
        }
    }
}

/// Runs everything; `report` gets the name and the digest of each item.
pub fn run(objects: &mut Objects, report: &mut dyn FnMut(&str, u64)) {
    let Objects { navigator, controller, identifier, app, frames } = objects;
    transcendental(report);
    process_model(report);
    wire_numbers(report);
    geodesy(report);
    navigation_steps(navigator, report);
    navigation_run(navigator, report);
    lqr_gain(controller, report);
    commands(controller, report);
    allocation(report);
    identification_steps(report);
    identification_run(identifier, report);
    voyage(app, frames, report);
}

fn item(report: &mut dyn FnMut(&str, u64), name: &str, fill: impl FnOnce(&mut Digest)) {
    let mut digest = Digest::new();
    fill(&mut digest);
    report(name, digest.finish());
}

type Function = fn(f64) -> f64;

/// The functions that core and app call.
fn transcendental(report: &mut dyn FnMut(&str, u64)) {
    let functions: [(&str, Function); 8] = [
        ("sin", libm::sin),
        ("cos", libm::cos),
        ("tan", libm::tan),
        ("asin", libm::asin),
        ("atan", libm::atan),
        ("sqrt", libm::sqrt),
        ("exp", libm::exp),
        ("atan2", |x| libm::atan2(x, 1.0 - x)),
    ];
    for (name, function) in functions {
        item(report, name, |digest| {
            let mut random = Random(1);
            for exponent in -12..4 {
                let bound = libm::exp2(f64::from(exponent));
                (0..50).for_each(|_| digest.number(function(random.within(bound))));
            }
            for x in [0.0, -0.0, f64::MIN_POSITIVE / 3.0, f64::INFINITY, f64::NAN] {
                digest.number(function(x));
            }
        });
    }
}

fn model(offsets: bool) -> Option<VehicleModel> {
    let mut parameters = VehicleParameters::IVER3;
    if offsets {
        (parameters.d26, parameters.d35) = (12.0, -9.0);
        (parameters.b_cb_to_cg_m[0], parameters.b_cb_to_cg_m[1]) = (0.003, 0.002);
        (parameters.linear_surge_ns_per_m, parameters.advance_n_s2_per_rad_m) = (0.7, 0.004);
    }
    VehicleModel::new(&parameters).ok()
}

fn note_linearisation(digest: &mut Digest, linearisation: &Linearisation) {
    digest.numbers(linearisation.f.as_slice());
    digest.numbers(linearisation.F().as_slice());
}

/// The reference cases, and states as wild as those of the identification's vectors.
fn process_model(report: &mut dyn FnMut(&str, u64)) {
    item(report, "process model, reference cases", |digest| {
        for case in &CASES {
            let Some(model) = model(case.offsets) else { continue };
            let x = VehicleState::from_column_slice(&case.x);
            let [propeller_radps, top, bottom, port, starboard] = case.xi;
            let input = ActuatorInput { propeller_radps, fins_rad: [top, bottom, port, starboard] };
            note_linearisation(digest, &model.linearise(&x, &input));
            note_linearisation(digest, &kinematic_linearise(&x));
            digest.numbers(model.derivative(&x, &input).as_slice());
            digest.numbers(model.input_jacobian(&x, &input).as_slice());
        }
    });
    item(report, "process model, wild states", |digest| {
        let mut random = Random(2);
        for k in 0..100 {
            let Some(model) = model(k % 2 == 0) else { continue };
            let x = VehicleState::from(random.array::<12>(1.5));
            let input = ActuatorInput { propeller_radps: random.within(150.0), fins_rad: random.array(0.6) };
            note_linearisation(digest, &model.linearise(&x, &input));
            let velocity = backseat_core::state::velocity(&x);
            digest.numbers(model.actuator_regressor(&velocity, &input).as_slice());
        }
    });
}

fn wire_numbers(report: &mut dyn FnMut(&str, u64)) {
    item(report, "decimals", |digest| {
        let mut random = Random(3);
        for k in 0..500_u32 {
            let value = random.within(libm::exp2(f64::from(k % 40) - 10.0));
            for scale in [0, 2, 7] {
                let Ok(decimal) = Decimal::from_f64(value, scale) else { continue };
                digest.word(decimal.mantissa().cast_unsigned());
                digest.number(decimal.to_f64());
            }
        }
        for text in ["-12.345", "0.0000001", "359.99", "70.123456789", "+3", "."] {
            digest.number(Decimal::parse(text.as_bytes()).map_or(f64::NAN, Decimal::to_f64));
            digest.word(TimeOfDay::parse(text.as_bytes()).map_or(u64::MAX, TimeOfDay::us));
        }
    });
}

fn geodesy(report: &mut dyn FnMut(&str, u64)) {
    item(report, "geodesy", |digest| {
        let mut random = Random(4);
        for origin in [[41.5, -70.7], [-33.9, 151.2], [70.0, 20.0]] {
            let frame = LocalFrame::new(origin[0], origin[1]);
            for _ in 0..50 {
                let (lat_deg, lon_deg) = frame.to_geodetic(random.array(20_000.0));
                digest.numbers(&[lat_deg, lon_deg]);
                digest.numbers(&frame.to_local(lat_deg, lon_deg));
            }
        }
    });
}

fn begin(navigator: &mut Navigator, current: bool) {
    let config = NavigationConfig {
        effect_states: if current { EffectStates::water_current(0.3, 1.0e-3) } else { EffectStates::NONE },
        ..NavigationConfig::REFERENCE
    };
    let Some(model) = model(false) else { return };
    let state = VehicleState::from_column_slice(&CASES[0].x);
    let sigma = VehicleState::from([3.0, 3.0, 0.1, 0.02, 0.02, 0.02, 0.1, 0.1, 0.1, 0.01, 0.01, 0.01]);
    // refused by none: a filter that is not initialised shows as a digest that does not change
    let _ = navigator.configure(&config, &model);
    let _ = navigator.initialise(0, &InitialState { state, sigma });
    let ship = InitialShip { state: [600.0, 450.0, 1.2, -1.0, 1.7, 0.003], sigma: [2.0, 2.0, 1.0, 0.5, 0.5, 0.05] };
    let _ = navigator.initialise_ship(&ship);
}

const INPUT: ActuatorInput = ActuatorInput { propeller_radps: 106.8, fins_rad: [0.05, -0.05, 0.008, -0.008] };

/// Prediction, clones and one update of each kind, with either process model.
fn navigation_steps(navigator: &mut Navigator, report: &mut dyn FnMut(&str, u64)) {
    for (name, model) in [("dynamic", ProcessModel::Dynamic), ("kinematic", ProcessModel::Kinematic)] {
        begin(navigator, true);
        let noise = navigator.config().process_noise;
        let _ = navigator.set_process_model(model, &noise);
        let mut digest = Digest::new();
        for gap_us in [100_000, 10_000, 999_999, 12_345] {
            let _ = navigator.predict(navigator.time_us() + gap_us, &INPUT);
            digest.word(navigator.digest());
        }
        report(name, digest.finish());
    }
    let (vehicle, ship) = (navigator.clone_vehicle(), navigator.clone_ship());
    let _ = navigator.predict(navigator.time_us() + 3_000_000, &INPUT);
    report("clones", navigator.digest());
    let (Ok(vehicle), Ok(ship)) = (vehicle, ship) else { return };
    let now = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Now };
    let delayed =
        AcousticPath { vehicle: VehicleEnd::Delayed { clone: vehicle, bridge_s: 0.4 }, ship: ShipEnd::Delayed(ship) };
    let [x, y, z] = core::array::from_fn(|i| navigator.state()[i]);
    let measurements = [
        ("depth", Measurement::Depth { z_m: z + 0.05 }),
        ("attitude", Measurement::Attitude { euler_rad: [0.01, -0.03, 0.5] }),
        ("rates", Measurement::Rates { rates_radps: [0.0, 0.0, -0.01] }),
        ("bottom track", Measurement::BottomTrack { velocity_mps: [1.0, 0.0, 0.0] }),
        ("water track", Measurement::WaterTrack { velocity_mps: [1.0, 0.0, 0.0] }),
        ("gnss", Measurement::VehicleGnss { position_m: [x + 1.0, y - 1.0] }),
        ("ship gnss", Measurement::ShipGnss { position_m: [597.0, 455.0] }),
        ("range", Measurement::Range { path: delayed, range_m: 730.0 }),
        ("range rate", Measurement::RangeRate { path: now, range_rate_mps: -0.9 }),
        ("two-way range", Measurement::TwoWayRange { outward: delayed, back: now, range_m: 730.0 }),
    ];
    for (name, measurement) in measurements {
        item(report, name, |digest| {
            for record in navigator.fuse(&measurement).iter() {
                digest.numbers(&[record.innovation, record.variance, record.test_ratio]);
                digest.word(record.outcome as u64);
            }
            digest.word(navigator.digest());
        });
    }
    navigator.drop_clone(vehicle);
    report("clone dropped", navigator.digest());
}

/// A minute of the filter at 10 Hz.
fn navigation_run(navigator: &mut Navigator, report: &mut dyn FnMut(&str, u64)) {
    begin(navigator, false);
    let Some(mut truth) = model(false).map(|model| (model, VehicleState::from_column_slice(&CASES[0].x))) else {
        return;
    };
    let (mut random, mut running) = (Random(5), 0);
    for k in 1..=600_u64 {
        let (model, x) = &mut truth;
        let half = *x + model.derivative(x, &INPUT) * 0.05;
        *x += model.derivative(&half, &INPUT) * 0.1;
        let _ = navigator.predict(k * 100_000, &INPUT);
        let mut noisy = |i: usize, bound: f64| x[i] + random.within(bound);
        navigator.fuse(&Measurement::Depth { z_m: noisy(2, 0.05) });
        navigator.fuse(&Measurement::Attitude { euler_rad: [3, 4, 5].map(|i| noisy(i, 0.01)) });
        navigator.fuse(&Measurement::Rates { rates_radps: [9, 10, 11].map(|i| noisy(i, 0.005)) });
        if k.is_multiple_of(100) {
            let path = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Now };
            let d = [x[0] - 600.0, x[1] - 450.0, x[2]];
            let range_m = libm::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            navigator.fuse(&Measurement::ShipGnss { position_m: [600.0, 450.0] });
            navigator.fuse(&Measurement::Range { path, range_m });
        }
        running = navigator.digest_from(running);
    }
    report("filter, 60 s", running);
}

fn lqr_gain(controller: &mut Controller, report: &mut dyn FnMut(&str, u64)) {
    item(report, "lqr gain", |digest| {
        let Some(model) = model(false) else { return };
        digest.word(u64::from(controller.configure(&ControlConfig::REFERENCE, &model).is_ok()));
        digest.numbers(controller.lqr().gain().as_slice());
    });
}

fn note_command(digest: &mut Digest, command: &Command) {
    digest.number(command.input.propeller_radps);
    digest.numbers(&command.input.fins_rad);
    let helm = command.helm.unwrap_or_default();
    digest.numbers(&[helm.heading_rad, helm.depth_m, helm.speed_mps, command.error.cross_m, command.error.depth_m]);
}

/// Ten seconds of each law around a corner, one with a change of speed (a new gain in slices).
fn commands(controller: &mut Controller, report: &mut dyn FnMut(&str, u64)) {
    let laws = [("pd", ControlLaw::Pd), ("lqr", ControlLaw::Lqr), ("lqr on reference", ControlLaw::LqrOnReference)];
    for (name, law) in laws {
        item(report, name, |digest| {
            let Some(model) = model(false) else { return };
            let mut mission = Mission::new();
            for (x_m, y_m, speed_mps) in [(0.0, 0.0, 1.0), (20.0, 0.0, 1.0), (20.0, 50.0, 1.3)] {
                let _ = mission.push(Waypoint { x_m, y_m, depth_m: 3.0, speed_mps });
            }
            let _ = controller.configure(&ControlConfig { law, ..ControlConfig::REFERENCE }, &model);
            controller.set_mission(&mission);
            let mut x = VehicleState::zeros();
            (x[0], x[2], x[6]) = (5.0, 2.8, 1.0);
            let _ = controller.start(&x);
            for k in 0..300 {
                let command = controller.command(k * 100_000, &x, [0.05, -0.05]);
                note_command(digest, &command);
                let half = x + model.derivative(&x, &command.input) * 0.05;
                x += model.derivative(&half, &command.input) * 0.1;
            }
            digest.numbers(x.as_slice());
        });
    }
}

fn allocation(report: &mut dyn FnMut(&str, u64)) {
    let methods = [("fins, decoupled", AllocationMethod::Decoupled), ("fins, 6-DOF", AllocationMethod::SixDof)];
    for (name, method) in methods {
        item(report, name, |digest| {
            let Some(model) = model(false) else { return };
            let mut random = Random(6);
            for _ in 0..50 {
                let mut velocity = random.array::<6>(0.2);
                velocity[0] += 1.0;
                let [pitch_nm, yaw_nm, roll_nm] = random.array(6.0);
                let moments = Moments { roll_nm: 0.05 * roll_nm, pitch_nm, yaw_nm };
                let fins = allocate(method, &model, &velocity.into(), &moments, &Datum::Above([0.0; 4]), 0.35);
                digest.numbers(&fins);
            }
        });
    }
}

/// One step of the laws from each of many states.
fn identification_steps(report: &mut dyn FnMut(&str, u64)) {
    item(report, "identification, steps", |digest| {
        let Some(model) = model(true) else { return };
        let mut random = Random(7);
        let theta = theta::theta_of(model.parameters());
        for k in 0..50 {
            let [then, now] = [k, k + 1].map(|k| {
                let (attitude, velocity, input) = motion::sample(17 * k, &mut random);
                Instant::new(&model, &velocity, &Attitude::new(&attitude).down(), &input)
            });
            let state = AidState { velocity: then.velocity + Vector6::from(random.array::<6>(0.1)), theta };
            let gains = Theta::from(random.array(1e-3)).abs();
            let next = heun(&state, &rates(&state, 0.3, &then), &gains, 0.3, &now, 0.1);
            digest.numbers(next.velocity.as_slice());
            digest.numbers(next.theta.as_slice());
        }
    });
}

/// Forty seconds of the identifier, most of them adapting.
fn identification_run(identifier: &mut Identifier, report: &mut dyn FnMut(&str, u64)) {
    let prior = VehicleParameters::IVER3;
    let config = IdentificationConfig { warm_up_s: 5.0, ..IdentificationConfig::DEFAULT };
    // refused by none: an identifier that is not configured shows as a digest that differs from the one before
    let _ = identifier.configure(&config, &prior);
    let mut random = Random(8);
    item(report, "identification, run", |digest| {
        for k in 1..=400 {
            let (attitude, velocity, input) = motion::sample(k, &mut random);
            let now = identifier.sample(k * STEP_US, &attitude, &velocity, &input);
            digest.numbers(now.velocity_error.as_slice());
            digest.numbers(identifier.state().theta.as_slice());
            digest.word(now.outcome as u64);
        }
        digest.numbers(identifier.estimate().unwrap_or_default().as_slice());
        digest.numbers(identifier.drift().scores().as_slice());
        for parameter in identifier.excitation() {
            digest.numbers(&[parameter.strength, parameter.noise, parameter.independent]);
            digest.word(parameter.visibility as u64);
        }
    });
}

/// The whole app from bytes: a hundred seconds with five packets, under way on a mission from the tenth on, adapting
/// from the ninetieth.
fn voyage(app: &mut App, frames: &mut Frames, report: &mut dyn FnMut(&str, u64)) {
    item(report, "app, 101 s", |digest| {
        feed::set(app, &[("app.use_dvl", 1.0), ("app.use_range_rate", 1.0), ("app.adapt", 1.0)]);
        for k in 1..=feed::WORST_STEP {
            if k == feed::START_STEP {
                feed::start(app);
            }
            frames.prepare(k);
            digest.word(deliver(app, k, frames) as u64);
            digest.word(app.digest());
        }
    });
}

/// Hands step `k` to the app and takes what it says; how many bytes that is.
fn deliver(app: &mut App, k: u64, frames: &Frames) -> usize {
    let time_us = k * STEP_US;
    if k.is_multiple_of(10) {
        app.pps(time_us);
    }
    for port in Port::DEVICES {
        app.receive(port, time_us, frames.port(port));
    }
    app.step(time_us);
    Port::ALL.into_iter().map(|port| feed::drain(app, port)).sum()
}
