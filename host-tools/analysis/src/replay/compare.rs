//! What the board sent against what the replay sends: where they part, in which record, in which field.

use crate::duration::exact_s;
use backseat_logs::STATE_COLUMNS;
use backseat_wire::hostlink::{Decoder, FromBoard, Health, Port, Refusal};
use serde::Serialize;
use serde_json::Value;
use std::collections::VecDeque;
use std::fmt;

/// Where log and replay are not the same.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Board time, s.
    pub t_s: String,
    /// `step`, `telemetry`, `fusion`, a sentence to a device…
    pub record: String,
    /// Its first field that is not the same.
    pub field: String,
    /// Its value in the log.
    pub logged: String,
    /// Its value in the replay.
    pub replayed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { t_s, record, field, logged, replayed } = self;
        write!(f, "at {t_s} s, {record}, {field}: logged {logged}, replayed {replayed}")
    }
}

/// What is there where one side has nothing.
const NOTHING: &str = "nothing";

/// Both sides of all five ports, up to the first difference.
#[derive(Default)]
pub struct Comparison {
    devices: [Sentences; 4],
    host: Messages,
    /// Bytes to devices that were the same.
    pub bytes: usize,
    /// Messages to the host that were the same.
    pub messages: usize,
    /// Messages about received bytes that the board's drivers had lost: what the app never saw is not in the log.
    pub losses: usize,
    pub difference: Option<Difference>,
}

impl Comparison {
    /// Bytes that the board sent, by its log.
    pub fn logged(&mut self, port: Port, time_us: u64, bytes: &[u8]) {
        match self.devices.get_mut(port as usize) {
            Some(device) => device.logged.extend(bytes),
            None => self.host.logged.push(bytes),
        }
        self.compare(port, time_us);
    }

    /// Bytes that the replay sends.
    pub fn replayed(&mut self, port: Port, time_us: u64, bytes: &[u8]) {
        match self.devices.get_mut(port as usize) {
            Some(device) => device.replayed.extend(bytes),
            None => self.host.replayed.push(bytes),
        }
        self.compare(port, time_us);
    }

    fn compare(&mut self, port: Port, time_us: u64) {
        if self.difference.is_none() {
            self.difference = match self.devices.get_mut(port as usize) {
                Some(device) => device.compare(port, time_us, &mut self.bytes),
                None => self.compare_host(time_us),
            };
        }
    }

    fn compare_host(&mut self, time_us: u64) -> Option<Difference> {
        while let Some((logged, replayed)) = self.host.fronts() {
            let judgement = if logged == replayed { Judgement::Same } else { judge(logged, replayed) };
            match judgement {
                Judgement::Same => self.messages += 1,
                Judgement::Losses => self.losses += 1,
                Judgement::OnlyLogged { losses } => {
                    self.losses += usize::from(losses);
                    self.host.logged.whole.pop_front();
                    continue;
                }
                Judgement::Different { record, field, values: [logged, replayed] } => {
                    return Some(Difference { t_s: exact_s(time_us), record, field, logged, replayed });
                }
            }
            self.host.logged.whole.pop_front();
            self.host.replayed.whole.pop_front();
        }
        None
    }

    /// The board starts again: what it had not sent whole by then is gone.
    pub fn start_again(&mut self, time_us: u64) {
        self.finish(time_us);
        (self.devices, self.host) = Default::default();
    }

    /// The log is at its end: what it still has, the replay lacks.
    pub fn finish(&mut self, time_us: u64) {
        if self.difference.is_some() {
            return;
        }
        let device = self.devices.iter().zip(Port::DEVICES).find(|(device, _)| !device.logged.is_empty());
        let host = self.host.logged.whole.iter().find(|frame| message(frame, |said| !is_boards_own(said)));
        let (record, logged) = match (device, host) {
            (Some((device, port)), _) => (sentence_to(port), text(device.logged.iter().copied())),
            (None, Some(frame)) => message(frame, |said| (kind(&said), brief(&said))),
            (None, None) => return,
        };
        let field = "whole".to_owned();
        self.difference =
            Some(Difference { t_s: exact_s(time_us), record, field, logged, replayed: NOTHING.to_owned() });
    }
}

/// What goes to a device.
#[derive(Default)]
struct Sentences {
    logged: VecDeque<u8>,
    replayed: VecDeque<u8>,
    /// The sentence under way, so far the same on both sides.
    begun: Vec<u8>,
}

impl Sentences {
    fn compare(&mut self, port: Port, time_us: u64, same: &mut usize) -> Option<Difference> {
        while let (Some(&logged), Some(&replayed)) = (self.logged.front(), self.replayed.front()) {
            if logged != replayed {
                let whole = |rest: &VecDeque<u8>| {
                    let rest = rest.iter().copied().take_while(|byte| *byte != b'\n');
                    text(self.begun.iter().copied().chain(rest))
                };
                return Some(Difference {
                    t_s: exact_s(time_us),
                    record: sentence_to(port),
                    field: format!("field {}", self.begun.iter().filter(|byte| **byte == b',').count()),
                    logged: whole(&self.logged),
                    replayed: whole(&self.replayed),
                });
            }
            self.logged.pop_front();
            self.replayed.pop_front();
            *same += 1;
            if logged == b'\n' {
                self.begun.clear();
            } else {
                self.begun.push(logged);
            }
        }
        None
    }
}

fn sentence_to(port: Port) -> String {
    format!("sentence to {}", port.name())
}

fn text(bytes: impl Iterator<Item = u8>) -> String {
    let bytes: Vec<u8> = bytes.take(96).collect();
    bytes.escape_ascii().to_string()
}

/// What goes to the host.
#[derive(Default)]
struct Messages {
    logged: Frames,
    replayed: Frames,
}

impl Messages {
    fn fronts(&self) -> Option<(&[u8], &[u8])> {
        Some((self.logged.whole.front()?, self.replayed.whole.front()?))
    }
}

/// Frames without their delimiters.
#[derive(Default)]
struct Frames {
    whole: VecDeque<Vec<u8>>,
    part: Vec<u8>,
}

impl Frames {
    fn push(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if byte != 0 {
                self.part.push(byte);
            } else if !self.part.is_empty() {
                self.whole.push_back(std::mem::take(&mut self.part));
            }
        }
    }
}

enum Judgement {
    Same,
    /// The same but for what the board's drivers counted.
    Losses,
    /// The board sent this without a request.
    OnlyLogged {
        losses: bool,
    },
    Different {
        record: String,
        field: String,
        values: [String; 2],
    },
}

/// Two frames that are not the same.
fn judge(logged: &[u8], replayed: &[u8]) -> Judgement {
    message(logged, |logged| {
        message(replayed, |replayed| match (&logged, &replayed) {
            (Some(FromBoard::StepDone(_) | FromBoard::EarlierCrash(_)), _) => Judgement::OnlyLogged { losses: false },
            // this computer runs another image
            (
                Some(FromBoard::Hello { firmware: a, parameter_schema: b, .. }),
                Some(FromBoard::Hello { firmware: c, parameter_schema: d, .. }),
            ) if (a, b) == (c, d) => Judgement::Same,
            (Some(FromBoard::Health(a)), Some(FromBoard::Health(b)))
                if (Health {
                    receive_losses: b.receive_losses,
                    log: b.log,
                    hardware: b.hardware,
                    refused_requests: b.refused_requests,
                    ..*a
                }) == *b =>
            {
                Judgement::Losses
            }
            // a number of the start that is in no log
            (Some(FromBoard::Challenge { .. }), Some(FromBoard::Challenge { .. })) => Judgement::Same,
            // this computer has no image to renew
            (
                Some(FromBoard::Images(_) | FromBoard::Done | FromBoard::Refused(_)),
                Some(FromBoard::Refused(Refusal::NoStore)),
            ) => Judgement::Same,
            (Some(FromBoard::Health(_)), replayed) if !matches!(replayed, Some(FromBoard::Health(_))) => {
                Judgement::OnlyLogged { losses: true }
            }
            _ => difference(logged, replayed),
        })
    })
}

fn difference(logged: Option<FromBoard<'_>>, replayed: Option<FromBoard<'_>>) -> Judgement {
    let (record, other) = (kind(&logged), kind(&replayed));
    if record != other {
        return Judgement::Different { record, field: "kind".to_owned(), values: [brief(&logged), brief(&replayed)] };
    }
    // the same to look at: not a number on one side, or the sign of a zero
    let alike = || ("whole".to_owned(), [format!("{logged:?}"), format!("{replayed:?}")]);
    let (path, values) = first_field(&raw(&logged), &raw(&replayed)).unwrap_or_else(alike);
    Judgement::Different { record, field: name(&path), values }
}

/// Neither the lock-step clock's answer nor news of losses and of earlier crashes comes from the app's input.
fn is_boards_own(message: Option<FromBoard<'_>>) -> bool {
    matches!(message, Some(FromBoard::StepDone(_) | FromBoard::Health(_) | FromBoard::EarlierCrash(_)))
}

/// The message of a frame; `None` if it is broken.
fn message<R>(frame: &[u8], take: impl FnOnce(Option<FromBoard<'_>>) -> R) -> R {
    let mut decoder = Decoder::new();
    let delimited: Vec<u8> = frame.iter().copied().chain([0]).collect();
    match decoder.feed(&mut delimited.as_slice()) {
        Some(Ok(frame)) => take(frame.message().ok()),
        _ => take(None),
    }
}

fn raw(message: &Option<FromBoard<'_>>) -> Value {
    message.as_ref().map_or(Value::Null, json)
}

fn json(message: impl Serialize) -> Value {
    serde_json::to_value(message).unwrap_or_default()
}

/// Name of the message.
fn kind(message: &Option<FromBoard<'_>>) -> String {
    match raw(message) {
        Value::Object(map) => map.keys().next().map(|key| key.to_lowercase()).unwrap_or_default(),
        Value::String(name) => name.to_lowercase(),
        _ => "broken frame".to_owned(),
    }
}

fn brief(message: &Option<FromBoard<'_>>) -> String {
    raw(message).to_string().chars().take(96).collect()
}

/// The first leaf that is not the same: its path and both values.
fn first_field(logged: &Value, replayed: &Value) -> Option<(String, [String; 2])> {
    let below = |name: String, inner: Option<(String, [String; 2])>| {
        inner.map(|(path, values)| {
            let dot = if path.is_empty() || path.starts_with('[') { "" } else { "." };
            (format!("{name}{dot}{path}"), values)
        })
    };
    match (logged, replayed) {
        (Value::Object(a), Value::Object(b)) => a
            .iter()
            .find_map(|(name, value)| below(name.clone(), first_field(value, b.get(name).unwrap_or(&Value::Null)))),
        (Value::Array(a), Value::Array(b)) => (0..a.len().max(b.len())).find_map(|i| {
            let at = |array: &[Value]| array.get(i).cloned().unwrap_or_default();
            below(format!("[{i}]"), first_field(&at(a), &at(b)))
        }),
        (a, b) if a == b => None,
        (a, b) => Some((String::new(), [a.to_string(), b.to_string()])),
    }
}

/// A path without the message's own name, and the vehicle's states by theirs.
fn name(path: &str) -> String {
    let path = path.split_once('.').map_or(path, |(_, path)| path);
    let element = |array: &str| {
        let index = path.strip_prefix(array)?.strip_prefix('[')?.strip_suffix(']')?;
        STATE_COLUMNS.get(index.parse::<usize>().ok()?)
    };
    match (element("state"), element("sigma")) {
        (Some(state), _) => (*state).to_owned(),
        (_, Some(state)) => format!("sigma_{state}"),
        _ => path.to_owned(),
    }
}
