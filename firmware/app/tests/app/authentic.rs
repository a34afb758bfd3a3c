//! What the acoustic side may do, and the key: packets are authenticated, repetitions refused, and nothing reads the
//! key back.

use crate::board::{Arrival, Board, Direct, Random, request_all};
use crate::faults::{hear, last, under_way};
use crate::flight::start;
use crate::world::{SHIP_STATE, START_S, World, frame, modem, received, statistics};
use backseat_app::Loss;
use backseat_app::parameters::PARAMETERS;
use backseat_wire::Error;
use backseat_wire::abort::{Abort, EVERYBODY};
use backseat_wire::hostlink::{Mode, ModeReason, Port, Refusal, ToBoard};
use backseat_wire::modem::{ClockMode, FromModem};
use backseat_wire::ship_state::{AUTHENTIC_LENGTH, Key, LENGTH, ShipState};

const KEY: [u8; 16] = *b"\x91\x5f\x0e\x33\xd4\x77\xa2\x68\x1c\xe9\x4b\x86\xf0\x2d\x53\xba";

fn provision(board: &mut dyn Board, key: [u8; 16]) {
    request_all(board, &[ToBoard::KeyBegin, ToBoard::KeySet(Key::new(key))]);
}

/// Where the ship is and the second at which it says so.
fn ship_at(ship_m: [f64; 2], second: u64) -> ShipState {
    let (lat_deg, lon_deg) = frame().to_geodetic(ship_m);
    ShipState { transmit_s: (START_S + second) as u32, position_deg: [lat_deg, lon_deg], ..SHIP_STATE }
}

/// Sentences of a packet whose payload arrived at `toa_us`.
fn packet(payload: &[u8], toa_us: u64) -> Vec<Vec<u8>> {
    vec![modem(&FromModem::ReceiveBegins { psk: false }), received(payload), statistics(toa_us, ClockMode(3))]
}

/// How many ranges were heard, whatever became of them.
fn ranges(board: &mut Direct) -> usize {
    board.heard().fusions.iter().filter(|fusion| fusion.sensor == 7).count()
}

/// Sends one payload as a packet of the present second and says whether it gave a range.
fn gives_range(world: &mut World, board: &mut Direct, payload: impl Fn(ShipState) -> Vec<u8>) -> bool {
    world.run(board, 20);
    let now_us = last(board).time_us;
    let before = ranges(board);
    let bytes = payload(ship_at([150.0, 0.0], now_us / 1_000_000));
    hear(world, board, &packet(&bytes, now_us / 1_000_000 * 1_000_000 + 350_000));
    world.run(board, 12);
    ranges(board) > before
}

#[test]
fn with_a_key_only_authentic_packets_give_ranges() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.silent[Port::Modem as usize] = true;
    world.run(&mut board, 8);
    let key = Key::new(KEY);
    assert!(gives_range(&mut world, &mut board, |ship| ship.emit().unwrap().to_vec()), "off by default");
    assert!(
        gives_range(&mut world, &mut board, |ship| ship.emit_authentic(&key).unwrap().to_vec()),
        "no key: no check"
    );
    provision(&mut board, KEY);
    assert!(gives_range(&mut world, &mut board, |ship| ship.emit_authentic(&key).unwrap().to_vec()));
    let forged = |board: &Direct| board.app().health().rejected_for(Port::Modem, Error::Forged);
    let mut expected = forged(&board);
    let wrong = Key::new([7; 16]);
    let forgeries: [&dyn Fn(ShipState) -> Vec<u8>; 5] = [
        &|ship| ship.emit().unwrap().to_vec(),
        &|ship| ship.emit_authentic(&wrong).unwrap().to_vec(),
        // truncated: the code is cut off
        &|ship| ship.emit_authentic(&key).unwrap()[..AUTHENTIC_LENGTH - 1].to_vec(),
        // the code of another payload
        &|ship| {
            let mut whole = ship.emit_authentic(&key).unwrap();
            let other = ShipState { sequence: 9, ..ship }.emit_authentic(&key).unwrap();
            whole[LENGTH..].copy_from_slice(&other[LENGTH..]);
            whole.to_vec()
        },
        // a version that has no code
        &|ship| {
            let mut whole = ship.emit_authentic(&key).unwrap();
            whole[..LENGTH].copy_from_slice(&ship.emit().unwrap());
            whole.to_vec()
        },
    ];
    for (case, forgery) in forgeries.into_iter().enumerate() {
        assert!(!gives_range(&mut world, &mut board, forgery), "case {case}");
        expected += 1;
        assert_eq!(forged(&board), expected, "case {case}");
    }
    provision(&mut board, [0; 16]);
    assert!(gives_range(&mut world, &mut board, |ship| ship.emit().unwrap().to_vec()), "and off again");
}

#[test]
fn what_was_recorded_cannot_be_played_again() {
    let (mut world, mut board) = under_way();
    let key = Key::new(KEY);
    let second = last(&mut board).time_us / 1_000_000;
    let old = ship_at([30.0, 0.0], second - 1).emit_authentic(&key).unwrap();
    let new = ship_at([30.0, 0.0], second).emit_authentic(&key).unwrap();
    hear(&mut world, &mut board, &packet(&new, second * 1_000_000 + 350_000));
    let lost = |board: &Direct, loss| board.app().health().lost_packets(loss);
    // At once: the same second, and one before it.
    for replayed in [&new, &old] {
        let before = lost(&board, Loss::Repeated);
        hear(&mut world, &mut board, &packet(replayed, second * 1_000_000 + 400_000));
        assert_eq!(lost(&board, Loss::Repeated), before + 1);
    }
    // Later: its transmit second does not fit the board's clock. That needs no memory, so that no reset helps.
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.silent[Port::Modem as usize] = true;
    world.run(&mut board, second + 20);
    let now_us = last(&mut board).time_us;
    hear(&mut world, &mut board, &packet(&new, now_us + 350_000));
    assert_eq!((lost(&board, Loss::Absurd), lost(&board, Loss::Repeated)), (1, 0));
}

#[test]
fn a_ship_whose_clock_is_set_back_is_heard_again() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.silent[Port::Modem as usize] = true;
    world.run(&mut board, 8);
    assert!(gives_range(&mut world, &mut board, |ship| ship.emit().unwrap().to_vec()));
    // the sequence number is the transmit second, and starts anew with it
    assert!(gives_range(&mut world, &mut board, |ship| {
        ShipState { sequence: ship.sequence.wrapping_sub(1), ..ship }.emit().unwrap().to_vec()
    }));
}

/// Whatever frame arrives, it is a ship state or nothing: no parameter, no mission, no command, no mode changes by it.
#[test]
fn from_the_acoustic_side_only_ship_states_come() {
    let (mut world, mut board) = under_way();
    world.run(&mut board, 5);
    let settings = *board.app().parameters();
    let (answers, mut random) = (board.heard().answers.len(), Random(11));
    for round in 0..400_usize {
        let mut bytes: Vec<u8> = (0..round % 64).map(|_| random.word() as u8).collect();
        // every value of the first byte, which says what it is
        if let Some(first) = bytes.first_mut() {
            *first = round as u8;
        }
        let time_us = last(&mut board).time_us + 1000;
        let sentences = packet(&bytes, time_us);
        let arrival = Arrival { port: Port::Modem, time_us, bytes: sentences.concat() };
        let sent = board.step(time_us + 1, &[], &[arrival]);
        assert!(!String::from_utf8_lossy(&sent[0]).contains("OMSTOP"));
        world.advance(&mut board);
    }
    assert_eq!(*board.app().parameters(), settings);
    assert!(last(&mut board).leg.is_some(), "the mission goes on");
    assert_eq!(board.heard().answers.len(), answers);
}

fn contains_key(bytes: &[u8]) -> bool {
    bytes.windows(4).any(|window| KEY.windows(4).any(|part| window == part))
}

#[test]
fn the_key_is_written_and_never_read() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    request_all(&mut board, &[ToBoard::KeyBegin]);
    assert_eq!(board.heard().keys.pop(), Some(false));
    world.run(&mut board, 3);
    assert_eq!(board.answer(&ToBoard::KeySet(Key::new(KEY))), Some(Err(Refusal::Sequence)), "two seconds are over");
    provision(&mut board, KEY);
    board.heard().keys.clear();

    board.listen_raw();
    for index in 0..=PARAMETERS.len() as u16 {
        board.request(&ToBoard::ParameterGet { index });
    }
    for message in [ToBoard::Hello, ToBoard::HealthGet, ToBoard::MissionGet { index: 0 }, ToBoard::KeyBegin] {
        board.request(&message);
    }
    world.run(&mut board, 5);
    assert_eq!(board.heard().keys.pop(), Some(true), "the board says that it has a key");
    let raw = board.listen_raw();
    assert!(raw.len() > 10_000 && !contains_key(&raw));
    assert!(contains_key(&KEY), "the search finds it");
    let settings = format!("{:?}", board.app().parameters());
    assert!(settings.contains("acoustic_key: set"), "{settings}");
    let as_list: Vec<u8> =
        PARAMETERS.iter().flat_map(|parameter| parameter.get(board.app().parameters()).to_le_bytes()).collect();
    assert!(!contains_key(&as_list) && PARAMETERS.iter().all(|parameter| !parameter.name.contains("key")));
}

#[test]
fn no_key_is_taken_under_way() {
    let (_, mut board) = under_way();
    request_all(&mut board, &[ToBoard::KeyBegin]);
    assert_eq!(board.answer(&ToBoard::KeySet(Key::new(KEY))), Some(Err(Refusal::UnderWay)));
    assert!(!board.app().parameters().app.acoustic_key.is_set());
}

/// An armed mission under way, with the key, and the UTC second of now.
fn under_way_with_key() -> (World, Direct, u32) {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    provision(&mut board, KEY);
    world.key = Key::new(KEY);
    world.run(&mut board, 8);
    start(&mut board);
    world.run(&mut board, 30);
    assert!(last(&mut board).leg.is_some());
    let second = utc_s(&mut board);
    (world, board, second)
}

fn utc_s(board: &mut Direct) -> u32 {
    (last(board).utc_us / 1_000_000) as u32
}

/// Sends one payload as a packet; true when the frontseat is told to stop in the same step.
fn hear_abort(world: &mut World, board: &mut Direct, payload: &[u8]) -> bool {
    world.silent[Port::Modem as usize] = true;
    let time_us = last(board).time_us + 10_000;
    let arrival = Arrival { port: Port::Modem, time_us, bytes: packet(payload, time_us).concat() };
    let [to_frontseat, ..] = board.step(time_us + 1, &[], &[arrival]);
    world.advance(board);
    String::from_utf8_lossy(&to_frontseat).contains("OMSTOP")
}

#[test]
fn an_authentic_abort_ends_the_mission_and_nothing_else() {
    let (mut world, mut board, second) = under_way_with_key();
    let settings = *board.app().parameters();
    let key = Key::new(KEY);
    let abort = Abort { destination: 2, transmit_s: second };
    // another vehicle's, with another key, too old, of tomorrow, of before this mission: nothing
    let refused = [
        Abort { destination: 3, ..abort }.emit_authentic(&key),
        abort.emit_authentic(&Key::new([9; 16])),
        Abort { transmit_s: second - 25, ..abort }.emit_authentic(&key).map(|mut old| {
            old[13] ^= 1;
            old
        }),
        Abort { transmit_s: second - 40, ..abort }.emit_authentic(&key),
        Abort { transmit_s: second + 86_400, ..abort }.emit_authentic(&key),
    ];
    for payload in refused {
        assert!(!hear_abort(&mut world, &mut board, &payload.unwrap()));
        world.run(&mut board, 2);
        assert!(last(&mut board).leg.is_some() && world.stops == 0, "{payload:?}");
    }
    assert!(hear_abort(&mut world, &mut board, &abort.emit_authentic(&key).unwrap()), "in the same step");
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason, record.leg), (Mode::Safe, ModeReason::Aborted, None));
    world.run(&mut board, 3);
    assert_eq!(world.stops, 1, "and again, until it is acknowledged");
    assert_eq!(*board.app().parameters(), settings);
    // the recording, played again in the next mission
    world.run(&mut board, 5);
    request_all(&mut board, &[ToBoard::MissionStart]);
    world.run(&mut board, 3);
    for destination in [2, EVERYBODY] {
        let recorded = Abort { destination, ..abort }.emit_authentic(&key).unwrap();
        assert!(!hear_abort(&mut world, &mut board, &recorded));
        world.run(&mut board, 2);
        assert!(last(&mut board).leg.is_some(), "{destination}");
    }
    // a new one to everybody
    let abort = Abort { destination: EVERYBODY, transmit_s: utc_s(&mut board) };
    hear_abort(&mut world, &mut board, &abort.emit_authentic(&key).unwrap());
    assert_eq!(last(&mut board).reason, ModeReason::Aborted);
}

#[test]
fn without_a_key_there_is_no_abort() {
    let (mut world, mut board) = under_way();
    world.run(&mut board, 5);
    let abort = Abort { destination: 2, transmit_s: utc_s(&mut board) };
    hear_abort(&mut world, &mut board, &abort.emit_authentic(&Key::new(KEY)).unwrap());
    world.run(&mut board, 2);
    assert!(last(&mut board).leg.is_some());
}

/// A mission that waits for its first fix is disarmed, and an abort at rest changes nothing that is shown.
#[test]
fn an_abort_disarms_a_mission_that_waits() {
    let key = Key::new(KEY);
    let (mut world, mut board) = (World::new(), Direct::new(None));
    provision(&mut board, KEY);
    // attitude is missing, UTC is not
    world.silent[Port::Ahrs as usize] = true;
    world.run(&mut board, 8);
    let abort = |board: &mut Direct| Abort { destination: 2, transmit_s: utc_s(board) }.emit_authentic(&key).unwrap();
    let payload = abort(&mut board);
    hear_abort(&mut world, &mut board, &payload);
    assert_ne!(last(&mut board).reason, ModeReason::Aborted, "there is no mission");
    start(&mut board);
    world.run(&mut board, 2);
    let payload = abort(&mut board);
    hear_abort(&mut world, &mut board, &payload);
    assert_eq!(last(&mut board).reason, ModeReason::Aborted);
    world.silent[Port::Ahrs as usize] = false;
    world.run(&mut board, 10);
    assert_eq!((last(&mut board).leg, world.servos), (None, 0));
}
