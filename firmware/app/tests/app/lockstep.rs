//! The pump over ports in memory: lock-step and own clock.

use crate::board::{Arrival, Board, Pumped};
use backseat_app::{Progress, START_US};
use backseat_wire::hostlink::{Port, ToBoard};

const COMPASS: &[u8] = b"$C82.8P-3.89R-2.63T20.3D3.2*78\r\n";

#[test]
fn a_step_waits_for_exactly_its_bytes() {
    let mut board = Pumped::new();
    let arrival = |port, time_us, bytes: &[u8]| Arrival { port, time_us, bytes: bytes.to_vec() };
    let arrivals = [arrival(Port::Frontseat, 60_000, COMPASS), arrival(Port::Dvl, 70_000, &[0; 300])];
    board.announce(100_000, &[50_000], &arrivals);
    assert_eq!(board.run(0), Progress::IdleUntil(None));
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
    board.request(&ToBoard::Hello);
    assert_eq!(board.heard().answers.pop(), Some(Ok(())));
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
