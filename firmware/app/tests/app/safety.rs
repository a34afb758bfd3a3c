//! The limits of safety, each with the action that follows; `firmware/app/src/safety` has the ladder itself.

use crate::board::{Board, Direct, request_all};
use crate::faults::{last, shown};
use crate::flight::{WAYPOINTS, load, parameters, start, start_along};
use crate::world::World;
use backseat_core::state::{X, Y, Z};
use backseat_wire::hostlink::{Mode, ModeReason, Refusal, ToBoard, Waypoint};
use backseat_wire::iver::ServoBytes;

/// A straight survey leg of two kilometres at 3 m.
pub const LONG: [Waypoint; 2] = [WAYPOINTS[0], Waypoint { x_m: 2000.0, y_m: 0.0, depth_m: 3.0, speed_mps: 1.0 }];

/// Under way along [`LONG`] for so many seconds, with these parameters.
pub fn flying(values: &[(&str, f64)], seconds: u64) -> (World, Direct) {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    parameters(&mut board, values);
    world.run(&mut board, 10);
    start_along(&mut board, &LONG);
    world.run(&mut board, seconds);
    let record = last(&mut board);
    assert_eq!((record.mode, record.reason), (Mode::Navigating, ModeReason::Nominal), "before anything happens");
    assert!(record.leg.is_some());
    (world, board)
}

/// Runs until the mission ends, at most so many seconds, changing the world before each second; how long it took, s.
pub fn until_ended(
    world: &mut World,
    board: &mut Direct,
    seconds: u64,
    mut change: impl FnMut(&mut World, f64),
) -> f64 {
    for step in 0..10 * seconds {
        change(world, 0.1 * step as f64);
        world.advance(board);
        if last(board).leg.is_none() {
            return 0.1 * step as f64;
        }
    }
    panic!("the mission goes on after {seconds} s: {:?} at {:.1} m", last(board).reason, world.x[Z]);
}

/// The frontseat was told to stop, and has a neutral vehicle.
pub fn stopped(world: &mut World, board: &mut Direct, reason: ModeReason) {
    assert_eq!(shown(board), (Mode::Safe, reason));
    world.run(board, 1);
    assert_eq!((world.stops, world.last_servo), (1, ServoBytes::NEUTRAL), "{reason:?}");
    world.run(board, 5);
    assert_eq!(shown(board), (Mode::Safe, reason), "it stays to be seen");
}

#[test]
fn a_leak_and_a_flat_battery_are_asked_for() {
    let (mut world, mut board) = flying(&[("app.power_rate_hz", 0.1)], 30);
    world.leak = true;
    let took_s = until_ended(&mut world, &mut board, 15, |_, _| {});
    assert!(took_s < 11.0, "asked for every ten seconds: {took_s}");
    stopped(&mut world, &mut board, ModeReason::Leak);
    assert_eq!(board.answer(&ToBoard::MissionStart), Some(Err(Refusal::Unsafe(ModeReason::Leak))));
    (world.leak, world.charge_percent) = (false, 5.0);
    world.run(&mut board, 11);
    assert_eq!(board.answer(&ToBoard::MissionStart), Some(Err(Refusal::Unsafe(ModeReason::BatteryLow))));
}

/// Low battery: straight back to where the mission began, at the surface, and a stop there.
#[test]
fn a_low_battery_brings_the_vehicle_back() {
    let (mut world, mut board) = flying(&[("app.power_rate_hz", 0.1)], 90);
    let home_m = [-30.0, 5.0];
    world.charge_percent = 9.0;
    world.run(&mut board, 25);
    assert_eq!(shown(&mut board), (Mode::Degraded, ModeReason::BatteryLow));
    assert!(last(&mut board).leg.is_some() && world.stops == 0, "it is flown");
    until_ended(&mut world, &mut board, 300, |_, _| {});
    let off_m = libm::hypot(world.x[X] - home_m[0], world.x[Y] - home_m[1]);
    assert!(off_m < 8.0 && world.x[Z] < 0.5, "{off_m} m from where it began, {} m deep", world.x[Z]);
    world.run(&mut board, 1);
    assert_eq!((shown(&mut board), world.stops), ((Mode::Safe, ModeReason::BatteryLow), 1));
    // there is no mission left that could be started by mistake
    world.charge_percent = 90.0;
    world.run(&mut board, 11);
    assert_eq!(board.answer(&ToBoard::MissionStart), Some(Err(Refusal::Sequence)));
}

#[test]
fn water_in_the_hull_shows_before_it_is_deep() {
    let (mut world, mut board) = flying(&[], 150);
    // 20 g/s
    let flood = |world: &mut World, t_s: f64| world.flooding_n = 0.2 * t_s;
    until_ended(&mut world, &mut board, 600, flood);
    let (_, reason) = shown(&mut board);
    assert!(matches!(reason, ModeReason::DepthDoubtful | ModeReason::TooDeep), "{reason:?}");
    assert!(world.x[Z] < 9.0, "{} m deep", world.x[Z]);
    stopped(&mut world, &mut board, reason);
}

#[test]
fn the_greatest_depth_ends_a_mission() {
    let (mut world, mut board) = flying(&[("safety.depth_max_m", 6.0)], 60);
    // water that sinks at 0.8 m/s
    until_ended(&mut world, &mut board, 60, |world, _| world.x[Z] += 0.08);
    assert!((5.0..7.0).contains(&world.x[Z]), "{:?}, {} m deep", shown(&mut board), world.x[Z]);
    stopped(&mut world, &mut board, ModeReason::TooDeep);
}

/// The sensor drifts by 5 cm/s towards the surface; the controller takes the vehicle down.
#[test]
fn a_drifting_pressure_sensor_is_seen_by_pitch_and_speed() {
    let (mut world, mut board) = flying(&[], 200);
    let start_m = world.x[Z];
    let took_s = until_ended(&mut world, &mut board, 600, |world, t_s| world.depth_error_m = -0.05 * t_s);
    stopped(&mut world, &mut board, ModeReason::DepthDoubtful);
    assert!(world.x[Z] - start_m < 14.0, "{took_s} s, {} m deep", world.x[Z]);
}

/// The other way the controller takes the vehicle up, where a fix says that it is not 3 m deep.
#[test]
fn a_fix_contradicts_a_pressure_sensor_that_says_deep() {
    let (mut world, mut board) = flying(&[], 200);
    until_ended(&mut world, &mut board, 300, |world, t_s| world.depth_error_m = 0.05 * t_s);
    let (_, reason) = shown(&mut board);
    assert!(matches!(reason, ModeReason::DepthDoubtful | ModeReason::Rejections), "{reason:?}");
    assert!(world.x[Z] < 3.2, "{} m deep", world.x[Z]);
}

/// From metres to feet and from feet to metres under way.
#[test]
fn a_pressure_sensor_that_changes_its_unit_ends_the_mission() {
    for factor in [0.3048, 3.281] {
        let (mut world, mut board) = flying(&[], 150);
        world.depth_factor = factor;
        let took_s = until_ended(&mut world, &mut board, 120, |_, _| {});
        let (_, reason) = shown(&mut board);
        assert!(
            matches!(reason, ModeReason::DepthDoubtful | ModeReason::Rejections | ModeReason::TooDeep),
            "{reason:?}"
        );
        assert!(world.x[Z] < 10.0, "{took_s} s, {} m deep", world.x[Z]);
    }
}

#[test]
fn the_bottom_comes_close() {
    for dvl in [false, true] {
        let (mut world, mut board) = flying(&[("safety.altitude_min_m", 2.0)], 60);
        world.dvl = dvl;
        until_ended(&mut world, &mut board, 120, |world, t_s| world.bottom_m = 15.0 - 0.2 * t_s);
        stopped(&mut world, &mut board, ModeReason::TooLow);
        assert!(world.bottom_m - world.x[Z] > 1.5, "{} m above the bottom", world.bottom_m - world.x[Z]);
    }
}

#[test]
fn a_fence_is_kept_at_upload_and_under_way() {
    let (mut world, mut board) = flying(&[], 60);
    // stricter under way
    parameters(&mut board, &[("safety.fence_radius_m", 80.0)]);
    until_ended(&mut world, &mut board, 120, |_, _| {});
    assert!((80.0..90.0).contains(&world.x[X]), "{}", world.x[X]);
    stopped(&mut world, &mut board, ModeReason::OutsideFence);
    assert_eq!(board.answer(&ToBoard::MissionStart), Some(Err(Refusal::Unsafe(ModeReason::OutsideFence))));
}

#[test]
fn a_far_first_waypoint_is_refused_at_start_or_when_it_would_begin() {
    let far = [Waypoint { x_m: 2100.0, ..WAYPOINTS[0] }];
    let (mut world, mut board) = (World::new(), Direct::new(None));
    start_along(&mut board, &far);
    world.run(&mut board, 10);
    assert_eq!(shown(&mut board), (Mode::Safe, ModeReason::FirstLegTooLong));
    assert_eq!((last(&mut board).leg, world.servos), (None, 0), "armed before the position was known");
    assert_eq!(board.answer(&ToBoard::MissionStart), Some(Err(Refusal::Unsafe(ModeReason::FirstLegTooLong))));
}

#[test]
fn legs_and_missions_have_their_time() {
    let (mut world, mut board) = flying(&[("safety.mission_time_max_s", 2000.0)], 60);
    // 1970 s would do; the operator has less
    parameters(&mut board, &[("safety.mission_time_max_s", 100.0)]);
    world.run(&mut board, 60);
    assert_eq!(shown(&mut board), (Mode::Degraded, ModeReason::MissionTooLong));
    until_ended(&mut world, &mut board, 400, |_, _| {});
    world.advance(&mut board);
    assert_eq!(shown(&mut board), (Mode::Safe, ModeReason::MissionTooLong));

    // 600 m at 3 m/s, which the vehicle does not reach: 200 s and a minute
    let (mut world, mut board) = (World::new(), Direct::new(None));
    parameters(&mut board, &[("safety.leg_time_factor", 1.0)]);
    world.run(&mut board, 10);
    start_along(&mut board, &[Waypoint { x_m: 570.0, y_m: 5.0, depth_m: 3.0, speed_mps: 3.0 }]);
    let took_s = until_ended(&mut world, &mut board, 400, |_, _| {});
    assert!((259.0..262.0).contains(&took_s), "{took_s}");
    stopped(&mut world, &mut board, ModeReason::LegTooLong);
}

#[test]
fn a_vehicle_that_does_not_dive_stops_its_propeller() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 10);
    start(&mut board);
    let took_s = until_ended(&mut world, &mut board, 150, |world, _| world.x[Z] = 0.0);
    let (_, reason) = shown(&mut board);
    assert!(took_s < 122.0, "{took_s}");
    // the nose goes down further and further: the limit of pitch may see it first, after 66 s
    let seen = matches!(reason, ModeReason::NoWater | ModeReason::Rejections | ModeReason::PitchExceeded);
    assert!(seen, "{reason:?} after {took_s} s");
    world.run(&mut board, 1);
    assert_eq!(world.last_servo, ServoBytes::NEUTRAL);
}

#[test]
fn a_steep_or_fast_vehicle_stops() {
    let (mut world, mut board) = flying(&[("safety.speed_max_mps", 0.8)], 4);
    until_ended(&mut world, &mut board, 60, |_, _| {});
    stopped(&mut world, &mut board, ModeReason::SpeedExceeded);
    let (mut world, mut board) = flying(&[("safety.pitch_max_rad", 0.1)], 1);
    until_ended(&mut world, &mut board, 60, |_, _| {});
    stopped(&mut world, &mut board, ModeReason::PitchExceeded);
}

/// Lost contact, where it counts: the vehicle comes up and waits, and the frontseat does not go on.
#[test]
fn a_vehicle_out_of_contact_waits_at_the_surface() {
    let (mut world, mut board) = flying(&[("safety.contact_time_max_s", 60.0)], 60);
    world.silent[backseat_wire::hostlink::Port::Modem as usize] = true;
    until_ended(&mut world, &mut board, 90, |_, _| {});
    assert_eq!(shown(&mut board), (Mode::Safe, ModeReason::ContactLost));
    let before = world.servos;
    world.run(&mut board, 10);
    assert_eq!((world.servos - before, world.stops), (100, 0), "neutral with every step");
    assert_eq!(world.last_servo, ServoBytes::NEUTRAL);
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 1);
    let before = world.servos;
    world.run(&mut board, 5);
    assert_eq!((world.servos, world.stops), (before, 1), "until the operator stops it");
}

/// A lost clock: the frontseat goes on with its own mission.
#[test]
fn without_its_clock_the_mission_is_handed_back() {
    let (mut world, mut board) = flying(&[("safety.clock_time_max_s", 20.0)], 30);
    world.pps = false;
    until_ended(&mut world, &mut board, 120, |_, _| {});
    assert_eq!(shown(&mut board), (Mode::Safe, ModeReason::ClockLost));
    world.run(&mut board, 5);
    assert_eq!((world.stops, world.last_servo), (0, ServoBytes::NEUTRAL), "neutral once, no stop");
}

#[test]
fn lasting_degradation_ends_the_mission() {
    let values = [("app.degraded_sigma_m", 1.0), ("safety.degraded_time_max_s", 30.0)];
    let (mut world, mut board) = (World::new(), Direct::new(None));
    parameters(&mut board, &values);
    world.run(&mut board, 10);
    start_along(&mut board, &LONG);
    world.silent[backseat_wire::hostlink::Port::Modem as usize] = true;
    until_ended(&mut world, &mut board, 600, |_, _| {});
    stopped(&mut world, &mut board, ModeReason::DegradedTooLong);
}

fn put_fenced(board: &mut Direct, waypoints: &[Waypoint], corners_m: &[[f64; 2]]) -> Option<Result<(), Refusal>> {
    load(board, waypoints);
    for (index, corner_m) in (0..).zip(corners_m) {
        request_all(board, &[ToBoard::FenceCorner { index, count: corners_m.len() as u8, corner_m: *corner_m }]);
    }
    board.answer(&ToBoard::MissionCommit)
}

/// Around [`LONG`], with room for its start at x = -30 m.
const FENCE: [[f64; 2]; 4] = [[-60.0, -50.0], [2100.0, -50.0], [2100.0, 50.0], [-60.0, 50.0]];

#[test]
fn a_polygon_is_kept_at_upload_at_start_and_under_way() {
    let outside = Some(Err(Refusal::Unsafe(ModeReason::OutsideFence)));
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.run(&mut board, 10);
    // at upload: a waypoint outside; a leg across a notch between two that are inside; what is no polygon
    let near = FENCE.map(|[x_m, y_m]| [x_m.min(1000.0), y_m]);
    assert_eq!(put_fenced(&mut board, &LONG, &near), outside);
    let notched = [FENCE[0], FENCE[1], FENCE[2], [1000.0, 50.0], [990.0, -10.0], [980.0, 50.0], FENCE[3]];
    assert_eq!(put_fenced(&mut board, &LONG, &notched), outside);
    assert_eq!(put_fenced(&mut board, &LONG, &FENCE[..2]), Some(Err(Refusal::Fence)));
    assert_eq!(board.answer(&ToBoard::MissionStart), Some(Err(Refusal::Fence)), "there is no mission");
    // at start: the vehicle itself is outside
    let ahead = FENCE.map(|[x_m, y_m]| [x_m.max(-25.0), y_m]);
    assert_eq!(put_fenced(&mut board, &LONG, &ahead), Some(Ok(())));
    assert_eq!(board.answer(&ToBoard::MissionStart), outside);
    // under way: a current that sets in carries it across the edge before it is known
    let narrow = FENCE.map(|[x_m, y_m]| [x_m, y_m.min(8.0)]);
    let surfaced = Waypoint { x_m: 1900.0, y_m: 5.0, depth_m: 0.0, speed_mps: 1.0 };
    assert_eq!(put_fenced(&mut board, &[surfaced], &narrow), Some(Ok(())));
    (0..5).for_each(|index| board.request(&ToBoard::FenceGet { index }));
    assert_eq!(board.heard().corners_m, narrow);
    request_all(&mut board, &[ToBoard::MissionStart]);
    world.run(&mut board, 60);
    assert_eq!(shown(&mut board), (Mode::Navigating, ModeReason::Nominal));
    until_ended(&mut world, &mut board, 120, |world, _| world.x[Y] += 0.05);
    stopped(&mut world, &mut board, ModeReason::OutsideFence);
    // ended beyond the edge, as it knows; 0.5 m/s; fixes that contradict model and ranges are doubted until the next
    // range, half a minute at most
    let ended = board.heard().telemetry.iter().find(|record| record.mode == Mode::Safe).expect("telemetry");
    let estimate_m = ended.state[Y];
    assert!(estimate_m > 8.0 && world.x[Y] < 25.0, "{estimate_m} m, in truth {} m", world.x[Y]);
}

/// The straight way home across a headland is none: the vehicle stops instead.
#[test]
fn a_way_home_that_leaves_the_fence_is_not_flown() {
    let leg = |x_m, y_m| Waypoint { x_m, y_m, depth_m: 3.0, speed_mps: 1.0 };
    // out along x, around the headland's tip at (20, 30), and back on its other side
    let legs = [leg(40.0, 5.0), leg(40.0, 55.0), leg(-60.0, 55.0)];
    let corners_m =
        [[-100.0, -20.0], [80.0, -20.0], [80.0, 90.0], [-100.0, 90.0], [-100.0, 31.0], [20.0, 30.0], [-100.0, 29.0]];
    let (mut world, mut board) = (World::new(), Direct::new(None));
    parameters(&mut board, &[("app.power_rate_hz", 0.1)]);
    world.run(&mut board, 10);
    assert_eq!(put_fenced(&mut board, &legs, &corners_m), Some(Ok(())));
    request_all(&mut board, &[ToBoard::MissionStart]);
    while last(&mut board).leg != Some(2) || world.x[X] > 0.0 {
        world.run(&mut board, 1);
        assert!(last(&mut board).leg.is_some(), "{:?}", shown(&mut board));
    }
    world.charge_percent = 5.0;
    until_ended(&mut world, &mut board, 30, |_, _| {});
    stopped(&mut world, &mut board, ModeReason::BatteryLow);
}
