//! Text sentences: published ones with other characters in them, and positions, angles and speeds on the grid of the
//! wire.

use super::generate::{grid, instant, text, time_of_day};
use backseat_wire::Error;
use backseat_wire::ahrs::os5000::Os5000;
use backseat_wire::dvl::{DvlSample, pd6};
use backseat_wire::gps::{Gga, Rmc};
use backseat_wire::iver::{
    Acknowledge, Battery, Compass, FromFrontseat, FrontseatDvl, FrontseatError, FrontseatMode, PositionAid, Power,
    Request, Servo, ServoBytes, Start, State, Steer, ToFrontseat, Units, VelocityAid,
};
use backseat_wire::modem::{FromModem, ToModem};
use backseat_wire::nmea::{Checksum, Sentence};
use proptest::array::{uniform3, uniform4};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::sample::{Index, select};

const METRES: Units = Units::remote_helm(5);
const DEGREE: f64 = std::f64::consts::PI / 180.0;
const KNOT_MPS: f64 = 1852.0 / 3600.0;
const ROOM: usize = 2048;

/// Reads a line and writes it; what is written then reads and writes as itself. Nothing for what is not understood, or
/// does not fit the digits of its fields.
macro_rules! settle {
    ($name:ident, |$sentence:ident| $parse:expr, |$message:ident, $buffer:ident| $emit:expr) => {
        fn $name(line: &[u8]) -> Result<Option<Vec<u8>>, TestCaseError> {
            fn once(line: &[u8], checksum: Checksum) -> Result<Vec<u8>, Error> {
                let $sentence = &Sentence::from_line(line, checksum)?;
                let $message = $parse?;
                let $buffer = &mut [0; ROOM];
                Ok($emit?.to_vec())
            }
            let Ok(written) = once(line, Checksum::Optional) else { return Ok(None) };
            let again = once(written.strip_suffix(b"\r\n").unwrap_or(b"no line end"), Checksum::Required);
            let show = |bytes: &[u8]| bytes.escape_ascii().to_string();
            prop_assert_eq!(again.as_deref().map(show), Ok(show(&written)), "of {}", show(line));
            Ok(Some(written))
        }
    };
}

settle!(from_frontseat, |s| FromFrontseat::parse(s, &METRES), |m, b| m.emit(&METRES, b));
settle!(to_frontseat, |s| ToFrontseat::parse(s, &METRES), |m, b| m.emit(&METRES, b));
settle!(from_modem, |s| FromModem::parse(s), |m, b| m.emit(b));
settle!(to_modem, |s| ToModem::parse(s), |m, b| m.emit(b));
settle!(rmc, |s| Rmc::parse(s), |m, b| m.emit(b));
settle!(gga, |s| Gga::parse(s), |m, b| m.emit(b));
settle!(os5000, |s| Os5000::parse(s), |m, b| m.emit(b));

type Settle = fn(&[u8]) -> Result<Option<Vec<u8>>, TestCaseError>;
const ALL: [Settle; 7] = [from_frontseat, to_frontseat, from_modem, to_modem, rmc, gga, os5000];

/// Published sentences without their checksums, so that changes reach the parsers.
fn published() -> Vec<&'static str> {
    let files = [
        include_str!("../../vectors/iver3.nmea"),
        include_str!("../../vectors/micromodem.nmea"),
        include_str!("../../vectors/gps.nmea"),
        include_str!("../../vectors/os5000.nmea"),
    ];
    let lines = files.into_iter().flat_map(str::lines).filter(|line| !line.starts_with('#') && !line.is_empty());
    lines.filter_map(|line| line.split('\t').nth(2)?.split('*').next()).collect()
}

#[test]
fn published_sentences_settle() {
    let understood = published().into_iter().filter(|line| {
        ALL.iter().any(|settle| settle(line.as_bytes()).unwrap_or_else(|error| panic!("{line}: {error}")).is_some())
    });
    assert!(understood.count() > 100);
}

/// What rounds to zero has no side.
#[test]
fn sides_of_zero_settle() {
    for line in [
        "$GPRMC,120000.00,A,0000.00000004,S,00000.00000004,W,0.0,0.0,010126,0.04,W",
        "$GPGGA,120000.00,0000.00000004,S,00000.00000004,W,1,08,0.9,-0.0004,M,-0.0,M,,",
        "$OMS,359.96,0.04,0.04,0.04,30",
        "$OPOS,-0.000004,-0.000004,-0.04,-0.004,-0.004",
        "$C359.96P-0.004R-0.004T-0.04D-0.04",
    ] {
        let settled = ALL.iter().filter_map(|settle| settle(line.as_bytes()).unwrap_or_else(|e| panic!("{e}")));
        assert!(settled.count() > 0, "{line}");
    }
}

/// Of one message: what comes back, and what it is written as.
fn sentence(bytes: &[u8]) -> Sentence<'_> {
    Sentence::from_line(bytes.strip_suffix(b"\r\n").unwrap(), Checksum::Required).unwrap()
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(1.0)
}

/// The same, and the same absence.
fn close_option(a: Option<f64>, b: Option<f64>) -> bool {
    a.zip(b).map_or(a.is_none() && b.is_none(), |(a, b)| close(a, b))
}

fn servo() -> impl Strategy<Value = ServoBytes> {
    any::<([u8; 4], u8)>().prop_map(|(fins, motor)| ServoBytes { fins, motor })
}

fn position(per_degree: i64) -> impl Strategy<Value = [f64; 2]> {
    let axis = move |limit: i64| {
        (-limit * per_degree..=limit * per_degree).prop_map(move |count| count as f64 / per_degree as f64)
    };
    (axis(90), axis(180)).prop_map(|(latitude, longitude)| [latitude, longitude])
}

const MODES: [FrontseatMode; 7] = [
    FrontseatMode::Normal,
    FrontseatMode::Stopped,
    FrontseatMode::Parking,
    FrontseatMode::ManualOverride,
    FrontseatMode::ManualParking,
    FrontseatMode::Servo,
    FrontseatMode::Mission,
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    /// Digits and letters of a published sentence replaced, put in and left out.
    #[test]
    fn changed_sentences_settle(
        line in select(published()),
        changes in vec((any::<Index>(), "[0-9A-Z,.;-]", 0..3), 1..4),
    ) {
        let mut line = line.as_bytes().to_vec();
        for (at, character, how) in &changes {
            let at = at.index(line.len() - 1) + 1;
            match how {
                0 => line[at] = character.as_bytes()[0],
                1 => line.insert(at, character.as_bytes()[0]),
                _ if line.len() > 4 => _ = line.remove(at),
                _ => {}
            }
        }
        for settle in ALL {
            settle(&line)?;
        }
    }
}

proptest! {
    #[test]
    fn steer(
        heading_rad in grid(0, 3599, 0.1 * DEGREE),
        depth_m in grid(0, 50_000, 0.1),
        max_pitch_rad in grid(0, 900, 0.1 * DEGREE),
        speed_mps in grid(0, 500, 0.1 * KNOT_MPS),
        timeout_s in 0..=120_u8,
        feet: bool,
    ) {
        let units = Units::remote_helm(if feet { 4 } else { 5 });
        let depth_m = if feet { depth_m * 0.3048 } else { depth_m };
        let x = Steer { heading_rad, depth_m, max_pitch_rad, speed_mps, timeout_s };
        let mut buffer = [0; ROOM];
        let written = ToFrontseat::Steer(x).emit(&units, &mut buffer).unwrap();
        let Ok(ToFrontseat::Steer(y)) = ToFrontseat::parse(&sentence(written), &units) else { panic!("no $OMS") };
        prop_assert!(close(x.heading_rad, y.heading_rad) && close(x.depth_m, y.depth_m), "{x:?} {y:?}");
        prop_assert!(close(x.max_pitch_rad, y.max_pitch_rad) && close(x.speed_mps, y.speed_mps), "{x:?} {y:?}");
        prop_assert_eq!(x.timeout_s, y.timeout_s);
    }

    #[test]
    fn commands(
        kind in 0..4,
        (servo, timeout_s, waypoint) in (servo(), 0..=120_u8, 0..=999_u16),
        (gps, compass, state, power, sonde, dvl, t, i) in any::<(bool, bool, bool, bool, bool, bool, bool, bool)>(),
        (mission, path) in (text(), option::of(text())),
    ) {
        let x = match kind {
            0 => ToFrontseat::Servo(Servo { servo, timeout_s }),
            1 => ToFrontseat::Request(Request { gps, compass, state, power, sonde, dvl, t, i }),
            2 => ToFrontseat::Jump { waypoint },
            _ => ToFrontseat::Start(Start {
                ignore_gps: gps,
                ignore_sounder: compass,
                ignore_pressure: state,
                safety_return: power,
                mission: &mission,
                return_path: path.as_deref(),
            }),
        };
        let mut buffer = [0; ROOM];
        prop_assert_eq!(ToFrontseat::parse(&sentence(x.emit(&METRES, &mut buffer).unwrap()), &METRES), Ok(x));
    }

    #[test]
    fn aiding(
        position_deg in position(100_000),
        speed_mps in grid(-500, 500, 0.1 * KNOT_MPS),
        (conductivity_ms_per_cm, temperature_degc) in (option::of(grid(0, 8000, 0.01)), option::of(grid(-400, 4000, 0.01))),
        velocity_mps in uniform3(grid(-3000, 3000, 0.01)),
        timeout_s in 0..=120_u8,
    ) {
        let x = PositionAid { position_deg, speed_mps, conductivity_ms_per_cm, temperature_degc };
        let mut buffer = [0; ROOM];
        let written = ToFrontseat::Position(x).emit(&METRES, &mut buffer).unwrap();
        let Ok(ToFrontseat::Position(y)) = ToFrontseat::parse(&sentence(written), &METRES) else { panic!("no $OPOS") };
        prop_assert!((0..2).all(|i| close(x.position_deg[i], y.position_deg[i])) && close(x.speed_mps, y.speed_mps));
        prop_assert!(close_option(x.conductivity_ms_per_cm, y.conductivity_ms_per_cm));
        prop_assert!(close_option(x.temperature_degc, y.temperature_degc));

        let x = VelocityAid { velocity_mps: [velocity_mps[0], velocity_mps[1]], timeout_s };
        let written = ToFrontseat::Velocity(x).emit(&METRES, &mut buffer).unwrap();
        let Ok(ToFrontseat::Velocity(y)) = ToFrontseat::parse(&sentence(written), &METRES) else { panic!("no $ODVL") };
        prop_assert!((0..2).all(|i| close(x.velocity_mps[i], y.velocity_mps[i])) && x.timeout_s == y.timeout_s);
    }

    #[test]
    fn state(
        (servo, mode, next_waypoint) in (servo(), select(MODES.to_vec()), any::<u16>()),
        position_deg in position(100_000),
        (speed_mps, distance_to_next_m) in (grid(-500, 500, 0.1 * KNOT_MPS), grid(0, 100_000, 0.1)),
        error in select(vec![FrontseatError::None, FrontseatError::Leak, FrontseatError::StopAndTransmit]),
        (altitude_m, park_time_s) in (option::of(grid(0, 2000, 0.1)), option::of(0..100_000_u32)),
        declination_rad in option::of(grid(-1800, 1800, 0.1 * DEGREE)),
        (mission, remaining_time) in (text(), text()),
        (heading_rad, depth_m) in (grid(0, 3599, 0.1 * DEGREE), grid(-1000, 50_000, 0.1)),
    ) {
        let x = State {
            servo, mode, next_waypoint, position_deg, speed_mps, distance_to_next_m, error, altitude_m, park_time_s,
            declination_rad, mission: &mission, remaining_time: &remaining_time, heading_rad, depth_m,
        };
        let mut buffer = [0; ROOM];
        let written = FromFrontseat::State(x).emit(&METRES, &mut buffer).unwrap();
        let Ok(FromFrontseat::State(y)) = FromFrontseat::parse(&sentence(written), &METRES) else { panic!("no $OSI") };
        prop_assert_eq!((x.servo, x.mode, x.next_waypoint, x.error), (y.servo, y.mode, y.next_waypoint, y.error));
        prop_assert_eq!((x.park_time_s, x.mission, x.remaining_time), (y.park_time_s, y.mission, y.remaining_time));
        prop_assert!((0..2).all(|i| close(x.position_deg[i], y.position_deg[i])));
        for (a, b) in [
            (x.speed_mps, y.speed_mps),
            (x.distance_to_next_m, y.distance_to_next_m),
            (x.heading_rad, y.heading_rad),
            (x.depth_m, y.depth_m),
        ] {
            prop_assert!(close(a, b), "{x:?} {y:?}");
        }
        prop_assert!(close_option(x.altitude_m, y.altitude_m) && close_option(x.declination_rad, y.declination_rad));
    }

    #[test]
    fn power_dvl_and_acknowledgement(
        (percent, remaining_wh, power_w) in (grid(0, 1000, 0.1), grid(0, 10_000, 0.1), grid(-5000, 5000, 0.1)),
        (voltage_v, current_a, minutes, leak) in (grid(0, 500, 0.1), grid(-5000, 5000, 0.01), any::<u32>(), any::<bool>()),
        battery in select(vec![Battery::Charging, Battery::Full, Battery::Discharging]),
        (velocity_mps, distance_m) in (option::of(uniform3(grid(-3000, 3000, 0.01))), option::of(grid(-30_000, 30_000, 0.1))),
        (depth_m, altitude_m) in (option::of(grid(0, 30_000, 0.01)), option::of(grid(0, 30_000, 0.01))),
        (command, accepted, error) in any::<(u8, bool, u8)>(),
    ) {
        let mut buffer = [0; ROOM];
        let x = Power { percent, remaining_wh, power_w, voltage_v, current_a, minutes, battery, leak };
        let written = FromFrontseat::Power(x).emit(&METRES, &mut buffer).unwrap();
        let Ok(FromFrontseat::Power(y)) = FromFrontseat::parse(&sentence(written), &METRES) else { panic!("no $OPI") };
        prop_assert_eq!((x.minutes, x.battery, x.leak), (y.minutes, y.battery, y.leak));
        let numbers = |p: &Power| [p.percent, p.remaining_wh, p.power_w, p.voltage_v, p.current_a];
        prop_assert!(numbers(&x).into_iter().zip(numbers(&y)).all(|(a, b)| close(a, b)), "{x:?} {y:?}");

        let x = FrontseatDvl { velocity_mps, distance_m: [distance_m, None], depth_m, altitude_m };
        let written = FromFrontseat::Dvl(x).emit(&METRES, &mut buffer).unwrap();
        let Ok(FromFrontseat::Dvl(y)) = FromFrontseat::parse(&sentence(written), &METRES) else { panic!("no $DVL") };
        let numbers = |d: &FrontseatDvl| {
            let axis = |i: usize| d.velocity_mps.map(|velocity| velocity[i]);
            [axis(0), axis(1), axis(2), d.distance_m[0], d.distance_m[1], d.depth_m, d.altitude_m]
        };
        prop_assert!(numbers(&x).into_iter().zip(numbers(&y)).all(|(a, b)| close_option(a, b)), "{x:?} {y:?}");

        let x = FromFrontseat::Acknowledge(Acknowledge { command, accepted, error });
        prop_assert_eq!(FromFrontseat::parse(&sentence(x.emit(&METRES, &mut buffer).unwrap()), &METRES), Ok(x));
    }

    #[test]
    fn compass(
        (heading_rad, pitch_rad) in (grid(0, 3599, 0.1 * DEGREE), grid(-9000, 9000, 0.01 * DEGREE)),
        roll_rad in grid(-18_000, 18_000, 0.01 * DEGREE),
        (temperature_degc, depth_ft) in (option::of(grid(-400, 800, 0.1)), option::of(grid(0, 20_000, 0.1))),
    ) {
        let depth_m = depth_ft.map(|feet| feet * 0.3048);
        let x = Compass { heading_rad, pitch_rad, roll_rad, temperature_degc, depth_m };
        let mut buffer = [0; ROOM];
        let written = FromFrontseat::Compass(x).emit(&METRES, &mut buffer).unwrap();
        let Ok(FromFrontseat::Compass(y)) = FromFrontseat::parse(&sentence(written), &METRES) else { panic!("no $C") };
        prop_assert!(close(x.heading_rad, y.heading_rad) && close(x.pitch_rad, y.pitch_rad), "{x:?} {y:?}");
        prop_assert!(close(x.roll_rad, y.roll_rad) && close_option(x.temperature_degc, y.temperature_degc));
        prop_assert!(close_option(x.depth_m, y.depth_m), "{x:?} {y:?}");
    }

    #[test]
    fn gnss(
        utc in (946_684_800_u64..4_102_444_800).prop_map(|s| backseat_wire::calendar::DateTime::from_unix_us(s * 1_000_000).unwrap()),
        position_deg in position(60_000_000),
        (speed_mps, course_rad) in (option::of(grid(0, 10_000, 0.01 * KNOT_MPS)), option::of(grid(0, 3600, 0.1 * DEGREE))),
        variation_rad in option::of(grid(-1800, 1800, 0.1 * DEGREE)),
        (time, quality, satellites) in (time_of_day(10_000), 1..=5_u8, 0..=40_u8),
        (hdop, altitude_m, geoid_m) in (option::of(grid(0, 9999, 0.01)), option::of(grid(-99_999, 99_999, 0.001)), option::of(grid(-99_999, 99_999, 0.001))),
    ) {
        let mut buffer = [0; ROOM];
        let x = Rmc { utc: Some(utc), valid: true, position_deg: Some(position_deg), speed_mps, course_rad, variation_rad };
        let y = Rmc::parse(&sentence(x.emit(&mut buffer).unwrap())).unwrap();
        prop_assert_eq!((x.utc, x.valid), (y.utc, y.valid));
        // to the wire's two millimetres
        let near = |y: Option<[f64; 2]>| y.is_some_and(|y| (0..2).all(|i| (position_deg[i] - y[i]).abs() < 1.0 / 120e6));
        prop_assert!(near(y.position_deg), "{x:?} {y:?}");
        prop_assert!(close_option(x.speed_mps, y.speed_mps) && close_option(x.course_rad, y.course_rad), "{x:?} {y:?}");
        prop_assert!(close_option(x.variation_rad, y.variation_rad), "{x:?} {y:?}");

        let x = Gga { time: Some(time), position_deg: Some(position_deg), quality, satellites, hdop, altitude_m, geoid_m };
        let y = Gga::parse(&sentence(x.emit(&mut buffer).unwrap())).unwrap();
        prop_assert_eq!((x.time, x.quality, x.satellites), (y.time, y.quality, y.satellites));
        prop_assert!(near(y.position_deg) && close_option(x.hdop, y.hdop), "{x:?} {y:?}");
        prop_assert!(close_option(x.altitude_m, y.altitude_m) && close_option(x.geoid_m, y.geoid_m), "{x:?} {y:?}");
    }

    #[test]
    fn instants_of_the_modem_and_back(instant in instant(1)) {
        prop_assert_eq!(backseat_wire::calendar::DateTime::from_unix_us(instant.unix_us()), Ok(instant));
    }

    #[test]
    fn pd6(
        bottom in option::of(uniform4(grid(-19_000, 19_000, 0.001))),
        water_mps in option::of(uniform3(grid(-19_000, 19_000, 0.001))),
        altitude_m in option::of(grid(1, 100_000, 0.01)),
        attitude in uniform3(grid(-8999, 8999, 0.01 * DEGREE)),
        (depth_m, sound_speed_mps) in (grid(0, 9999, 0.1), grid(14_000, 16_000, 0.1)),
        time_of_day_s in grid(0, 8_639_999, 0.01),
    ) {
        let bottom_mps = bottom.map(|[x, y, z, _]| [x, y, z]);
        let attitude_rad = [attitude[0], attitude[1], attitude[2].abs()];
        let x = DvlSample {
            bottom_mps,
            water_mps,
            altitude_m,
            error_mps: bottom.map(|[.., error]| error),
            attitude_rad: Some(attitude_rad),
            depth_m: Some(depth_m),
            sound_speed_mps: Some(sound_speed_mps),
            time_of_day_s: Some(time_of_day_s),
            ..DvlSample::default()
        };
        let mut buffer = [0; pd6::MAX_SET];
        let mut written = pd6::emit(&x, 0.0, &mut buffer).unwrap();
        let y = pd6::Decoder::new(0.0).feed(&mut written).unwrap().unwrap();
        let numbers = |s: &DvlSample| {
            let [b, w, a] = [s.bottom_mps, s.water_mps, s.attitude_rad].map(|three| move |i: usize| three.map(|three| three[i]));
            [
                b(0), b(1), b(2), w(0), w(1), w(2), a(0), a(1), a(2), s.error_mps, s.altitude_m, s.depth_m,
                s.sound_speed_mps, s.time_of_day_s,
            ]
        };
        prop_assert!(numbers(&x).into_iter().zip(numbers(&y)).all(|(a, b)| close_option(a, b)), "{x:?} {y:?}");
    }
}
