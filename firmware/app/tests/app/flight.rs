//! The app initialises, navigates and steers; however its bytes are cut, the digest is the same.

use crate::board::{Board, Direct, Pumped, request_all};
use crate::world::World;
use backseat_core::state::{PSI, X, Y, Z};
use backseat_wire::hostlink::{Mode, ModeReason, ToBoard, Waypoint};

pub const WAYPOINTS: [Waypoint; 4] = [
    Waypoint { x_m: 0.0, y_m: 0.0, depth_m: 3.0, speed_mps: 1.0 },
    Waypoint { x_m: 120.0, y_m: 0.0, depth_m: 3.0, speed_mps: 1.0 },
    Waypoint { x_m: 120.0, y_m: 40.0, depth_m: 3.0, speed_mps: 1.0 },
    Waypoint { x_m: 40.0, y_m: 40.0, depth_m: 3.0, speed_mps: 1.0 },
];

/// Begins to load a mission: all its waypoints.
pub fn load(board: &mut dyn Board, waypoints: &[Waypoint]) {
    request_all(board, &[ToBoard::MissionBegin { count: waypoints.len() as u16 }]);
    for (index, waypoint) in (0..).zip(waypoints) {
        request_all(board, &[ToBoard::MissionItem { index, waypoint: *waypoint }]);
    }
}

/// Loads and starts a mission.
pub fn start_along(board: &mut dyn Board, waypoints: &[Waypoint]) {
    load(board, waypoints);
    request_all(board, &[ToBoard::MissionCommit, ToBoard::MissionStart]);
}

/// Loads and starts the mission.
pub fn start(board: &mut dyn Board) {
    start_along(board, &WAYPOINTS);
}

pub fn parameters(board: &mut dyn Board, values: &[(&str, f64)]) {
    request_all(board, &[ToBoard::Unlock, ToBoard::ParameterBegin]);
    for &(name, value) in values {
        request_all(board, &[ToBoard::ParameterSet { name, value }]);
    }
    request_all(board, &[ToBoard::ParameterCommit]);
}

#[test]
fn initialises_navigates_and_steers() {
    let mut world = World::new();
    let mut board = Direct::new(None);
    world.run(&mut board, 10);
    let record = board.heard().telemetry.last().cloned().unwrap();
    assert_eq!((record.mode, record.reason), (Mode::Navigating, ModeReason::Nominal));
    start(&mut board);
    let (mut worst_m, mut worst_cross_m, mut legs) = (0.0_f64, 0.0_f64, Vec::new());
    for _ in 0..3300 {
        world.advance(&mut board);
        let record = board.heard().telemetry.last().unwrap();
        assert_eq!(record.mode, Mode::Navigating, "at {} µs: {:?}", record.time_us, record.reason);
        worst_m = worst_m.max(world.error_m(record));
        if record.leg != legs.last().copied().flatten() || legs.is_empty() {
            legs.push(record.leg);
        }
        if record.leg == Some(1) && (20.0..100.0).contains(&world.x[X]) {
            worst_cross_m = worst_cross_m.max(world.x[Y].abs());
            assert!((world.x[Z] - 3.0).abs() < 0.5, "depth {}", world.x[Z]);
        }
        if record.leg.is_none() {
            break;
        }
    }
    assert_eq!(legs, [Some(0), Some(1), Some(2), Some(3), None]);
    // Three fixes of 0.5 m start it and a range of 1 m comes every 20 s; a fault shows as tens of metres.
    assert!(worst_m < 3.0, "worst position error {worst_m} m");
    assert!(worst_cross_m < 3.0, "worst cross-track error {worst_cross_m} m");
    // 330 s have 16 downlinks; the first may come before the filter is there.
    let ranges = board.heard().fusions.iter().filter(|fusion| fusion.sensor == 7 && fusion.outcome == 0).count();
    assert!(ranges >= 9, "{ranges} ranges were fused");
    // the ship lies still; its packet has its position to a hand's breadth
    let ships = &board.heard().ships;
    assert_eq!(ships.len(), ranges, "one of each packet");
    for ship in ships {
        let [north_m, east_m] = [0, 1].map(|i| ship.position_m[i] - world.ship_m[i]);
        assert!(libm::hypot(north_m, east_m) < 0.2 && ship.sigma_m == 0.5, "{ship:?}");
    }
    assert_eq!(board.app().health().lost_packets(backseat_app::Loss::Replaced), 0);
}

#[test]
fn helm_mode_sends_heading_depth_and_speed() {
    let mut world = World::new();
    let mut board = Direct::new(None);
    parameters(&mut board, &[("app.control_mode", 1.0), ("app.attitude_source", 1.0)]);
    world.run(&mut board, 10);
    start(&mut board);
    world.run(&mut board, 3);
    assert_eq!(world.servos, 0);
    let steer = world.last_steer.expect("a steering command");
    assert!((steer.depth_m - 3.0).abs() < 0.1 && (steer.speed_mps - 1.0).abs() < 0.1, "{steer:?}");
    // from (-30, 5) to the origin: a little to port of north
    assert!(steer.heading_rad > 5.5, "{steer:?}");
    assert!(world.x[PSI].abs() < 0.1);
}

#[test]
fn the_modem_is_configured_and_again_after_a_reboot() {
    let mut world = World::new();
    let mut board = Direct::new(None);
    world.run(&mut board, 12);
    let all = ["SRC 2", "SNV 1", "CST 1", "RXP 1"];
    assert_eq!(world.settings, all);
    world.reboot_modem();
    world.run(&mut board, 12);
    assert_eq!(world.settings, [all, all].concat());
}

fn fly(board: &mut dyn Board, seconds: u64) -> (u64, Vec<u8>) {
    let mut world = World::new();
    world.run(board, 8);
    start(board);
    world.run(board, seconds);
    let last = board.heard().telemetry.last().unwrap();
    assert_eq!(last.mode, Mode::Navigating);
    let state = last.state.iter().flat_map(|x| x.to_bits().to_le_bytes()).collect();
    (board.app().digest(), state)
}

#[test]
fn cutting_the_streams_changes_nothing() {
    let whole = fly(&mut Direct::new(None), 60);
    for seed in 1..4 {
        assert_eq!(fly(&mut Direct::new(Some(seed)), 60), whole);
    }
    assert_eq!(fly(&mut Pumped::new(), 60), whole);
    let mut stingy = Pumped::new();
    for (port, stingy) in stingy.ports.iter_mut().zip([1, 3, 7, 2, 5]) {
        port.stingy = Some(stingy);
    }
    assert_eq!(fly(&mut stingy, 60), whole);
}

#[test]
fn naming_only_watches() {
    let whole = fly(&mut Direct::new(None), 200);
    // off, and as long as nothing is named whatever may follow
    for naming in [0.0, 2.0, 3.0] {
        let mut board = Direct::new(None);
        parameters(&mut board, &[("app.naming", naming)]);
        assert_eq!(fly(&mut board, 200), whole);
    }
}

#[test]
fn a_restart_leaves_nothing_behind() {
    let mut board = Pumped::new();
    board.step(0, &[], &[]);
    let first = fly(&mut board, 30);
    board.request(&ToBoard::Hello);
    board.step(0, &[], &[]);
    board.heard().telemetry.clear();
    assert_eq!(fly(&mut board, 30), first);
}
