use super::*;
use crate::log::LogRow;
use backseat_core::dynamics::Attitude;
use nalgebra::Vector3;

/// Ten minutes of a vehicle that dives up and down along a circle, rolls and slips, every sensor at 5 Hz, as it must be.
fn good() -> Log {
    let mut log = Log::default();
    let (mut x, mut y, mut depth) = (0.0_f64, 0.0_f64, 15.0_f64);
    for k in 0..3000_u64 {
        let t = k as f64 * 0.2;
        let (heading, rate) = (0.03 * t, 0.03);
        let pitch = 0.2 * (0.1 * t).sin();
        let (roll, sway, heave) = (0.1 * (0.4 * t).sin(), 0.1 * (0.02 * t).cos(), 0.08 * (0.3 * t).sin());
        let noise = |salt: u64| ((k * 7919 + salt * 104_729) % 1000) as f64 * 1e-3 - 0.5;
        let mut row = LogRow::new(k * 200_000);
        row.set_all(
            Column::Roll,
            &[roll + 0.01 * noise(1), pitch + 0.005 * noise(2), heading.rem_euclid(std::f64::consts::TAU)],
        );
        row.set_all(
            Column::P,
            &[
                0.04 * (0.4 * t).cos() + 0.01 * noise(3),
                0.02 * (0.1 * t).cos() + 0.004 * noise(4),
                rate + 0.004 * noise(5),
            ],
        );
        row.set_all(Column::DvlU, &[1.5 + 0.01 * noise(6), sway + 0.01 * noise(7), heave + 0.01 * noise(8)]);
        row.set(Column::Depth, depth);
        row.set_all(Column::GpsX, &[x, y]);
        row.set_all(Column::PropRpm, &[1200.0, 0.05, -0.05, 0.0, 0.0]);
        let velocity = Attitude::new(&[roll, pitch, heading].into()).rotation() * Vector3::new(1.5, sway, heave);
        (x, y, depth) = (x + 0.2 * velocity.x, y + 0.2 * velocity.y, depth + 0.2 * velocity.z);
        log.rows.push(row);
    }
    log
}

/// The log with one column changed.
fn with(column: Column, change: impl Fn(f64) -> f64) -> Log {
    let mut log = good();
    for row in &mut log.rows {
        let value = row.get(column).unwrap();
        row.set(column, change(value));
    }
    log
}

fn messages(log: &Log) -> String {
    Examination::of(log).suspicions().map(|finding| finding.message.clone()).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_good_log_is_not_suspicious() {
    let examination = Examination::of(&good());
    // its fixes are those of no receiver, at 9 to 15 m of depth
    let found: Vec<&str> = examination.findings.iter().map(|finding| finding.message.as_str()).collect();
    assert!(matches!(found[..], [one] if one.contains("more than 3 m of depth")), "{found:?}");
    assert!(!examination.is_suspicious());
    let depth = examination.columns.iter().find(|summary| summary.column == Column::Depth).unwrap();
    assert_eq!((depth.samples, depth.filled), (3000, 1.0));
    assert!((depth.rate_hz().unwrap() - 5.0).abs() < 1e-9);
}

#[test]
fn units_and_signs_are_found() {
    let degrees = |x: f64| x.to_degrees();
    for (column, change, part) in [
        (Column::Heading, &degrees as &dyn Fn(f64) -> f64, "heading_rad reaches 3"),
        (Column::Pitch, &degrees, "pitch_rad is in deg: "),
        (Column::R, &degrees, "r_radps is in deg/s"),
        (Column::R, &|x| -x, "r_radps has the wrong sign: the change of heading_rad on r_radps has slope -"),
        (Column::Heading, &|x| -x, "heading_rad is counted counter-clockwise (negated): "),
        (Column::Pitch, &|x| -x, "pitch_rad has the wrong sign: "),
        (Column::Depth, &|x| -20.0 - x, "mended by columns.depth_m = { column = \"depth_m\", sign = -1 }"),
        (Column::Depth, &|x| 40.0 - x, "depth_m has the wrong sign: "),
        (Column::P, &|x| -x, "p_radps has the wrong sign; or roll_rad has the wrong sign: "),
        (Column::Q, &|x| -x, "q_radps has the wrong sign: "),
        (Column::Roll, &|x| -x, "or roll_rad has the wrong sign: "),
        (Column::DvlU, &|x| -x, "dvl_u_mps has the wrong sign: "),
        (Column::DvlV, &|x| -x, "dvl_v_mps has the wrong sign: "),
        (Column::DvlW, &|x| -x, "dvl_w_mps has the wrong sign: "),
        (Column::DvlU, &|x| 100.0 * x, "dvl_u_mps"),
        (Column::Depth, &|_| 4.25, "depth_m is 4.25 in all 3000 samples while pitch_rad goes from -0.2"),
        (Column::FinTop, &|x| 2500.0 * x, "fin_top_rad reaches 125"),
        (Column::GpsX, &|x| 4.0e6 + x, "is it a UTM coordinate"),
    ] {
        let found = messages(&with(column, change));
        assert!(found.contains(part), "{column:?}: expected {part:?} in {found:?}");
    }
}

#[test]
fn swapped_positions_and_other_times_are_found() {
    let mut log = good();
    for row in &mut log.rows {
        let [x, y] = row.gnss_m().unwrap();
        row.set_all(Column::GpsX, &[y, x]);
    }
    assert!(messages(&log).contains("gps_x_m and gps_y_m are exchanged: "), "{}", messages(&log));
    for (factor, guess) in [(1000, "in milliseconds?"), (1_000_000, "in microseconds?")] {
        let mut log = good();
        log.rows.iter_mut().for_each(|row| row.time_us *= factor);
        assert!(messages(&log).contains(guess), "{}", messages(&log));
    }
}

/// In knots are all three axes; the unit is seen without fixes as well, and of a logged speed beside a current.
#[test]
fn velocities_in_knots_are_found() {
    let in_knots = |fixes: bool| {
        let mut log = good();
        for row in &mut log.rows {
            let knots = row.dvl_mps().unwrap().map(|mps| mps * 3600.0 / 1852.0);
            row.set_all(Column::DvlU, &knots);
            let t = row.time_us as f64 * 1e-6;
            let [x, y] = row.gnss_m().unwrap();
            row.set_all(Column::GpsX, &if fixes { [x + 0.3 * t, y] } else { [f64::NAN; 2] });
        }
        log
    };
    let found = messages(&in_knots(false));
    assert!(found.contains("dvl_u_mps, dvl_v_mps, dvl_w_mps are in kn: the change of depth_m"), "{found}");
    let mut log = in_knots(true);
    for row in &mut log.rows {
        let speed = row.get(Column::DvlU).unwrap();
        row.set_all(Column::DvlU, &[f64::NAN; 3]).set(Column::SpeedLog, speed).set(Column::Roll, f64::NAN);
    }
    let found = messages(&log);
    assert!(found.contains("speed_log_mps is in kn"), "{found}");
}

/// A pitch that swings as much by its own error as by the vehicle halves the factor of the surge, which is no unit.
#[test]
fn errors_of_the_attitude_are_no_unit() {
    for swing in [0.2, 0.21, 0.22, 0.23] {
        let mut log = good();
        for row in &mut log.rows {
            let t = row.time_us as f64 * 1e-6;
            let pitch = row.get(Column::Pitch).unwrap() + swing * (0.15 * t).sin();
            row.set(Column::Pitch, pitch).set_all(Column::GpsX, &[f64::NAN; 2]);
        }
        assert!(!messages(&log).contains("are in"), "{swing}: {}", messages(&log));
    }
}

#[test]
fn an_unwound_heading_is_a_heading() {
    // ten minutes at 0.03 rad/s: almost three turns
    let mut log = good();
    for (k, row) in log.rows.iter_mut().enumerate() {
        row.set(Column::Heading, 0.006 * k as f64);
    }
    assert_eq!(messages(&log), "");
}

#[test]
fn a_rounded_heading_about_north_is_in_radians() {
    // to four digits a turn is 6.2832, more than 2 pi; about north every second sample wraps
    let mut log = good();
    for (k, row) in log.rows.iter_mut().enumerate() {
        let swing = row.get(Column::Heading).unwrap() + if k % 2 == 0 { 0.004 } else { -0.004 };
        row.set(Column::Heading, (swing.rem_euclid(std::f64::consts::TAU) * 1e4).round() * 1e-4);
    }
    log.rows[0].set(Column::Heading, (std::f64::consts::TAU * 1e4).ceil() * 1e-4);
    assert_eq!(angles::heading_units(&log).len(), 0);
    assert!(!messages(&log).contains("heading_rad"), "{}", messages(&log));
}

#[test]
fn held_readings_outliers_and_lone_columns() {
    let mut log = good();
    for k in 0..log.rows.len() {
        let held = log.rows[k / 10 * 10].get(Column::Pitch).unwrap();
        log.rows[k].set(Column::Pitch, held);
    }
    log.rows[700].set(Column::DvlU, -32.768);
    let found = Examination::of(&log);
    assert!(!found.is_suspicious(), "{:?}", found.findings);
    let text: Vec<&str> = found.findings.iter().map(|finding| finding.message.as_str()).collect();
    assert!(text.iter().any(|m| m.starts_with("pitch_rad repeats the value before in 90 %")), "{text:?}");
    assert!(text.iter().any(|m| m.starts_with("dvl_u_mps reaches -32.7680 (1 of 3000 samples)")), "{text:?}");
    let mut log = good();
    for (k, row) in log.rows.iter_mut().enumerate() {
        row.set(if k % 2 == 0 { Column::Heading } else { Column::Roll }, f64::NAN);
    }
    assert!(messages(&log).contains("roll_rad, pitch_rad, heading_rad: no row has all of them"));
}

#[test]
fn the_speed_of_a_motor_says_nothing_of_the_propeller() {
    let mut log = with(Column::PropRpm, |rpm| 10.0 * rpm);
    assert!(messages(&log).contains("for each turn of prop_rpm"), "{}", messages(&log));
    log.is_motor_rpm = true;
    assert_eq!(messages(&log), "");
    let untested = Examination::of(&log).untested;
    let size = untested.iter().find(|test| test.test == "propeller against speed, size").unwrap();
    assert!(size.why.contains("that of the motor") && !size.is_inconclusive, "{}", size.why);
}

/// Sway by the DVL has neither sign where it is noise: that was compared, and is no lack of the log.
#[test]
fn what_was_compared_without_a_conclusion_is_inconclusive() {
    let log = with(Column::DvlV, |v| (1e6 * v).sin());
    let untested = Examination::of(&log).untested;
    let compared: Vec<_> = untested.iter().filter(|test| test.is_inconclusive).collect();
    assert!(compared.iter().any(|test| test.why.contains("slope")), "{untested:?}");
    assert!(compared.iter().all(|test| !test.lacks_columns), "{untested:?}");
}

/// The same with a fix by USBL every ten seconds of a ship 250 m to the south, `change` applied to what it reads.
fn seen_by_ship(change: impl Fn([f64; 3]) -> [f64; 3]) -> Log {
    let mut log = good();
    for row in log.rows.iter_mut().step_by(50) {
        let [x, y] = row.gnss_m().unwrap();
        let (north, east, down) = (x + 250.0, y + 30.0, row.get(Column::Depth).unwrap());
        let level = north.hypot(east);
        let read = [level.hypot(down), east.atan2(north), (-down).atan2(level)];
        row.set_all(Column::UsblRange, &change(read)).set_all(Column::ShipX, &[-250.0, -30.0]);
    }
    log
}

#[test]
fn fixes_by_usbl_are_tested_against_depth_and_gnss() {
    assert!(!Examination::of(&seen_by_ship(|read| read)).is_suspicious());
    // an array that is turned by 0.1 rad is no mistake in recording
    assert!(!Examination::of(&seen_by_ship(|[range, bearing, up]| [range, bearing + 0.1, up])).is_suspicious());
    let depression = messages(&seen_by_ship(|[range, bearing, up]| [range, bearing, -up]));
    assert!(depression.contains("columns.usbl_elevation_rad") && depression.contains("sign = -1"), "{depression}");
    let degrees = messages(&seen_by_ship(|[range, bearing, up]| [range, bearing.to_degrees(), up.to_degrees()]));
    assert!(degrees.contains("usbl_bearing_rad") && degrees.contains("are in deg:"), "{degrees}");
    let from_east = messages(&seen_by_ship(|[range, bearing, up]| [range, std::f64::consts::FRAC_PI_2 - bearing, up]));
    assert!(from_east.contains("USBL's bearing against fixes"), "{from_east}");
}

/// At a quay: speeds of nothing, and fixes that scatter.
#[test]
fn a_vehicle_that_lies_still_is_told() {
    let log = |speed_mps: f64| {
        let rows = (0..60_u64).map(|t| {
            let mut row = LogRow::new(t * 1_000_000);
            row.set(Column::SpeedLog, speed_mps).set(Column::GpsX, 0.4 * (t as f64).sin()).set(Column::GpsY, 1.0);
            row
        });
        Log { rows: rows.collect(), ..Log::default() }
    };
    let is_told = |log: &Log| Examination::of(log).findings.iter().any(|found| found.message.contains("does not move"));
    assert!(is_told(&log(0.0)) && !is_told(&log(0.8)));
}

/// Rates that do not fit speak of the time only where more than one relation does, and of a vehicle that moves.
#[test]
fn a_vehicle_that_hardly_moves_says_nothing_of_the_time() {
    let mut log = good();
    log.rows.iter_mut().for_each(|row| row.time_us /= 60);
    assert!(messages(&log).contains("t_s is in min"), "{}", messages(&log));
    for row in &mut log.rows {
        row.set(Column::DvlU, 0.01);
    }
    assert!(!messages(&log).contains("t_s is in"), "{}", messages(&log));
}

/// Down a spiral the roll rate is −ψ̇ sin θ, and roll stays what it is.
#[test]
fn a_spiral_is_no_wrong_roll_rate() {
    let (turning, pitch) = (0.2, -0.6_f64);
    let log = |p: f64| {
        let rows = (0..3000_u64).map(|k| {
            let noise = |salt: u64| 0.02 * (((k * 7919 + salt * 104_729) % 1000) as f64 * 1e-3 - 0.5);
            let heading = (turning * k as f64 * 0.2).rem_euclid(std::f64::consts::TAU);
            let mut row = LogRow::new(k * 200_000);
            row.set_all(Column::Roll, &[noise(1), pitch + noise(2), heading]);
            row.set_all(Column::P, &[p + noise(3), noise(4), turning * pitch.cos() + noise(5)]);
            row
        });
        Log { rows: rows.collect(), ..Log::default() }
    };
    let said = messages(&log(-turning * pitch.sin()));
    assert!(!said.contains("turns of more than"), "{said}");
    let said = messages(&log(0.5));
    assert!(said.contains("turns of more than"), "{said}");
}

/// From the middle on.
fn with_from(column: Column, from_s: f64, change: impl Fn(f64) -> f64) -> Log {
    let mut log = good();
    for row in log.rows.iter_mut().filter(|row| row.time_us as f64 * 1e-6 >= from_s) {
        let value = row.get(column).unwrap();
        row.set(column, change(value));
    }
    log
}

fn later(mut log: Log, by_s: f64) -> Log {
    log.rows.iter_mut().for_each(|row| row.time_us += (by_s * 1e6) as u64);
    log
}

#[test]
fn a_mistake_in_a_part_of_a_log_is_said_with_its_time() {
    for (log, expected) in [
        (with_from(Column::R, 300.0, |r| -r), "from about 300 s on r_radps has the wrong sign"),
        (later(with_from(Column::R, 300.0, |r| -r), 1000.0), "from about 1300 s on r_radps has the wrong sign"),
        (with_from(Column::PropRpm, 300.0, |rpm| -rpm), "from about 300 s on prop_rpm has the wrong sign"),
        (with_from(Column::DvlW, 300.0, |w| -w), "from about 300 s on dvl_w_mps has the wrong sign"),
    ] {
        let found = Examination::of(&log);
        let said: Vec<&str> = found.suspicions().map(|finding| finding.message.as_str()).collect();
        assert!(said.len() == 1 && said[0].contains(expected), "{said:?}");
        // a mapping would break the other half
        assert!(found.findings.iter().all(|finding| finding.mend.is_none()), "{said:?}");
    }
}

#[test]
fn a_depth_that_leaps_and_stays_is_told_and_one_reading_is_not() {
    let moved = messages(&with_from(Column::Depth, 300.0, |depth| depth + 4.0));
    assert!(moved.contains("depth_m leaps by 4.1 m at 300 s"), "{moved}");
    let mut log = good();
    log.rows[1500].set(Column::Depth, 40.0);
    assert_eq!(messages(&log), "");
}

/// Of a million samples of one value every stretch stands elsewhere: that is found out of each without reading on.
#[test]
fn a_sensor_that_stands_still_is_no_stretch_written_twice() {
    let mut log = Log::default();
    log.rows.extend((0..1_000_000).map(|k| {
        let mut row = LogRow::new(k * 100_000);
        row.set(Column::Depth, 1.0);
        row
    }));
    assert!(!messages(&log).contains("written twice"));
}

#[test]
fn a_stretch_that_was_written_twice_is_told() {
    let mut log = good();
    let again: Vec<LogRow> = log.rows[500..1000].to_vec();
    let (begin_us, end_us) = (again[0].time_us, log.rows[log.rows.len() - 1].time_us + 200_000);
    log.rows.extend(again.into_iter().map(|mut row| {
        row.time_us = row.time_us - begin_us + end_us;
        row
    }));
    let said = messages(&log);
    assert!(said.contains("from 100 to 200 s stands again from 600 s on, to the last digit (500 samples)"), "{said}");
}
