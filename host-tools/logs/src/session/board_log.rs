//! The log that a board writes to its memory card, as events of a session.

use super::passed::{Passed, Source};
use super::{Entry, Event};
use crate::DataError;
use backseat_app::parameters::{PARAMETER_SCHEMA, PARAMETERS};
use backseat_wire::boardlog::LogRecord;
use backseat_wire::hostlink::Decoder;
use std::fs::File;
use std::io::Read;
use std::path::Path;

const BLOCK: usize = 1 << 16;

/// Reads a board log.
pub struct BoardLog {
    passed: Passed,
    decoder: Decoder,
    firmware: String,
    schema: u16,
    /// Values of a set that is not complete yet.
    values: Vec<f64>,
    time_us: u64,
}

impl Source for BoardLog {
    fn passed(&mut self) -> &mut Passed {
        &mut self.passed
    }

    fn so_far(&self) -> &Passed {
        &self.passed
    }

    /// Takes in one block of the file.
    fn advance(&mut self) -> Result<(), DataError> {
        let mut block = vec![0; BLOCK];
        let count = self.passed.file.read(&mut block).map_err(|error| DataError::io(&self.passed.path, &error))?;
        if count == 0 {
            self.passed.ended = true;
            self.passed.damage.cut_bytes = self.passed.length.saturating_sub(self.passed.whole);
            return Ok(());
        }
        let mut decoder = std::mem::take(&mut self.decoder);
        let mut bytes = &block[..count];
        let mut outcome = Ok(());
        while outcome.is_ok()
            && let Some(frame) = decoder.feed(&mut bytes)
        {
            match frame.and_then(|frame| frame.message()) {
                Ok(record) => {
                    self.passed.whole = self.passed.read + (count - bytes.len()) as u64;
                    outcome = self.take(record);
                }
                Err(_) => self.passed.damage.broken_records += 1,
            }
        }
        self.decoder = decoder;
        self.passed.read += count as u64;
        outcome
    }
}

impl BoardLog {
    /// Reads its first block, which has to hold a record.
    pub fn open(path: &Path, file: File) -> Result<Self, DataError> {
        let (passed, decoder) = (Passed::open(path, file, 0)?, Decoder::new());
        let mut log = Self { passed, decoder, firmware: String::new(), schema: 0, values: Vec::new(), time_us: 0 };
        log.advance()?;
        if log.passed.waiting.is_empty() {
            return Err(DataError::file(path, "neither a session (MCAP) nor a log of a board's memory card"));
        }
        Ok(log)
    }

    pub fn program(&self) -> String {
        format!("backseat {}", if self.firmware.is_empty() { "(unknown)" } else { &self.firmware })
    }

    fn take(&mut self, record: LogRecord<'_>) -> Result<(), DataError> {
        if !self.values.is_empty() && !matches!(record, LogRecord::Parameters { .. }) {
            self.set_complete()?;
        }
        let (time_us, event) = match record {
            LogRecord::Start { firmware, parameter_schema, image, restart, record } => {
                (self.firmware, self.schema) = (firmware.to_owned(), parameter_schema);
                self.time_us = 0;
                let (firmware, record) = (firmware.to_owned(), record.to_vec());
                (0, Event::Start { firmware, parameter_schema, image, restart, record })
            }
            LogRecord::Parameters { first, values } => {
                if usize::from(first) != self.values.len() {
                    // records before it are missing
                    self.values.clear();
                    self.passed.damage.broken_records += 1;
                    return Ok(());
                }
                self.values.extend_from_slice(&values);
                return Ok(());
            }
            LogRecord::Received { port, time_us, bytes } => (time_us, Event::Received { port, bytes: bytes.to_vec() }),
            LogRecord::Sent { port, time_us, bytes } => (time_us, Event::Sent { port, bytes: bytes.to_vec() }),
            LogRecord::Edge { time_us } => (time_us, Event::Edge),
            LogRecord::Step { time_us, digest } => (time_us, Event::Step { digest }),
            LogRecord::Oscillator { time_us, oscillator } => (time_us, Event::Oscillator(oscillator)),
            LogRecord::Fittings { time_us, readings } => (time_us, Event::Fittings(readings)),
            LogRecord::EarlierCrash(crash) => (self.time_us, Event::Note(format!("an earlier crash: {crash}"))),
            LogRecord::Lost { records } => (self.time_us, Event::Lost(records)),
        };
        self.time_us = time_us;
        self.passed.waiting.push_back(Entry { time_us, event });
        Ok(())
    }

    /// Names the values, which the log has in the order of the board's list.
    fn set_complete(&mut self) -> Result<(), DataError> {
        let values = std::mem::take(&mut self.values);
        if self.schema != PARAMETER_SCHEMA || values.len() != PARAMETERS.len() {
            let message = format!(
                "written with version {} of the parameter list ({} parameters); this program knows version \
                 {PARAMETER_SCHEMA} ({})",
                self.schema,
                values.len(),
                PARAMETERS.len()
            );
            return Err(DataError::file(&self.passed.path, message));
        }
        let values = PARAMETERS.iter().map(|parameter| parameter.name.to_owned()).zip(values).collect();
        self.passed.waiting.push_back(Entry { time_us: self.time_us, event: Event::Parameters(values) });
        Ok(())
    }
}
