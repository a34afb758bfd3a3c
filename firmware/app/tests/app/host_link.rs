//! Parameters, mission and telemetry over the host link.

use crate::board::{Board, Direct, request_all};
use crate::flight::{WAYPOINTS, start};
use crate::world::World;
use backseat_app::parameters::PARAMETERS;
use backseat_core::parameters::Inconsistent;
use backseat_wire::hostlink::{BoardLog, LogState, ModeReason, Port, Refusal, ToBoard, Waypoint};

fn ask(board: &mut Direct, message: &ToBoard<'_>) -> Result<(), Refusal> {
    board.answer(message).expect("an answer")
}

fn value_of(board: &mut Direct, name: &str) -> f64 {
    let index = PARAMETERS.iter().position(|parameter| parameter.name == name).expect("declared");
    board.request(&ToBoard::ParameterGet { index: index as u16 });
    let (found, value) = board.heard().parameters.pop().expect("a parameter");
    assert_eq!(found, name);
    value
}

#[test]
fn a_parameter_transaction_is_all_or_nothing() {
    let mut board = Direct::new(None);
    let set = |name, value| ToBoard::ParameterSet { name, value };
    assert_eq!(ask(&mut board, &ToBoard::Hello), Ok(()));
    assert_eq!(ask(&mut board, &set("vehicle.mass_kg", 39.0)), Err(Refusal::Sequence));
    request_all(&mut board, &[ToBoard::ParameterBegin, set("vehicle.mass_kg", 39.0)]);
    assert_eq!(ask(&mut board, &set("vehicle.weight_kg", 39.0)), Err(Refusal::UnknownParameter));
    assert_eq!(ask(&mut board, &set("fins.cd[0]", -0.1)), Err(Refusal::OutOfRange));
    assert_eq!(ask(&mut board, &set("sensors.range_m", f64::NAN)), Err(Refusal::OutOfRange));
    assert_eq!(value_of(&mut board, "vehicle.mass_kg"), 38.0);
    // the transfer breaks here; the next one starts from what is active
    request_all(&mut board, &[ToBoard::ParameterBegin, set("fins.cp_m[0][2]", -0.14), ToBoard::ParameterCommit]);
    assert_eq!(value_of(&mut board, "vehicle.mass_kg"), 38.0);
    assert_eq!(value_of(&mut board, "fins.cp_m[0][2]"), -0.14);
    assert_eq!(ask(&mut board, &ToBoard::ParameterCommit), Err(Refusal::Sequence));
    // in range one by one, but the vehicle does not reach the cruise speed
    request_all(
        &mut board,
        &[ToBoard::ParameterBegin, set("propeller.omega_max_radps", 50.0), set("app.cruise_speed_mps", 3.0)],
    );
    let refused = ask(&mut board, &ToBoard::ParameterCommit);
    let Err(Refusal::Inconsistent { rule }) = refused else { panic!("{refused:?}") };
    assert!(Inconsistent::of_rule(rule).unwrap().parameters().contains(&"app.cruise_speed_mps"));
    assert_eq!(value_of(&mut board, "propeller.omega_max_radps"), 200.0);
    assert_eq!(
        board.answer(&ToBoard::ParameterGet { index: PARAMETERS.len() as u16 }),
        Some(Err(Refusal::UnknownParameter))
    );
}

#[test]
fn under_way_only_live_parameters_change_and_the_mission_stays() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    start(&mut board);
    world.run(&mut board, 5);
    let set = |name, value| ToBoard::ParameterSet { name, value };
    let live = set("installation.sound_speed_mps", 1501.0);
    let locked = |board: &mut Direct| {
        for message in [&ToBoard::ParameterBegin, &live, &ToBoard::ParameterCommit] {
            assert_eq!(ask(board, message), Err(Refusal::Locked));
        }
    };
    locked(&mut board);
    request_all(&mut board, &[ToBoard::Unlock, ToBoard::ParameterBegin]);
    assert_eq!(ask(&mut board, &set("vehicle.mass_kg", 39.0)), Err(Refusal::UnderWay));
    request_all(&mut board, &[live.clone(), ToBoard::ParameterCommit, ToBoard::ParameterBegin, live.clone()]);
    // a minute later it is locked again, whatever was begun
    world.run(&mut board, 60);
    locked(&mut board);
    assert_eq!(value_of(&mut board, "installation.sound_speed_mps"), 1501.0);
    request_all(&mut board, &[ToBoard::MissionBegin { count: 1 }]);
    request_all(&mut board, &[ToBoard::MissionItem { index: 0, waypoint: WAYPOINTS[2] }]);
    assert_eq!(ask(&mut board, &ToBoard::MissionCommit), Err(Refusal::UnderWay));
    assert_eq!(ask(&mut board, &ToBoard::MissionStart), Err(Refusal::UnderWay));
    world.run(&mut board, 5);
    assert!(board.heard().telemetry.last().unwrap().leg.is_some());
}

#[test]
fn the_mission_is_read_back() {
    let mut board = Direct::new(None);
    assert_eq!(ask(&mut board, &ToBoard::MissionStart), Err(Refusal::Sequence));
    board.request(&ToBoard::MissionGet { index: 0 });
    assert_eq!(board.heard().waypoints.pop(), Some(None));
    start(&mut board);
    for (index, waypoint) in (0..).zip(WAYPOINTS) {
        board.request(&ToBoard::MissionGet { index });
        assert_eq!(board.heard().waypoints.pop(), Some(Some(waypoint)));
    }
    request_all(&mut board, &[ToBoard::MissionBegin { count: 2 }]);
    let bad = Waypoint { speed_mps: -1.0, ..WAYPOINTS[0] };
    assert_eq!(ask(&mut board, &ToBoard::MissionItem { index: 0, waypoint: bad }), Err(Refusal::OutOfRange));
    assert_eq!(ask(&mut board, &ToBoard::MissionCommit), Err(Refusal::UnderWay), "it is armed");
    board.request(&ToBoard::MissionGet { index: 3 });
    assert_eq!(board.heard().waypoints.pop(), Some(Some(WAYPOINTS[3])));
}

#[test]
fn telemetry_fits_the_line() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    start(&mut board);
    let before = board.host_bytes;
    world.run(&mut board, 30);
    let per_step = (board.host_bytes - before) / 300;
    // 115200 baud carries 1152 bytes in a step
    assert!(per_step < 800, "{per_step} bytes a step");
}

#[test]
fn the_counters_tell_what_came_in() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 12);
    board.request(&ToBoard::HealthGet);
    let health = board.heard().health.take().expect("counters");
    let [frontseat, dvl, ahrs, modem] = health.accepted_frames;
    // 7 Hz compass and more; no DVL; 10 Hz AHRS; its four settings at least
    assert!(frontseat > 70 && dvl == 0 && ahrs > 100 && modem >= 4, "{health:?}");
    assert_eq!(health.rejected_frames, [0; 4]);
    assert!((11..=13).contains(&health.pps_edges) && health.synchronised, "{health:?}");
    assert_eq!(health.receive_losses, [0; 5]);
}

/// However full of reports the ring is.
#[test]
fn who_asks_is_answered_however_long_nobody_has_read() {
    for unread in 20..80 {
        let mut board = Direct::new(None);
        for step in 1..=unread {
            board.app_mut().step(100_000 * step);
        }
        board.request(&ToBoard::HealthGet);
        assert!(board.heard().health.take().is_some(), "after {unread} steps");
        assert_eq!(ask(&mut board, &ToBoard::Hello), Ok(()), "after {unread} steps");
    }
}

/// Six tenths of a second without a step: it came half a second late.
#[test]
fn steps_that_come_late_are_counted() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 2);
    let now_us = board.app_mut().stepped_us().expect("a step");
    for step_us in [now_us + 199_999, now_us + 799_999, now_us + 899_999] {
        board.app_mut().step(step_us);
    }
    board.request(&ToBoard::HealthGet);
    let health = board.heard().health.take().expect("counters");
    assert_eq!((health.late_steps, health.latest_step_us), (1, 500_000));
}

#[test]
fn what_drivers_lose_is_reported_once_and_unasked() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 1);
    assert_eq!(board.heard().health, None);
    board.app_mut().receive_losses(Port::Ahrs, 3);
    board.app_mut().receive_losses(Port::Host, u32::MAX);
    world.advance(&mut board);
    let health = board.heard().health.take().expect("counters");
    assert_eq!(health.receive_losses, [0, 0, 3, 0, u32::MAX]);
    // a driver says what it counted whenever it is asked
    board.app_mut().receive_losses(Port::Ahrs, 3);
    world.run(&mut board, 1);
    assert_eq!(board.heard().health, None);
    let log = BoardLog { state: LogState::Failed, lost_records: 7 };
    board.app_mut().board_log(log);
    world.advance(&mut board);
    assert_eq!(board.heard().health.take().expect("counters").log, log);
    board.app_mut().board_log(log);
    world.run(&mut board, 1);
    assert_eq!(board.heard().health, None);
    // they are the board's since power-up, not the app's since a restart
    board.app_mut().restart();
    board.request(&ToBoard::HealthGet);
    assert_eq!(board.heard().health.take().expect("counters").receive_losses, [0, 0, 3, 0, u32::MAX]);
}

#[test]
fn the_fins_are_shown_with_the_propeller_stopped_and_come_to_rest() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    assert_eq!(ask(&mut board, &ToBoard::FinWiggle), Ok(()));
    let (servos, stops) = (world.servos, world.stops);
    let mut moved = [[false; 2]; 4];
    for _ in 0..60 {
        world.advance(&mut board);
        assert_eq!(world.input.propeller_radps, 0.0);
        for (moved, angle_rad) in moved.iter_mut().zip(world.input.fins_rad) {
            // half a degree: a step of the servo byte
            moved[0] |= (angle_rad - 0.15).abs() < 0.01;
            moved[1] |= (angle_rad + 0.15).abs() < 0.01;
        }
    }
    assert_eq!(moved, [[true; 2]; 4]);
    // forty steps of it, and neutral once; handed back
    assert_eq!((world.servos - servos, world.stops - stops), (41, 1));
    assert_eq!(world.input.fins_rad, [0.0; 4]);
    start(&mut board);
    assert_eq!(ask(&mut board, &ToBoard::FinWiggle), Err(Refusal::UnderWay));
    world.run(&mut board, 2);
    assert_eq!(ask(&mut board, &ToBoard::FinWiggle), Err(Refusal::UnderWay));
    assert!(world.input.propeller_radps > 0.0);
}

#[test]
fn a_stop_ends_the_wiggle_and_a_mission_waits_for_its_end() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    start(&mut board);
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 1);
    request_all(&mut board, &[ToBoard::FinWiggle]);
    world.run(&mut board, 1);
    assert!(world.input.fins_rad != [0.0; 4]);
    assert_eq!(ask(&mut board, &ToBoard::MissionStart), Err(Refusal::NotReady));
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 1);
    assert_eq!(world.input.fins_rad, [0.0; 4]);
    request_all(&mut board, &[ToBoard::MissionStart]);
}

#[test]
fn a_stop_does_not_end_the_mission_that_is_started_behind_it() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    start(&mut board);
    world.run(&mut board, 1);
    request_all(&mut board, &[ToBoard::MissionStop, ToBoard::MissionStart]);
    world.run(&mut board, 2);
    assert!(board.heard().telemetry.last().unwrap().leg.is_some());
    assert!(world.input.propeller_radps > 0.0);
}

/// Whatever unlocks, whenever it was staged: under way a limit of safety becomes stricter or stays.
#[test]
fn under_way_a_safety_limit_only_becomes_stricter() {
    let set = |name, value| ToBoard::ParameterSet { name, value };
    let limits =
        [("safety.depth_max_m", 50.0, 200.0), ("safety.altitude_min_m", 3.0, 0.0), ("app.lost_sigma_m", 100.0, 400.0)];
    // staged at rest, committed under way
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    request_all(&mut board, &[ToBoard::ParameterBegin, set("safety.depth_max_m", 200.0)]);
    start(&mut board);
    assert_eq!(ask(&mut board, &ToBoard::Unlock), Ok(()));
    assert_eq!(ask(&mut board, &ToBoard::ParameterCommit), Err(Refusal::Relaxes));
    request_all(&mut board, &[ToBoard::MissionStop, ToBoard::ParameterBegin, set("vehicle.mass_kg", 39.0)]);
    world.run(&mut board, 1);
    request_all(&mut board, &[ToBoard::MissionStart, ToBoard::Unlock]);
    assert_eq!(ask(&mut board, &ToBoard::ParameterCommit), Err(Refusal::UnderWay));
    world.run(&mut board, 5);
    assert!(board.heard().telemetry.last().unwrap().leg.is_some());
    for (name, strict, lax) in limits {
        let before = value_of(&mut board, name);
        request_all(&mut board, &[ToBoard::Unlock, ToBoard::ParameterBegin]);
        assert_eq!(ask(&mut board, &set(name, lax)), Err(Refusal::Relaxes), "{name}");
        assert_eq!(value_of(&mut board, name), before);
        request_all(&mut board, &[set(name, strict), ToBoard::ParameterCommit]);
        assert_eq!(value_of(&mut board, name), strict);
    }
    request_all(&mut board, &[ToBoard::MissionStop, ToBoard::ParameterBegin]);
    for (name, _, lax) in limits {
        request_all(&mut board, &[set(name, lax)]);
    }
    request_all(&mut board, &[ToBoard::ParameterCommit]);
}

/// The mission before is never flown in the place of one that was refused, or that did not arrive.
#[test]
fn after_a_refused_mission_there_is_none() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    let deep = Waypoint { depth_m: 99.5, ..WAYPOINTS[1] };
    let bad = Waypoint { speed_mps: -1.0, ..WAYPOINTS[1] };
    let item = |index, waypoint| ToBoard::MissionItem { index, waypoint };
    for (messages, refusal) in [
        (vec![item(0, bad)], Refusal::OutOfRange),
        (vec![item(0, WAYPOINTS[0]), ToBoard::MissionCommit], Refusal::Sequence),
        (vec![item(0, WAYPOINTS[0]), item(1, deep), ToBoard::MissionCommit], Refusal::Unsafe(ModeReason::TooDeep)),
        (vec![item(0, WAYPOINTS[0])], Refusal::Sequence),
    ] {
        start(&mut board);
        request_all(&mut board, &[ToBoard::MissionStop, ToBoard::MissionBegin { count: 2 }]);
        let answers: Vec<_> = messages.iter().map(|message| ask(&mut board, message)).collect();
        assert!(answers.last().is_none_or(|answer| *answer == Ok(()) || *answer == Err(refusal)), "{answers:?}");
        assert_eq!(ask(&mut board, &ToBoard::MissionStart), Err(refusal));
        board.request(&ToBoard::MissionGet { index: 0 });
        assert_eq!(board.heard().waypoints.pop(), Some(None));
        world.run(&mut board, 1);
        assert!(board.heard().telemetry.last().unwrap().leg.is_none());
    }
    start(&mut board);
}
