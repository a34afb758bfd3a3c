//! Logs of DUNE (`.lsf`, `.lsf.gz`): messages of IMC, the protocol of the LSTS toolchain, one behind the other. North,
//! east, down and forward, starboard, down, in SI units and radians. Times are those of the messages' headers.

use super::mapping::ColumnMap;
use super::message_tables::{Layout, TABLES};
use super::signals::Signals;
use super::{Imported, layout, whole};
use crate::DataError;
use crc::{CRC_16_ARC, Crc};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "LSTS log (IMC)";

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_ARC);
const HEADER: usize = 20;
const FOOTER: usize = 2;
const ENTITY_INFO: u16 = 3;
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
    let mut signals = Signals::new(path, map, "imc")?;
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
        let is_this = |layout: &&Layout| layout.number == u32::from(head.number);
        let Some(Layout { name, fields, .. }) = TABLES["imc"].layouts.iter().find(is_this) else {
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
    signals.finish(NAME, notes)
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
