//! Logs of DUNE (`.lsf`, `.lsf.gz`): messages of IMC, the protocol of the LSTS toolchain, one behind the other. North,
//! east, down and forward, starboard, down, in SI units and radians. Times are those of the messages' headers.

use super::mapping::ColumnMap;
use super::message_tables::{Layout, TABLES};
use super::signals::Signals;
use super::{Imported, whole};
use crate::DataError;
use crate::log::layout;
use backseat_core::state::wrap_angle;
use crc::{CRC_16_ARC, Crc};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "LSTS log (IMC)";

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_ARC);
const HEADER: usize = 20;
const FOOTER: usize = 2;
const ENTITY_INFO: u16 = 3;
/// A declination that is told, rad.
const LEAST_DECLINATION_RAD: f64 = 0.02;

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

/// The sound messages of a log, one behind the other.
struct Messages<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Bytes that are part of none.
    skipped: usize,
}

impl<'a> Iterator for Messages<'a> {
    type Item = (Head, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        while self.at < self.bytes.len() {
            let rest = self.bytes.get(self.at..).unwrap_or_default();
            let found = head(rest).and_then(|head| Some((rest.get(..HEADER + head.size + FOOTER)?, head)));
            if let Some((message, head)) = found.filter(|(message, head)| is_sound(message, head)) {
                self.at += message.len();
                let payload = message.get(HEADER..HEADER + head.size).unwrap_or_default();
                return Some((head, payload));
            }
            (self.at, self.skipped) = (self.at + 1, self.skipped + 1);
        }
        None
    }
}

/// What a message of this number holds.
fn layout_of(number: u16) -> Option<&'static Layout> {
    TABLES["imc"].layouts.iter().find(|layout| layout.number == u32::from(number))
}

/// The system that most messages are of: those of others, heard by a modem or over the air, are logged as well.
fn vehicle(bytes: &[u8]) -> Option<u16> {
    let mut counts: BTreeMap<u16, usize> = BTreeMap::new();
    for (head, _) in (Messages { bytes, at: 0, skipped: 0 }) {
        *counts.entry(head.source).or_default() += usize::from(layout_of(head.number).is_some());
    }
    counts.into_iter().max_by_key(|(_, count)| *count).map(|(source, _)| source)
}

/// Reads a log.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let bytes = whole(path)?;
    let mut signals = Signals::new(path, map, "imc")?;
    let vehicle = vehicle(&bytes);
    let mut entities: BTreeMap<u8, String> = BTreeMap::new();
    let mut compass = Compass::default();
    let mut messages = Messages { bytes: &bytes, at: 0, skipped: 0 };
    for (head, payload) in messages.by_ref() {
        if Some(head.source) != vehicle {
            continue;
        }
        if head.number == ENTITY_INFO
            && let Some((entity, label)) = entity(payload, head.is_big_endian)
        {
            entities.insert(entity, label);
        }
        let Some(Layout { name, fields, .. }) = layout_of(head.number) else { continue };
        let values = layout::numbers(fields, payload, head.is_big_endian);
        compass.take(name, &values);
        let which = match values.first() {
            Some(("id", id)) => format!("[{id}]"),
            _ => match entities.get(&head.entity) {
                Some(label) => format!("[{label}]"),
                None => format!("[{}]", head.entity),
            },
        };
        signals.message((head.time_s * 1e6) as i64, name, &which, &values);
    }
    let mut notes = Vec::new();
    if messages.skipped > 0 {
        notes.push(format!("{} bytes are part of no sound message and left out", messages.skipped));
    }
    if signals.has("Rpm") {
        notes.push("prop_rpm is the measured speed of the propeller (Rpm)".to_owned());
    }
    notes.extend(compass.note());
    signals.finish(NAME, notes)
}

/// The heading of the sensor beside that of the vehicle's own state, which adds the declination.
#[derive(Default)]
struct Compass {
    heading_rad: Option<f64>,
    /// The sensor knows no true heading.
    is_magnetic: bool,
    lacks_rad: Vec<f64>,
}

impl Compass {
    fn take(&mut self, message: &str, values: &[(&str, f64)]) {
        let get = |field: &str| values.iter().find(|(name, _)| *name == field).map(|(_, value)| *value);
        match (message, get("psi"), get("psi_magnetic"), self.heading_rad) {
            ("EulerAngles", Some(psi), magnetic, last) => {
                self.is_magnetic = magnetic == Some(psi) && (self.is_magnetic || last.is_none());
                self.heading_rad = Some(psi);
            }
            ("EstimatedState", Some(psi), _, Some(heading_rad)) => self.lacks_rad.push(wrap_angle(psi - heading_rad)),
            _ => {}
        }
    }

    fn note(mut self) -> Option<String> {
        self.lacks_rad.sort_by(f64::total_cmp);
        let lacks_rad = self.lacks_rad.get(self.lacks_rad.len() / 2).filter(|rad| rad.abs() > LEAST_DECLINATION_RAD)?;
        self.is_magnetic.then(|| {
            format!(
                "the heading is magnetic (psi of EulerAngles is psi_magnetic); that of the vehicle's own state is {:.1} deg \
                 more, by a mapping: columns.heading_rad = {{ column = \"EulerAngles.psi\", offset = {lacks_rad:.4} }}",
                lacks_rad.to_degrees()
            )
        })
    }
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

#[cfg(test)]
mod tests {
    use super::super::tests::{import, import_mapped};
    use super::*;
    use crate::log::Column;

    /// A message of the vehicle 8259, or of another, with its numbers in the order of their layout.
    fn message(source: u16, time_s: f64, name: &str, values: &[f64]) -> Vec<u8> {
        let layout = TABLES["imc"].layouts.iter().find(|layout| layout.name == name).unwrap();
        let mut payload = Vec::new();
        for ((_, code), value) in layout.fields.iter().zip(values) {
            match code {
                b'B' => payload.push(*value as u8),
                b'H' => payload.extend((*value as u16).to_le_bytes()),
                b'f' => payload.extend((*value as f32).to_le_bytes()),
                _ => payload.extend(value.to_le_bytes()),
            }
        }
        let mut bytes = vec![0x54, 0xfe];
        bytes.extend((layout.number as u16).to_le_bytes());
        bytes.extend((payload.len() as u16).to_le_bytes());
        bytes.extend(time_s.to_le_bytes());
        bytes.extend(source.to_le_bytes());
        bytes.extend([9, 0xff, 0xff, 0xff]);
        bytes.extend(payload);
        let sum = CRC.checksum(&bytes);
        bytes.extend(sum.to_le_bytes());
        bytes
    }

    /// As published results of two logs of a LAUV describe them: another vehicle's state comes first, the compass is not
    /// corrected, and a receiver under water states a place whose error is 198 m.
    #[test]
    fn what_a_lauv_logs() {
        let mut bytes = message(8260, 1e9, "Depth", &[7.0]);
        for k in 0..4 {
            let (time_s, psi) = (1e9 + f64::from(k), 1.0 + 0.1 * f64::from(k));
            bytes.extend(message(8259, time_s, "Depth", &[1.0]));
            bytes.extend(message(8259, time_s, "EulerAngles", &[0.0, 0.01, 0.02, psi, psi]));
            let state = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.01, 0.02, psi + 0.222];
            bytes.extend(message(8259, time_s, "EstimatedState", &state));
            let hacc_m = if k == 2 { 198.0 } else { 1.2 };
            let fix = [4.0, 0.0, 2026.0, 9.0, 7.0, 0.0, 1.37, 0.29, 0.0, 9.0, 0.0, 0.0, 1.0, 1.0, hacc_m, 2.0];
            bytes.extend(message(8259, time_s, "GpsFix", &fix));
        }
        let log = import(&bytes).unwrap().log;
        let depth: Vec<f64> = log.column(Column::Depth).map(|(_, depth)| depth).collect();
        let fixes: Vec<u64> = log.column(Column::GpsX).map(|(time_us, _)| time_us / 1_000_000).collect();
        assert_eq!((depth, fixes), (vec![1.0; 4], vec![0, 1, 3]));
        let said =
            "is 12.7 deg more, by a mapping: columns.heading_rad = { column = \"EulerAngles.psi\", offset = 0.2220 }";
        assert!(log.notes.iter().any(|note| note.contains(said)), "{:?}", log.notes);
        let map = "columns.heading_rad = { column = \"EulerAngles.psi\", offset = 0.2220 }";
        let log = import_mapped(&bytes, map).unwrap().log;
        assert!((log.column(Column::Heading).next().unwrap().1 - 1.222).abs() < 1e-9);
    }
}
