//! Telemetry logs of MAVLink (`.tlog`), as ground stations write them: microseconds since 1970, then a packet. Body
//! axes forward, right, down. Times are those at which the ground station received a packet.

use super::mapping::ColumnMap;
use super::message_tables::{Layout, TABLES};
use super::signals::Signals;
use super::{Imported, whole};
use crate::DataError;
use crate::log::layout;
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
    let layout = TABLES["mavlink"].layouts.iter().find(|layout| layout.number == number);
    let sum = u16::from_le_bytes(*whole.get(head + length..)?.first_chunk()?);
    let is_sound = layout.is_none_or(|layout| {
        let mut digest = CRC.digest();
        digest.update(whole.get(1..head + length).unwrap_or_default());
        digest.update(&[layout.check]);
        digest.finalize() == sum
    });
    Some(Packet { number, system, payload, length: whole.len(), layout, is_sound })
}

/// Reads a log.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let bytes = whole(path)?;
    let mut signals = Signals::new(path, map, "mavlink")?;
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
        let is_delta = packet.layout.is_some_and(|layout| layout.name == "VISION_POSITION_DELTA");
        if vehicle.is_some_and(|(system, _)| system != packet.system) && !is_delta {
            continue;
        }
        let Some(Layout { name, fields, .. }) = packet.layout else {
            let name = format!("message {}", packet.number);
            if signals.wants(&name) {
                signals.message(time_us, &name, "", &[]);
            }
            continue;
        };
        let values = layout::numbers(fields, packet.payload, false);
        let get = |name: &str| values.iter().find(|(field, _)| *field == name).map(|(_, value)| *value);
        let is_autopilot = name == "HEARTBEAT" && get("autopilot") != Some(NO_AUTOPILOT);
        if vehicle.is_none() && is_autopilot {
            vehicle = Some((packet.system, get("type") == Some(SUBMARINE)));
        }
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
    signals.finish(NAME, notes)
}
