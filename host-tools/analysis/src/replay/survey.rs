//! A first look through a session: what the replay has to know before it begins.

use backseat_logs::DataError;
use backseat_logs::session::{Entry, Event, Reader};
use backseat_wire::hostlink::{Decoder, FromBoard, LearntStored, Port, Refusal, Telemetry, ToBoard};
use std::collections::VecDeque;
use std::path::Path;

/// The board answered that it had written its parameters, or could not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// After the step of this board time, µs.
    pub after_us: Option<u64>,
    pub kept: bool,
}

/// The board's report of one step, and when it was read.
#[derive(Clone, Copy, Debug)]
pub struct ReportedStep {
    /// The session's clock, µs.
    pub read_us: u64,
    /// Board time, µs.
    pub time_us: u64,
    /// 0 while unknown.
    pub utc_us: u64,
    /// North and east, m; `None` before navigation is initialised.
    pub position_m: Option<[f64; 2]>,
}

/// What a session has.
#[derive(Default)]
pub struct Survey {
    /// Steps of the app with their digests.
    pub steps: usize,
    /// Time came from a simulator.
    pub lockstep: bool,
    /// What a memory for parameters did, which only its board knew.
    pub stored: VecDeque<Stored>,
    /// Telemetry, step by step.
    pub reported: Vec<ReportedStep>,
    pub has_parameters: bool,
    /// The board had a key of the acoustic payloads, or was given one: no log holds it.
    pub has_key: bool,
}

/// Requests and answers of the host link, as they passed.
#[derive(Default)]
struct Listener {
    to_board: Decoder,
    from_board: Decoder,
    /// Requests that will be answered by "done" or a refusal.
    unanswered: usize,
    storing: bool,
    /// The key may come, which no log holds.
    key_expected: bool,
    step_us: Option<u64>,
}

impl Survey {
    /// Reads the whole session.
    pub fn of(path: &Path) -> Result<Self, DataError> {
        let mut survey = Self::default();
        let mut listener = Listener::default();
        for entry in Reader::open(path)? {
            let Entry { time_us, event } = entry?;
            match event {
                Event::Received { port: Port::Host, bytes } => listener.asked(&bytes),
                Event::Sent { port: Port::Host, bytes } => listener.answered(time_us, &bytes, &mut survey),
                Event::Step { .. } => survey.steps += 1,
                Event::Restart => survey.lockstep = true,
                Event::Parameters(_) => survey.has_parameters = true,
                Event::Start { .. } => listener = Listener::default(),
                _ => {}
            }
        }
        Ok(survey)
    }
}

impl Listener {
    fn asked(&mut self, mut bytes: &[u8]) {
        while let Some(frame) = self.to_board.feed(&mut bytes) {
            match frame.and_then(|frame| frame.message::<ToBoard<'_>>()).and_then(ToBoard::unsigned) {
                Ok(ToBoard::ParameterStore) => self.storing = true,
                Ok(ToBoard::KeyBegin) => self.key_expected = true,
                Ok(
                    ToBoard::ParameterBegin
                    | ToBoard::ParameterSet { .. }
                    | ToBoard::ParameterCommit
                    | ToBoard::MissionBegin { .. }
                    | ToBoard::MissionItem { .. }
                    | ToBoard::FenceCorner { .. }
                    | ToBoard::MissionCommit
                    | ToBoard::MissionStart
                    | ToBoard::MissionStop
                    | ToBoard::DropWeight { .. }
                    | ToBoard::Helm { .. }
                    | ToBoard::FinWiggle
                    | ToBoard::Unlock
                    | ToBoard::KeySet(_),
                ) => self.unanswered += 1,
                _ => {}
            }
        }
    }

    fn answered(&mut self, read_us: u64, mut bytes: &[u8], survey: &mut Survey) {
        while let Some(frame) = self.from_board.feed(&mut bytes) {
            let Ok(message) = frame.and_then(|frame| frame.message()) else { continue };
            match message {
                FromBoard::Telemetry(record) => {
                    self.step_us = Some(record.time_us);
                    survey.reported.push(reported_step(read_us, &record));
                }
                FromBoard::LearntStored(LearntStored { time_us, kept }) => {
                    survey.stored.push_back(Stored { after_us: Some(time_us), kept });
                }
                FromBoard::Key { set } => survey.has_key |= set,
                FromBoard::Done | FromBoard::Refused(_) if self.unanswered > 0 => self.unanswered -= 1,
                FromBoard::Done | FromBoard::Refused(Refusal::StoreFailed) if self.storing => {
                    self.storing = false;
                    let kept = message == FromBoard::Done;
                    survey.stored.push_back(Stored { after_us: self.step_us, kept });
                }
                FromBoard::Done if self.key_expected => {
                    self.key_expected = false;
                    survey.has_key = true;
                }
                // the request to store was refused at once
                FromBoard::Refused(_) => self.storing = false,
                _ => {}
            }
        }
    }
}

pub fn reported_step(read_us: u64, record: &Telemetry) -> ReportedStep {
    let Telemetry { time_us, utc_us, state: [x_m, y_m, ..], sigma, .. } = *record;
    ReportedStep { read_us, time_us, utc_us, position_m: (sigma[0] > 0.0).then_some([x_m, y_m]) }
}
