//! Logs of DUNE (`.lsf`, `.lsf.gz`): messages of IMC, the protocol of the LSTS toolchain, one behind the other. North,
//! east, down and forward, starboard, down, in SI units and radians. Times are those of the messages' headers.
//!
//! Definitions are those of IMC 5.4 (`IMC.xml`), of the few messages that are read: the first numbers of each.

use super::mapping::ColumnMap;
use super::signals::{Hint, Message, Only, Signals, Take, number};
use super::{Imported, layout, whole};
use crate::DataError;
use crate::log::Column;
use crc::{CRC_16_ARC, Crc};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "LSTS log (IMC)";

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_ARC);
const HEADER: usize = 20;
const FOOTER: usize = 2;
const ENTITY_INFO: u16 = 3;
const DEG: f64 = 180.0 / PI;
/// `VALID_POS` of a fix.
const VALID_POSITION: u32 = 4;

/// Number and name of a message, and its numbers.
type Definition = (u16, &'static str, &'static [(&'static str, u8)]);

const VALUE_F32: &[(&str, u8)] = &[("value", b'f')];
const VALUE_F64: &[(&str, u8)] = &[("value", b'd')];
const ACTUATOR: &[(&str, u8)] = &[("id", b'B'), ("value", b'f')];
const VELOCITY: &[(&str, u8)] = &[("validity", b'B'), ("x", b'd'), ("y", b'd'), ("z", b'd')];

#[rustfmt::skip]
const DEFINITIONS: [Definition; 18] = [
    (200, "LblRange", &[("id", b'B'), ("range", b'f')]),
    (250, "Rpm", &[("value", b'h')]),
    (253, "GpsFix", &[
        ("validity", b'H'), ("type", b'B'), ("utc_year", b'H'), ("utc_month", b'B'), ("utc_day", b'B'),
        ("utc_time", b'f'), ("lat", b'd'), ("lon", b'd'), ("height", b'f'), ("satellites", b'B'), ("cog", b'f'),
        ("sog", b'f'), ("hdop", b'f'), ("vdop", b'f'), ("hacc", b'f'), ("vacc", b'f'),
    ]),
    (254, "EulerAngles", &[("time", b'd'), ("phi", b'd'), ("theta", b'd'), ("psi", b'd'), ("psi_magnetic", b'd')]),
    (256, "AngularVelocity", &[("time", b'd'), ("x", b'd'), ("y", b'd'), ("z", b'd')]),
    (259, "GroundVelocity", VELOCITY),
    (260, "WaterVelocity", VELOCITY),
    (264, "Pressure", VALUE_F64),
    (265, "Depth", VALUE_F32),
    (267, "SoundSpeed", VALUE_F32),
    (268, "WaterDensity", VALUE_F32),
    (281, "ServoPosition", ACTUATOR),
    (301, "SetThrusterActuation", ACTUATOR),
    (302, "SetServoPosition", ACTUATOR),
    (350, "EstimatedState", &[
        ("lat", b'd'), ("lon", b'd'), ("height", b'f'), ("x", b'f'), ("y", b'f'), ("z", b'f'), ("phi", b'f'),
        ("theta", b'f'), ("psi", b'f'), ("u", b'f'), ("v", b'f'), ("w", b'f'), ("vx", b'f'), ("vy", b'f'), ("vz", b'f'),
        ("p", b'f'), ("q", b'f'), ("r", b'f'), ("depth", b'f'), ("alt", b'f'),
    ]),
    (351, "EstimatedStreamVelocity", &[("x", b'd'), ("y", b'd'), ("z", b'd')]),
    (400, "DesiredHeading", VALUE_F64),
    (402, "DesiredSpeed", VALUE_F64),
];

static MESSAGES: [Message; 9] = [
    Message {
        name: "EulerAngles",
        only: Only::Always,
        takes: &[
            number("phi", Column::Roll, 1.0),
            number("theta", Column::Pitch, 1.0),
            number("psi", Column::Heading, 1.0),
        ],
    },
    Message {
        name: "AngularVelocity",
        only: Only::Always,
        takes: &[number("x", Column::P, 1.0), number("y", Column::Q, 1.0), number("z", Column::R, 1.0)],
    },
    Message { name: "Depth", only: Only::Always, takes: &[number("value", Column::Depth, 1.0)] },
    // all three axes
    Message {
        name: "GroundVelocity",
        only: Only::Bits("validity", 0b111),
        takes: &[number("x", Column::DvlU, 1.0), number("y", Column::DvlV, 1.0), number("z", Column::DvlW, 1.0)],
    },
    Message { name: "GpsFix", only: Only::Bits("validity", VALID_POSITION), takes: &[Take::Fix(["lat", "lon"], DEG)] },
    Message { name: "Rpm", only: Only::Always, takes: &[number("value", Column::PropRpm, 1.0)] },
    Message {
        name: "SoundSpeed",
        only: Only::From("value", 1000.0),
        takes: &[number("value", Column::SoundSpeed, 1.0)],
    },
    Message {
        name: "WaterDensity",
        only: Only::From("value", 900.0),
        takes: &[number("value", Column::WaterDensity, 1.0)],
    },
    // where no sensor's own message is logged
    Message {
        name: "EstimatedState",
        only: Only::Always,
        takes: &[
            number("phi", Column::Roll, 1.0),
            number("theta", Column::Pitch, 1.0),
            number("psi", Column::Heading, 1.0),
            number("p", Column::P, 1.0),
            number("q", Column::Q, 1.0),
            number("r", Column::R, 1.0),
            number("depth", Column::Depth, 1.0),
        ],
    },
];

const HINTS: &[Hint] = &[
    (
        "SetServoPosition",
        "commands of fins, whose numbers differ by vehicle: name them by --columns, as SetServoPosition[0].value",
    ),
    ("SetThrusterActuation", "a share of full thrust: Rpm has the propeller's speed"),
    ("ServoPosition", "measured angles: the commands can be named by --columns"),
    ("LblRange", "ranges to transponders whose places are not part of the message"),
    ("WaterVelocity", "velocity through the water, not over ground"),
    ("EstimatedState", "the vehicle's own estimate"),
    ("EstimatedStreamVelocity", "the vehicle's own estimate"),
];

/// The head of a message.
struct Head {
    is_big_endian: bool,
    number: u16,
    size: usize,
    time_s: f64,
    source: u16,
    entity: u8,
}

/// The head of a message of IMC 5, whose sync number says the order of its bytes.
fn head(bytes: &[u8]) -> Option<Head> {
    let bytes = bytes.first_chunk::<HEADER>()?;
    let is_big_endian = match (bytes[0], bytes[1]) {
        (0x50..=0x5f, 0xfe) => false,
        (0xfe, 0x50..=0x5f) => true,
        _ => return None,
    };
    let short = |at: usize| layout::number(b'H', bytes.get(at..)?, is_big_endian).map(|value| value as u16);
    Some(Head {
        is_big_endian,
        number: short(2)?,
        size: usize::from(short(4)?),
        time_s: layout::number(b'd', bytes.get(6..)?, is_big_endian)?,
        source: short(14)?,
        entity: bytes[16],
    })
}

/// Whether the beginning of a file, unpacked, is that of such a log.
pub(super) fn is_lsf(beginning: &[u8]) -> bool {
    head(beginning).is_some_and(|head| (0.0..1e10).contains(&head.time_s))
}

/// Reads a log.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let bytes = whole(path)?;
    let mut signals = Signals::new(path, map, &MESSAGES)?;
    // labels of the entities of each system
    let mut entities: BTreeMap<(u16, u8), String> = BTreeMap::new();
    let mut vehicle = None;
    let (mut at, mut skipped) = (0, 0);
    while at < bytes.len() {
        let rest = bytes.get(at..).unwrap_or_default();
        let found = head(rest).and_then(|head| Some((rest.get(..HEADER + head.size + FOOTER)?, head)));
        let Some((message, head)) = found.filter(|(message, head)| is_sound(message, head)) else {
            (at, skipped) = (at + 1, skipped + 1);
            continue;
        };
        at += message.len();
        let payload = message.get(HEADER..HEADER + head.size).unwrap_or_default();
        if head.number == ENTITY_INFO
            && let Some((entity, label)) = entity(payload, head.is_big_endian)
        {
            entities.insert((head.source, entity), label);
        }
        let Some((_, name, fields)) = DEFINITIONS.iter().find(|(number, ..)| *number == head.number) else {
            continue;
        };
        // messages of other systems, heard by a modem or over the air, are logged as well
        if *vehicle.get_or_insert(head.source) != head.source {
            continue;
        }
        let values = layout::numbers(fields, payload, head.is_big_endian);
        let which = match values.first() {
            Some(("id", id)) => format!("[{id}]"),
            _ => match entities.get(&(head.source, head.entity)) {
                Some(label) => format!("[{label}]"),
                None => format!("[{}]", head.entity),
            },
        };
        signals.message((head.time_s * 1e6) as i64, name, &which, &values);
    }
    let mut notes = Vec::new();
    if skipped > 0 {
        notes.push(format!("{skipped} bytes are part of no sound message and left out"));
    }
    if signals.has("Rpm") {
        notes.push("prop_rpm is the measured speed of the propeller (Rpm)".to_owned());
    }
    signals.finish(NAME, HINTS, notes)
}

fn is_sound(message: &[u8], head: &Head) -> bool {
    let (content, sum) = message.split_at(HEADER + head.size);
    layout::number(b'H', sum, head.is_big_endian) == Some(f64::from(CRC.checksum(content)))
}

/// Number and label of an `EntityInfo`.
fn entity(payload: &[u8], is_big_endian: bool) -> Option<(u8, String)> {
    let length = layout::number(b'H', payload.get(1..)?, is_big_endian)? as usize;
    Some((*payload.first()?, String::from_utf8_lossy(payload.get(3..3 + length)?).into_owned()))
}
