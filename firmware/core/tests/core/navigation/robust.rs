//! The robust filter from outside: priors, separability, the bank, and what one dive leaves to the next.

use super::support::*;
use backseat_core::dynamics::ActuatorInput;
use backseat_core::navigation::*;

fn robust(change: impl FnOnce(&mut Priors)) -> NavigationConfig {
    let mut config = NavigationConfig::REFERENCE;
    change(&mut config.priors);
    config.make_robust();
    config
}

/// Two minutes of depth, attitude and ranges at cruise.
fn flown(config: &NavigationConfig, learnt: Option<&Learnt>) -> Box<Navigator> {
    let mut navigator = started(config);
    if let Some(learnt) = learnt {
        navigator.start_from(learnt);
    }
    let path = reported(still([300.0, 0.0], [0.5, 0.1]));
    for k in 1..=1200_u64 {
        let turn = if k % 300 < 150 { 0.05 } else { -0.05 };
        let input = ActuatorInput { propeller_radps: 106.0, fins_rad: [turn, -turn, 0.0, 0.0] };
        navigator.predict(k * 100_000, &input).unwrap();
        let x = *navigator.state();
        navigator.fuse(&Measurement::Depth { z_m: x[2] });
        navigator.fuse(&Measurement::Attitude { euler_rad: [x[3], x[4], x[5]] });
        if k % 300 == 0 {
            let range_m = ((x[0] - 300.0).powi(2) + x[1].powi(2) + x[2].powi(2)).sqrt();
            navigator.fuse(&Measurement::Range { path, range_m });
        }
    }
    navigator
}

#[test]
fn a_prior_of_zero_means_known() {
    assert_eq!(robust(|_| {}).effect_states.len(), 18);
    let known = robust(|priors| {
        priors.mass = [0.0; 3];
        priors.current_mps = 0.0;
    });
    assert_eq!(known.effect_states.len(), 13);
    assert!(known.effect_states.current().is_none());
    assert!(known.effect_states.iter().all(|state| state.parameter.name() != "m11"));
    // Without a current there is none that changes either.
    let mut states = known.effect_states;
    states.add_tide();
    assert_eq!(states, known.effect_states);
}

#[test]
fn too_short_a_log_separates_little_and_says_so() {
    let navigator = flown(&robust(|_| {}), None);
    let estimates: Vec<StateEstimate> = navigator.main().estimates().collect();
    assert_eq!(estimates.len(), 20);
    for estimate in &estimates {
        // a walk, that of the tide, adds up to 2.7e-3 of the prior in two minutes
        assert!(estimate.sigma <= estimate.prior_sigma * 1.003 && estimate.correlation <= 1.0, "{estimate:?}");
    }
    let separable = |name| estimates.iter().find(|estimate| estimate.parameter.name() == name).unwrap().is_separable();
    // Two minutes at one speed: neither the mass nor a compass that is off by a constant.
    assert!(!separable("m11") && !separable("const_rad") && !separable("beta1"));
}

#[test]
fn the_next_dive_starts_from_what_was_learnt_of_the_vehicle() {
    let config = robust(|_| {});
    let first = flown(&config, None);
    let kept = first.main().learnt(1).expect("a covariance");
    assert_eq!((kept.dives, kept.check()), (1, Ok(())));
    let mut second = navigator(&config);
    second.initialise(0, &initial()).unwrap();
    second.start_from(&kept);
    for (kept, learnt) in second.main().estimates().zip(first.main().estimates()) {
        if kept.parameter.is_of_the_vehicle() {
            // Between two dives somebody handles the vehicle: a tenth of the prior's sigma is added.
            let sigma = learnt.sigma.hypot(0.1 * learnt.prior_sigma).min(learnt.prior_sigma);
            assert_eq!(kept.value, learnt.value);
            assert!((kept.sigma / sigma - 1.0).abs() < 1e-12, "{kept:?} {learnt:?}");
            // It is independent from state to state, so that no correlation grows.
            assert!(kept.correlation <= learnt.correlation + 1e-12, "{kept:?} {learnt:?}");
        } else {
            assert_eq!((kept.value, kept.sigma), (0.0, kept.prior_sigma), "the water is another");
        }
    }
    // It is a covariance: the filter goes on from it.
    let second = flown(&config, Some(&kept));
    let summed = |navigator: &Navigator| navigator.main().estimates().map(|e| e.sigma / e.prior_sigma).sum::<f64>();
    assert!(summed(&second) < summed(&first));
}

/// A hull that lies at the surface with its elevators hard over swims at two thirds of its speed. It is no proof
/// of a weak propeller, nor of a current.
#[test]
fn a_vehicle_that_the_surface_holds_teaches_no_wrong_propeller() {
    const SPEED_MPS: f64 = 0.65;
    let mut navigator = navigator(&robust(|_| {}));
    let mut surfaced = initial();
    (surfaced.state[2], surfaced.state[6]) = (0.1, SPEED_MPS);
    navigator.initialise(0, &surfaced).unwrap();
    let [x_m, y_m] = [surfaced.state[0], surfaced.state[1]];
    let heading_rad = surfaced.state[5];
    let input = ActuatorInput { propeller_radps: 106.0, fins_rad: [0.0, 0.0, -0.346, -0.346] };
    for k in 1..=600_u64 {
        navigator.predict(k * 100_000, &input).unwrap();
        navigator.fuse(&Measurement::Depth { z_m: 0.1 });
        navigator.fuse(&Measurement::Attitude { euler_rad: [0.0, -0.04, heading_rad] });
        if k % 10 == 0 {
            let along_m = SPEED_MPS * 0.1 * k as f64;
            let position_m = [x_m + along_m * heading_rad.cos(), y_m + along_m * heading_rad.sin()];
            navigator.fuse(&Measurement::VehicleGnss { position_m });
        }
    }
    let [current_north, current_east] = navigator.current();
    let speed_mps = navigator.state()[6] + current_north * heading_rad.cos() + current_east * heading_rad.sin();
    // fixes of 1.5 m a second, and a speed that may change by 0.2 m/s in a second
    assert!((speed_mps - SPEED_MPS).abs() < 0.2, "{speed_mps}");
    // three seconds, in which it may still dive, have taught a little
    for estimate in
        navigator.main().estimates().filter(|estimate| ["m11", "d11", "beta5"].contains(&estimate.parameter.name()))
    {
        assert!(estimate.value.abs() < 2.0 * estimate.prior_sigma, "{estimate:?}");
    }
}

#[test]
fn the_main_filter_allows_most() {
    let config = robust(|_| {});
    let navigator = flown(&config, None);
    let [Some(main), Some(nominal), Some(steady)] = navigator.members() else { panic!("all three run") };
    let states = |member: BankMember<'_>| member.filter.config().effect_states;
    let (main, nominal, steady) = (states(main), states(nominal), states(steady));
    assert_eq!((main.len(), nominal.len(), steady.len()), (20, 0, 18));
    let walk = |states: &EffectStates| states.current().unwrap().random_walk_per_sqrt_s;
    assert_eq!((walk(&main), walk(&steady)), (config.priors.current_walk_mps_per_sqrt_s, 1.0e-5));
}

#[test]
fn a_filter_without_states_of_the_vehicle_learns_nothing() {
    assert_eq!(flown(&NavigationConfig::REFERENCE, None).main().learnt(1), None);
    assert_eq!(Navigator::new().main().learnt(1), None);
}

#[test]
fn the_bank_mixes_means_and_covariances() {
    let config = robust(|_| {});
    let navigator = flown(&config, None);
    let [nominal, tidal] = navigator.weights();
    assert!(nominal > 0.0 && tidal > 0.0 && nominal + tidal < 1.0, "{nominal} {tidal}");
    // The mixture of three covariances lies between them, but for the spread of the means.
    let alone = flown(&NavigationConfig { bank: false, ..config }, None);
    let nominal = flown(&NavigationConfig::REFERENCE, None);
    assert!(navigator.variance(0) < alone.variance(0) * 1.5 && navigator.variance(0) > nominal.variance(0));
    assert_eq!(alone.weights(), [0.0; 2]);
    assert_ne!(navigator.digest(), alone.digest());
}
