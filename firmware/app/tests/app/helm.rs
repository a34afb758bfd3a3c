//! A host that holds heading, depth and speed instead of the leg.

use crate::board::{Board, Direct, request_all};
use crate::faults::{last, shown};
use crate::flight::{parameters, start, start_along};
use crate::safety::{LONG, flying, stopped, until_ended};
use crate::world::World;
use backseat_core::state::{PSI, U, X, Y, Z, wrap_angle};
use backseat_wire::hostlink::{Held, Mode, ModeReason, Refusal, ToBoard, Waypoint};
use std::f64::consts::TAU;

/// It may.
const MAY: (&str, f64) = ("app.helm", 1.0);
const NOMINAL: (Mode, ModeReason) = (Mode::Navigating, ModeReason::Nominal);

const fn helm(heading_rad: f64, depth_m: f64, speed_mps: f64) -> ToBoard<'static> {
    ToBoard::Helm { heading_rad, depth_m, speed_mps }
}

/// Says it twice a second.
fn steer(world: &mut World, board: &mut Direct, seconds: u64, helm: &ToBoard<'_>) {
    for step in 0..10 * seconds {
        if step % 5 == 0 {
            request_all(board, std::slice::from_ref(helm));
        }
        world.advance(board);
    }
}

fn refused(board: &mut Direct, helm: &ToBoard<'_>) -> Option<Refusal> {
    board.answer(helm).expect("an answer").err()
}

#[test]
fn it_is_obeyed_and_then_the_leg_is_flown_again() {
    let (mut world, mut board) = flying(&[MAY], 60);
    let north_m = world.x[X];
    steer(&mut world, &mut board, 40, &helm(1.2, 5.0, 1.3));
    for _ in 0..20 {
        steer(&mut world, &mut board, 1, &helm(1.2, 5.0, 1.3));
        let off = [wrap_angle(world.x[PSI] - 1.2), world.x[Z] - 5.0, world.x[U] - 1.3];
        assert!(off[0].abs() < 0.035 && off[1].abs() < 0.3 && off[2].abs() < 0.1, "{off:.3?} rad, m, m/s");
        assert_eq!((shown(&mut board), last(&mut board).leg), (NOMINAL, Some(1)));
    }
    assert!(world.x[Y] > 50.0 && world.x[X] > north_m + 15.0, "{:?}", world.x);
    world.run(&mut board, 180);
    assert_eq!((shown(&mut board), last(&mut board).leg), (NOMINAL, Some(1)));
    let off = [world.x[Y], world.x[Z] - 3.0, world.x[U] - 1.0];
    assert!(off[0].abs() < 3.0 && off[1].abs() < 0.3 && off[2].abs() < 0.1, "{off:.3?} m, m, m/s");
}

/// As a vehicle that steers itself hears it, twice a second.
#[test]
fn it_holds_for_two_seconds() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    parameters(&mut board, &[MAY, ("app.control_mode", 1.0), ("app.attitude_source", 1.0)]);
    world.run(&mut board, 10);
    start(&mut board);
    world.run(&mut board, 1);
    let holds = |world: &mut World, board: &mut Direct, steps: u64| {
        (0..steps).for_each(|_| world.advance(board));
        (world.last_steer.expect("a command").heading_rad - 1.2).abs() < 0.01
    };
    assert!(!holds(&mut world, &mut board, 1));
    request_all(&mut board, &[helm(1.2, 4.0, 1.3)]);
    assert!(holds(&mut world, &mut board, 5) && holds(&mut world, &mut board, 14));
    let steer = world.last_steer.expect("a command");
    assert!((steer.depth_m - 4.0).abs() < 0.1 && (steer.speed_mps - 1.3).abs() < 0.1, "{steer:?}");
    assert!(!holds(&mut world, &mut board, 6), "2.5 s");
}

/// Who steers is told when it changes and every ten seconds; who flies a leg, never.
#[test]
fn it_is_told_who_steers() {
    let (mut world, mut board) = flying(&[MAY], 60);
    assert!(board.heard().steered.is_empty());
    steer(&mut world, &mut board, 25, &helm(1.2 - TAU, 5.0, 1.3));
    steer(&mut world, &mut board, 1, &helm(1.0, 5.0, 1.3));
    world.run(&mut board, 20);
    let told = std::mem::take(&mut board.heard().steered);
    let values = |held: &Held| [held.heading_rad, held.depth_m, held.speed_mps];
    let told: Vec<_> = told.iter().map(|steered| steered.by_host.as_ref().map(values)).collect();
    let [first, middle @ .., otherwise, end] = &told[..] else { panic!("{told:?}") };
    assert_eq!((*first, *otherwise, *end), (Some([1.2, 5.0, 1.3]), Some([1.0, 5.0, 1.3]), None));
    assert!((2..=3).contains(&middle.len()) && middle.iter().all(|told| told == first), "{told:?}");
    // and at the end of the mission
    request_all(&mut board, &[helm(1.0, 5.0, 1.3)]);
    world.run(&mut board, 1);
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 1);
    let told: Vec<_> = board.heard().steered.iter().map(|steered| steered.by_host.is_some()).collect();
    assert_eq!(told, [true, false]);
}

#[test]
fn what_may_not_be_is_refused() {
    let east = helm(1.2, 5.0, 1.3);
    let (mut world, mut board) = flying(&[], 20);
    assert_eq!(refused(&mut board, &east), Some(Refusal::NotPermitted), "by default");
    world.run(&mut board, 1);
    assert!(wrap_angle(world.x[PSI]).abs() < 0.5);
    // the law about the reference trajectory flies the mission itself
    let (_, mut board) = flying(&[MAY, ("app.control_law", 2.0)], 20);
    assert_eq!(refused(&mut board, &east), Some(Refusal::NotPermitted));

    let (mut world, mut board) = (World::new(), Direct::new(None));
    parameters(&mut board, &[MAY, ("safety.depth_max_m", 20.0)]);
    assert_eq!(refused(&mut board, &east), Some(Refusal::NotReady), "it looks for its position");
    world.run(&mut board, 10);
    assert_eq!(refused(&mut board, &east), Some(Refusal::NotReady), "at rest");
    start_along(&mut board, &LONG);
    assert_eq!(refused(&mut board, &east), Some(Refusal::NotReady), "armed");
    world.run(&mut board, 20);
    let cases = [
        (helm(0.0, 19.5, 1.0), Some(Refusal::Unsafe(ModeReason::TooDeep))),
        (helm(0.0, 301.0, 1.0), Some(Refusal::OutOfRange)),
        (helm(0.0, -0.1, 1.0), Some(Refusal::OutOfRange)),
        (helm(0.0, 3.0, 0.49), Some(Refusal::OutOfRange)),
        (helm(0.0, 3.0, 3.1), Some(Refusal::OutOfRange)),
        (helm(f64::NAN, 3.0, 1.0), Some(Refusal::OutOfRange)),
        (helm(f64::INFINITY, 3.0, 1.0), Some(Refusal::OutOfRange)),
        (helm(0.0, f64::NAN, 1.0), Some(Refusal::OutOfRange)),
        (helm(0.0, 3.0, f64::NAN), Some(Refusal::OutOfRange)),
        (helm(-1e300, 19.0, 3.0), None),
    ];
    for (helm, expected) in cases {
        assert_eq!(refused(&mut board, &helm), expected, "{helm:?}");
    }
    request_all(&mut board, &[ToBoard::MissionStop]);
    assert_eq!(refused(&mut board, &east), Some(Refusal::NotReady), "stopped");
}

#[test]
fn the_fence_ends_the_mission_whoever_steers() {
    let (mut world, mut board) = flying(&[MAY, ("safety.fence_radius_m", 3000.0)], 60);
    parameters(&mut board, &[("safety.fence_radius_m", 120.0)]);
    let mut seconds = 0;
    while last(&mut board).leg.is_some() {
        steer(&mut world, &mut board, 1, &helm(1.57, 3.0, 1.5));
        seconds += 1;
        assert!(seconds < 150, "{:?}", world.x);
        if shown(&mut board) != NOMINAL {
            break;
        }
    }
    assert!((115.0..135.0).contains(&libm::hypot(world.x[X], world.x[Y])), "{:?}", world.x);
    stopped(&mut world, &mut board, ModeReason::OutsideFence);
    assert_eq!(refused(&mut board, &helm(1.57, 3.0, 1.5)), Some(Refusal::NotReady));
}

/// Battery low: back to where the mission began, and nobody steers elsewhere.
#[test]
fn the_way_back_is_not_for_the_host() {
    let (mut world, mut board) = flying(&[MAY, ("app.power_rate_hz", 0.1)], 90);
    world.charge_percent = 9.0;
    while shown(&mut board) == NOMINAL {
        board.request(&helm(1.57, 3.0, 1.0));
        world.advance(&mut board);
    }
    assert_eq!(shown(&mut board), (Mode::Degraded, ModeReason::BatteryLow));
    assert_eq!(refused(&mut board, &helm(1.57, 3.0, 1.0)), Some(Refusal::NotReady));
    until_ended(&mut world, &mut board, 400, |_, _| {});
    let off_m = libm::hypot(world.x[X] + 30.0, world.x[Y] - 5.0);
    assert!(off_m < 8.0, "{off_m} m from where it began");
}

/// A position that is no longer certain: the leg, and a refusal.
#[test]
fn degraded_navigation_drops_it() {
    let (mut world, mut board) = flying(&[MAY], 60);
    steer(&mut world, &mut board, 30, &helm(0.5, 3.0, 1.0));
    parameters(&mut board, &[("app.degraded_sigma_m", 1.0)]);
    world.advance(&mut board);
    assert_eq!(shown(&mut board), (Mode::Degraded, ModeReason::PositionUncertain));
    assert_eq!(refused(&mut board, &helm(0.5, 3.0, 1.0)), Some(Refusal::NotReady));
    world.run(&mut board, 10);
    assert!(wrap_angle(world.x[PSI]) < 0.0, "back towards the line: {:?}", world.x);
}

/// Let go in the middle of a dive, and ordered up in the middle of another: there is time to turn.
#[test]
fn a_dive_that_is_broken_off_ends_no_mission() {
    for instead in [None, Some(helm(0.0, 3.0, 1.5))] {
        let (mut world, mut board) = flying(&[MAY], 60);
        while world.x[Z] < 14.0 {
            steer(&mut world, &mut board, 1, &helm(0.0, 40.0, 1.5));
            assert_eq!(shown(&mut board), NOMINAL, "{:?}", world.x);
        }
        match instead {
            Some(up) => steer(&mut world, &mut board, 90, &up),
            None => world.run(&mut board, 90),
        }
        assert_eq!(shown(&mut board), NOMINAL);
        assert!((world.x[Z] - 3.0).abs() < 0.3, "{} m deep", world.x[Z]);
    }
}

/// Water that sinks at 0.8 m/s under a vehicle that the host steers at 10 m.
#[test]
fn sinking_below_it_ends_the_mission() {
    let (mut world, mut board) = flying(&[MAY], 60);
    steer(&mut world, &mut board, 60, &helm(0.0, 10.0, 1.0));
    assert_eq!(shown(&mut board), NOMINAL);
    while last(&mut board).leg.is_some() {
        world.x[Z] += 0.08;
        board.request(&helm(0.0, 10.0, 1.0));
        world.advance(&mut board);
        assert!(world.x[Z] < 25.0, "{:?}", shown(&mut board));
    }
    stopped(&mut world, &mut board, ModeReason::TooDeep);
}

/// A leg of 90 m may take 150 s with a factor of one; while the host steers it does not count, and then from there.
#[test]
fn the_time_of_the_leg_is_not_the_hosts() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    parameters(&mut board, &[MAY, ("safety.leg_time_factor", 1.0)]);
    world.run(&mut board, 10);
    start_along(&mut board, &[Waypoint { x_m: 60.0, y_m: 5.0, depth_m: 3.0, speed_mps: 1.0 }]);
    world.run(&mut board, 10);
    steer(&mut world, &mut board, 200, &helm(3.1, 3.0, 1.0));
    until_ended(&mut world, &mut board, 400, |_, _| {});
    assert_eq!(shown(&mut board), NOMINAL);
    assert!(world.x[X] > 55.0, "{:?}", world.x);
}

#[test]
fn another_mission_knows_nothing_of_it() {
    let (mut world, mut board) = flying(&[MAY], 60);
    request_all(&mut board, &[helm(1.57, 3.0, 1.0), ToBoard::MissionStop]);
    world.advance(&mut board);
    start_along(&mut board, &LONG[1..]);
    world.run(&mut board, 2);
    assert!(last(&mut board).leg.is_some());
    assert!(wrap_angle(world.x[PSI]).abs() < 0.2, "{:?}", world.x);
}
