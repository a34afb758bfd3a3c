//! Parameters that are kept, and carrying on after a reset.

use crate::board::{Board, Direct, request_all};
use crate::faults::last;
use crate::flight::start;
use crate::world::{START_S, World};
use backseat_app::parameters::Settings;
use backseat_app::store::{Response, RestartRecord, coast_m};
use backseat_core::state::{X, Y, Z};
use backseat_wire::hostlink::{Crash, KeptCrash, Mode, ModeReason, Port, Refusal, ResetCause, Restart, ToBoard};

const STORE: ToBoard<'_> = ToBoard::ParameterStore;

#[test]
fn storing_is_answered_when_it_is_done() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    assert_eq!(board.answer(&STORE), Some(Err(Refusal::NoStore)));
    assert!(board.app_mut().restore(None));
    world.run(&mut board, 8);
    for (kept, answer) in [(true, Ok(())), (false, Err(Refusal::StoreFailed))] {
        assert_eq!(board.app().to_store(), None);
        assert_eq!(board.answer(&STORE), None);
        assert_eq!(board.app().to_store(), Some(&Settings::DEFAULT));
        assert_eq!(board.answer(&STORE), Some(Err(Refusal::NoStore)));
        board.app_mut().stored(kept);
        world.run(&mut board, 1);
        assert_eq!(board.heard().answers.pop(), Some(answer));
    }
}

#[test]
fn no_mission_while_storing_and_no_storing_while_a_mission_runs() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    board.app_mut().restore(None);
    world.run(&mut board, 8);
    start(&mut board);
    assert_eq!(board.answer(&STORE), Some(Err(Refusal::UnderWay)));
    world.run(&mut board, 2);
    assert!(board.app().is_under_way());
    assert_eq!(board.answer(&STORE), Some(Err(Refusal::UnderWay)));
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 1);
    assert_eq!(board.answer(&STORE), None);
    assert_eq!(board.answer(&ToBoard::MissionStart), Some(Err(Refusal::NotReady)));
    board.app_mut().stored(true);
    world.run(&mut board, 1);
    board.heard().answers.clear();
    assert_eq!(board.answer(&ToBoard::MissionStart), Some(Ok(())));
}

#[test]
fn a_stored_set_is_taken_up_and_one_that_does_not_fit_is_not() {
    let mut settings = Settings::DEFAULT;
    settings.app.installation.sound_speed_mps = 1480.0;
    let mut board = Direct::new(None);
    assert!(board.app_mut().restore(Some(&settings)));
    assert_eq!(board.answer(&STORE), None);
    assert_eq!(board.app().to_store(), Some(&settings));

    // in range one by one, but the vehicle does not reach the cruise speed
    settings.vehicle.omega_max_radps = 1.0;
    settings.control.cruise_speed_mps = 3.0;
    let mut board = Direct::new(None);
    assert!(!board.app_mut().restore(Some(&settings)));
    assert_eq!(board.answer(&STORE), None);
    assert_eq!(board.app().to_store(), Some(&Settings::DEFAULT));
}

/// A board in the same world that was reset by its watchdog while it flew.
fn reset(board: &Direct, record: RestartRecord) -> (Direct, Response) {
    let record = board.app().restart_record(&record, 20_000_000);
    let bytes = record.encode();
    let found = RestartRecord::decode(&bytes).expect("intact");
    assert_eq!(found, record);
    let (response, next) = RestartRecord::respond(ResetCause::Watchdog, Some(&found));
    let mut board = Direct::new(None);
    board.app_mut().resume(next.report(ResetCause::Watchdog, None), &response);
    (board, response)
}

#[test]
fn after_a_watchdog_reset_it_stops_and_navigates_on_as_degraded() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    start(&mut board);
    world.run(&mut board, 30);
    let before = last(&mut board);
    assert!(before.leg.is_some());
    let record = board.app().restart_record(&RestartRecord::default(), 20_000_000);
    let (response, _) = RestartRecord::respond(ResetCause::Pin, Some(&record));
    assert!(matches!(response, Response::Resume { .. }), "under way nobody presses the button: {response:?}");

    let (_, response) = reset(&board, RestartRecord::default());
    let Response::Resume { navigation: Some(navigation), utc_us: Some(utc_us) } = response else {
        panic!("{response:?}")
    };
    assert_eq!(navigation.position_m, [before.state[X], before.state[Y]]);
    assert_eq!(utc_us, before.utc_us + 750_000);
    // the board's time begins anew; the world's UTC would begin anew as well
    let response = Response::Resume { navigation: Some(navigation), utc_us: Some(START_S * 1_000_000 + 200_000) };
    let mut board = Direct::new(None);
    board.app_mut().resume(Restart { cause: ResetCause::Watchdog, resets: 1, safe: false, crash: None }, &response);
    let x = world.x;
    let mut world = World::new();
    world.x = x;
    world.advance(&mut board);
    assert_eq!(world.stops, 1, "the frontseat is told to stop at once");
    assert!(world.x[Z] > 1.0, "under water there is no fix");
    world.run(&mut board, 3);
    let after = last(&mut board);
    assert_eq!((after.mode, after.reason), (Mode::Degraded, ModeReason::Restarted));
    assert_eq!(after.leg, None);
    let error_m = world.error_m(&after);
    let sigma_m = libm::hypot(after.sigma[X], after.sigma[Y]);
    assert!(sigma_m > before.sigma[X] && error_m < 3.0 * sigma_m, "{error_m} m of {sigma_m} m");
    assert_eq!(board.heard().restarts, [Restart { cause: ResetCause::Watchdog, resets: 1, safe: false, crash: None }]);
    board.request(&ToBoard::Hello);
    assert_eq!(board.heard().restarts.len(), 2);
    // a range confirms the position
    world.run(&mut board, 25);
    assert_eq!(last(&mut board).reason, ModeReason::Nominal);
}

#[test]
fn a_second_reset_before_the_sensors_speak_keeps_the_position() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    let (mut board, first) = reset(&board, RestartRecord::default());
    world.silent = [true; 4];
    world.run(&mut board, 4);
    assert_eq!(last(&mut board).mode, Mode::Initialising);
    let (_, second) = reset(&board, RestartRecord::default());
    let at = |response| match response {
        Response::Resume { navigation: Some(navigation), .. } => navigation,
        other => panic!("{other:?}"),
    };
    let (first, second) = (at(first), at(second));
    // it coasted on until the world's twelfth second, which is the board's time too
    assert_eq!(second.position_m, first.coasted(12_000_000, coast_m(&Settings::DEFAULT.vehicle)).position_m);
    assert!(second.sigma_m >= first.sigma_m);
}

#[test]
fn earlier_crashes_are_told_at_start_and_to_whoever_asks() {
    let mut board = Direct::new(None);
    let crashes = [1, 2].map(|pc| KeptCrash { crash: Crash { pc, ..Crash::default() }, overwritten: 0 });
    board.app_mut().earlier_crashes(&crashes);
    let restart = Restart { cause: ResetCause::Fault, resets: 3, safe: false, crash: Some(Crash::at("main.rs", 3)) };
    board.app_mut().resume(restart, &Response::Fresh);
    board.request(&ToBoard::Hello);
    let heard = board.heard();
    assert_eq!((&heard.restarts[..], &heard.earlier_crashes[..]), (&[restart; 2][..], &[crashes; 2].concat()[..]));
}

#[test]
fn too_many_resets_end_in_safe_mode_until_the_operator_starts_again() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    let restart = Restart { cause: ResetCause::Fault, resets: 3, safe: true, crash: None };
    board.app_mut().resume(restart, &Response::Safe);
    world.run(&mut board, 8);
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason), (Mode::Safe, ModeReason::Resets));
    assert!(world.stops > 0);
    assert_eq!(board.app().waiting(Port::Frontseat), 0);
    // a start alone does not brush the resets aside: the operator's stop says that they are known
    request_all(&mut board, &[ToBoard::MissionBegin { count: 1 }]);
    assert!(board.answer(&ToBoard::MissionStart).unwrap().is_err());
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 1);
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason), (Mode::Safe, ModeReason::Stopped));
    start(&mut board);
    world.run(&mut board, 1);
    assert_eq!(last(&mut board).mode, Mode::Navigating);
}

#[test]
fn too_many_resets_by_the_watchdog_leave_navigation_out_until_the_operator_stops() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    let restart = Restart { cause: ResetCause::Watchdog, resets: 3, safe: true, crash: None };
    board.app_mut().resume(restart, &Response::Safe);
    let untouched = board.app().digest();
    world.run(&mut board, 8);
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason), (Mode::Safe, ModeReason::Overloaded));
    assert!(world.stops > 0);
    assert_eq!(board.app().digest(), untouched, "the filter has moved");
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 4);
    start(&mut board);
    world.run(&mut board, 1);
    assert_eq!(last(&mut board).mode, Mode::Navigating);
}
