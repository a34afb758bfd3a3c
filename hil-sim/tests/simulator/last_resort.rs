//! The drop weight in closed loop: what releases it, that the vehicle then rises, and that it sinks without.

use backseat_link::Client;
use backseat_wire::hostlink::{Fittings, ModeReason, ReleaseReason};
use hil_sim::backseat::InProcess;
use hil_sim::faults::{FaultKind, FittingFault};
use hil_sim::fittings::FittedParts;
use hil_sim::flight::fly_watched;
use hil_sim::scenario::Scenario;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// How a flight went.
struct Seen {
    /// When the weight was released, s, and why.
    released: Option<(f64, ReleaseReason)>,
    /// When the mission ended, s, and why.
    ended: Option<(f64, ModeReason)>,
    /// The largest true depth, m.
    deepest_m: f64,
    /// When the vehicle was back at the surface after that, s.
    surfaced_s: Option<f64>,
    last_m: f64,
    last: Fittings,
}

/// Propeller and hull fail at 240 s, the detector is wet from 250 s on.
fn scenario(seed: u64) -> Scenario {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/last_resort.toml");
    let mut scenario = Scenario::load(&path).unwrap();
    scenario.settings.seed = seed;
    scenario
}

fn flown(scenario: &Scenario) -> Seen {
    let mut seen =
        Seen { released: None, ended: None, deepest_m: 0.0, surfaced_s: None, last_m: 0.0, last: Fittings::default() };
    let (mut client, mut flew) = (Client::new(InProcess::new()), false);
    fly_watched(scenario, &mut client, None, &AtomicBool::new(false), |step| {
        let (time_s, depth_m) = (step.time_us as f64 * 1e-6, step.truth.state[2]);
        if let Some(reason) = step.fittings.released {
            seen.released.get_or_insert((time_s, reason));
        }
        if let Some(telemetry) = step.telemetry {
            flew |= telemetry.leg.is_some();
            if flew && telemetry.leg.is_none() {
                seen.ended.get_or_insert((time_s, telemetry.reason));
            }
        }
        if depth_m > seen.deepest_m {
            (seen.deepest_m, seen.surfaced_s) = (depth_m, None);
        } else if depth_m < 0.3 {
            seen.surfaced_s.get_or_insert(time_s);
        }
        (seen.last_m, seen.last) = (depth_m, *step.fittings);
    })
    .unwrap();
    seen
}

#[test]
fn a_flooded_vehicle_without_its_propeller_comes_up_by_its_drop_weight() {
    let seen = flown(&scenario(1));
    let (released_s, reason) = seen.released.expect("released");
    let surfaced_s = seen.surfaced_s.expect("surfaced");
    println!("released at {released_s} s, {reason:?}; deepest {:.1} m; surface at {surfaced_s} s", seen.deepest_m);
    assert_eq!((reason, seen.last.aborts), (ReleaseReason::Leak, true));
    assert!((251.0..253.0).contains(&released_s), "two seconds of a wet detector: {released_s}");
    let (ended_s, _) = seen.ended.expect("ended");
    assert!(ended_s <= released_s);
    assert!(seen.deepest_m < 8.0 && surfaced_s < 300.0, "{:.1} m, {surfaced_s} s", seen.deepest_m);

    let mut bare = scenario(1);
    bare.settings.fittings = FittedParts::default();
    let sunk = flown(&bare);
    println!("without: {:.1} m deep at the end", sunk.last_m);
    assert!(sunk.released.is_none() && sunk.last_m > 30.0, "{:.1} m", sunk.last_m);
}

#[test]
fn a_dip_of_the_supply_is_borne_and_a_supply_at_its_end_is_not() {
    let mut sound = scenario(2);
    (sound.settings.effects, sound.settings.duration_s) = (Default::default(), 330.0);
    let fault = &mut sound.settings.faults[0];
    fault.kind = FaultKind::Fitting(FittingFault::SupplyDip { supply_v: 18.0 });
    fault.until_us = fault.from_us + 1_500_000;
    let seen = flown(&sound);
    assert_eq!((seen.released, seen.ended), (None, None));
    sound.settings.faults[0].until_us = u64::MAX;
    let seen = flown(&sound);
    let (ended_s, reason) = seen.ended.expect("ended");
    assert_eq!((reason, seen.released), (ModeReason::SupplyLow, Some((ended_s, ReleaseReason::SupplyLow))));
    assert!((251.0..253.0).contains(&ended_s), "{ended_s}");
}

#[test]
fn a_mission_does_not_begin_with_a_wet_detector() {
    let mut wet = scenario(3);
    wet.settings.faults[0].from_us = 0;
    wet.settings.duration_s = 120.0;
    let mut client = Client::new(InProcess::new());
    // armed before anything was read; refused, or disarmed when it would begin
    let flight = fly_watched(&wet, &mut client, None, &AtomicBool::new(false), |step| {
        assert!(step.telemetry.is_none_or(|telemetry| telemetry.leg.is_none()));
        assert!(step.fittings.released.is_none());
    });
    assert!(flight.is_err() || !flight.unwrap().finished);
}
