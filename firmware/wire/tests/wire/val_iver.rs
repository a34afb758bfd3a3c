use crate::vectors::{assert_framed_at_every_split, sentence, sentences};
use backseat_wire::Error;
use backseat_wire::iver::servo::{LinearServo, ServoCalibration};
use backseat_wire::iver::{
    Acknowledge, FromFrontseat, FrontseatError, FrontseatMode, ServoBytes, Steer, ToFrontseat, Units,
};
use backseat_wire::nmea::{Checksum, Sentence};

const FILE: &str = include_str!("../vectors/iver3.nmea");
const FEET: Units = Units::remote_helm(4);
const METRES: Units = Units::remote_helm(5);

#[test]
fn val_every_vector_is_taken_and_survives_being_written() {
    let mut buffer = [0; 256];
    let mut taken = 0;
    for (_, line) in sentences(FILE) {
        for units in [FEET, METRES] {
            let parsed = sentence(line);
            let written = match (FromFrontseat::parse(&parsed, &units), ToFrontseat::parse(&parsed, &units)) {
                (Ok(message), Err(Error::Unknown)) => {
                    let written = message.emit(&units, &mut buffer).unwrap();
                    let again = Sentence::from_line(written, Checksum::Required).unwrap();
                    assert_eq!(FromFrontseat::parse(&again, &units), Ok(message), "{line}");
                    written
                }
                (Err(Error::Unknown), Ok(message)) => {
                    let written = message.emit(&units, &mut buffer).unwrap();
                    let again = Sentence::from_line(written, Checksum::Required).unwrap();
                    assert_eq!(ToFrontseat::parse(&again, &units), Ok(message), "{line}");
                    written
                }
                other => panic!("{line}: {other:?}"),
            };
            // Ours is the same text, except for the older spelling of manual parking, the mark for "invalid", and
            // commas.
            let own = std::str::from_utf8(written).unwrap().trim_end();
            if !line.contains("Mp,") && !line.contains("-3200") && !line.contains("$OSD,,") {
                assert_eq!(own, line);
            }
        }
        taken += 1;
    }
    assert_eq!(taken, 29);
}

#[test]
fn val_published_compass() {
    let line = "$C82.8P-3.89R-2.63T20.3D3.2*78";
    let FromFrontseat::Compass(compass) = FromFrontseat::parse(&sentence(line), &METRES).unwrap() else { panic!() };
    for (value, degrees) in [(compass.heading_rad, 82.8_f64), (compass.pitch_rad, -3.89), (compass.roll_rad, -2.63)] {
        assert!((value - degrees.to_radians()).abs() < 1e-12);
    }
    assert_eq!(compass.temperature_degc, Some(20.3));
    // Feet, whatever the version.
    assert!((compass.depth_m.unwrap() - 3.2 * 0.3048).abs() < 1e-12);
}

#[test]
fn val_state() {
    let line = "$OSI,7F7F8282B4,A,3,41.52425,-70.67121,2.4,98.1,N,31.1,P0,-14.6,TEST,00:12:20,311.0,9.8,,*75";
    for (units, metre) in [(FEET, 0.3048), (METRES, 1.0)] {
        let FromFrontseat::State(state) = FromFrontseat::parse(&sentence(line), &units).unwrap() else { panic!() };
        assert_eq!(state.servo, ServoBytes { fins: [0x7F, 0x7F, 0x82, 0x82], motor: 0xB4 });
        assert_eq!((state.mode, state.error, state.next_waypoint), (FrontseatMode::Servo, FrontseatError::None, 3));
        assert_eq!(state.position_deg, [41.52425, -70.67121]);
        assert!((state.speed_mps - 2.4 * 1852.0 / 3600.0).abs() < 1e-12);
        assert_eq!((state.mission, state.remaining_time), ("TEST", "00:12:20"));
        assert!((state.heading_rad - 311.0_f64.to_radians()).abs() < 1e-12);
        assert!(
            (state.depth_m - 9.8 * metre).abs() < 1e-12 && (state.altitude_m.unwrap() - 31.1 * metre).abs() < 1e-12
        );
        assert!((state.declination_rad.unwrap() + 14.6_f64.to_radians()).abs() < 1e-12);
        assert_eq!(state.park_time_s, Some(0));
    }
}

#[test]
fn both_spellings_of_manual_parking_and_what_takes_commands() {
    for (line, mode, accepts) in [
        ("$OSI,8080808080,mP,1,0,0,0,0,N,,,,,,0,0", FrontseatMode::ManualParking, true),
        ("$OSI,8080808080,Mp,1,0,0,0,0,N,,,,,,0,0", FrontseatMode::ManualParking, true),
        ("$OSI,8080808080,P,1,0,0,0,0,N,,,,,,0,0", FrontseatMode::Parking, false),
        ("$OSI,8080808080,S,1,0,0,0,0,Sed,,,,,,0,0", FrontseatMode::Stopped, false),
    ] {
        let FromFrontseat::State(state) = FromFrontseat::parse(&sentence(line), &METRES).unwrap() else { panic!() };
        assert_eq!((state.mode, state.mode.accepts_commands()), (mode, accepts));
    }
}

#[test]
fn depth_of_a_command_is_feet_before_remote_helm_5() {
    let steer = ToFrontseat::Steer(Steer {
        heading_rad: 123.4_f64.to_radians(),
        depth_m: 3.0,
        max_pitch_rad: 45.0_f64.to_radians(),
        speed_mps: 2.5 * 1852.0 / 3600.0,
        timeout_s: 5,
    });
    let mut buffer = [0; 64];
    assert_eq!(steer.emit(&METRES, &mut buffer).unwrap(), b"$OMS,123.4,3.0,45.0,2.5,5*79\r\n");
    // 3 m are 9.84 ft.
    assert_eq!(steer.emit(&FEET, &mut buffer).unwrap(), b"$OMS,123.4,9.8,45.0,2.5,5*7B\r\n");
}

#[test]
fn heading_of_a_command_stays_below_360() {
    let mut buffer = [0; 64];
    for (heading_deg, text) in [(359.96_f64, "0.0"), (-0.1, "359.9"), (720.0, "0.0"), (-90.0, "270.0")] {
        let steer = Steer {
            heading_rad: heading_deg.to_radians(),
            depth_m: 0.0,
            max_pitch_rad: 0.0,
            speed_mps: 0.0,
            timeout_s: 2,
        };
        let written = ToFrontseat::Steer(steer).emit(&METRES, &mut buffer).unwrap();
        assert!(written.starts_with(format!("$OMS,{text},0.0,").as_bytes()), "{}", String::from_utf8_lossy(written));
    }
    let nan = Steer { heading_rad: f64::NAN, depth_m: 0.0, max_pitch_rad: 0.0, speed_mps: 0.0, timeout_s: 2 };
    assert_eq!(ToFrontseat::Steer(nan).emit(&METRES, &mut buffer), Err(Error::OutOfRange));
    let late = Steer { heading_rad: 0.0, timeout_s: 121, ..nan };
    assert_eq!(ToFrontseat::Steer(late).emit(&METRES, &mut buffer), Err(Error::OutOfRange));
}

#[test]
fn servo_order_is_top_bottom_port_starboard_motor() {
    let ToFrontseat::Servo(command) = ToFrontseat::parse(&sentence("$OMP,01020304FE,00,9"), &METRES).unwrap() else {
        panic!()
    };
    assert_eq!((command.servo, command.timeout_s), (ServoBytes { fins: [1, 2, 3, 4], motor: 0xFE }, 9));
    let lower = ToFrontseat::parse(&sentence("$OMP,01020304fe,00,9"), &METRES).unwrap();
    assert_eq!(lower, ToFrontseat::Servo(command));
}

#[test]
fn calibration_says_what_was_commanded() {
    let mut calibration = ServoCalibration::NOMINAL;
    calibration.fins[0].counts_per_unit = -calibration.fins[0].counts_per_unit;
    calibration.fins[1].null = 0x7C;
    for step in -60..=60 {
        let asked = f64::from(step) * 0.01;
        let bytes = calibration.bytes([asked; 4], 300.0 * asked);
        assert!(bytes.fins.into_iter().chain([bytes.motor]).all(|byte| byte != 0 && byte != 0xFF));
        for (servo, angle) in calibration.fins.iter().zip(calibration.fins_rad(&bytes)) {
            let wanted = asked.clamp(-servo.limit, servo.limit);
            // Half a count, and a whole one at the limit, which is never exceeded.
            let count = 1.0 / servo.counts_per_unit.abs();
            assert!(
                (angle - wanted).abs() <= if wanted == asked { 0.5 } else { 1.0 } * count + 1e-12,
                "{asked} {angle}"
            );
            assert!(angle.abs() <= servo.limit + 1e-12);
            // What was commanded is commanded again by itself.
            assert_eq!(servo.to_byte(angle), servo.to_byte(wanted));
        }
    }
    assert_eq!(calibration.fins[0].to_byte(0.1), 0x80 - 16);
    assert_eq!(ServoCalibration::NOMINAL.bytes([f64::NAN; 4], f64::INFINITY), ServoBytes::NEUTRAL);
    for broken in [f64::NAN, 0.0, f64::INFINITY] {
        let servo = LinearServo { counts_per_unit: broken, null: 3, limit: broken };
        assert!((1..=254).contains(&servo.to_byte(1.0)));
    }
}

#[test]
fn refused_by_cause() {
    for (line, cause) in [
        ("$OSI,80808080,N,2,41.5,-70.6,2.5,120.4,N,,,,,,310.2,3.2", Error::Malformed),
        ("$OSI,8080808080,Z,2,41.5,-70.6,2.5,120.4,N,,,,,,310.2,3.2", Error::Malformed),
        ("$OSI,8080808080,N,2,91.5,-70.6,2.5,120.4,N,,,,,,310.2,3.2", Error::OutOfRange),
        ("$OSI,8080808080,N,2,41.5,-70.6,2.5,120.4,N,,,,,,310.2", Error::Missing),
        ("$OPI,87.5,512.3,61.2,25.9,2.36,502,X,0", Error::Malformed),
        ("$ACK,8,2,0", Error::Malformed),
        ("$ACK,300,0,0", Error::OutOfRange),
        ("$DVL,1.2,,0.01", Error::Missing),
        ("$CPRTD", Error::Missing),
        ("$C12.3P-1.0", Error::Missing),
        ("$QQQ,1", Error::Unknown),
    ] {
        assert_eq!(FromFrontseat::parse(&sentence(line), &METRES).unwrap_err(), cause, "{line}");
    }
    for (line, cause) in [
        ("$OMS,361.0,5.0,45.0,2.5,5", Error::OutOfRange),
        ("$OMS,123.4,5.0,45.0,2.5,121", Error::OutOfRange),
        ("$OMS,123.4,5.0,45.0,2.5", Error::Missing),
        ("$OMS,1e3,5.0,45.0,2.5,5", Error::Malformed),
        ("$OMP,8080808080,01,2", Error::Malformed),
        ("$OMP,80808080,00,2", Error::Malformed),
        ("$OMSTOP,1", Error::Malformed),
        ("$OJW,1000", Error::OutOfRange),
        ("$OSD,G,X", Error::Malformed),
        ("$OMLOAD,x,0", Error::Unknown),
    ] {
        assert_eq!(ToFrontseat::parse(&sentence(line), &METRES).unwrap_err(), cause, "{line}");
    }
    assert_eq!(Acknowledge::malformed(Acknowledge::SERVO), 21);
}

#[test]
fn framed_at_every_split() {
    let lines: Vec<&str> = sentences(FILE).into_iter().map(|(_, line)| line).take(12).collect();
    assert_framed_at_every_split(&lines);
}
