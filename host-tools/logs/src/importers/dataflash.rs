//! DataFlash logs of ArduPilot (`.BIN`): each message begins with A3 95 and its number; FMT messages say what the
//! others hold. Angles are in degrees, rates of the body axes forward, right, down.
//!
//! No crate reads them well enough: the one there is stops at damage and knows no half-precision numbers.

use super::mapping::ColumnMap;
use super::signals::Signals;
use super::{Imported, whole};
use crate::DataError;
use crate::log::layout;
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "ArduPilot DataFlash log";

const MAGIC: [u8; 2] = [0xa3, 0x95];
/// Number and length of the message that describes messages.
const FMT: u8 = 0x80;
const FMT_LENGTH: usize = 89;

/// A message as its FMT describes it.
struct Described {
    name: String,
    length: usize,
    /// Label, letter and place of each field.
    fields: Vec<(String, u8, usize)>,
}

/// Whether the beginning of a file is that of such a log.
pub(super) fn is_dataflash(beginning: &[u8]) -> bool {
    beginning.starts_with(&[MAGIC[0], MAGIC[1], FMT])
}

/// Reads a log.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let bytes = whole(path)?;
    let mut signals = Signals::new(path, map, "dataflash")?;
    let mut described: BTreeMap<u8, Described> = BTreeMap::new();
    let (mut at, mut skipped, mut time_us) = (0, 0, 0);
    let (mut firmware, mut is_utc) = (None, false);
    while let Some(&[a, b, kind]) = bytes.get(at..).and_then(<[u8]>::first_chunk) {
        let length = if kind == FMT { Some(FMT_LENGTH) } else { described.get(&kind).map(|d| d.length) };
        let message = length.filter(|_| [a, b] == MAGIC).and_then(|length| bytes.get(at..at + length));
        let Some(message) = message else {
            (at, skipped) = (at + 1, skipped + 1);
            continue;
        };
        at += message.len();
        if kind == FMT {
            if let Some((kind, new)) = describe(message) {
                described.insert(kind, new);
            }
            continue;
        }
        let Some(kind) = described.get(&kind) else { continue };
        if kind.name == "MSG" {
            firmware = firmware.or_else(|| vehicle(kind, message));
        }
        if !signals.wants(&kind.name) {
            continue;
        }
        let values: Vec<(&str, f64)> = kind
            .fields
            .iter()
            .filter_map(|(label, letter, at)| Some((label.as_str(), value(*letter, message.get(*at..)?)?)))
            .collect();
        let get = |label: &str| values.iter().find(|(name, _)| *name == label).map(|(_, value)| *value);
        let time = get("TimeUS").or_else(|| get("TimeMS").map(|ms| ms * 1e3)).filter(|us| (0.0..1e17).contains(us));
        time_us = time.map_or(time_us, |us| us as i64);
        if kind.name == "GPS" && !is_utc {
            if let (Some(ms), Some(week), true) = (get("GMS"), get("GWk"), get("Status") >= Some(3.0)) {
                signals.shift_us = gps_to_unix_us(week, ms) - time_us;
            }
            is_utc = signals.shift_us != 0;
        }
        let sensor = ["I", "Instance", "C"].into_iter().find_map(get).filter(|sensor| *sensor >= 1.0);
        let which = sensor.map_or_else(String::new, |sensor| format!("[{sensor}]"));
        signals.message(time_us, &kind.name, &which, &values);
    }
    let mut notes = Vec::new();
    if skipped > 0 {
        notes.push(format!("{skipped} bytes are part of no message and left out"));
    }
    let firmware = firmware.unwrap_or_else(|| "an unknown firmware".to_owned());
    if firmware.starts_with("ArduSub") {
        notes.push(format!("{firmware}; depth is that of the pressure cell (CTUN.BAlt)"));
    } else {
        signals.refuse("CTUN", "an altitude in the air, or none: the vehicle is no submarine");
        notes.push(firmware);
    }
    signals.finish(NAME, notes)
}

/// What an FMT message describes; `None` for what cannot be.
fn describe(message: &[u8]) -> Option<(u8, Described)> {
    let text = |bytes: &[u8]| {
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        String::from_utf8_lossy(&bytes[..end]).into_owned()
    };
    let (kind, length) = (*message.get(3)?, usize::from(*message.get(4)?));
    let (name, letters) = (text(message.get(5..9)?), message.get(9..25)?);
    let labels = text(message.get(25..89)?);
    let mut at = 3;
    let mut fields = Vec::new();
    for (label, letter) in labels.split(',').zip(letters) {
        fields.push((label.to_owned(), *letter, at));
        at += match letter {
            b'c' | b'C' | b'g' => 2,
            b'e' | b'E' | b'L' | b'n' => 4,
            b'M' => 1,
            b'N' => 16,
            b'Z' | b'a' => 64,
            plain => layout::size(*plain),
        };
    }
    (length >= 3 && kind != FMT && !name.is_empty()).then_some((kind, Described { name, length, fields }))
}

/// A number by its letter; `None` for texts.
fn value(letter: u8, bytes: &[u8]) -> Option<f64> {
    match letter {
        b'c' => layout::number(b'h', bytes, false).map(|value| value / 100.0),
        b'C' => layout::number(b'H', bytes, false).map(|value| value / 100.0),
        b'e' => layout::number(b'i', bytes, false).map(|value| value / 100.0),
        b'E' => layout::number(b'I', bytes, false).map(|value| value / 100.0),
        b'L' => layout::number(b'i', bytes, false),
        b'M' => layout::number(b'B', bytes, false),
        b'g' => layout::number(b'H', bytes, false).map(|bits| half(bits as u16)),
        plain => layout::number(plain, bytes, false),
    }
}

/// A number of half precision (IEEE 754 binary16).
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    if bits >> 15 == 1 { -size } else { size }
}

/// The firmware's name of itself, in a MSG.
fn vehicle(kind: &Described, message: &[u8]) -> Option<String> {
    let (.., at) = kind.fields.iter().find(|(label, ..)| label == "Message")?;
    let text = message.get(*at..)?.split(|byte| *byte == 0).next()?;
    let text = String::from_utf8_lossy(text).into_owned();
    let is_name = ["Ardu", "Rover", "Blimp", "AntennaTracker"].iter().any(|name| text.starts_with(name));
    is_name.then_some(text)
}

/// Week and milliseconds of GPS as µs since 1970; 18 leap seconds, as since 2017.
fn gps_to_unix_us(week: f64, ms: f64) -> i64 {
    const EPOCH_S: f64 = 315_964_800.0;
    ((EPOCH_S + week * 604_800.0 - 18.0) * 1e6 + ms * 1e3) as i64
}
