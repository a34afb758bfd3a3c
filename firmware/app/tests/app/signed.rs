//! What a host without the key may do to a board that has one: ask, and nothing else.

use crate::board::{Board, Direct, Pumped, request_all};
use crate::faults::last;
use crate::flight::WAYPOINTS;
use crate::world::World;
use backseat_app::parameters::Settings;
use backseat_wire::hostlink::{MAX_MESSAGE, Refusal, Signed, Step, ToBoard, Waypoint};
use backseat_wire::ship_state::Key;

const KEY: Key = Key::new(*b"\x21\x5f\x0e\x33\xd4\x77\xa2\x68\x1c\xe9\x4b\x86\xf0\x2d\x53\xba");
const OTHER: Key = Key::new([7; 16]);
const CHALLENGE: u64 = 0x1234_5678_9ABC_DEF0;
const WAYPOINT: Waypoint = Waypoint { x_m: 900.0, y_m: 0.0, depth_m: 40.0, speed_mps: 1.0 };

/// Everything that a host may ask for that is more than a question.
fn demands() -> Vec<ToBoard<'static>> {
    vec![
        ToBoard::ParameterBegin,
        ToBoard::ParameterSet { name: "installation.sound_speed_mps", value: 1400.0 },
        ToBoard::ParameterCommit,
        ToBoard::MissionBegin { count: 1 },
        ToBoard::MissionItem { index: 0, waypoint: WAYPOINT },
        ToBoard::FenceCorner { index: 0, count: 3, corner_m: [0.0; 2] },
        ToBoard::MissionCommit,
        ToBoard::MissionStart,
        ToBoard::MissionStop,
        ToBoard::Helm { heading_rad: 0.0, depth_m: 3.0, speed_mps: 1.0 },
        ToBoard::ParameterStore,
        ToBoard::FinWiggle,
        ToBoard::Unlock,
        ToBoard::KeySet(OTHER),
        ToBoard::Step(Step {
            time_us: 0,
            pps_us: Default::default(),
            chunks: Default::default(),
            fittings: Default::default(),
        }),
    ]
}

/// Sends a request signed like this; the board's answer, if it is one that says yes or no.
fn signed(
    board: &mut dyn Board,
    request: &ToBoard<'_>,
    key: Key,
    challenge: u64,
    counter: u64,
) -> Option<Result<(), Refusal>> {
    let mut buffer = [0; MAX_MESSAGE];
    let signed = Signed::new(request, &key, challenge, counter, &mut buffer).unwrap();
    board.answer(&ToBoard::Signed(signed))
}

/// A board at rest with the key, and its world.
fn paired() -> (World, Direct) {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    board.app_mut().set_challenge(CHALLENGE);
    request_all(&mut board, &[ToBoard::KeyBegin, ToBoard::KeySet(KEY)]);
    world.run(&mut board, 8);
    (world, board)
}

/// How an operator starts a mission.
fn mission() -> Vec<ToBoard<'static>> {
    let items = (0..).zip(WAYPOINTS).map(|(index, waypoint)| ToBoard::MissionItem { index, waypoint });
    let begin = ToBoard::MissionBegin { count: WAYPOINTS.len() as u16 };
    [begin].into_iter().chain(items).chain([ToBoard::MissionCommit, ToBoard::MissionStart]).collect()
}

/// The same under way: the requests of [`mission`] had the first counters.
fn paired_under_way() -> (World, Direct) {
    let (mut world, mut board) = paired();
    world.key = KEY;
    let mission = mission();
    for (counter, request) in (1..).zip(&mission) {
        assert_eq!(signed(&mut board, request, KEY, CHALLENGE, counter), Some(Ok(())), "{request:?}");
    }
    world.run(&mut board, 10);
    assert!(last(&mut board).leg.is_some());
    (world, board)
}

fn settings(board: &Direct) -> Settings {
    *board.app().parameters()
}

#[test]
fn without_the_key_nothing_changes() {
    let (mut world, mut board) = paired_under_way();
    let before = settings(&board);
    let mut refused = 0;
    for demand in demands() {
        assert!(demand.changes_a_flight(), "{demand:?}");
        assert_eq!(board.answer(&demand), Some(Err(Refusal::Unsigned)), "{demand:?}");
        // a key that is not the board's, and a code that is a guess
        assert_eq!(signed(&mut board, &demand, OTHER, CHALLENGE, 1000), Some(Err(Refusal::Forged)), "{demand:?}");
        let guess = Signed { counter: 1000, code: 0, request: &[8] };
        assert_eq!(board.answer(&ToBoard::Signed(guess)), Some(Err(Refusal::Forged)));
        refused += 3;
        world.run(&mut board, 1);
        assert!(last(&mut board).leg.is_some(), "{demand:?}");
    }
    assert!(settings(&board) == before && board.app().is_under_way());
    assert_eq!(board.heard().health.unwrap().refused_requests, refused, "counted, and told after the next step");
}

#[test]
fn questions_are_answered_to_everybody() {
    let (_, mut board) = paired();
    for question in [ToBoard::Hello, ToBoard::HealthGet, ToBoard::ParameterGet { index: 0 }, ToBoard::ChallengeGet] {
        assert!(!question.changes_a_flight());
        board.request(&question);
    }
    board.request(&ToBoard::KeyBegin);
    let heard = board.heard();
    assert_eq!((heard.health.map(|health| health.refused_requests), heard.parameters.len()), (Some(0), 1));
    assert_eq!((heard.challenges.as_slice(), heard.keys.last()), (&[(CHALLENGE, 0)][..], Some(&true)));
    // but the question for the key keeps nothing off the board's log: only its owner may send a key
    assert_eq!(signed(&mut board, &ToBoard::KeySet(OTHER), KEY, CHALLENGE, 1), Some(Err(Refusal::Sequence)));
}

#[test]
fn what_was_recorded_is_not_taken_again() {
    let (mut world, mut board) = paired_under_way();
    let stop = |board: &mut Direct, challenge, counter| signed(board, &ToBoard::MissionStop, KEY, challenge, counter);
    // of another start of the board; of this start, but before the last
    assert_eq!(stop(&mut board, CHALLENGE + 1, 9), Some(Err(Refusal::Forged)));
    let started = mission().len() as u64;
    assert_eq!(stop(&mut board, CHALLENGE, started - 1), Some(Err(Refusal::Forged)));
    let again = signed(&mut board, &ToBoard::MissionStart, KEY, CHALLENGE, started);
    assert_eq!(again, Some(Err(Refusal::Forged)), "twice the same");
    world.run(&mut board, 1);
    assert!(last(&mut board).leg.is_some());
    assert_eq!(stop(&mut board, CHALLENGE, started + 1), Some(Ok(())));
    // a simulator's time zero restarts the app, not the count
    board.app_mut().restart();
    assert_eq!(stop(&mut board, CHALLENGE, started + 1), Some(Err(Refusal::Forged)));
    assert_eq!(stop(&mut board, CHALLENGE, started + 2), Some(Ok(())));
}

#[test]
fn another_key_needs_the_old_one() {
    let (_, mut board) = paired();
    assert_eq!(signed(&mut board, &ToBoard::KeyBegin, KEY, CHALLENGE, 1), Some(Ok(())));
    assert_eq!(signed(&mut board, &ToBoard::KeySet(OTHER), OTHER, CHALLENGE, 2), Some(Err(Refusal::Forged)));
    assert_eq!(signed(&mut board, &ToBoard::KeySet(OTHER), KEY, CHALLENGE, 2), Some(Ok(())));
    assert_eq!(signed(&mut board, &ToBoard::Unlock, KEY, CHALLENGE, 3), Some(Err(Refusal::Forged)));
    assert_eq!(signed(&mut board, &ToBoard::Unlock, OTHER, CHALLENGE, 3), Some(Ok(())));
    // and back to none: then nobody has to sign
    request_key(&mut board, Key::NONE, OTHER, 4);
    request_all(&mut board, &[ToBoard::Unlock]);
}

fn request_key(board: &mut Direct, key: Key, old: Key, counter: u64) {
    assert_eq!(signed(board, &ToBoard::KeyBegin, old, CHALLENGE, counter), Some(Ok(())));
    assert_eq!(signed(board, &ToBoard::KeySet(key), old, CHALLENGE, counter + 1), Some(Ok(())));
}

/// At rest a host could take the clock, and with it what the board takes for now and for the second of the pulse.
#[test]
fn the_clock_is_lent_to_whoever_has_the_key() {
    let mut board = Pumped::new();
    board.run(0);
    request_all(&mut board, &[ToBoard::KeyBegin, ToBoard::KeySet(KEY)]);
    let step = |time_us| {
        ToBoard::Step(Step {
            time_us,
            pps_us: Default::default(),
            chunks: Default::default(),
            fittings: Default::default(),
        })
    };
    assert_eq!(board.answer(&step(0)), Some(Err(Refusal::Unsigned)));
    assert!(!board.pump.is_lockstep());
    signed(&mut board, &step(0), KEY, 0, 1);
    assert!(board.pump.is_lockstep());
    assert_eq!(board.answer(&step(100_000)), Some(Err(Refusal::Unsigned)), "and each step");
    signed(&mut board, &step(100_000), KEY, 0, 2);
    assert_eq!(board.heard().done.last().map(|done| done.time_us), Some(100_000));
}

/// A request in a request in a request: refused, whoever signed it.
#[test]
fn a_signed_request_holds_no_other() {
    let (_, mut board) = paired();
    let mut buffer = [0; MAX_MESSAGE];
    let inner = Signed::new(&ToBoard::Unlock, &KEY, CHALLENGE, 9, &mut buffer).unwrap();
    let nested = ToBoard::Signed(inner);
    assert_eq!(signed(&mut board, &nested, KEY, CHALLENGE, 10), Some(Err(Refusal::Forged)));
}
