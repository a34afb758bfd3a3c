//! Telemetry logs of MAVLink (`.tlog`), as ground stations write them: microseconds since 1970, then a packet. Body
//! axes forward, right, down. Times are those at which the ground station received a packet.
//!
//! Layouts and check numbers are those of the dialects `common` and `ardupilotmega`, of the few messages that are read.

use super::mapping::ColumnMap;
use super::signals::{Hint, Message, Only, Signals, Take, number};
use super::{Imported, layout, whole};
use crate::DataError;
use crate::log::Column;
use crc::{CRC_16_MCRF4XX, Crc};
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "MAVLink telemetry log";

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_MCRF4XX);
/// `MAV_TYPE_SUBMARINE` of a heartbeat.
const SUBMARINE: f64 = 12.0;
/// `MAV_AUTOPILOT_INVALID`: a ground station or a camera.
const NO_AUTOPILOT: f64 = 8.0;
/// Packets that follow each other are less apart, µs.
const DAY_US: u64 = 86_400_000_000;
/// Pressure at the surface, hPa.
const SURFACE_HPA: f64 = 1013.25;
/// Metres of sea water in one hPa.
const M_PER_HPA: f64 = 100.0 / super::mapping::SEA_WATER_N_PER_M3;

/// Number, check number and name of a message, and its numbers as they stand in the packet.
type Layout = (u32, u8, &'static str, &'static [(&'static str, u8)]);

const PRESSURE: &[(&str, u8)] =
    &[("time_boot_ms", b'I'), ("press_abs", b'f'), ("press_diff", b'f'), ("temperature", b'h')];

#[rustfmt::skip]
const LAYOUTS: [Layout; 13] = [
    (0, 50, "HEARTBEAT", &[("custom_mode", b'I'), ("type", b'B'), ("autopilot", b'B'), ("base_mode", b'B')]),
    (24, 24, "GPS_RAW_INT", &[
        ("time_usec", b'Q'), ("lat", b'i'), ("lon", b'i'), ("alt", b'i'), ("eph", b'H'), ("epv", b'H'), ("vel", b'H'),
        ("cog", b'H'), ("fix_type", b'B'), ("satellites_visible", b'B'),
    ]),
    (29, 115, "SCALED_PRESSURE", PRESSURE),
    (30, 39, "ATTITUDE", &[
        ("time_boot_ms", b'I'), ("roll", b'f'), ("pitch", b'f'), ("yaw", b'f'), ("rollspeed", b'f'),
        ("pitchspeed", b'f'), ("yawspeed", b'f'),
    ]),
    (32, 185, "LOCAL_POSITION_NED", &[
        ("time_boot_ms", b'I'), ("x", b'f'), ("y", b'f'), ("z", b'f'), ("vx", b'f'), ("vy", b'f'), ("vz", b'f'),
    ]),
    (33, 104, "GLOBAL_POSITION_INT", &[
        ("time_boot_ms", b'I'), ("lat", b'i'), ("lon", b'i'), ("alt", b'i'), ("relative_alt", b'i'), ("vx", b'h'),
        ("vy", b'h'), ("vz", b'h'), ("hdg", b'H'),
    ]),
    (36, 222, "SERVO_OUTPUT_RAW", &[
        ("time_usec", b'I'), ("servo1_raw", b'H'), ("servo2_raw", b'H'), ("servo3_raw", b'H'), ("servo4_raw", b'H'),
        ("servo5_raw", b'H'), ("servo6_raw", b'H'), ("servo7_raw", b'H'), ("servo8_raw", b'H'), ("port", b'B'),
        ("servo9_raw", b'H'), ("servo10_raw", b'H'), ("servo11_raw", b'H'), ("servo12_raw", b'H'),
        ("servo13_raw", b'H'), ("servo14_raw", b'H'), ("servo15_raw", b'H'), ("servo16_raw", b'H'),
    ]),
    (74, 20, "VFR_HUD", &[
        ("airspeed", b'f'), ("groundspeed", b'f'), ("alt", b'f'), ("climb", b'f'), ("heading", b'h'),
        ("throttle", b'H'),
    ]),
    (103, 208, "VISION_SPEED_ESTIMATE", &[("usec", b'Q'), ("x", b'f'), ("y", b'f'), ("z", b'f')]),
    (137, 195, "SCALED_PRESSURE2", PRESSURE),
    (143, 131, "SCALED_PRESSURE3", PRESSURE),
    (226, 207, "RPM", &[("rpm1", b'f'), ("rpm2", b'f')]),
    (11_011, 106, "VISION_POSITION_DELTA", &[
        ("time_usec", b'Q'), ("time_delta_usec", b'Q'), ("angle_delta[0]", b'f'), ("angle_delta[1]", b'f'),
        ("angle_delta[2]", b'f'), ("position_delta[0]", b'f'), ("position_delta[1]", b'f'), ("position_delta[2]", b'f'),
        ("confidence", b'f'),
    ]),
];

static MESSAGES: [Message; 4] = [
    Message {
        name: "ATTITUDE",
        only: Only::Always,
        takes: &[
            number("roll", Column::Roll, 1.0),
            number("pitch", Column::Pitch, 1.0),
            number("yaw", Column::Heading, 1.0),
            number("rollspeed", Column::P, 1.0),
            number("pitchspeed", Column::Q, 1.0),
            number("yawspeed", Column::R, 1.0),
        ],
    },
    Message {
        name: "SCALED_PRESSURE2",
        only: Only::From("press_abs", 1.0),
        takes: &[Take::Number("press_abs", Column::Depth, M_PER_HPA, -SURFACE_HPA)],
    },
    Message { name: "GPS_RAW_INT", only: Only::From("fix_type", 3.0), takes: &[Take::Fix(["lat", "lon"], 1e-7)] },
    // position deltas of a DVL: what they are per second is added where they are read
    Message {
        name: "VISION_POSITION_DELTA",
        only: Only::From("time_delta_usec", 1e3),
        takes: &[number("u", Column::DvlU, 1.0), number("v", Column::DvlV, 1.0), number("w", Column::DvlW, 1.0)],
    },
];

const ESTIMATE: &str = "the vehicle's own estimate";
const HINTS: &[Hint] = &[
    (
        "SERVO_OUTPUT_RAW",
        "pulse widths of the outputs: name propeller and fins by --columns, as SERVO_OUTPUT_RAW.servo1_raw",
    ),
    ("RPM", "measured speeds: name the propeller by --columns"),
    ("LOCAL_POSITION_NED", ESTIMATE),
    ("GLOBAL_POSITION_INT", ESTIMATE),
    ("VFR_HUD", ESTIMATE),
    ("SCALED_PRESSURE", "the air in the hull"),
];

/// A packet: its message, who sent it, its payload, its length with its frame, and whether its check sum is right.
struct Packet<'a> {
    number: u32,
    system: u8,
    payload: &'a [u8],
    length: usize,
    layout: Option<&'static Layout>,
    is_sound: bool,
}

/// Whether the beginning of a file is that of such a log: a time between 2001 and 2100, and a packet.
pub(super) fn is_tlog(beginning: &[u8]) -> bool {
    time_us(beginning).is_some_and(|time_us| (1_000_000_000_000_000..4_100_000_000_000_000).contains(&time_us))
        && packet_frame(beginning.get(8..).unwrap_or_default()).is_some()
}

fn time_us(bytes: &[u8]) -> Option<i64> {
    i64::try_from(u64::from_be_bytes(*bytes.first_chunk()?)).ok()
}

/// Length of the head, of the payload and of what follows it.
fn packet_frame(bytes: &[u8]) -> Option<[usize; 3]> {
    let length = usize::from(*bytes.get(1)?);
    match *bytes.first()? {
        0xfe => Some([6, length, 2]),
        // signed packets have 13 bytes more
        0xfd => Some([10, length, if *bytes.get(2)? & 1 == 1 { 15 } else { 2 }]),
        _ => None,
    }
}

fn packet(bytes: &[u8]) -> Option<Packet<'_>> {
    let [head, length, tail] = packet_frame(bytes)?;
    let whole = bytes.get(..head + length + tail)?;
    let payload = whole.get(head..head + length)?;
    let (system, number) = match head {
        6 => (*whole.get(3)?, u32::from(*whole.get(5)?)),
        _ => (*whole.get(5)?, u32::from_le_bytes([*whole.get(7)?, *whole.get(8)?, *whole.get(9)?, 0])),
    };
    let layout = LAYOUTS.iter().find(|(known, ..)| *known == number);
    let sum = u16::from_le_bytes(*whole.get(head + length..)?.first_chunk()?);
    let is_sound = layout.is_none_or(|(_, extra, ..)| {
        let mut digest = CRC.digest();
        digest.update(whole.get(1..head + length).unwrap_or_default());
        digest.update(&[*extra]);
        digest.finalize() == sum
    });
    Some(Packet { number, system, payload, length: whole.len(), layout, is_sound })
}

/// Reads a log.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let bytes = whole(path)?;
    let mut signals = Signals::new(path, map, &MESSAGES)?;
    let (mut at, mut skipped, mut broken) = (0, 0, 0);
    // the first system with an autopilot, and whether it is a submarine
    let mut vehicle: Option<(u8, bool)> = None;
    while let Some(time_us) = bytes.get(at..).and_then(time_us) {
        // what is no packet by its check sum is one if another begins behind it
        let found = packet(bytes.get(at + 8..).unwrap_or_default());
        let is_whole = |packet: &Packet<'_>| {
            let next = bytes.get(at + 8 + packet.length..).unwrap_or_default();
            let is_packet = next.get(8..).and_then(packet_frame).is_some();
            next.is_empty() || (is_packet && self::time_us(next).is_some_and(|us| us.abs_diff(time_us) < DAY_US))
        };
        let is_known = |packet: &Packet<'_>| packet.layout.is_some() && packet.is_sound;
        let Some(packet) = found.filter(|packet| is_known(packet) || is_whole(packet)) else {
            (at, skipped) = (at + 1, skipped + 1);
            continue;
        };
        if !packet.is_sound {
            (at, skipped, broken) = (at + 8 + packet.length, skipped + 8 + packet.length, broken + 1);
            continue;
        }
        at += 8 + packet.length;
        // a DVL's driver has an address of its own
        let is_delta = packet.layout.is_some_and(|(_, _, name, _)| *name == "VISION_POSITION_DELTA");
        if vehicle.is_some_and(|(system, _)| system != packet.system) && !is_delta {
            continue;
        }
        let Some((_, _, name, fields)) = packet.layout else {
            let name = format!("message {}", packet.number);
            if signals.wants(&name) {
                signals.message(time_us, &name, "", &[]);
            }
            continue;
        };
        let mut values = layout::numbers(fields, packet.payload, false);
        let get = |name: &str| values.iter().find(|(field, _)| *field == name).map(|(_, value)| *value);
        let is_autopilot = *name == "HEARTBEAT" && get("autopilot") != Some(NO_AUTOPILOT);
        if vehicle.is_none() && is_autopilot {
            vehicle = Some((packet.system, get("type") == Some(SUBMARINE)));
        }
        let per_second = match (*name, get("time_delta_usec")) {
            ("VISION_POSITION_DELTA", Some(us)) if us > 0.0 => {
                let delta = |axis: usize| get(["position_delta[0]", "position_delta[1]", "position_delta[2]"][axis]);
                [("u", 0), ("v", 1), ("w", 2)]
                    .map(|(name, axis)| (name, delta(axis).unwrap_or(f64::NAN) * 1e6 / us))
                    .to_vec()
            }
            _ => Vec::new(),
        };
        values.extend(per_second);
        signals.message(time_us, name, "", &values);
    }
    let mut notes = vec!["times are the ground station's, later than the vehicle's by the link".to_owned()];
    if skipped > 0 {
        notes.push(format!("{skipped} bytes are part of no packet and left out; {broken} check sums are wrong"));
    }
    if !vehicle.is_some_and(|(_, is_submarine)| is_submarine) {
        signals.refuse("SCALED_PRESSURE2", "the pressure of water on a submarine only");
    } else if signals.has("SCALED_PRESSURE2") {
        notes.push(format!("depth: absolute pressure less {SURFACE_HPA} hPa, sea water of 1025 kg/m^3"));
    }
    signals.finish(NAME, HINTS, notes)
}
