//! The host link from the simulator's side: parameters, mission, and one lock-step after the other.

use crate::Arrival;
use crate::Reset;
use crate::output::{ReportedFusion, StepOutput};
use crate::tape::Tape;
use crate::{BackseatError, Ports};
use backseat_logs::session::{Event, Writer};
use backseat_wire::hostlink::{
    Chunk, Decoder, FittingReadings, FromBoard, MAX_FRAME, MAX_MESSAGE, Port, Refusal, Signed, Step, StepDone, ToBoard,
    Waypoint, encode,
};
use backseat_wire::ship_state::Key;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Nothing is under way on a line that has been silent this long: 190 bytes at 19,200 baud.
const QUIET: Duration = Duration::from_millis(100);

/// Talks to a backseat over its ports.
pub struct Client<P> {
    ports: P,
    decoder: Decoder,
    unread: Vec<u8>,
    /// Bytes of device ports that were read ahead.
    ahead: [Vec<u8>; 4],
    tape: Tape,
    /// What changes a flight is signed by this key.
    key: Key,
    /// The board's challenge and the counter of the last signed request, once it was asked.
    challenge: Option<(u64, u64)>,
    /// What simulated last-resort hardware reads.
    fittings: FittingReadings,
}

impl<P: Ports> Client<P> {
    /// Over these ports.
    pub fn new(ports: P) -> Self {
        let (unread, ahead, tape, fittings) = Default::default();
        Self { ports, decoder: Decoder::new(), unread, ahead, tape, key: Key::NONE, challenge: None, fittings }
    }

    /// Writes into `session` from here on what passes, the board's parameters first: what is needed to do it again.
    ///
    /// # Errors
    /// When the board does not send its parameters, or the file cannot be written.
    pub fn record(&mut self, session: Writer) -> Result<(), BackseatError> {
        let parameters = self.parameters()?;
        self.tape.start(session);
        Ok(self.tape.write(Event::Parameters(parameters))?)
    }

    /// Ends the session.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn end_record(&mut self) -> Result<(), BackseatError> {
        Ok(self.tape.finish()?)
    }

    /// The ports.
    pub fn ports(&mut self) -> &mut P {
        &mut self.ports
    }

    /// Signs what changes a flight by this key from here on; a board without a key does not look at it.
    pub fn sign_with(&mut self, key: Key) {
        (self.key, self.challenge) = (key, None);
    }

    /// What it signs by.
    pub fn key(&self) -> Key {
        self.key
    }

    /// The board's challenge, and a counter that it has not seen.
    fn next_challenge(&mut self) -> Result<(u64, u64), BackseatError> {
        let (challenge, counter) = match self.challenge {
            Some(known) => known,
            None => {
                self.send(&ToBoard::ChallengeGet)?;
                self.receive(|message| match message {
                    FromBoard::Challenge { challenge, counter } => Some((challenge, counter)),
                    _ => None,
                })?
            }
        };
        let next = (challenge, counter + 1);
        self.challenge = Some(next);
        Ok(next)
    }

    /// Sends one message, signed if that is needed and there is a key.
    ///
    /// # Errors
    /// When the backseat is gone.
    pub fn send(&mut self, message: &ToBoard<'_>) -> Result<(), BackseatError> {
        let nothing = |error| BackseatError::Protocol(format!("nothing: {error:?}"));
        let (mut plain, mut buffer) = ([0; MAX_MESSAGE], [0; MAX_FRAME]);
        let frame = if self.key.is_set() && (message.changes_a_flight() || *message == ToBoard::KeyBegin) {
            let (challenge, counter) = self.next_challenge()?;
            let signed = Signed::new(message, &self.key, challenge, counter, &mut plain).map_err(nothing)?;
            encode(&ToBoard::Signed(signed), &mut buffer).map_err(nothing)?
        } else {
            encode(message, &mut buffer).map_err(nothing)?
        };
        self.ports.write(Port::Host, frame)?;
        // the clock is recorded otherwise, the key nowhere
        if self.tape.is_running() && !matches!(message, ToBoard::Step(_) | ToBoard::KeySet(_)) {
            self.tape.write_heard()?;
            self.tape.write(Event::Received { port: Port::Host, bytes: frame.to_vec() })?;
        }
        Ok(())
    }

    /// Hands bytes to a device port of a board that keeps its own clock.
    ///
    /// # Errors
    /// When the backseat is gone.
    pub fn deliver(&mut self, time_us: u64, port: Port, bytes: &[u8]) -> Result<(), BackseatError> {
        self.ports.write(port, bytes)?;
        if self.tape.is_running() {
            self.tape.write_at(time_us, Event::Received { port, bytes: bytes.to_vec() })?;
        }
        Ok(())
    }

    /// What a device port has sent by now, of a board that keeps its own clock.
    ///
    /// # Errors
    /// When the backseat is gone.
    pub fn collect(&mut self, time_us: u64, port: Port) -> Result<Vec<u8>, BackseatError> {
        let mut bytes = Vec::new();
        self.ports.poll(port, &mut bytes)?;
        self.tape.set_time(time_us);
        if self.tape.is_running() && !bytes.is_empty() {
            self.tape.write(Event::Sent { port, bytes: bytes.clone() })?;
        }
        Ok(bytes)
    }

    /// Hands over the messages that have been read, up to the first that `take` makes something of.
    fn unread<T>(&mut self, mut take: impl FnMut(FromBoard<'_>) -> Option<T>) -> Option<T> {
        let mut bytes = self.unread.as_slice();
        let mut found = None;
        while found.is_none()
            && let Some(frame) = self.decoder.feed(&mut bytes)
        {
            // A broken frame is what was on the line before we listened.
            if let Ok(message) = frame.and_then(|frame| frame.message()) {
                found = take(message);
            }
        }
        let consumed = self.unread.len() - bytes.len();
        self.tape.hear(&self.unread[..consumed]);
        self.unread.drain(..consumed);
        found
    }

    /// Waits for the message that `take` makes something of.
    ///
    /// # Errors
    /// When the backseat is gone, silent, or sends other messages only.
    pub fn receive<T>(&mut self, mut take: impl FnMut(FromBoard<'_>) -> Option<T>) -> Result<T, BackseatError> {
        let begun = Instant::now();
        loop {
            if let Some(answer) = self.unread(&mut take) {
                return Ok(answer);
            }
            let patience = self.ports.patience();
            if begun.elapsed() > patience {
                return Err(BackseatError::Unanswered { seconds: patience.as_secs() as u32 });
            }
            self.ports.read(Port::Host, &mut self.unread)?;
        }
    }

    /// Messages that have come by now, without waiting.
    ///
    /// # Errors
    /// When the backseat is gone.
    pub fn drain(&mut self, mut take: impl FnMut(FromBoard<'_>)) -> Result<(), BackseatError> {
        self.ports.poll(Port::Host, &mut self.unread)?;
        self.unread(|message| {
            take(message);
            None::<()>
        });
        Ok(self.tape.write_heard()?)
    }

    /// Sends a request that is answered by "done" or a refusal.
    ///
    /// # Errors
    /// [`BackseatError::Refused`] with the request as `describe` names it.
    pub fn request(&mut self, message: &ToBoard<'_>, describe: impl FnOnce() -> String) -> Result<(), BackseatError> {
        self.send(message)?;
        let answer = self.receive(|message| match message {
            FromBoard::Done => Some(Ok(())),
            FromBoard::Refused(refusal) => Some(Err(refusal)),
            _ => None,
        })?;
        answer.map_err(|refusal| BackseatError::Refused { request: describe(), refusal })
    }

    /// Waits until the board is there; its firmware version.
    ///
    /// # Errors
    /// When it does not answer.
    pub fn hello(&mut self) -> Result<String, BackseatError> {
        self.send(&ToBoard::Hello)?;
        self.receive(|message| match message {
            FromBoard::Hello { firmware, .. } => Some(crate::printable(firmware)),
            _ => None,
        })
    }

    /// The active parameters, in the board's order.
    fn parameters(&mut self) -> Result<Vec<(String, f64)>, BackseatError> {
        let mut parameters = Vec::new();
        loop {
            let wanted = parameters.len() as u16;
            self.send(&ToBoard::ParameterGet { index: wanted })?;
            let (parameter, count) = self.receive(|message| match message {
                FromBoard::Parameter(info) if info.index == wanted => {
                    Some((Some((info.name.to_owned(), info.value)), info.count))
                }
                FromBoard::Refused(_) => Some((None, 0)),
                _ => None,
            })?;
            parameters.extend(parameter);
            if wanted + 1 >= count {
                return Ok(parameters);
            }
        }
    }

    /// Sends the board the key; none switches authentication off. What follows is not signed by it before
    /// [`Self::sign_with`].
    ///
    /// # Errors
    /// When it is refused.
    pub fn set_key(&mut self, key: Key) -> Result<(), BackseatError> {
        self.has_key()?;
        self.request(&ToBoard::KeySet(key), || "the key".into())
    }

    /// Whether the board has a key; it never reveals it. A new one may follow now, of whoever has the old one.
    ///
    /// # Errors
    /// When it does not answer.
    pub fn has_key(&mut self) -> Result<bool, BackseatError> {
        self.send(&ToBoard::KeyBegin)?;
        let answer = self.receive(|message| match message {
            FromBoard::Key { set } => Some(Ok(set)),
            FromBoard::Refused(refusal @ Refusal::Forged) => Some(Err(refusal)),
            _ => None,
        })?;
        answer.map_err(|refusal| BackseatError::Refused { request: "the key".into(), refusal })
    }

    /// Sets parameters as one transaction.
    ///
    /// # Errors
    /// The first that is refused, by name.
    pub fn set_parameters(&mut self, values: &[(String, f64)]) -> Result<(), BackseatError> {
        self.request(&ToBoard::ParameterBegin, || "to take parameters".into())?;
        for (name, value) in values {
            self.request(&ToBoard::ParameterSet { name, value: *value }, || format!("parameter {name} = {value}"))?;
        }
        self.request(&ToBoard::ParameterCommit, || "the parameter set".into())
    }

    /// Stores a mission without a polygon.
    ///
    /// # Errors
    /// When it is refused.
    pub fn set_mission(&mut self, waypoints: &[Waypoint]) -> Result<(), BackseatError> {
        self.set_fenced_mission(waypoints, &[])
    }

    /// Stores a mission and the corners of its fence, north and east, m; without corners there is no polygon.
    ///
    /// # Errors
    /// When it is refused.
    pub fn set_fenced_mission(&mut self, waypoints: &[Waypoint], corners_m: &[[f64; 2]]) -> Result<(), BackseatError> {
        let count = u16::try_from(waypoints.len()).unwrap_or(u16::MAX);
        self.request(&ToBoard::MissionBegin { count }, || format!("a mission of {count} waypoints"))?;
        for (index, waypoint) in (0..).zip(waypoints) {
            self.request(&ToBoard::MissionItem { index, waypoint: *waypoint }, || {
                format!("waypoint {index}: {waypoint:?}")
            })?;
        }
        let count = u8::try_from(corners_m.len()).unwrap_or(u8::MAX);
        for (index, corner_m) in (0..=u8::MAX).zip(corners_m) {
            self.request(&ToBoard::FenceCorner { index, count, corner_m: *corner_m }, || {
                format!("corner {index} of the fence: {corner_m:?}")
            })?;
        }
        self.request(&ToBoard::MissionCommit, || "the mission".into())
    }

    /// Starts the stored mission.
    ///
    /// # Errors
    /// When it is refused.
    pub fn start_mission(&mut self) -> Result<(), BackseatError> {
        self.request(&ToBoard::MissionStart, || "to start the mission".into())
    }

    /// Keeps the active parameters in the board's memory.
    ///
    /// # Errors
    /// When it has none, or refuses.
    pub fn store_parameters(&mut self) -> Result<(), BackseatError> {
        self.request(&ToBoard::ParameterStore, || "to store its parameters".into())
    }

    /// Resets the board; what was on the lines is gone.
    ///
    /// # Errors
    /// When it cannot be reset from here.
    pub fn reset(&mut self, reset: Reset) -> Result<(), BackseatError> {
        self.tape.write_heard()?;
        // the board's time begins anew
        self.tape.set_time(0);
        for event in self.ports.reset(reset)? {
            self.tape.write(event)?;
        }
        (self.decoder, self.challenge) = (Decoder::new(), None);
        self.unread.clear();
        self.ahead.iter_mut().for_each(Vec::clear);
        Ok(())
    }

    /// From the next lock-step on last-resort hardware reads this.
    pub fn set_fittings(&mut self, readings: FittingReadings) {
        self.fittings = readings;
    }

    /// One lock-step: time, PPS edges and what arrived, for what the board sent and found.
    ///
    /// # Errors
    /// When the backseat is gone, silent or answers for another time.
    pub fn step(
        &mut self,
        time_us: u64,
        pps_us: &[u64],
        arrivals: &[(Port, Arrival)],
    ) -> Result<StepOutput, BackseatError> {
        self.begin_step(time_us, pps_us, arrivals)?;
        self.end_step(time_us)
    }

    /// The first half of [`Self::step`]: what the board is given.
    ///
    /// # Errors
    /// When the backseat is gone.
    pub fn begin_step(
        &mut self,
        time_us: u64,
        pps_us: &[u64],
        arrivals: &[(Port, Arrival)],
    ) -> Result<(), BackseatError> {
        self.tape.write_inputs(time_us, pps_us, arrivals)?;
        let fittings = self.fittings;
        if fittings != FittingReadings::default() {
            self.tape.write(Event::Fittings(fittings))?;
        }
        let mut step = Step { time_us, pps_us: Default::default(), chunks: Default::default(), fittings };
        for edge_us in pps_us {
            step.pps_us
                .push(*edge_us)
                .map_err(|_| BackseatError::Protocol("none: more PPS edges in one step than a message holds".into()))?;
        }
        for (port, Arrival { time_us, bytes }) in arrivals {
            let chunk = Chunk { port: *port, time_us: *time_us, length: bytes.len() as u16 };
            step.chunks.push(chunk).map_err(|_| BackseatError::Protocol("nothing: too many chunks".into()))?;
            self.ports.write(*port, bytes)?;
        }
        self.send(&ToBoard::Step(step))
    }

    /// The second half of [`Self::step`]: waits for what the board sent and found.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn end_step(&mut self, time_us: u64) -> Result<StepOutput, BackseatError> {
        let mut output = StepOutput::default();
        let answer = self.receive(|message| {
            match message {
                FromBoard::StepDone(done) => return Some(Ok(done)),
                FromBoard::Refused(refusal @ Refusal::OwnClock) => return Some(Err(refusal)),
                FromBoard::Telemetry(record) => output.telemetry = Some(record),
                FromBoard::Fusion(record) => output.fusions.extend(ReportedFusion::of(&record)),
                FromBoard::Identification(record) => output.identification = Some(record),
                FromBoard::Naming(record) => output.naming = Some(record),
                FromBoard::Health(health) => output.fittings = Some(health.fittings),
                _ => {}
            }
            None
        })?;
        let StepDone { time_us: answered_us, sent: counts, digest } =
            answer.map_err(|refusal| BackseatError::Refused { request: "a simulator's clock".into(), refusal })?;
        if answered_us != time_us {
            return Err(BackseatError::Protocol(format!("it is for {answered_us} µs; expected {time_us} µs")));
        }
        if time_us == 0 {
            self.discard(counts)?;
        }
        for (port, count) in Port::DEVICES.into_iter().zip(counts) {
            let ahead = &mut self.ahead[port as usize];
            while ahead.len() < usize::from(count) {
                self.ports.read(port, ahead)?;
            }
            output.sent[port as usize] = ahead.drain(..usize::from(count)).collect();
        }
        output.digest = digest;
        self.tape.write_outputs(digest, &output.sent)?;
        Ok(output)
    }

    /// Forgets what the device ports carried before the board restarted, while it ran on its own
    /// clock: all but the last `counts` bytes.
    fn discard(&mut self, counts: [u16; 4]) -> Result<(), BackseatError> {
        let mut heard = Instant::now();
        while heard.elapsed() < QUIET {
            for (port, ahead) in Port::DEVICES.into_iter().zip(&mut self.ahead) {
                let before = ahead.len();
                self.ports.poll(port, ahead)?;
                if ahead.len() > before {
                    heard = Instant::now();
                }
            }
            sleep(QUIET / 20);
        }
        for (ahead, count) in self.ahead.iter_mut().zip(counts) {
            ahead.drain(..ahead.len().saturating_sub(usize::from(count)));
        }
        Ok(())
    }
}
