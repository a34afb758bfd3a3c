//! What passes between simulator and backseat, as a session log.

use crate::Arrival;
use backseat_logs::DataError;
use backseat_logs::session::{Entry, Event, Writer};
use backseat_wire::hostlink::Port;

/// The recording side of a [`Client`](super::Client); without a session it does nothing.
#[derive(Default)]
pub(super) struct Tape {
    session: Option<Writer>,
    /// Bytes from the host port since the last entry: where a pseudo-terminal cuts them is chance.
    heard: Vec<u8>,
    /// Time of the last step, or of the clock that is in use.
    time_us: u64,
}

impl Tape {
    pub fn start(&mut self, session: Writer) {
        self.session = Some(session);
    }

    pub fn is_running(&self) -> bool {
        self.session.is_some()
    }

    pub fn set_time(&mut self, time_us: u64) {
        self.time_us = time_us;
    }

    /// Ends the file.
    pub fn finish(&mut self) -> Result<(), DataError> {
        self.write_heard()?;
        self.session.take().map_or(Ok(()), Writer::finish)
    }

    /// One entry, at this time.
    pub fn write_at(&mut self, time_us: u64, event: Event) -> Result<(), DataError> {
        self.session.as_mut().map_or(Ok(()), |session| session.write(&Entry { time_us, event }))
    }

    /// One entry, now.
    pub fn write(&mut self, event: Event) -> Result<(), DataError> {
        self.write_at(self.time_us, event)
    }

    /// The host port was read.
    pub fn hear(&mut self, bytes: &[u8]) {
        if self.is_running() {
            self.heard.extend_from_slice(bytes);
        }
    }

    /// The entry of what was heard.
    pub fn write_heard(&mut self) -> Result<(), DataError> {
        let bytes = std::mem::take(&mut self.heard);
        if bytes.is_empty() { Ok(()) } else { self.write(Event::Sent { port: Port::Host, bytes }) }
    }

    /// The inputs of a step, in the order in which the app is fed them: an edge goes before the chunk that ended with
    /// it.
    pub fn write_inputs(
        &mut self,
        time_us: u64,
        pps_us: &[u64],
        arrivals: &[(Port, Arrival)],
    ) -> Result<(), DataError> {
        if !self.is_running() {
            return Ok(());
        }
        self.write_heard()?;
        self.time_us = time_us;
        if time_us == 0 {
            self.write(Event::Restart)?;
        }
        let mut edges = pps_us.iter().copied().peekable();
        for (port, arrival) in arrivals {
            while let Some(edge_us) = edges.next_if(|edge_us| *edge_us <= arrival.time_us) {
                self.write_at(edge_us, Event::Edge)?;
            }
            self.write_at(arrival.time_us, Event::Received { port: *port, bytes: arrival.bytes.clone() })?;
        }
        while let Some(edge_us) = edges.next_if(|edge_us| *edge_us <= time_us) {
            self.write_at(edge_us, Event::Edge)?;
        }
        Ok(())
    }

    /// What came of the step.
    pub fn write_outputs(&mut self, digest: u64, sent: &[Vec<u8>; 4]) -> Result<(), DataError> {
        if !self.is_running() {
            return Ok(());
        }
        self.write(Event::Step { digest })?;
        for (port, bytes) in Port::DEVICES.into_iter().zip(sent).filter(|(_, bytes)| !bytes.is_empty()) {
            self.write(Event::Sent { port, bytes: bytes.clone() })?;
        }
        self.write_heard()
    }
}
