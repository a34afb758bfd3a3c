//! Session logs: what went over the ports of a backseat, when, and what the board computed from it.
//!
//! A session is an MCAP file (<https://mcap.dev>) that other people's tools open as well:
//!
//! | topic | encoding | content |
//! |---|---|---|
//! | `port/<name>/rx` | `bytes` | bytes to the board, as they came |
//! | `port/<name>/tx` | `bytes` | bytes from the board |
//! | `clock` | `json` | `{"event": "pps" \| "restart" \| "step", "time_us", "digest"}`: edges and steps |
//! | `start` | `json` | the board's start: firmware, parameter list, reset cause |
//! | `parameters` | `json` | the board's active set at this point, by name |
//! | `note` | `json` | what the recorder noticed: a port unplugged, records lost |
//! | `telemetry` | `json` | decoded from `port/host/tx`, named and with units: [`TelemetryRow`] |
//! | `identification`, `learnt`, `health`, `ship` | `json` | decoded from `port/host/tx` |
//! | `estimates` | `json` | the robust filter's, by name: [`EstimatesRow`] |
//!
//! `<name>` is `frontseat`, `dvl`, `ahrs`, `modem` or `host`. A metadata record `session` at the
//! front holds [`Meta`]; vehicle file and scenario are attachments.
//!
//! **Replay.** The events of a session whose clock is [`Clock::Board`] are, in the order of the
//! file, exactly what the app was fed: [`Event::Received`], [`Event::Edge`], [`Event::Restart`] and
//! [`Event::Step`] map one to one on `App::receive`, `pps`, `restart` and `step`, with
//! [`Entry::time_us`] as their time; after each step the app's digest is [`Event::Step`]'s. The
//! same holds for the log that a board writes to its memory card, which [`Reader`] reads as well.
//! A session with [`Clock::Host`] has the times at which a PC read or wrote the bytes, and no steps.
//!
//! **Cuts.** Messages are written in chunks, each whole and with a CRC. A file that was cut off is
//! good up to its last whole chunk; [`Reader::damage`] lists what is missing.

mod axis;
mod board_log;
mod format;
mod index;
mod passed;
mod reader;
mod record;
mod telemetry;
mod writer;

pub use axis::Axis;
pub use reader::Reader;
pub(crate) use reader::sound_part;
pub use telemetry::{EstimateRow, EstimatesRow, FusionRow, TelemetryRow};
pub use writer::Writer;

use backseat_wire::hostlink::{FittingReadings, ImageId, Oscillator, Port, Restart};
use std::collections::BTreeMap;

/// Whose time the times of a session are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// The board's, exactly as the app received it: the session replays to the bit.
    Board,
    /// A PC's that stood beside: microseconds since 1970 UTC, or since the start of a simulation.
    Host,
}

/// The description of a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Meta {
    /// Program and version that wrote it.
    pub program: String,
    /// Whose times these are.
    pub clock: Clock,
    /// Anything else worth knowing: `scenario`, `seed`, `backseat`, a port's device…
    pub facts: BTreeMap<String, String>,
}

impl Meta {
    /// Without facts.
    pub fn new(program: impl Into<String>, clock: Clock) -> Self {
        Self { program: program.into(), clock, facts: BTreeMap::new() }
    }

    /// With one more fact.
    #[must_use]
    pub fn with(mut self, name: &str, value: impl ToString) -> Self {
        self.facts.insert(name.to_owned(), value.to_string());
        self
    }
}

/// A file that belongs to a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// File name.
    pub name: String,
    /// Media type, as `application/toml`.
    pub media_type: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Something that happened, and when, by the session's [`Clock`].
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// µs.
    pub time_us: u64,
    /// What.
    pub event: Event,
}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The board started (board logs).
    Start {
        /// Firmware version.
        firmware: String,
        /// Version of its parameter list.
        parameter_schema: u16,
        /// Which image ran.
        image: ImageId,
        /// Why it started.
        restart: Restart,
        /// The restart record that it found, as it was stored; empty when there was none.
        record: Vec<u8>,
    },
    /// The whole set of parameters that is active on the board from here on, before what follows.
    Parameters(Vec<(String, f64)>),
    /// Bytes to the board. Their time is that of the arrival of the last of them.
    Received {
        /// At which port of the board.
        port: Port,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// Bytes from the board.
    Sent {
        /// From which port of the board.
        port: Port,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// An edge of the pulse per second.
    Edge,
    /// The board's clock counts this oscillator from here on (board logs).
    Oscillator(Oscillator),
    /// Last-resort hardware reads this from here on.
    Fittings(FittingReadings),
    /// The lock-step clock went back to zero: the app forgets everything but parameters and mission.
    Restart,
    /// The app took a step.
    Step {
        /// Running digest of filter state and covariance after it.
        digest: u64,
    },
    /// Something that the recorder noticed.
    Note(String),
    /// The board could not write so many records before this one.
    Lost(u32),
}

/// What is wrong with a file that could still be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Damage {
    /// The end of the file is missing: it was cut off, or is still being written. (A board's log has no end.)
    pub unfinished: bool,
    /// Bytes after the last whole record.
    pub cut_bytes: u64,
    /// Whole records or chunks whose CRC is wrong; they were left out.
    pub broken_records: u64,
}

/// The port of a name, as in topics, files and on command lines.
#[must_use]
pub fn port_named(name: &str) -> Option<Port> {
    Port::ALL.into_iter().find(|port| port.name() == name)
}
