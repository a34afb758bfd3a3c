//! The pump over ports in memory: lock-step and own clock.

use crate::board::{Arrival, Board, Heard, Pumped, request_all};
use crate::flight::start;
use crate::world::World;
use backseat_app::{App, PARTIAL_US, Progress, SILENT_US, START_US};
use backseat_wire::hostlink::{Mode, Port, Refusal, ToBoard};

const COMPASS: &[u8] = b"$C82.8P-3.89R-2.63T20.3D3.2*78\r\n";

#[test]
fn a_step_waits_for_exactly_its_bytes() {
    let mut board = Pumped::new();
    let arrival = |port, time_us, bytes: &[u8]| Arrival { port, time_us, bytes: bytes.to_vec() };
    let arrivals = [arrival(Port::Frontseat, 60_000, COMPASS), arrival(Port::Dvl, 70_000, &[0; 300])];
    board.announce(100_000, &[50_000], &arrivals);
    assert_eq!(board.run(0), Progress::IdleUntil(Some(PARTIAL_US)));
    board.send(Port::Dvl, &[0; 300]);
    board.send(Port::Frontseat, &COMPASS[..10]);
    board.run(0);
    assert!(board.heard().done.is_empty(), "22 bytes are missing");
    // one byte more than announced stays in its port until it is announced
    board.send(Port::Frontseat, &COMPASS[10..]);
    board.send(Port::Frontseat, b"$");
    board.run(0);
    assert_eq!(board.heard().done.pop().map(|done| done.time_us), Some(100_000));
    assert_eq!(board.ports[Port::Frontseat as usize].to_board.len(), 1);
    assert_eq!(board.app.health().accepted(Port::Frontseat), 1);
    assert!(board.app.health().depth_m().is_some());
}

#[test]
fn requests_between_steps_are_answered_at_once() {
    let mut board = Pumped::new();
    board.step(0, &[], &[]);
    assert_eq!(board.answer(&ToBoard::Hello), Some(Ok(())));
    board.step(100_000, &[], &[]);
    // a step that goes back does nothing, but is answered
    let digest = board.app.digest();
    board.step(100_000, &[], &[]);
    assert_eq!(board.app.digest(), digest);
}

#[test]
fn without_a_clock_from_outside_it_takes_its_own() {
    let mut board = Pumped::new();
    board.send(Port::Frontseat, COMPASS);
    assert_eq!(board.run(5_000), Progress::IdleUntil(Some(5_000 + START_US)));
    assert_eq!(board.app.health().accepted(Port::Frontseat), 0, "a simulator may still come");
    assert_eq!(board.run(5_000 + START_US), Progress::IdleUntil(Some(5_000 + START_US + 100_000)));
    assert_eq!(board.app.health().accepted(Port::Frontseat), 1);
    let mut now_us = 5_000 + START_US;
    for _ in 0..10 {
        now_us += 100_000;
        board.run(now_us);
    }
    assert_eq!(board.heard().telemetry.len(), 11);
    // held up for a second: it goes on from there, once
    board.run(now_us + 1_050_000);
    assert_eq!(board.heard().telemetry.len(), 12);
    assert_eq!(board.run(now_us + 1_060_000), Progress::IdleUntil(Some(now_us + 1_100_000)));
    // and a simulator takes over with time zero
    board.ports.iter_mut().for_each(|port| port.from_board.clear());
    board.step(0, &[], &[]);
    assert_eq!(board.app.digest(), 0);
}

/// A board on its own clock, with a world around it.
struct OwnClock {
    pumped: Pumped,
    now_us: u64,
}

impl Board for OwnClock {
    fn request(&mut self, message: &ToBoard<'_>) {
        self.pumped.ask(message);
        self.pumped.run(self.now_us);
    }

    fn step(&mut self, time_us: u64, pps_us: &[u64], arrivals: &[Arrival]) -> [Vec<u8>; 4] {
        let mut edges = pps_us.iter().peekable();
        for arrival in arrivals {
            while let Some(edge_us) = edges.next_if(|edge_us| **edge_us <= arrival.time_us) {
                self.pumped.app.pps(*edge_us);
            }
            self.pumped.send(arrival.port, &arrival.bytes);
            self.pumped.run(arrival.time_us);
        }
        edges.for_each(|edge_us| self.pumped.app.pps(*edge_us));
        self.pumped.run(time_us);
        self.now_us = time_us;
        Port::DEVICES.map(|port| std::mem::take(&mut self.pumped.ports[port as usize].from_board))
    }

    fn heard(&mut self) -> &mut Heard {
        self.pumped.heard()
    }

    fn app(&self) -> &App {
        &self.pumped.app
    }
}

fn own_clock() -> (World, OwnClock) {
    (World::new(), OwnClock { pumped: Pumped::new(), now_us: 0 })
}

/// A simulator that is attached by accident cannot take the clock from a board that flies, is armed or stops.
#[test]
fn a_board_under_way_keeps_its_clock() {
    let (mut world, mut board) = own_clock();
    let attach = |board: &mut OwnClock, time_us: u64, arrivals: &[Arrival]| {
        board.pumped.announce(time_us, &[], arrivals);
        board.pumped.run(board.now_us);
        assert_eq!(board.heard().answers.pop(), Some(Err(Refusal::OwnClock)));
        assert!(board.heard().done.is_empty());
    };
    // armed: it still waits for its sensors
    world.silent = [true; 4];
    world.run(&mut board, 4);
    start(&mut board);
    world.run(&mut board, 1);
    attach(&mut board, 0, &[]);
    world.silent = [false; 4];
    world.run(&mut board, 20);
    assert!(board.heard().telemetry.last().is_some_and(|record| record.leg == Some(0)));
    for (time_us, arrivals) in [
        (0, vec![]),
        (world_time(&board) + 100_000, vec![]),
        (0, vec![Arrival { port: Port::Frontseat, time_us: 0, bytes: vec![0; 300] }]),
        (u64::MAX, vec![]),
    ] {
        attach(&mut board, time_us, &arrivals);
    }
    board.heard().telemetry.clear();
    world.run(&mut board, 5);
    assert_eq!(board.heard().telemetry.len(), 50, "a step every 0.1 s");
    assert!(board.heard().telemetry.iter().all(|record| record.leg.is_some() && record.mode == Mode::Navigating));
    // and it can be stopped; until the stop is acknowledged it keeps the clock
    request_all(&mut board, &[ToBoard::MissionStop]);
    attach(&mut board, 0, &[]);
    world.run(&mut board, 2);
    assert_eq!(world.stops, 1);
    board.pumped.announce(0, &[], &[]);
    board.pumped.run(board.now_us);
    assert_eq!(board.heard().done.len(), 1, "at rest a simulator may come");
}

fn world_time(board: &OwnClock) -> u64 {
    board.now_us
}

/// At rest lock-step has to be announced: time zero, nothing else.
#[test]
fn lock_step_is_announced() {
    let (mut world, mut board) = own_clock();
    world.run(&mut board, 5);
    for (time_us, arrivals) in [(5_100_000, vec![]), (0, vec![Arrival { port: Port::Dvl, time_us: 0, bytes: vec![1] }])]
    {
        board.pumped.announce(time_us, &[], &arrivals);
        board.pumped.run(board.now_us);
        assert_eq!(board.heard().answers.pop(), Some(Err(Refusal::OwnClock)));
    }
    world.run(&mut board, 1);
    assert_eq!(board.heard().telemetry.last().map(|record| record.time_us), Some(6_000_000));
}

/// A host that goes away in lock-step, with a step complete or half of it, leaves the board its own clock.
#[test]
fn a_clock_that_stops_is_given_up() {
    for (missing, after_us) in [(0, SILENT_US), (12, PARTIAL_US)] {
        let mut board = Pumped::new();
        board.step(0, &[], &[]);
        board.step(100_000, &[], &[]);
        if missing > 0 {
            board.announce(
                200_000,
                &[],
                &[Arrival { port: Port::Frontseat, time_us: 150_000, bytes: COMPASS.to_vec() }],
            );
            board.send(Port::Frontseat, &COMPASS[..COMPASS.len() - missing]);
        }
        board.heard().telemetry.clear();
        assert_eq!(
            board.run(after_us - 1),
            Progress::IdleUntil(Some(if missing > 0 { 2 * after_us - 1 } else { after_us }))
        );
        let ends_us = if missing > 0 { 2 * after_us - 1 } else { after_us };
        board.run(ends_us);
        let sent = String::from_utf8(board.ports[Port::Frontseat as usize].from_board.clone()).unwrap();
        assert!(sent.contains("$OMP,8080808080,00,2") && sent.contains("$OMSTOP,0"), "{sent}");
        assert_eq!(board.heard().telemetry.pop().map(|record| record.time_us), Some(ends_us));
        // the rest of the half step does no harm, and requests are answered
        board.send(Port::Frontseat, &COMPASS[COMPASS.len() - missing..]);
        board.run(ends_us + 100_000);
        board.ask(&ToBoard::Hello);
        board.run(ends_us + 100_000);
        assert_eq!(board.heard().answers.pop(), Some(Ok(())));
        assert_eq!(board.heard().telemetry.len(), 1);
    }
}

/// A step that announces 60,000 bytes, of which some come every second, leaves the board its own clock as well.
#[test]
fn a_step_that_trickles_in_is_given_up() {
    let mut board = Pumped::new();
    board.step(0, &[], &[]);
    let arrival = Arrival { port: Port::Dvl, time_us: 50_000, bytes: vec![0; 60_000] };
    board.announce(100_000, &[], &[arrival]);
    board.heard().telemetry.clear();
    for now_us in (0..=PARTIAL_US).step_by(1_000_000) {
        assert!(board.heard().telemetry.is_empty(), "{now_us}");
        board.send(Port::Dvl, &[0; 10]);
        board.run(now_us);
    }
    assert_eq!(board.heard().telemetry.pop().map(|record| record.time_us), Some(PARTIAL_US));
}
