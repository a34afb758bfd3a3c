//! Effects in the filter: derivatives against differences, states that find the truth, onsets, refusals.

use super::support::*;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::effects::{CATALOGUE, EffectSet, Moment, ParameterId, ParameterKind, SensorChannel, parameters};
use backseat_core::navigation::*;

/// Every parameter at half its plausible size.
fn half(info: &backseat_core::effects::EffectInfo) -> Vec<f64> {
    let value = |p: &backseat_core::effects::ParameterInfo| match p.kind {
        ParameterKind::Fin => 3.0,
        _ => 0.5 * p.max,
    };
    info.parameters.iter().map(value).collect()
}

#[test]
fn val_measurement_slopes_are_the_differences() {
    let moment = Moment { t_s: 1234.0, sound_speed_mps: 1480.0 };
    for info in CATALOGUE {
        let Some(measure) = info.hooks.measure else { continue };
        let values = half(info);
        let at = [0.7, -0.2, 1.9];
        let read = |values: &[f64], at: [f64; 3]| {
            let mut reading = at;
            (measure.apply)(values, &moment, &mut reading);
            reading
        };
        let slopes = (measure.apply)(&values, &moment, &mut at.clone());
        // Central differences: truncation and rounding both near 1e-10 of the scale.
        let h = 1e-6;
        let close = |a: f64, b: f64| (a - b).abs() < 1e-8 * (1.0 + a.abs());
        for j in 0..3 {
            let (mut above, mut below) = (at, at);
            above[j] += h;
            below[j] -= h;
            let (above, below) = (read(&values, above), read(&values, below));
            for i in 0..3 {
                let difference = (above[i] - below[i]) / (2.0 * h);
                assert!(close(slopes.by_reading[i][j], difference), "{} {i} {j}", info.name);
            }
        }
        for k in 0..values.len() {
            let (mut above, mut below) = (values.clone(), values.clone());
            above[k] += h;
            below[k] -= h;
            let (above, below) = (read(&above, at), read(&below, at));
            for i in 0..3 {
                let difference = (above[i] - below[i]) / (2.0 * h);
                assert!(close(slopes.by_parameter[k][i], difference), "{} {i} by {k}", info.name);
            }
        }
        // No effect is no change.
        assert_eq!(read(&vec![0.0; values.len()], at), at, "{}", info.name);
    }
}

const OF_THE_PROCESS: [(&str, &str); 3] =
    [("water_current", "north_mps"), ("linear_drag", "surge_ns_per_m"), ("thrust_loss", "k_n_s2_per_rad_m")];

/// A start with effects of known size, as nearly certain as may be.
fn started(effects: EffectSet, effect_states: EffectStates) -> Box<Navigator> {
    super::support::started(&NavigationConfig { effects, effect_states, ..NavigationConfig::REFERENCE })
}

#[test]
fn val_columns_of_the_process_are_the_differences() {
    let input = ActuatorInput { propeller_radps: 140.0, fins_rad: [0.1, -0.1, 0.05, -0.02] };
    for (effect, parameter) in OF_THE_PROCESS {
        let id = ParameterId::find(effect, parameter).unwrap();
        let sigma = 1e-3 * id.info().max;
        let states = match effect {
            "water_current" => EffectStates::water_current(sigma, 0.0),
            _ => EffectStates::NONE.with(effect, parameter, sigma, 0.0).unwrap(),
        };
        for step_us in [50_000_u64, 100_000] {
            let moved = |value: f64, states: EffectStates| {
                let mut effects = EffectSet::NONE;
                effects.set(id, value);
                let mut navigator = started(effects, states);
                navigator.predict(step_us, &input).unwrap();
                navigator
            };
            // Cov(x, θ) = Γ σ² after one step from independence.
            let filter = moved(0.3 * id.info().max, states);
            let (above, below) = (0.3 * id.info().max + sigma, 0.3 * id.info().max - sigma);
            let (above, below) = (moved(above, EffectStates::NONE), moved(below, EffectStates::NONE));
            let mut largest: f64 = 0.0;
            for i in 0..12 {
                let column = filter.covariance(i, 12) / (sigma * sigma);
                let difference = (above.state_at(i) - below.state_at(i)) / (2.0 * sigma);
                largest = largest.max(difference.abs());
                // F itself depends on the parameter and moves x by its product with f: h²/2, half a per cent of the
                // column.
                assert!((column - difference).abs() < 5e-3 * largest.max(1e-3), "{effect} {i} {column} {difference}");
            }
            assert!(largest > 1e-3);
        }
    }
}

#[test]
fn val_fixed_sensor_effects_move_innovations_by_their_definition() {
    let at = initial().state;
    let innovation = |effects: EffectSet, measurement: Measurement| -> Vec<f64> {
        started(effects, EffectStates::NONE).fuse(&measurement).iter().map(|record| record.innovation).collect()
    };
    let bias = EffectSet::NONE.with("heading_bias", &[0.01, 0.02, -0.01]).unwrap();
    let expected = 0.01 + 0.02 * at[5].sin() - 0.01 * at[5].cos();
    let attitude = Measurement::Attitude { euler_rad: [at[3], at[4], at[5]] };
    assert!((innovation(bias, attitude)[2] + expected).abs() < 1e-15);
    let scale = EffectSet::NONE.with("dvl_scale", &[0.02]).unwrap();
    let track = Measurement::WaterTrack { velocity_mps: [at[6], at[7], at[8]] };
    assert!((innovation(scale, track)[0] + 0.02 * at[6]).abs() < 1e-15);
    let current = EffectSet::NONE.with("water_current", &[0.05, -0.02]).unwrap();
    let along = (0.05 * at[5].cos() - 0.02 * at[5].sin()) * at[4].cos();
    let bottom = Measurement::BottomTrack { velocity_mps: [at[6], at[7], at[8]] };
    assert!((innovation(current, bottom)[0] + along).abs() < 1e-15);
    let path = reported(still([300.0, 0.0], [0.0; 2]));
    let distance: f64 = (300.0_f64 * 300.0 + 9.0).sqrt();
    let clocks = EffectSet::NONE.with("sound_speed", &[-0.002]).unwrap().with("clock_offset", &[0.001]).unwrap();
    let range = Measurement::Range { path, range_m: distance };
    // Range 300 m: some units in the last place.
    assert!((innovation(clocks, range)[0] + 1.5 - 0.002 * distance).abs() < 1e-12);
    // No clock is shared on the way there and back.
    let both = Measurement::TwoWayRange { outward: path, back: path, range_m: distance };
    assert!((innovation(clocks, both)[0] - 0.002 * distance).abs() < 1e-12);
}

/// Ten minutes over a square with fixes of the ship, ranges and a DVL through the water and over ground; the sensors
/// and the plant have `truth`, the filter estimates `states` from zero.
fn fly(truth: &EffectSet, states: EffectStates, seed: u64, tally: &mut Consistency) -> Box<Navigator> {
    let config = NavigationConfig { effect_states: states, surface: None, ..NavigationConfig::REFERENCE };
    let mut noise = Noise(seed);
    let mut navigator = navigator(&config);
    let mut initial = initial();
    initial.sigma[0] = 1.0;
    initial.sigma[1] = 1.0;
    navigator.initialise(0, &initial).unwrap();
    let mut x = initial.state;
    for i in 0..12 {
        x[i] += initial.sigma[i] * noise.normal();
    }
    let (mut current, mut vehicle) = ([0.0; 2], backseat_core::dynamics::VehicleParameters::IVER3);
    for (_, info, values) in truth.active() {
        if let Some(plant) = info.hooks.plant {
            plant(values, 0.0, &mut vehicle);
        }
        current = info.hooks.water.map_or(current, |water| water(values));
    }
    let mut simulated = Truth::of(x, current, [300.0, 100.0, 0.0, 0.0], &vehicle);
    let sigma = &config.sensors;
    let read = |channel: SensorChannel, t_s: f64, ideal: [f64; 3]| {
        let mut reading = ideal;
        let moment = Moment { t_s, sound_speed_mps: config.sound_speed_mps };
        for (_, info, values) in truth.active() {
            if let Some(measure) = info.hooks.measure.filter(|measure| measure.channels.contains(&channel)) {
                (measure.apply)(values, &moment, &mut reading);
            }
        }
        reading
    };
    for k in 1..=60_000_u64 {
        let t_s = k as f64 * 0.01;
        // Turns all the time, and two propeller speeds.
        let propeller_radps = if (k / 3000) % 2 == 0 { 106.8 } else { 140.0 };
        let turn = if (k / 6000) % 2 == 0 { 0.03 } else { -0.02 };
        let input = ActuatorInput { propeller_radps, fins_rad: [turn, -turn, 0.008, -0.008] };
        simulated.tick(&input, &config, &mut noise);
        if k % 20 != 0 {
            continue;
        }
        navigator.predict(k * TICK_US, &input).unwrap();
        let x = simulated.x;
        let attitude = backseat_core::dynamics::Attitude::new(&nalgebra::Vector3::new(x[3], x[4], x[5]));
        let nu = nalgebra::Vector3::new(x[6], x[7], x[8]);
        let over_ground = nu + attitude.rotation().tr_mul(&nalgebra::Vector3::new(current[0], current[1], 0.0));
        let mut all = vec![
            Measurement::Depth {
                z_m: read(SensorChannel::Depth, t_s, [x[2], 0.0, 0.0])[0] + sigma.depth_m * noise.normal(),
            },
            Measurement::Attitude {
                euler_rad: noise.normals(read(SensorChannel::Attitude, t_s, [x[3], x[4], x[5]]), sigma.attitude_rad),
            },
            Measurement::Rates {
                rates_radps: noise.normals(read(SensorChannel::Rates, t_s, [x[9], x[10], x[11]]), sigma.rates_radps),
            },
            Measurement::BottomTrack {
                velocity_mps: noise.normals(read(SensorChannel::Dvl, t_s, over_ground.into()), sigma.dvl_mps),
            },
        ];
        if k % 1000 == 0 {
            let (range, _) = range_and_rate([x[0], x[1], x[2]], [0.0; 3], simulated.ship);
            let path = reported(still([simulated.ship[0], simulated.ship[1]], [1e-3; 2]));
            let range_m = read(SensorChannel::Range, t_s, [range, 0.0, 0.0])[0] + sigma.range_m * noise.normal();
            all.push(Measurement::Range { path, range_m });
            all.push(Measurement::VehicleGnss { position_m: noise.normals([x[0], x[1]], sigma.gnss_m) });
        }
        for measurement in &all {
            navigator.fuse(measurement).iter().for_each(|record| tally.add(record));
        }
    }
    navigator
}

#[test]
fn val_each_state_finds_the_truth_within_its_sigma() {
    let cases: &[(&str, &[f64], f64)] = &[
        ("water_current", &[0.2, -0.1], 0.3),
        ("linear_drag", &[1.0], 1.0),
        ("thrust_loss", &[0.006], 0.01),
        ("heading_bias", &[0.05, 0.03, -0.04], 0.1),
        ("pitch_sensor", &[0.02, 0.05], 0.05),
        ("gyro_bias", &[0.004, -0.003, 0.002], 0.005),
        ("depth_bias", &[0.5], 1.0),
        ("dvl_scale", &[0.03], 0.05),
        ("dvl_misalignment", &[0.04, -0.03], 0.05),
        ("sound_speed", &[0.01], 0.02),
        ("clock_offset", &[0.004], 0.01),
        ("clock_drift", &[8.0], 10.0),
    ];
    let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0.0);
    for (seed, (effect, truth, sigma)) in (7..).zip(cases) {
        let set = EffectSet::NONE.with(effect, truth).unwrap();
        assert!(set.validate().is_ok());
        let info = backseat_core::effects::find(effect).unwrap();
        let mut states = EffectStates::NONE;
        for parameter in info.parameters {
            states = states.with(effect, parameter.name, *sigma, 0.0).unwrap();
        }
        let mut tally = Consistency::new();
        let navigator = fly(&set, states, seed, &mut tally);
        for (parameter, truth) in info.parameters.iter().zip(*truth) {
            let (value, now) = navigator.main().effect_state(effect, parameter.name).unwrap();
            let off = (value - truth) / now;
            println!("{effect}.{} {value:.5} ± {now:.5} ({truth}), {off:.1} sigma", parameter.name);
            (worst, squares, count) = (worst.max(off.abs()), squares + off * off, count + 1.0);
            // Depth bias hides behind depth: only slant ranges measure depth as well.
            let learned = now < 0.5 * sigma;
            assert!(learned || *effect == "depth_bias" || *effect == "pitch_sensor", "{effect}: {now}");
        }
        for sensor in [Sensor::Attitude, Sensor::Rates, Sensor::BottomTrack, Sensor::Range, Sensor::Depth] {
            let tally = tally.tally(sensor);
            let mean = tally.mean().unwrap();
            // Chi-square of n degrees of freedom over n, four and a half sigmas: sixty of these are looked at.
            let bound = 4.5 * (2.0 / f64::from(tally.count)).sqrt();
            assert!((mean - 1.0).abs() < bound, "{effect} {} {mean:.3} ± {bound:.3}", sensor.name());
        }
    }
    // 21 numbers, normal: the largest beyond 4 sigmas once in 800 tries; their mean square 1 ± 4 √(2/21).
    assert!(worst < 4.0, "{worst}");
    assert!((squares / count - 1.0_f64).abs() < 4.0 * (2.0 / count).sqrt(), "{}", squares / count);
}

#[test]
fn plant_changes_at_its_onset_and_not_before() {
    let change = EffectSet::NONE.with("drag_change", &[4.0, 60.0, 0.0]).unwrap();
    let run = |effects: EffectSet, until_s: u64| {
        let mut navigator = started(effects, EffectStates::NONE);
        for k in 1..=10 * until_s {
            navigator.predict(k * 100_000, &CRUISE).unwrap();
        }
        navigator.state()[6]
    };
    assert_eq!(run(change, 60), run(EffectSet::NONE, 60));
    assert!(run(change, 90) < run(EffectSet::NONE, 90) - 0.1);
    // With an end it is the same until then, and the speed comes back.
    let passing = EffectSet::NONE.with("drag_change", &[4.0, 60.0, 90.0]).unwrap();
    assert_eq!(run(passing, 90), run(change, 90));
    assert!((run(passing, 180) / run(EffectSet::NONE, 180) - 1.0).abs() < 1e-3);
    // From the epoch on, not from the start.
    let mut navigator = started(change, EffectStates::NONE);
    navigator.set_epoch(30_000_000);
    for k in 1..=900 {
        navigator.predict(k * 100_000, &CRUISE).unwrap();
    }
    assert_eq!(navigator.state()[6], run(EffectSet::NONE, 90));
}

#[test]
fn effects_change_while_the_filter_runs() {
    let mut navigator = started(EffectSet::NONE, EffectStates::NONE);
    navigator.predict(1_000_000, &CRUISE).unwrap();
    let effects = EffectSet::NONE.with("water_current", &[0.3, 0.1]).unwrap().with("thrust_loss", &[0.01]).unwrap();
    let config = NavigationConfig { effects, ..NavigationConfig::REFERENCE };
    let before = navigator.digest();
    navigator.reconfigure(&config).unwrap();
    assert_eq!(navigator.digest(), before);
    assert_eq!(navigator.current(), [0.3, 0.1]);
    // And back: as if nothing had been.
    navigator.reconfigure(&NavigationConfig::REFERENCE).unwrap();
    let mut plain = started(EffectSet::NONE, EffectStates::NONE);
    plain.predict(1_000_000, &CRUISE).unwrap();
    for both in [&mut navigator, &mut plain] {
        both.predict(2_000_000, &CRUISE).unwrap();
    }
    assert_eq!(navigator.digest(), plain.digest());
}

#[test]
fn a_start_is_freed_of_known_effects() {
    let effects = EffectSet::NONE
        .with("heading_bias", &[0.3, 0.1, -0.1])
        .and_then(|set| set.with("dvl_scale", &[0.05]))
        .and_then(|set| set.with("water_current", &[0.2, 0.0]))
        .unwrap();
    let config = NavigationConfig { effects, ..NavigationConfig::REFERENCE };
    let heading: f64 = 1.0;
    let compass = heading + 0.3 + 0.1 * heading.sin() - 0.1 * heading.cos();
    let dvl = [1.0 + 0.2 * heading.cos(), -0.2 * heading.sin(), 0.0].map(|v| 1.05 * v);
    let speed = InitialSpeed::Dvl(dvl);
    let start = InitialState::from_fix([0.0; 2], 1.0, 3.0, [0.0, 0.0, compass], [0.0; 3], speed, &config);
    // Twelve rounds, each of which leaves a seventh of the error: 1e-10.
    assert!((start.state[5] - heading).abs() < 1e-9);
    assert!((start.state[6] - 1.0).abs() < 1e-9 && start.state[7].abs() < 1e-9);
}

#[test]
fn what_does_not_fit_is_refused() {
    let none = EffectStates::NONE;
    let refused = |effect, parameter| ConfigError::NotAState { effect, parameter };
    assert_eq!(none.with("fin_bias", "rad", 0.1, 0.0), Err(refused("fin_bias", "rad")));
    assert_eq!(none.with("dvl_scale", "yaw_rad", 0.1, 0.0), Err(refused("dvl_scale", "yaw_rad")));
    let one = none.with("dvl_scale", "ratio", 0.1, 0.0).unwrap();
    assert_eq!(one.with("dvl_scale", "ratio", 0.1, 0.0), Err(refused("dvl_scale", "ratio")));
    let full = (0..19).fold(one, |states, j| {
        let parameter = StateParameter::LogFactor(j);
        states.with_state(EffectState { parameter, initial_sigma: 0.1, random_walk_per_sqrt_s: 0.0 }).unwrap()
    });
    assert_eq!(full.with("depth_bias", "m", 0.1, 0.0), Err(ConfigError::TooManyEffectStates));
    let configure = |config: &NavigationConfig| Navigator::new().configure(config, &model());
    let half_a_current = none.with("water_current", "north_mps", 0.1, 0.0).unwrap();
    let config = NavigationConfig { effect_states: half_a_current, ..NavigationConfig::REFERENCE };
    assert_eq!(configure(&config), Err(refused("water_current", "north_mps")));
    let beyond = EffectSet::NONE.with("sound_speed", &[0.2]).unwrap();
    let config = NavigationConfig { effects: beyond, ..NavigationConfig::REFERENCE };
    assert_eq!(configure(&config), Err(ConfigError::Effect { effect: "sound_speed", parameter: "ratio" }));
    // Plausible by itself, but this vehicle's drag would create energy.
    let mut small = backseat_core::dynamics::VehicleParameters::IVER3;
    small.quadratic_diag[1] = 20.0;
    small.quadratic_diag[5] = 5.0;
    let model = backseat_core::dynamics::VehicleModel::new(&small).unwrap();
    let effects = EffectSet::NONE.with("cross_drag", &[90.0, 0.0]).unwrap();
    let config = NavigationConfig { effects, ..NavigationConfig::REFERENCE };
    assert_eq!(Navigator::new().configure(&config, &model), Err(ConfigError::Plant { key: "drag.d26" }));
    // Impossible for a while is impossible.
    let mut dragging = backseat_core::dynamics::VehicleParameters::IVER3;
    dragging.linear_surge_ns_per_m = 99_990.0;
    let model = backseat_core::dynamics::VehicleModel::new(&dragging).unwrap();
    for until_s in [0.0, 90.0] {
        let effects = EffectSet::NONE.with("drag_change", &[20.0, 60.0, until_s]).unwrap();
        let config = NavigationConfig { effects, ..NavigationConfig::REFERENCE };
        let key = "drag.linear_surge_ns_per_m";
        assert_eq!(Navigator::new().configure(&config, &model), Err(ConfigError::Plant { key }));
    }
}

#[test]
fn every_effect_runs_for_a_while_at_half_its_size_both_ways() {
    for info in CATALOGUE {
        for sign in [1.0, -1.0] {
            let mut set = EffectSet::NONE.with(info.name, &half(info)).unwrap();
            for id in parameters().filter(|id| id.effect().name == info.name) {
                let (size, least) = (set.get(id), id.info().min);
                if id.info().kind == ParameterKind::Size {
                    set.set(id, if sign < 0.0 { (sign * size).max(least) } else { size });
                }
            }
            let mut navigator = started(set, EffectStates::NONE);
            for k in 1..=300 {
                navigator.predict(k * 100_000, &CRUISE).unwrap();
                navigator.fuse(&Measurement::Attitude { euler_rad: [0.0, -0.036, 0.3] });
            }
            assert!(navigator.failure().is_none(), "{}", info.name);
        }
    }
}
