//! Clocks that turn over, days and years that end, seconds that are inserted: ranges and mission go on.

use crate::board::{Arrival, Board, Direct};
use crate::faults::{hear, last};
use crate::flight::start;
use crate::world::{
    LEAP_SECOND_US, PHASE_US, SOUND_SPEED_MPS, START_S, World, date_time, modem, received, ship_frame, statistics,
};
use backseat_app::Loss;
use backseat_core::state::{X, Y};
use backseat_wire::Error;
use backseat_wire::calendar::{Date, DateTime, TimeOfDay};
use backseat_wire::hostlink::{Mode, Port};
use backseat_wire::modem::{ClockMode, FromModem};

/// Board time at which a day begins, µs.
fn beginning_of(year: u16, month: u8, day: u8) -> u64 {
    let day = DateTime { date: Date::new(year, month, day).unwrap(), time: TimeOfDay::from_us(0) };
    day.unix_us() - START_S * 1_000_000 + PHASE_US
}

/// Ranges fused in a stretch of board time.
fn ranges(board: &mut Direct, from_us: u64, to_us: u64) -> usize {
    let is_range = |sensor, outcome| sensor == 7 && outcome == 0;
    let fusions = &board.heard().fusions;
    fusions.iter().filter(|f| is_range(f.sensor, f.outcome) && (from_us..to_us).contains(&f.time_us)).count()
}

/// A board that starts 110 s before a moment and dives, so that it is under way when the moment comes.
fn under_way_before(moment_us: u64, dvl: bool) -> (World, Direct) {
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.dvl = dvl;
    world.leap((moment_us - 110_000_000) / 100_000 * 100_000);
    world.run(&mut board, 10);
    start(&mut board);
    (world, board)
}

/// Goes on for some seconds and demands that nothing is wrong at any step.
fn fly(world: &mut World, board: &mut Direct, seconds: u64) {
    for _ in 0..10 * seconds {
        world.advance(board);
        let record = last(board);
        assert_eq!(record.mode, Mode::Navigating, "at {} µs: {:?}", record.time_us, record.reason);
        // As in a flight of no particular time; a fault shows as tens of metres.
        assert!(world.error_m(&record) < 3.0, "at {} µs: {} m", record.time_us, world.error_m(&record));
        assert_eq!(record.utc_us, date_time(record.time_us).unix_us());
    }
}

/// Flies 100 s up to a moment and 100 s beyond.
fn nothing_happens_at(moment_us: u64, dvl: bool) {
    let (mut world, mut board) = under_way_before(moment_us, dvl);
    // The first label may be late: it is read at once, whenever that is.
    let odd = board.app().health().odd_times();
    fly(&mut world, &mut board, 200);
    let after_us = last(&mut board).time_us;
    assert!(after_us > moment_us + 80_000_000);
    // A packet each 20 s, some seconds late.
    let counts = [ranges(&mut board, 0, moment_us), ranges(&mut board, moment_us, after_us)];
    assert!(counts.iter().all(|count| *count >= 3), "{counts:?}");
    let health = board.app().health();
    for loss in [Loss::NoTime, Loss::Arrival, Loss::Repeated, Loss::Absurd] {
        assert_eq!(health.lost_packets(loss), 0, "{loss:?}");
    }
    assert_eq!(health.odd_times(), odd);
    assert_eq!(Port::DEVICES.map(|port| health.rejected(port)), [0; 4]);
}

#[test]
fn val_midnight_and_the_ends_of_month_and_year() {
    for (year, month, day) in [(2026, 11, 21), (2026, 12, 1), (2027, 1, 1), (2028, 2, 29), (2028, 3, 1)] {
        nothing_happens_at(beginning_of(year, month, day), false);
    }
}

#[test]
fn val_a_range_that_flies_over_midnight() {
    let midnight_us = beginning_of(2026, 11, 21);
    let (mut world, mut board) = under_way_before(midnight_us, false);
    while last(&mut board).time_us < midnight_us + 50_000 {
        world.advance(&mut board);
    }
    // Sent in the last second of the day by a ship 1.7 km ahead; the modem tells of it in 0.16 s.
    let toa_us = last(&mut board).time_us + 110_000 - 50_000;
    let launch_us = midnight_us - 1_000_000;
    let range_m = SOUND_SPEED_MPS * (toa_us - launch_us) as f64 * 1e-6;
    world.ship_m = [world.x[X] + range_m, world.x[Y]];
    let packet = [
        modem(&FromModem::ReceiveBegins { psk: false }),
        received(&ship_frame(world.ship_m, date_time(launch_us).unix_us() / 1_000_000)),
        statistics(toa_us, ClockMode(3)),
    ];
    board.heard().fusions.clear();
    hear(&mut world, &mut board, &packet);
    let range = board.heard().fusions.iter().find(|fusion| fusion.sensor == 7).expect("a range");
    // Gated it would be at five metres or so; a day off it would be absurd.
    assert!(range.outcome == 0 && range.innovation.abs() < 4.0, "{range:?}");
}

#[test]
fn val_counters_of_the_devices_and_of_time_itself_turn_over() {
    const AHRS_US: u64 = 16 << 32; // the 3DM-GX3's timer, 19 h
    const ENSEMBLES_US: u64 = 100_000 << 16; // the low word of PD0's ensemble number
    const MICROSECONDS: u64 = 1 << 32;
    const MILLISECONDS: u64 = 1000 << 32; // 49.7 days
    for moment_us in [AHRS_US, ENSEMBLES_US, MICROSECONDS, MILLISECONDS] {
        nothing_happens_at(moment_us, true);
    }
}

#[test]
fn val_a_leap_second_under_water_leaves_the_ranges() {
    // Ship and modem insert the second; the board, without a label, does not hear of it.
    let midnight_us = beginning_of(2027, 1, 1);
    LEAP_SECOND_US.set(midnight_us);
    let (mut world, mut board) = under_way_before(midnight_us, false);
    let end_us = midnight_us + 100_000_000;
    while last(&mut board).time_us < end_us {
        world.advance(&mut board);
        let record = last(&mut board);
        assert_eq!(record.mode, Mode::Navigating, "at {} µs: {:?}", record.time_us, record.reason);
        // The bridge to the time of arrival is a second off from then on: a metre of way at most.
        assert!(world.error_m(&record) < 4.0, "at {} µs: {} m", record.time_us, world.error_m(&record));
    }
    assert!(ranges(&mut board, midnight_us + 10_000_000, end_us) >= 3);
}

#[test]
fn val_a_leap_second_at_the_surface_is_learnt() {
    let midnight_us = beginning_of(2027, 1, 1);
    LEAP_SECOND_US.set(midnight_us);
    let (mut world, mut board) = (World::new(), Direct::new(None));
    world.leap((midnight_us - 30_000_000) / 100_000 * 100_000);
    world.run(&mut board, 29);
    let off_us = |board: &mut Direct| {
        let record = last(board);
        record.utc_us as i64 - date_time(record.time_us).unix_us() as i64
    };
    assert_eq!((last(&mut board).mode, off_us(&mut board)), (Mode::Navigating, 0));
    // What a receiver says in the inserted second itself is refused, and nothing else comes of it.
    let sentence = b"GPRMC,235960.00,A,4130.0000,N,07042.0000,W,0.00,0.0,311226,,,A";
    let bytes =
        [b"$", &sentence[..], format!("*{:02X}\r\n", sentence.iter().fold(0, |sum, byte| sum ^ byte)).as_bytes()]
            .concat();
    let refused = board.app().health().rejected_for(Port::Frontseat, Error::OutOfRange);
    let time_us = last(&mut board).time_us;
    board.step(time_us + 1, &[], &[Arrival { port: Port::Frontseat, time_us, bytes }]);
    assert_eq!(board.app().health().rejected_for(Port::Frontseat, Error::OutOfRange), refused + 1);
    assert_eq!((last(&mut board).mode, off_us(&mut board)), (Mode::Navigating, 0));
    // Three labels that agree; the fixes of the seconds in between count all the same.
    world.run(&mut board, 6);
    assert_eq!((last(&mut board).mode, off_us(&mut board)), (Mode::Navigating, 0));
    let odd = board.app().health().odd_times();
    assert!((2..6).contains(&odd), "{odd}");
    world.run(&mut board, 60);
    assert_eq!(board.app().health().odd_times(), odd);
    assert_eq!(last(&mut board).mode, Mode::Navigating);
    assert!(ranges(&mut board, midnight_us + 10_000_000, u64::MAX) >= 2);
}
