//! Silence, refusals, absurd packets, babbling ports: survived, counted, and never steered by.

use crate::board::{Arrival, Board, Direct, Random, request_all};
use crate::flight::start;
use crate::world::{START_S, World, date_time, modem, received, ship_frame, statistics};
use backseat_app::Loss;
use backseat_wire::hostlink::{Mode, ModeReason, Port, Telemetry, ToBoard};
use backseat_wire::iver::{FrontseatMode, ServoBytes};
use backseat_wire::modem::{ClockMode, FromModem, ModemTime, ReceptionStatistics};

pub fn last(board: &mut Direct) -> Telemetry {
    board.heard().telemetry.last().cloned().expect("telemetry")
}

/// What the board shows.
pub fn shown(board: &mut Direct) -> (Mode, ModeReason) {
    let record = last(board);
    (record.mode, record.reason)
}

/// A vehicle some seconds into its mission.
pub fn under_way() -> (World, Direct) {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 8);
    start(&mut board);
    world.run(&mut board, 20);
    assert_eq!(last(&mut board).mode, Mode::Navigating);
    assert_ne!(world.last_servo, ServoBytes::NEUTRAL);
    (world, board)
}

#[test]
fn a_silent_source_ends_the_mission_until_it_is_started_again() {
    for (port, reason) in [(Port::Ahrs, ModeReason::AttitudeStale), (Port::Frontseat, ModeReason::DepthStale)] {
        let (mut world, mut board) = under_way();
        world.silent[port as usize] = true;
        world.run(&mut board, 1);
        assert_eq!(last(&mut board).mode, Mode::Navigating, "within the timeout");
        world.run(&mut board, 2);
        let record = last(&mut board);
        assert_eq!((record.mode, record.reason, record.leg), (Mode::Safe, reason, None));
        assert_eq!((world.last_servo, world.stops > 0), (ServoBytes::NEUTRAL, true));
        let servos = world.servos;
        world.silent[port as usize] = false;
        world.run(&mut board, 10);
        let record = last(&mut board);
        assert_eq!((record.mode, record.reason), (Mode::Safe, reason), "it does not go on by itself");
        assert_eq!(world.servos, servos, "the frontseat is in charge");
        board.request(&ToBoard::MissionStart);
        world.run(&mut board, 1);
        assert_eq!((last(&mut board).mode, last(&mut board).leg), (Mode::Navigating, Some(0)));
        assert!(world.servos > servos);
    }
}

#[test]
fn a_stop_that_is_not_acknowledged_is_repeated_and_reported() {
    let (mut world, mut board) = under_way();
    world.silent[Port::Frontseat as usize] = true;
    world.run(&mut board, 10);
    assert_eq!(last(&mut board).reason, ModeReason::DepthStale);
    world.run(&mut board, 20);
    assert_eq!(world.stops, 5);
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason), (Mode::Safe, ModeReason::StopUnanswered), "the host hears of it");
}

#[test]
fn a_frontseat_that_refuses_gets_its_control_back() {
    let (mut world, mut board) = under_way();
    world.mode = FrontseatMode::Stopped;
    world.run(&mut board, 5);
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason), (Mode::Safe, ModeReason::FrontseatRefuses));
    let servos = world.servos;
    world.run(&mut board, 5);
    assert_eq!(world.servos, servos);
}

#[test]
fn the_operators_stop_is_neutral_at_once() {
    let (mut world, mut board) = under_way();
    board.request(&ToBoard::MissionStop);
    world.advance(&mut board);
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason, record.leg), (Mode::Safe, ModeReason::Stopped, None));
    assert_eq!((world.last_servo, world.stops), (ServoBytes::NEUTRAL, 1));
    world.run(&mut board, 5);
    assert_eq!(world.stops, 1, "it was acknowledged");
}

#[test]
fn without_a_fix_nothing_is_initialised_and_an_armed_mission_waits() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.silent[Port::Frontseat as usize] = true;
    world.run(&mut board, 3);
    start(&mut board);
    world.run(&mut board, 3);
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason, record.leg), (Mode::Initialising, ModeReason::DepthStale, None));
    assert_eq!(world.servos, 0);
    world.silent[Port::Frontseat as usize] = false;
    world.run(&mut board, 3);
    assert_eq!(last(&mut board).leg, Some(0));
}

const SYNCHRONOUS: ClockMode = ClockMode(3);

/// Sends sentences to the modem port, 0.2 s apart, in a world whose own ship is silent.
pub fn hear(world: &mut World, board: &mut Direct, sentences: &[Vec<u8>]) {
    world.silent[Port::Modem as usize] = true;
    for bytes in sentences {
        world.advance(board);
        let time_us = last(board).time_us + 10_000;
        let arrival = Arrival { port: Port::Modem, time_us, bytes: bytes.clone() };
        board.step(time_us + 1, &[], &[arrival]);
        world.advance(board);
    }
}

/// Sentences of a packet that arrives about now, 100 ms after the UTC second it was sent at.
type Packet = fn(&World, toa_us: u64, transmit_s: u64) -> Vec<Vec<u8>>;

fn begins() -> Vec<u8> {
    modem(&FromModem::ReceiveBegins { psk: false })
}

fn broken() -> Vec<u8> {
    modem(&FromModem::Message { text: "BAD_CRC", number: 1 })
}

const ABSURD: [(Loss, Packet); 10] = [
    (Loss::Unannounced, |w, _, s| vec![received(&ship_frame(w.ship_m, s))]),
    (Loss::Unannounced, |_, toa_us, _| vec![statistics(toa_us, SYNCHRONOUS)]),
    // two may be under way; the third takes the place of the first, and both that are left are then reported as broken
    (Loss::Replaced, |_, _, _| vec![begins(), begins(), begins(), broken(), broken()]),
    (Loss::Bad, |w, _, s| {
        let mut frame = ship_frame(w.ship_m, s);
        frame[9] ^= 1;
        vec![begins(), received(&frame)]
    }),
    (Loss::Bad, |w, toa_us, s| {
        let time = ModemTime::Full(date_time(toa_us));
        let timeout = modem(&FromModem::Statistics(ReceptionStatistics::new(Some(6), 2, time, SYNCHRONOUS)));
        vec![begins(), received(&ship_frame(w.ship_m, s)), timeout]
    }),
    (Loss::NotSynchronous, |w, toa_us, s| {
        vec![begins(), received(&ship_frame(w.ship_m, s)), statistics(toa_us, ClockMode(1))]
    }),
    (Loss::Arrival, |w, toa_us, s| {
        vec![begins(), received(&ship_frame(w.ship_m, s)), statistics(toa_us + 3_600_000_000, SYNCHRONOUS)]
    }),
    // a ship beyond the local plane
    (Loss::Absurd, |_, toa_us, s| {
        vec![begins(), received(&ship_frame([2.0e6, 0.0], s)), statistics(toa_us, SYNCHRONOUS)]
    }),
    // sent after it arrived, and sent half an hour before
    (Loss::Absurd, |w, toa_us, s| {
        vec![begins(), received(&ship_frame(w.ship_m, s + 30)), statistics(toa_us, SYNCHRONOUS)]
    }),
    (Loss::Absurd, |w, toa_us, s| {
        vec![begins(), received(&ship_frame(w.ship_m, s - 1800)), statistics(toa_us, SYNCHRONOUS)]
    }),
];

#[test]
fn absurd_packets_leave_nothing_but_a_count() {
    let (mut world, mut board) = under_way();
    // to a time when no packet is under way
    world.run(&mut board, 20);
    let losses = |board: &Direct, loss| board.app().health().lost_packets(loss);
    for (case, (loss, packet)) in ABSURD.into_iter().enumerate() {
        let before = losses(&board, loss);
        let second = last(&mut board).time_us / 1_000_000;
        let sentences = packet(&world, second * 1_000_000 + 350_000, START_S + second);
        hear(&mut world, &mut board, &sentences);
        assert!(losses(&board, loss) > before, "case {case}: {loss:?}");
    }
    let before = losses(&board, Loss::TimedOut);
    let frame = ship_frame(world.ship_m, START_S + last(&mut board).time_us / 1_000_000);
    hear(&mut world, &mut board, &[begins(), received(&frame)]);
    world.run(&mut board, 11);
    assert_eq!(losses(&board, Loss::TimedOut), before + 1);
    // No clone is left behind: the real ship is still heard.
    let ranges = |board: &mut Direct| board.heard().fusions.iter().filter(|f| f.sensor == 7 && f.outcome == 0).count();
    let heard = ranges(&mut board);
    world.silent[Port::Modem as usize] = false;
    world.run(&mut board, 45);
    assert!(ranges(&mut board) >= heard + 2);
    let record = last(&mut board);
    let error_m = world.error_m(&record);
    // as in the undisturbed flight
    assert!(error_m < 3.0 && record.mode == Mode::Navigating, "{error_m} m, {:?}", record.reason);
}

/// In a cycle of short slots the next packet may begin before the last sentences of one have come: both give a range.
#[test]
fn a_packet_that_begins_inside_another_loses_neither() {
    let (mut world, mut board) = under_way();
    world.run(&mut board, 20);
    let ranges = |board: &mut Direct| board.heard().fusions.iter().filter(|f| f.sensor == 7).count();
    let before = ranges(&mut board);
    let begun_us = last(&mut board).time_us;
    hear(&mut world, &mut board, &[begins()]);
    world.run(&mut board, 5);
    let second = last(&mut board).time_us / 1_000_000;
    // the first began when its test did, five seconds before the second
    let (first, next) = (begun_us / 1_000_000, second);
    hear(
        &mut world,
        &mut board,
        &[
            begins(),
            received(&ship_frame([30.0, 0.0], START_S + first)),
            statistics(first * 1_000_000 + 250_000, SYNCHRONOUS),
            received(&ship_frame([30.0, 0.0], START_S + next)),
            statistics(next * 1_000_000 + 350_000, SYNCHRONOUS),
        ],
    );
    assert_eq!(ranges(&mut board), before + 2);
    assert_eq!(board.app().health().lost_packets(Loss::Replaced), 0);
}

#[test]
fn a_repeated_packet_counts_once() {
    let (mut world, mut board) = under_way();
    let now_us = last(&mut board).time_us;
    let second = now_us / 1_000_000;
    let packet = |toa_us| {
        vec![
            modem(&FromModem::ReceiveBegins { psk: false }),
            received(&ship_frame([30.0, 0.0], START_S + second)),
            statistics(toa_us, SYNCHRONOUS),
        ]
    };
    let toa_us = now_us + 250_000;
    hear(&mut world, &mut board, &packet(toa_us));
    hear(&mut world, &mut board, &packet(toa_us));
    assert_eq!(board.app().health().lost_packets(Loss::Repeated), 1);
}

#[test]
fn babbling_ports_are_bounded_and_survived() {
    let (mut world, mut board) = under_way();
    let mut random = Random(5);
    let depth = b"$C82.8P-3.89R-2.63T20.3D3.2*78\r\n".repeat(500);
    for _ in 0..5 {
        world.advance(&mut board);
        let time_us = last(&mut board).time_us + 1000;
        let noise: Vec<u8> = (0..20_000).map(|_| random.word() as u8).collect();
        let mut arrivals: Vec<Arrival> =
            Port::DEVICES.map(|port| Arrival { port, time_us, bytes: noise.clone() }).to_vec();
        arrivals.push(Arrival { port: Port::Frontseat, time_us, bytes: depth.clone() });
        let sent = board.step(time_us + 1, &[], &arrivals);
        assert!(sent.iter().all(|bytes| bytes.len() <= 1024));
    }
    // 256 samples wait at most, the others were dropped and counted
    assert!(board.app().health().overflows() >= 5 * (500 - 256));
    let rejected = last(&mut board).rejected_frames;
    assert!(rejected[0] > 0, "{rejected:?}");
    world.run(&mut board, 60);
    let record = last(&mut board);
    let error_m = world.error_m(&record);
    assert!(error_m < 5.0 && record.mode == Mode::Navigating, "{error_m} m, {:?} {:?}", record.mode, record.reason);
}

#[test]
fn nobody_reads_the_ports() {
    // A board whose ports take nothing keeps its rings bounded and says how much it dropped.
    let (mut world, mut board) = under_way();
    let app = board.app_mut();
    for step in 0..2000_u64 {
        app.step(28_100_000 + step * 100_000);
    }
    assert!(app.waiting(Port::Host) <= 8192 && app.waiting(Port::Frontseat) <= 1024);
    assert!(app.health().unsent(Port::Host) > 0 && app.health().unsent(Port::Frontseat) > 0);
    world.run(&mut board, 1);
}

#[test]
fn declared_delays_are_waited_for_and_what_comes_later_is_fused_late_or_dropped() {
    // Fixes name their own time and come some 0.4 s after it.
    for (name, value, late, dropped) in [
        ("installation.ahrs_delay_s", 0.0, true, false),
        ("installation.ahrs_delay_s", 1.2, false, false),
        ("app.late_tolerance_s", 0.1, false, true),
    ] {
        let (mut world, mut board) = (World::new(), Direct::new(None));
        let set = ToBoard::ParameterSet { name, value };
        request_all(&mut board, &[ToBoard::ParameterBegin, set, ToBoard::ParameterCommit]);
        world.run(&mut board, 10);
        let health = board.app().health();
        assert_eq!((health.late() > 0, health.too_late() > 0), (late, dropped), "{name} {value}");
        assert_eq!(last(&mut board).mode, Mode::Navigating);
    }
}

#[test]
fn a_clock_that_leaps_ends_the_mission_and_navigation_starts_again() {
    let (mut world, mut board) = under_way();
    // beyond the longest gap the filter crosses
    let leap_us = 700_000_000;
    let now_us = last(&mut board).time_us;
    board.step(now_us + leap_us, &[], &[]);
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason, record.leg), (Mode::Lost, ModeReason::FilterFailed, None));
    // Nothing is before the new time until the world gets there.
    world.leap(leap_us);
    world.surface();
    world.run(&mut board, 5);
    board.request(&ToBoard::MissionStart);
    world.run(&mut board, 3);
    assert_eq!((last(&mut board).mode, last(&mut board).leg), (Mode::Navigating, Some(0)));
}
