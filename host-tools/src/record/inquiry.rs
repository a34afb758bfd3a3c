//! Asks the board which image it runs, and for its parameters, one after the other, while its port is recorded.

use backseat_wire::hostlink::{Decoder, FromBoard, MAX_FRAME, ToBoard, encode};
use serialport::TTYPort;
use std::io::Write;
use std::time::{Duration, Instant};

/// An answer that has not come by then is asked for again ...
const PATIENCE: Duration = Duration::from_secs(1);
/// ... this many times, before the board is taken to be silent.
const ATTEMPTS: u32 = 5;

/// The set as far as it is known.
pub struct Inquiry {
    device: TTYPort,
    decoder: Decoder,
    values: Vec<(String, f64)>,
    asked: Option<Instant>,
    attempts: u32,
}

impl Inquiry {
    pub fn new(device: TTYPort) -> Self {
        Self { device, decoder: Decoder::new(), values: Vec::new(), asked: None, attempts: 0 }
    }

    /// Asks (again) when it is time; returns the bytes sent to the board, which belong to the session.
    pub fn ask(&mut self) -> Option<Vec<u8>> {
        if self.attempts >= ATTEMPTS || self.asked.is_some_and(|at| at.elapsed() < PATIENCE) {
            return None;
        }
        self.attempts += 1;
        self.asked = Some(Instant::now());
        let index = self.values.len() as u16;
        // with the first one: which image answers
        let hello = (index == 0).then_some(ToBoard::Hello);
        let mut sent = Vec::new();
        for request in hello.into_iter().chain([ToBoard::ParameterGet { index }]) {
            sent.extend_from_slice(encode(&request, &mut [0; MAX_FRAME]).ok()?);
        }
        // a device that does not take it is about to be reported lost
        self.device.write_all(&sent).ok()?;
        Some(sent)
    }

    /// Reads the board's bytes; returns the set when it is complete.
    pub fn hear(&mut self, mut bytes: &[u8]) -> Option<Vec<(String, f64)>> {
        while let Some(frame) = self.decoder.feed(&mut bytes) {
            let Ok(FromBoard::Parameter(info)) = frame.and_then(|frame| frame.message()) else { continue };
            if usize::from(info.index) != self.values.len() {
                continue;
            }
            self.values.push((info.name.to_owned(), info.value));
            (self.asked, self.attempts) = (None, 0);
            if self.values.len() >= usize::from(info.count) {
                return Some(std::mem::take(&mut self.values));
            }
        }
        None
    }
}
