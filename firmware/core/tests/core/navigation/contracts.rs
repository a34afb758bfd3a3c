//! Contracts: what is refused and leaves no trace, what stays positive definite, what has the same bits.

use super::support::*;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::navigation::*;
use backseat_core::state::{PSI, R, U, V, VehicleState, X, Y};
use nalgebra::SMatrix;

fn current() -> EffectStates {
    EffectStates::water_current(0.3, 1e-4)
}

fn report(ship: [f64; 2]) -> ShipReport {
    still(ship, [0.5, 0.1])
}

/// Smallest pivot of the correlation matrix' Cholesky factorisation.
fn smallest_pivot(navigator: &Navigator) -> f64 {
    const MAX: usize = 34;
    let n = navigator.main().dimension();
    let mut l = Box::new(SMatrix::<f64, MAX, MAX>::zeros());
    let mut smallest = f64::INFINITY;
    for j in 0..n {
        for i in j..n {
            let scale = (navigator.variance(i) * navigator.variance(j)).sqrt();
            let dot: f64 = (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum();
            let a = navigator.covariance(i, j) / scale - dot;
            if i == j {
                smallest = smallest.min(a);
                l[(i, i)] = a.max(1e-15).sqrt();
            } else {
                l[(i, j)] = a / l[(j, j)];
            }
        }
    }
    smallest
}

/// Random steps, measurements near the estimate and far from it, clones taken and dropped.
fn random_walk(steps: usize, seed: u64, mut check: impl FnMut(&Navigator, usize)) -> Box<Navigator> {
    let config = NavigationConfig { effect_states: current(), ..NavigationConfig::REFERENCE };
    let mut navigator = started(&config);
    let mut noise = Noise(seed);
    let mut clones = Vec::new();
    for step in 0..steps {
        let x = *navigator.state();
        let ship = navigator.main().ship_state().unwrap_or([300.0, 100.0, 0.0, 0.0, 0.0, 0.0]);
        let spread = if noise.uniform() < 0.02 { 50.0 } else { 1.0 };
        let near = |noise: &mut Noise, at: usize, sigma: f64| -> [f64; 3] {
            core::array::from_fn(|i| x[at + i] + spread * sigma * noise.normal())
        };
        let choice = noise.word() % 14;
        match choice {
            0..=3 => {
                let input =
                    ActuatorInput { propeller_radps: 106.8, fins_rad: noise.normals([0.0, 0.0, 0.008, -0.008], 0.02) };
                let to_us = navigator.time_us() + noise.word() % 300_000;
                navigator.predict(to_us, &input).unwrap();
            }
            4 => drop(navigator.fuse(&Measurement::Depth { z_m: near(&mut noise, 0, 0.06)[2] })),
            5 => drop(navigator.fuse(&Measurement::Attitude { euler_rad: noise.normals([0.0, -0.036, 0.0], 0.017) })),
            6 => drop(navigator.fuse(&Measurement::Rates { rates_radps: near(&mut noise, 9, 0.01) })),
            7 => {
                let velocity_mps = near(&mut noise, 6, 0.01).map(|v| v.clamp(-1.5, 1.5));
                navigator.fuse(&Measurement::BottomTrack { velocity_mps });
            }
            8 => {
                let [x, y, _] = near(&mut noise, 0, 1.5);
                navigator.fuse(&Measurement::VehicleGnss { position_m: [x, y] });
            }
            9 => {
                let position_m = noise.normals([300.0, 100.0], spread * 0.5);
                navigator.fuse(&Measurement::ShipGnss { position_m });
            }
            10 => {
                let initial = InitialShip::from_fix(noise.normals([300.0, 100.0], 0.5), &config);
                if noise.uniform() < 0.05 {
                    navigator.initialise_ship(&initial).unwrap();
                }
            }
            11 => {
                let id = if noise.uniform() < 0.5 { navigator.clone_vehicle() } else { navigator.clone_ship() };
                clones.extend(id.ok());
            }
            12 => {
                if clones.len() > 1 {
                    navigator.drop_clone(clones.remove(0));
                }
            }
            _ => {
                let vehicle = clones
                    .first()
                    .map_or(VehicleEnd::Now, |clone| VehicleEnd::Delayed { clone: *clone, bridge_s: noise.normal() });
                let back = AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Now };
                let path = AcousticPath { vehicle, ship: ShipEnd::Now };
                let range_m = (x[0] - ship[0]).hypot(x[1] - ship[1]) + spread * noise.normal();
                navigator.fuse(&Measurement::Range { path, range_m });
                navigator.fuse(&Measurement::TwoWayRange { outward: path, back, range_m });
                navigator.fuse(&Measurement::RangeRate { path, range_rate_mps: spread * 0.1 * noise.normal() });
            }
        }
        check(&navigator, step);
    }
    navigator
}

#[test]
fn covariance_stays_positive_definite_over_1e5_random_steps() {
    random_walk(100_000, 7, |navigator, step| {
        if step % 500 == 0 {
            // A clone just taken is a copy: singular but for rounding, relative to the unit diagonal.
            let pivot = smallest_pivot(navigator);
            assert!(pivot > -1e-11, "{step} {pivot:e}");
        }
        assert!(navigator.failure().is_none(), "{step}");
    });
}

#[test]
fn same_input_same_digest_and_any_change_shows() {
    let mut running = [0xcbf2_9ce4_8422_2325_u64; 2];
    for digest in &mut running {
        random_walk(2_000, 11, |navigator, _| *digest = navigator.digest_from(*digest));
    }
    assert_eq!(running[0], running[1]);
    let mut one = navigator(&NavigationConfig::REFERENCE);
    let mut initial = initial();
    one.initialise(0, &initial).unwrap();
    let mut other = navigator(&NavigationConfig::REFERENCE);
    initial.state[7] = f64::from_bits(initial.state[7].to_bits() + 1);
    other.initialise(0, &initial).unwrap();
    assert_ne!(one.digest(), other.digest());
}

#[test]
fn what_is_not_finite_leaves_no_trace() {
    let mut navigator = started(&NavigationConfig { effect_states: current(), ..NavigationConfig::REFERENCE });
    let clone = navigator.clone_vehicle().unwrap();
    let before = navigator.digest();
    let bad_report = ShipReport { position_sigma_m: f64::NAN, ..report([300.0, 0.0]) };
    let bridged = |bridge_s| AcousticPath {
        vehicle: VehicleEnd::Delayed { clone, bridge_s },
        ship: ShipEnd::Reported(report([300.0, 0.0])),
    };
    let above = [navigator.state()[0], navigator.state()[1]];
    let nan = f64::NAN;
    let measurements = [
        Measurement::Depth { z_m: nan },
        Measurement::Depth { z_m: f64::INFINITY },
        Measurement::Attitude { euler_rad: [0.0, nan, 0.0] },
        Measurement::Rates { rates_radps: [0.0, 0.0, nan] },
        Measurement::BottomTrack { velocity_mps: [nan, 0.0, 0.0] },
        Measurement::WaterTrack { velocity_mps: [nan, 0.0, 0.0] },
        Measurement::VehicleGnss { position_m: [0.0, nan] },
        Measurement::ShipGnss { position_m: [0.0, 0.0] },
        Measurement::Range { path: reported(report([nan, 0.0])), range_m: 10.0 },
        Measurement::Range { path: reported(report([300.0, 0.0])), range_m: nan },
        Measurement::RangeRate { path: reported(report([300.0, 0.0])), range_rate_mps: nan },
        Measurement::Range { path: bridged(nan), range_m: 300.0 },
        Measurement::Range { path: bridged(1e200), range_m: 300.0 },
        Measurement::Range { path: reported(bad_report), range_m: 300.0 },
        // The ship is not known.
        Measurement::Range { path: AcousticPath { vehicle: VehicleEnd::Now, ship: ShipEnd::Now }, range_m: 300.0 },
    ];
    for measurement in measurements {
        let fusions = navigator.fuse(&measurement);
        assert_eq!(fusions.iter().count(), measurement.scalars(), "{measurement:?}");
        assert!(fusions.iter().all(|record| record.outcome == FusionOutcome::Invalid), "{measurement:?}");
        assert!(fusions.iter().all(|record| record.sensor == measurement.sensor()));
    }
    // A ship right above a vehicle at the surface has no direction.
    navigator.fuse(&Measurement::Depth { z_m: 3.0 });
    let digest = navigator.digest();
    assert_ne!(digest, before);
    assert!(navigator.failure().is_none());
    let fusions = navigator.fuse(&Measurement::Range { path: reported(report(above)), range_m: 3.0 });
    assert!(fusions.iter().all(|record| record.outcome == FusionOutcome::Fused));
}

#[test]
fn refused_predictions_leave_no_trace() {
    let mut navigator = navigator(&NavigationConfig::REFERENCE);
    assert_eq!(navigator.predict(1, &CRUISE), Err(NavigationError::NotInitialised));
    assert_eq!(navigator.clone_vehicle(), Err(CloneError::NotInitialised));
    assert!(navigator.fuse(&Measurement::Depth { z_m: 0.0 }).iter().all(|r| r.outcome == FusionOutcome::Invalid));
    navigator.initialise(5_000_000, &initial()).unwrap();
    let before = navigator.digest();
    assert_eq!(navigator.predict(4_999_999, &CRUISE), Err(NavigationError::TimeBackwards));
    assert_eq!(navigator.predict(5_000_000 + MAX_GAP_US + 1, &CRUISE), Err(NavigationError::GapTooLong));
    let broken = ActuatorInput { propeller_radps: f64::NAN, ..CRUISE };
    assert_eq!(navigator.predict(5_100_000, &broken), Err(NavigationError::InvalidInput));
    assert_eq!(navigator.clone_ship(), Err(CloneError::NoShip));
    assert_eq!(navigator.predict(5_000_000, &CRUISE), Ok(()));
    assert_eq!(navigator.digest(), before);
    // The longest gap is crossed in bounded time and stays finite.
    assert_eq!(navigator.predict(5_000_000 + MAX_GAP_US, &CRUISE), Ok(()));
    // Nobody knows where a vehicle is that was not heard of for ten minutes.
    assert!(navigator.horizontal_sigma_m() > 500.0);
    // The kinematic model does not ask the actuators.
    navigator.set_process_model(ProcessModel::Kinematic, &ProcessNoise::KINEMATIC).unwrap();
    assert_eq!(navigator.predict(6_000_000 + MAX_GAP_US, &broken), Ok(()));
}

/// A minute after inputs are taken to hold, against the closed form of a vehicle that goes straight on under white
/// accelerations of 0.1 m/s²/√Hz ahead and sideways.
#[test]
fn val_a_vehicle_of_unknown_input_is_where_it_may_have_moved() {
    const T: f64 = 60.0;
    let mut navigator = started(&NavigationConfig::REFERENCE);
    navigator.predict((1e6 * LONGEST_HOLD_S) as u64, &CRUISE).unwrap();
    let before = navigator.clone();
    // one call, as of a log that is silent
    navigator.initialise(0, &initial()).unwrap();
    navigator.predict((1e6 * (LONGEST_HOLD_S + T)) as u64, &CRUISE).unwrap();
    let (sin, cos) = before.state()[PSI].sin_cos();
    let u = before.state()[U];
    let by = |position: usize| {
        let ahead = if position == X { [cos, -sin, -u * sin] } else { [sin, cos, u * cos] };
        let [by_u, by_v, by_psi] = ahead;
        [(position, 1.0), (U, T * by_u), (V, T * by_v), (PSI, T * by_psi), (R, 0.5 * T * T * by_psi)]
    };
    for position in [X, Y] {
        let terms = by(position);
        let known: f64 = terms.iter().flat_map(|a| terms.map(|b| a.1 * b.1 * before.covariance(a.0, b.0))).sum();
        let expected = known + 0.1 * 0.1 * T * T * T / 3.0;
        let found = navigator.variance(position);
        // the closed form is of level flight: the trim's pitch of some degrees is squared in it
        assert!((found / expected - 1.0).abs() < 0.02, "{position}: {found} {expected}");
    }
    // any heading, π/√3
    assert!((1.7..2.5).contains(&navigator.variance(PSI).sqrt()), "{}", navigator.variance(PSI).sqrt());
}

#[test]
fn a_failed_filter_says_so_until_it_is_initialised() {
    let mut navigator = navigator(&NavigationConfig::REFERENCE);
    let mut initial = initial();
    initial.state[6] = 1e200;
    navigator.initialise(0, &initial).unwrap();
    let failure = navigator.predict(100_000, &CRUISE).unwrap_err();
    assert_eq!(failure, NavigationError::NotFinite);
    assert_eq!(navigator.failure(), Some(failure));
    assert!(!navigator.is_initialised());
    assert_eq!(navigator.predict(200_000, &CRUISE), Err(failure));
    assert!(navigator.fuse(&Measurement::Depth { z_m: 3.0 }).iter().all(|r| r.outcome == FusionOutcome::Invalid));
    navigator.initialise(0, &super::support::initial()).unwrap();
    assert_eq!(navigator.predict(100_000, &CRUISE), Ok(()));
}

#[test]
fn configurations_out_of_range_are_named_and_change_nothing() {
    let mut navigator = started(&NavigationConfig::REFERENCE);
    let mut config = NavigationConfig::REFERENCE;
    config.sensors.range_m = 0.0;
    let refuses = |refused, key| matches!(refused, Err(ConfigError::OutOfRange(error)) if error.key == key);
    assert!(refuses(navigator.reconfigure(&config), "sensors.range_m"));
    config = NavigationConfig { gate_sigma: f64::NAN, ..NavigationConfig::REFERENCE };
    assert!(refuses(navigator.configure(&config, &model()), "app.gate_sigma"));
    config = NavigationConfig { effect_states: current(), ..NavigationConfig::REFERENCE };
    assert_eq!(navigator.reconfigure(&config), Err(ConfigError::LayoutChange));
    assert!(navigator.is_initialised());
    assert_eq!(navigator.config(), &NavigationConfig::REFERENCE);
    let mut broken = initial();
    broken.sigma[3] = 0.0;
    assert_eq!(navigator.initialise(0, &broken), Err(NavigationError::NotPositive));
    assert!(navigator.is_initialised());
}

#[test]
fn heading_goes_the_shorter_way_round() {
    let mut navigator = navigator(&NavigationConfig::REFERENCE);
    let mut initial = initial();
    initial.state[5] = 3.13;
    navigator.initialise(0, &initial).unwrap();
    for _ in 0..20 {
        let fusions = navigator.fuse(&Measurement::Attitude { euler_rad: [0.0, -0.036, -3.13] });
        assert!(fusions.iter().all(|record| record.outcome == FusionOutcome::Fused));
    }
    let heading = navigator.state()[5];
    assert!(heading < -3.12 && heading > -std::f64::consts::PI, "{heading}");
}

#[test]
fn initial_states_say_what_they_know() {
    let config = NavigationConfig::REFERENCE;
    let start = |speed, config: &NavigationConfig| {
        InitialState::from_fix([1.0, 2.0], 1.5, 3.0, [0.0, -0.03, 1.0], [0.0, 0.0, 0.01], speed, config)
    };
    let commanded = start(InitialSpeed::Commanded(2.0), &config);
    assert_eq!(commanded.state, VehicleState::from([1.0, 2.0, 3.0, 0.0, -0.03, 1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.01]));
    assert_eq!((commanded.sigma[0], commanded.sigma[2], commanded.sigma[6]), (1.5, 0.06, 0.2));
    let dvl = start(InitialSpeed::Dvl([1.0, 0.1, 0.0]), &config);
    assert_eq!((dvl.state[7], dvl.sigma[7]), (0.1, 0.01));
    // Bottom track in an unknown current knows the velocity through the water no better than the current.
    let drifting = NavigationConfig { effect_states: current(), ..config };
    let dvl = start(InitialSpeed::Dvl([1.0, 0.1, 0.0]), &drifting);
    assert!((dvl.sigma[6] - 0.3_f64.hypot(0.01)).abs() < 1e-12);
    let mut navigator = navigator(&drifting);
    navigator.initialise(0, &dvl).unwrap();
    assert_eq!(navigator.main().current_sigma(), Some([0.3, 0.3]));
    navigator.initialise_ship(&InitialShip::from_fix([5.0, 6.0], &drifting)).unwrap();
    assert_eq!(navigator.main().ship_state().unwrap()[..2], [5.0, 6.0]);
}

#[test]
fn a_range_rate_far_from_certain_is_left_out_but_in_the_filter_of_the_thesis() {
    let mut thesis = NavigationConfig::REFERENCE;
    thesis.make_as_in_thesis();
    let rate = Measurement::RangeRate { path: reported(report([300.0, 0.0])), range_rate_mps: -0.95 };
    let outcome = |config: &NavigationConfig, sigma_m: f64, measurement: &Measurement| {
        let mut navigator = navigator(config);
        let mut start = initial();
        (start.sigma[0], start.sigma[1]) = (sigma_m, sigma_m);
        navigator.initialise(0, &start).unwrap();
        let fusions = navigator.fuse(measurement);
        let moved = *navigator.state() != start.state;
        (fusions.iter().next().unwrap().outcome, moved)
    };
    // at 1 m/s towards the ship; sqrt(2) sigma is what counts: 49.5 and 50.9 m
    assert_eq!(outcome(&NavigationConfig::REFERENCE, 35.0, &rate), (FusionOutcome::Fused, true));
    assert_eq!(outcome(&NavigationConfig::REFERENCE, 36.0, &rate), (FusionOutcome::PositionUncertain, false));
    assert_eq!(outcome(&thesis, 36.0, &rate), (FusionOutcome::Fused, true));
    // beyond the gate of five sigmas, and used all the same
    let deep = Measurement::Depth { z_m: initial().state[2] + 1.0e3 };
    assert_eq!(outcome(&NavigationConfig::REFERENCE, 1.0, &deep), (FusionOutcome::Gated, false));
    let depth_sigma_m = initial().sigma[2];
    let deep = Measurement::Depth { z_m: initial().state[2] + 50.0 * depth_sigma_m.hypot(thesis.sensors.depth_m) };
    assert_eq!(outcome(&thesis, 1.0, &deep), (FusionOutcome::Fused, true));
}

#[test]
fn what_is_left_out_is_counted_apart() {
    let record = FusionRecord {
        sensor: Sensor::RangeRate,
        axis: 0,
        time_us: 0,
        innovation: f64::NAN,
        variance: f64::NAN,
        test_ratio: f64::NAN,
        outcome: FusionOutcome::PositionUncertain,
    };
    let mut consistency = Consistency::new();
    consistency.add(&record);
    let tally = consistency.tally(Sensor::RangeRate);
    assert_eq!((tally.position_uncertain, tally.rejected, tally.invalid, tally.count), (1, 0, 0, 0));
}
