//! What runs on the ship: topside in this process, or a program of its own.

use backseat_link::{Arrival, BackseatError, board};
use backseat_topside::ship::ShipEstimate;
use backseat_topside::track::VehicleEstimate;
use backseat_topside::{Port, Topside};
use backseat_wire::hostlink;
use std::io;
use std::process::ExitStatus;

/// Why the ship's program cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum ProgramError {
    /// Its process ended.
    #[error("topside's process ended ({0})")]
    Ended(ExitStatus),
    /// It stopped answering.
    #[error("topside gave no answer for {0} s")]
    Silent(u32),
    /// Its answer does not fit the request.
    #[error("unexpected answer of topside: {0}")]
    Protocol(String),
    /// A line, a file or the process itself.
    #[error("topside: {what}: {error}")]
    Io {
        /// Which.
        what: String,
        /// How it failed.
        error: io::Error,
    },
}

impl From<BackseatError> for ProgramError {
    fn from(error: BackseatError) -> Self {
        match error {
            BackseatError::Died(status) => Self::Ended(status),
            BackseatError::Silent { seconds, .. } | BackseatError::Unanswered { seconds } => Self::Silent(seconds),
            BackseatError::Port { port, error } => Self::Io { what: format!("{} line", line_name(port)), error },
            BackseatError::Refused { request, refusal } => {
                Self::Protocol(format!("{request} refused, {}", board::reason(refusal)))
            }
            BackseatError::Protocol(text) => Self::Protocol(text),
            other => Self::Protocol(other.to_string()),
        }
    }
}

/// The name by which the host link announces bytes of a port of topside. It has none for a GNSS receiver, whose place
/// on the ship is that of the frontseat on the vehicle: it says where the vessel is.
#[must_use]
pub const fn announced(port: Port) -> hostlink::Port {
    match port {
        Port::Gnss => hostlink::Port::Frontseat,
        Port::Modem => hostlink::Port::Modem,
    }
}

fn line_name(port: hostlink::Port) -> &'static str {
    match port {
        hostlink::Port::Frontseat => "GNSS",
        hostlink::Port::Modem => "modem",
        _ => "host",
    }
}

/// What the ship knows at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// Its own transducer.
    pub ship: Option<ShipEstimate>,
    /// The vehicle that was asked for.
    pub vehicle: Option<VehicleEstimate>,
}

/// A program on the ship.
pub trait Program {
    /// Gives it what has arrived; `step` every 0.1 s. It may work on that until [`Self::take`].
    ///
    /// # Errors
    /// It has ended.
    fn give(&mut self, now_us: u64, arrivals: &[(Port, Arrival)], step: bool) -> Result<(), ProgramError>;

    /// Takes what it sends to its modem of what it was given last.
    ///
    /// # Errors
    /// It has ended.
    fn take(&mut self) -> Result<Vec<u8>, ProgramError>;

    /// Its state, if it is in this process.
    fn topside(&self) -> Option<&Topside> {
        None
    }

    /// What it knows of the ship and of the vehicle with this modem address at `utc_us`, if it says that.
    fn knows(&self, utc_us: u64, vehicle: u8) -> Option<Known> {
        let topside = self.topside()?;
        let track = topside.tracks().iter().find(|track| track.vehicle == vehicle);
        Some(Known { ship: topside.ship_at(utc_us), vehicle: track.and_then(|track| track.at(utc_us)) })
    }
}

/// Topside in this process, on the simulation's clock.
pub struct InProcess {
    topside: Box<Topside>,
    sent: Vec<u8>,
}

impl InProcess {
    /// As after power-up.
    pub fn new(topside: Topside) -> Self {
        Self { topside: Box::new(topside), sent: Vec::new() }
    }
}

impl Program for InProcess {
    fn give(&mut self, now_us: u64, arrivals: &[(Port, Arrival)], step: bool) -> Result<(), ProgramError> {
        self.sent = exchange(&mut self.topside, now_us, arrivals, step);
        Ok(())
    }

    fn take(&mut self) -> Result<Vec<u8>, ProgramError> {
        Ok(std::mem::take(&mut self.sent))
    }

    fn topside(&self) -> Option<&Topside> {
        Some(&self.topside)
    }
}

/// One exchange with topside in this process: what it sends to its modem.
#[must_use]
pub fn exchange(topside: &mut Topside, now_us: u64, arrivals: &[(Port, Arrival)], step: bool) -> Vec<u8> {
    for (port, arrival) in arrivals {
        topside.receive(*port, arrival.time_us, &arrival.bytes);
    }
    if step {
        topside.step(now_us);
    }
    let mut sent = Vec::new();
    while !topside.transmit(Port::Modem).is_empty() {
        let bytes = topside.transmit(Port::Modem).to_vec();
        topside.transmitted(Port::Modem, bytes.len());
        sent.extend(bytes);
    }
    sent
}
