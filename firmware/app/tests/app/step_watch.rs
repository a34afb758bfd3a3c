//! What a watchdog is fed by: steps of navigation, on either clock.

use crate::board::{Arrival, Pumped};
use backseat_app::{START_US, StepWatch};
use backseat_wire::hostlink::{MAX_FRAME, Port, ToBoard, encode};

const TICK_US: u64 = 10_000;

/// Pumps until the watchdog would starve; when, or `None` when it was fed for a minute and a half. Each tick the host
/// does something.
fn starves_us(board: &mut Pumped, mut host: impl FnMut(&mut Pumped, u64)) -> Option<u64> {
    let mut steps = StepWatch::new(0);
    for now_us in (0..90_000_000).step_by(TICK_US as usize) {
        host(board, now_us);
        board.run(now_us);
        steps.look(&board.app, now_us);
        if !steps.is_in_time(&board.pump, now_us) {
            return Some(now_us);
        }
    }
    None
}

#[test]
fn a_board_that_steps_is_fed_on_either_clock() {
    assert_eq!(starves_us(&mut Pumped::new(), |_, _| {}), None, "its own, after the wait for another one");
    let steps = |board: &mut Pumped, now_us| {
        if now_us % 2_000_000 == 0 {
            board.announce(now_us, &[], &[]);
        }
    };
    assert_eq!(starves_us(&mut Pumped::new(), steps), None, "that of a slow simulator");
}

#[test]
fn no_host_keeps_a_board_alive_that_does_not_step() {
    // Nobody polls: the navigation step does not come back.
    let (board, steps) = (Pumped::new(), StepWatch::new(0));
    assert!(steps.is_in_time(&board.pump, START_US));
    assert!(!steps.is_in_time(&board.pump, START_US + 310_000));
    // A step whose bytes trickle in so slowly that it never runs, and requests beside them: the board takes its clock back
    // before it starves.
    let mut board = Pumped::new();
    board.announce(0, &[], &[]);
    let all = Arrival { port: Port::Dvl, time_us: 1, bytes: vec![0; 60_000] };
    board.announce(100_000, &[], &[all]);
    let trickle = |board: &mut Pumped, now_us| {
        if now_us % 1_000_000 == 0 {
            board.send(Port::Dvl, &[0]);
            board.send(Port::Host, encode(&ToBoard::HealthGet, &mut [0; MAX_FRAME]).expect("a frame"));
        }
    };
    assert_eq!(starves_us(&mut board, trickle), None);
    assert!(!board.pump.is_lockstep());
    // The same step over and over.
    let again = |board: &mut Pumped, now_us| {
        if now_us % 1_000_000 == 0 {
            board.announce(100_000, &[], &[]);
        }
    };
    assert!(starves_us(&mut Pumped::new(), again).expect("repetitions are no steps") < 31_000_000);
}
