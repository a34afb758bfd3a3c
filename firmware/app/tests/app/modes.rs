//! Every transition of docs/method/modes.md that no other test shows, and what a mode means for the commands.

use crate::board::{Arrival, Board, Direct, Heard, request_all};
use crate::faults::{last, shown, under_way};
use crate::flight::{parameters, start, start_along};
use crate::world::{STEP_US, UNITS, World};
use backseat_app::App;
use backseat_core::state::Z;
use backseat_wire::hostlink::{Mode, ModeReason, Port, Refusal, ToBoard, Waypoint};
use backseat_wire::iver::servo::ServoCalibration;
use backseat_wire::iver::{FrontseatMode, ServoBytes, Steer, ToFrontseat};
use backseat_wire::nmea::{Checksum, Framer};

fn leg(board: &mut Direct) -> Option<u16> {
    last(board).leg
}

/// Runs until the board shows `wanted`, at most so many seconds; what it showed on the way, without repetitions.
fn until(world: &mut World, board: &mut Direct, wanted: (Mode, ModeReason), seconds: u64) -> Vec<(Mode, ModeReason)> {
    world.advance(board);
    let mut way = vec![shown(board)];
    for _ in 0..seconds * 10 {
        world.advance(board);
        let now = shown(board);
        if way.last() != Some(&now) {
            way.push(now);
        }
        if now == wanted {
            return way;
        }
    }
    panic!("{wanted:?} does not come within {seconds} s: {way:?}");
}

/// The kinematic model with the noise that covers this world's manoeuvres.
const KINEMATIC: [(&str, f64); 7] = [
    ("app.process_model", 1.0),
    ("noise.linear_mps2_per_sqrt_hz[0]", 0.1),
    ("noise.linear_mps2_per_sqrt_hz[1]", 0.1),
    ("noise.linear_mps2_per_sqrt_hz[2]", 0.1),
    ("noise.angular_radps2_per_sqrt_hz[0]", 0.2),
    ("noise.angular_radps2_per_sqrt_hz[1]", 0.2),
    ("noise.angular_radps2_per_sqrt_hz[2]", 0.2),
];

const NAVIGATING: (Mode, ModeReason) = (Mode::Navigating, ModeReason::Nominal);

#[test]
fn steps_that_come_late_end_the_mission() {
    let (mut world, mut board) = under_way();
    let neutral_before = world.stops;
    for late in 1..=5 {
        assert_eq!(shown(&mut board), NAVIGATING, "after {late}");
        world.leap(STEP_US);
        world.advance(&mut board);
    }
    assert_eq!(shown(&mut board), (Mode::Safe, ModeReason::Overloaded));
    assert_eq!((leg(&mut board), world.stops), (None, neutral_before + 1));
}

#[test]
fn initialising_tells_what_it_waits_for() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.silent = [true; 4];
    // under water there is no fix
    world.x[Z] = 10.0;
    world.run(&mut board, 1);
    assert_eq!(shown(&mut board), (Mode::Initialising, ModeReason::AttitudeStale));
    world.silent[Port::Ahrs as usize] = false;
    world.run(&mut board, 1);
    assert_eq!(shown(&mut board), (Mode::Initialising, ModeReason::DepthStale));
    world.silent = [false; 4];
    world.run(&mut board, 3);
    assert_eq!(shown(&mut board), (Mode::Initialising, ModeReason::NoFix));
    world.surface();
    assert_eq!(until(&mut world, &mut board, NAVIGATING, 5).len(), 2);
}

#[test]
fn without_a_mission_a_missing_source_is_safe_until_it_is_back() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    until(&mut world, &mut board, NAVIGATING, 10);
    for (port, way) in [
        (Port::Ahrs, &[ModeReason::AttitudeStale][..]),
        // depth comes from there as well, and is missed sooner
        (Port::Frontseat, &[ModeReason::DepthStale, ModeReason::FrontseatSilent]),
    ] {
        world.silent[port as usize] = true;
        for reason in way {
            until(&mut world, &mut board, (Mode::Safe, *reason), 12);
        }
        assert!(board.answer(&ToBoard::MissionStart).unwrap().is_err());
        world.silent[port as usize] = false;
        let way = until(&mut world, &mut board, NAVIGATING, 5);
        assert_eq!(way.len(), 2, "{way:?}");
    }
    assert_eq!((world.servos, world.stops), (0, 0), "the frontseat was in charge all the time");
}

#[test]
fn a_silent_frontseat_ends_the_mission_though_depth_may_be_old() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    parameters(&mut board, &[("app.depth_timeout_s", 60.0)]);
    world.run(&mut board, 8);
    start(&mut board);
    world.run(&mut board, 20);
    world.silent[Port::Frontseat as usize] = true;
    let way = until(&mut world, &mut board, (Mode::Safe, ModeReason::FrontseatSilent), 12);
    assert_eq!(way.len(), 2, "{way:?}");
    assert_eq!((leg(&mut board), world.last_servo), (None, ServoBytes::NEUTRAL));
}

#[test]
fn an_uncertain_position_degrades_and_then_ends_the_mission() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    // no range, no velocity, no model of the vehicle
    world.silent[Port::Modem as usize] = true;
    parameters(&mut board, &KINEMATIC);
    // the limits are tried by what grows, not by the receiver's bias, which is there from the first on
    parameters(&mut board, &[("app.degraded_sigma_m", 2.0), ("app.receiver_bias_m", 0.0)]);
    until(&mut world, &mut board, NAVIGATING, 10);
    start(&mut board);
    let degraded = (Mode::Degraded, ModeReason::PositionUncertain);
    until(&mut world, &mut board, degraded, 200);
    assert!(leg(&mut board).is_some(), "it goes on");
    let sigma_m = |board: &mut Direct| {
        let record = last(board);
        libm::hypot(record.sigma[0], record.sigma[1])
    };
    assert!((2.0..2.1).contains(&sigma_m(&mut board)), "{}", sigma_m(&mut board));

    parameters(&mut board, &[("app.lost_sigma_m", 2.0)]);
    world.advance(&mut board);
    let lost = (Mode::Lost, ModeReason::PositionUncertain);
    assert_eq!((shown(&mut board), leg(&mut board)), (lost, None));
    assert_eq!((world.last_servo, world.stops), (ServoBytes::NEUTRAL, 1));
    assert_eq!(board.answer(&ToBoard::MissionStart), Some(Err(Refusal::NotReady)), "while it is lost");

    // the position is believed again: what ended the mission stays to be seen until the next start
    parameters(&mut board, &[("app.lost_sigma_m", 1000.0)]);
    world.run(&mut board, 4);
    assert_eq!((shown(&mut board), leg(&mut board)), (lost, None));
    request_all(&mut board, &[ToBoard::MissionStart]);
    world.advance(&mut board);
    assert_eq!(shown(&mut board), degraded);
    assert!(leg(&mut board).is_some());
    // within the limits for three seconds it navigates again; under way the limit cannot be relaxed
    request_all(&mut board, &[ToBoard::MissionStop]);
    parameters(&mut board, &[("app.degraded_sigma_m", 1000.0)]);
    world.run(&mut board, 2);
    request_all(&mut board, &[ToBoard::MissionStart]);
    world.advance(&mut board);
    assert_eq!(shown(&mut board), degraded);
    until(&mut world, &mut board, NAVIGATING, 2);
}

#[test]
fn a_suspect_depth_degrades_and_then_ends_the_mission() {
    let (mut world, mut board) = under_way();
    // a pressure sensor that is 10 m wrong from one moment to the next: 10 m are three sigmas of 0.1 m/s after 33 s
    world.x[Z] += 10.0;
    let began_us = last(&mut board).time_us;
    let way = until(&mut world, &mut board, (Mode::Degraded, ModeReason::Rejections), 10);
    assert_eq!(way.len(), 2, "{way:?}");
    assert!(last(&mut board).time_us - began_us <= 2_300_000, "two seconds of exceedances");
    assert!(leg(&mut board).is_some(), "the mission goes on");
    until(&mut world, &mut board, (Mode::Safe, ModeReason::Rejections), 9);
    assert_eq!((leg(&mut board), world.last_servo), (None, ServoBytes::NEUTRAL), "there is no depth to steer by");
    world.run(&mut board, 10);
    assert!(last(&mut board).sigma[Z] > 1.5, "suspicion grows: {}", last(&mut board).sigma[Z]);
    assert_eq!(
        board.answer(&ToBoard::MissionStart),
        Some(Err(Refusal::NotReady)),
        "that its readings agree is not enough"
    );
    let mut seconds = 0;
    while board.app().mode().0 == Mode::Safe && seconds < 60 {
        world.run(&mut board, 1);
        board.request(&ToBoard::MissionStart);
        seconds += 1;
    }
    assert!((5..40).contains(&seconds), "{seconds} s: consistent with the suspicion");
    assert!(last(&mut board).sigma[Z] > 3.0, "it covers both positions: {}", last(&mut board).sigma[Z]);
}

#[test]
fn a_source_that_was_wrong_for_a_while_comes_back_at_once() {
    let (mut world, mut board) = under_way();
    world.x[Z] += 10.0;
    until(&mut world, &mut board, (Mode::Degraded, ModeReason::Rejections), 10);
    world.x[Z] -= 10.0;
    until(&mut world, &mut board, NAVIGATING, 5);
    // hypot(0.25, 0.2): a sensor's slow error is always stated
    assert!(last(&mut board).sigma[Z] < 0.32);
}

#[test]
fn a_short_refusal_is_borne() {
    let (mut world, mut board) = under_way();
    world.mode = FrontseatMode::Stopped;
    world.run(&mut board, 2);
    world.mode = FrontseatMode::Normal;
    world.run(&mut board, 5);
    assert_eq!(shown(&mut board), NAVIGATING);
    assert!(leg(&mut board).is_some());
    assert_ne!(world.last_servo, ServoBytes::NEUTRAL);
}

#[test]
fn the_operators_stop_is_shown_without_a_mission_too() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    until(&mut world, &mut board, NAVIGATING, 10);
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.run(&mut board, 5);
    assert_eq!(shown(&mut board), (Mode::Safe, ModeReason::Stopped));
    assert_eq!(world.stops, 1);
    start(&mut board);
    world.run(&mut board, 1);
    assert_eq!((shown(&mut board), leg(&mut board)), (NAVIGATING, Some(0)));
}

#[test]
fn a_stop_disarms_a_mission_that_waits() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.silent[Port::Frontseat as usize] = true;
    start(&mut board);
    world.run(&mut board, 2);
    request_all(&mut board, &[ToBoard::MissionStop]);
    world.silent[Port::Frontseat as usize] = false;
    world.run(&mut board, 10);
    assert_eq!((shown(&mut board), leg(&mut board)), ((Mode::Safe, ModeReason::Stopped), None));
}

#[test]
fn a_mission_flown_to_its_end_leaves_the_frontseat_to_its_timeout() {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    until(&mut world, &mut board, NAVIGATING, 10);
    start_along(&mut board, &[Waypoint { x_m: -20.0, y_m: 5.0, depth_m: 0.0, speed_mps: 1.0 }]);
    world.run(&mut board, 1);
    assert_eq!(leg(&mut board), Some(0));
    while leg(&mut board).is_some() {
        world.advance(&mut board);
        assert!(last(&mut board).time_us < 100_000_000, "10 m at 1 m/s");
    }
    assert_eq!((shown(&mut board), world.last_servo, world.stops), (NAVIGATING, ServoBytes::NEUTRAL, 0));
    let servos = world.servos;
    world.run(&mut board, 5);
    assert_eq!(world.servos, servos, "silence: the last command lapses");
}

/// A command as the frontseat hears it.
#[derive(Clone, Copy, Debug)]
enum Order {
    Servo(ServoBytes, u8),
    Steer(Steer),
}

/// A board whose commands are noted.
struct Noted {
    board: Direct,
    framer: Framer,
    orders: Vec<Order>,
}

impl Noted {
    fn new() -> Self {
        Self { board: Direct::new(None), framer: Framer::new(Checksum::Required), orders: Vec::new() }
    }
}

impl Board for Noted {
    fn request(&mut self, message: &ToBoard<'_>) {
        self.board.request(message);
    }

    fn step(&mut self, time_us: u64, pps_us: &[u64], arrivals: &[Arrival]) -> [Vec<u8>; 4] {
        let sent = self.board.step(time_us, pps_us, arrivals);
        let mut rest = sent[Port::Frontseat as usize].as_slice();
        while let Some(sentence) = self.framer.feed(&mut rest) {
            match ToFrontseat::parse(&sentence.unwrap(), &UNITS).unwrap() {
                ToFrontseat::Servo(servo) => self.orders.push(Order::Servo(servo.servo, servo.timeout_s)),
                ToFrontseat::Steer(steer) => self.orders.push(Order::Steer(steer)),
                _ => {}
            }
        }
        sent
    }

    fn heard(&mut self) -> &mut Heard {
        self.board.heard()
    }

    fn app(&self) -> &App {
        self.board.app()
    }
}

#[test]
fn commands_keep_their_limits_and_rates_and_lapse_by_themselves() {
    let (mut world, mut board) = (World::new(), Noted::new());
    parameters(&mut board, &[("app.command_timeout_s", 3.0), ("app.fin_limit_rad", 0.2), ("app.fin_rate_radps", 0.4)]);
    world.run(&mut board, 10);
    start(&mut board);
    world.run(&mut board, 120); // a dive and its levelling off
    let calibration = ServoCalibration::NOMINAL;
    // half a count of rounding at either end
    let count_rad = 1.0 / calibration.fins[0].counts_per_unit.abs();
    let mut last_rad = [0.0; 4];
    let (mut largest_rad, mut fastest_rad) = (0.0_f64, 0.0_f64);
    assert!(board.orders.len() > 1000, "ten a second");
    for order in &board.orders {
        let Order::Servo(bytes, timeout_s) = order else { panic!("{order:?}") };
        assert_eq!(*timeout_s, 3);
        let fins_rad = calibration.fins_rad(bytes);
        for (fin_rad, last_rad) in fins_rad.iter().zip(&last_rad) {
            largest_rad = largest_rad.max(fin_rad.abs());
            fastest_rad = fastest_rad.max((fin_rad - last_rad).abs());
        }
        last_rad = fins_rad;
    }
    assert!(largest_rad <= 0.2 + 0.5 * count_rad && largest_rad > 0.15, "{largest_rad}");
    assert!(fastest_rad <= 0.04 + count_rad && fastest_rad > 0.03, "{fastest_rad}");
}

#[test]
fn steering_commands_carry_their_timeout_too() {
    let (mut world, mut board) = (World::new(), Noted::new());
    parameters(&mut board, &[("app.control_mode", 1.0), ("app.attitude_source", 1.0), ("app.command_timeout_s", 4.0)]);
    world.run(&mut board, 10);
    start(&mut board);
    world.run(&mut board, 20);
    let steers = board.orders.iter().filter_map(|order| match order {
        Order::Steer(steer) => Some(steer),
        Order::Servo(..) => None,
    });
    let timeouts: Vec<u8> = steers.map(|steer| steer.timeout_s).collect();
    // every half second
    assert!(timeouts.len() >= 38 && timeouts.iter().all(|timeout_s| *timeout_s == 4), "{timeouts:?}");
}
