//! Topics and messages as they stand in the file.

use super::{Clock, Meta, port_named};
use backseat_wire::hostlink::{FittingReadings, ImageId, Oscillator, Port, Restart};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Name of the metadata record at the front.
pub const METADATA: &str = "session";
/// Version of what this module describes.
const VERSION: &str = "1";

/// Message encodings.
pub const BYTES: &str = "bytes";
pub const JSON: &str = "json";

pub const CLOCK: &str = "clock";
pub const START: &str = "start";
pub const PARAMETERS: &str = "parameters";
pub const NOTE: &str = "note";
pub const TELEMETRY: &str = "telemetry";
pub const IDENTIFICATION: &str = "identification";
pub const LEARNT: &str = "learnt";
pub const HEALTH: &str = "health";
pub const SHIP: &str = "ship";
pub const FAULT: &str = "fault";
pub const ESTIMATES: &str = "estimates";
pub const NAMING: &str = "naming";
pub const STEERED: &str = "steered";

/// To the board, or from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    Rx,
    Tx,
}

/// Topic of a port's bytes.
pub fn topic(port: Port, direction: Direction) -> String {
    let direction = match direction {
        Direction::Rx => "rx",
        Direction::Tx => "tx",
    };
    format!("port/{}/{direction}", port.name())
}

/// The port whose bytes a topic has.
pub fn port_of(topic: &str) -> Option<(Port, Direction)> {
    let (name, direction) = topic.strip_prefix("port/")?.split_once('/')?;
    let direction = match direction {
        "rx" => Direction::Rx,
        "tx" => Direction::Tx,
        _ => return None,
    };
    Some((port_named(name)?, direction))
}

/// A message of [`CLOCK`].
#[derive(Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "lowercase")]
pub enum Tick {
    Pps { time_us: u64 },
    Oscillator { time_us: u64, oscillator: Oscillator },
    Fittings { time_us: u64, readings: FittingReadings },
    Restart { time_us: u64 },
    Step { time_us: u64, digest: String },
}

/// A message of [`START`].
#[derive(Serialize, Deserialize)]
pub struct Start {
    pub time_us: u64,
    pub firmware: String,
    pub parameter_schema: u16,
    #[serde(flatten)]
    pub image: ImageId,
    #[serde(flatten)]
    pub restart: Restart,
    pub record: Vec<u8>,
}

/// A message of [`PARAMETERS`]: pairs, because their order is the board's.
#[derive(Serialize, Deserialize)]
pub struct Parameters {
    pub time_us: u64,
    pub values: Vec<(String, f64)>,
}

/// A message of [`NOTE`].
#[derive(Serialize, Deserialize)]
pub struct Note {
    pub time_us: u64,
    pub note: String,
    /// Records that the board could not write.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lost: Option<u32>,
}

/// The metadata record of a session.
pub fn to_metadata(meta: &Meta) -> BTreeMap<String, String> {
    let clock = match meta.clock {
        Clock::Board => "board",
        Clock::Host => "host",
    };
    let own = [("format", VERSION), ("program", &meta.program), ("clock", clock)];
    let mut map = meta.facts.clone();
    map.extend(own.map(|(name, value)| (name.to_owned(), value.to_owned())));
    map
}

/// The session that a metadata record describes.
pub fn from_metadata(mut map: BTreeMap<String, String>) -> Result<Meta, String> {
    let mut take = |name: &str| map.remove(name).ok_or_else(|| format!("its description has no `{name}`"));
    let version = take("format")?;
    if version != VERSION {
        return Err(format!("session format {version}; this program reads {VERSION}"));
    }
    let program = take("program")?;
    let clock = match take("clock")?.as_str() {
        "board" => Clock::Board,
        "host" => Clock::Host,
        other => return Err(format!("clock `{other}`: expected `board` or `host`")),
    };
    Ok(Meta { program, clock, facts: map })
}
