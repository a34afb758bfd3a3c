//! Writing a session, chunk by chunk.

use super::format::{self, Direction, Note, Parameters, Start, Tick};
use super::{Attachment, Entry, EstimatesRow, Event, Meta, TelemetryRow};
use crate::DataError;
use crate::output::{Existing, check};
use backseat_wire::hostlink::{Decoder, FromBoard, Port};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Compression, McapError, WriteOptions};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Bytes of messages collected in a chunk at most, before compression.
const CHUNK: u64 = 1 << 16;

/// Writes a session.
///
/// What was written up to the last [`Writer::flush`] survives whatever happens to the program.
pub struct Writer {
    path: PathBuf,
    file: File,
    /// Chunks are made in memory and written whole.
    mcap: mcap::Writer<NoSeek<BufWriter<File>>>,
    channels: HashMap<Cow<'static, str>, u16>,
    /// Of the bytes that the board sends to the host.
    decoder: Decoder,
}

impl Writer {
    /// Begins a session file.
    ///
    /// # Errors
    /// If the file exists and is to be kept, or cannot be written.
    pub fn create(path: &Path, meta: &Meta, existing: Existing) -> Result<Self, DataError> {
        check(path, existing)?;
        let io = |error| DataError::io(path, &error);
        let file = File::create(path).map_err(io)?;
        let buffered = BufWriter::new(file.try_clone().map_err(io)?);
        let options = WriteOptions::new()
            .profile("backseat")
            .library(concat!("backseat ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Lz4))
            .chunk_size(Some(CHUNK))
            .disable_seeking(true);
        let failed = |error| DataError::file(path, describe(error));
        let mut mcap = options.create(NoSeek::new(buffered)).map_err(failed)?;
        let metadata = Metadata { name: format::METADATA.to_owned(), metadata: format::to_metadata(meta) };
        mcap.write_metadata(&metadata).map_err(failed)?;
        Ok(Self { path: path.to_owned(), file, mcap, channels: HashMap::new(), decoder: Decoder::new() })
    }

    /// Adds a file that belongs to the session.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn attach(&mut self, attachment: &Attachment) -> Result<(), DataError> {
        let Attachment { name, media_type, bytes } = attachment;
        let attachment = mcap::Attachment {
            log_time: 0,
            create_time: 0,
            name: name.clone(),
            media_type: media_type.clone(),
            data: Cow::Borrowed(bytes),
        };
        self.mcap.attach(&attachment).map_err(|error| failed(&self.path, error))
    }

    /// Adds what happened; bytes that the board sends to the host are decoded as well.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&mut self, entry: &Entry) -> Result<(), DataError> {
        let time_us = entry.time_us;
        match &entry.event {
            Event::Received { port, bytes } => self.bytes(*port, Direction::Rx, time_us, bytes),
            Event::Sent { port, bytes } => {
                self.bytes(*port, Direction::Tx, time_us, bytes)?;
                if *port == Port::Host { self.decode(time_us, bytes) } else { Ok(()) }
            }
            Event::Edge => self.json(format::CLOCK, time_us, &Tick::Pps { time_us }),
            Event::Oscillator(oscillator) => {
                self.json(format::CLOCK, time_us, &Tick::Oscillator { time_us, oscillator: *oscillator })
            }
            Event::Fittings(readings) => {
                self.json(format::CLOCK, time_us, &Tick::Fittings { time_us, readings: *readings })
            }
            Event::Restart => self.json(format::CLOCK, time_us, &Tick::Restart { time_us }),
            Event::Step { digest } => {
                let digest = format!("{digest:016x}");
                self.json(format::CLOCK, time_us, &Tick::Step { time_us, digest })
            }
            Event::Parameters(values) => {
                self.json(format::PARAMETERS, time_us, &Parameters { time_us, values: values.clone() })
            }
            Event::Note(note) => self.json(format::NOTE, time_us, &Note { time_us, note: note.clone(), lost: None }),
            Event::Lost(records) => {
                let note = Note { time_us, note: format!("{records} records are missing"), lost: Some(*records) };
                self.json(format::NOTE, time_us, &note)
            }
            Event::Start { firmware, parameter_schema, image, restart, record } => {
                let start = Start {
                    time_us,
                    firmware: firmware.clone(),
                    parameter_schema: *parameter_schema,
                    image: *image,
                    restart: *restart,
                    record: record.clone(),
                };
                self.json(format::START, time_us, &start)
            }
        }
    }

    /// Adds bytes of a line that is no port of a board, to `port/<name>/rx` or, of what was sent, `port/<name>/tx`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write_line(&mut self, name: &str, sent: bool, time_us: u64, bytes: &[u8]) -> Result<(), DataError> {
        let direction = if sent { "tx" } else { "rx" };
        self.message(format!("port/{name}/{direction}").into(), format::BYTES, time_us, bytes)
    }

    /// Adds a message of another program than a board's.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write_json(&mut self, topic: &'static str, time_us: u64, message: &impl Serialize) -> Result<(), DataError> {
        self.json(topic, time_us, message)
    }

    fn bytes(&mut self, port: Port, direction: Direction, time_us: u64, bytes: &[u8]) -> Result<(), DataError> {
        self.message(format::topic(port, direction).into(), format::BYTES, time_us, bytes)
    }

    fn json(&mut self, topic: &'static str, time_us: u64, message: &impl Serialize) -> Result<(), DataError> {
        let text = serde_json::to_vec(message).map_err(|error| DataError::file(&self.path, error.to_string()))?;
        self.message(topic.into(), format::JSON, time_us, &text)
    }

    fn message(
        &mut self,
        topic: Cow<'static, str>,
        encoding: &str,
        time_us: u64,
        data: &[u8],
    ) -> Result<(), DataError> {
        let Self { path, mcap, channels, .. } = self;
        let channel_id = match channels.get(&topic) {
            Some(id) => *id,
            None => {
                let id =
                    mcap.add_channel(0, &topic, encoding, &BTreeMap::new()).map_err(|error| failed(path, error))?;
                channels.insert(topic, id);
                id
            }
        };
        let time_ns = time_us.saturating_mul(1000);
        let header = MessageHeader { channel_id, sequence: 0, log_time: time_ns, publish_time: time_ns };
        mcap.write_to_known_channel(&header, data).map_err(|error| failed(path, error))
    }

    /// Writes beside the bytes what they say.
    fn decode(&mut self, time_us: u64, mut bytes: &[u8]) -> Result<(), DataError> {
        let mut decoder = std::mem::take(&mut self.decoder);
        let mut outcome = Ok(());
        while outcome.is_ok()
            && let Some(frame) = decoder.feed(&mut bytes)
        {
            // what is no frame stays in the bytes
            let Ok(message) = frame.and_then(|frame| frame.message()) else { continue };
            outcome = match message {
                FromBoard::Telemetry(record) => {
                    self.json(format::TELEMETRY, time_us, &TelemetryRow::from(&record).at(time_us))
                }
                FromBoard::Identification(record) => self.json(format::IDENTIFICATION, time_us, &record),
                FromBoard::LearntStored(stored) => self.json(format::LEARNT, time_us, &stored),
                FromBoard::Health(health) => self.json(format::HEALTH, time_us, &health),
                FromBoard::Ship(ship) => self.json(format::SHIP, time_us, &ship),
                FromBoard::Fault(report) => self.json(format::FAULT, time_us, &report),
                FromBoard::Naming(naming) => self.json(format::NAMING, time_us, &naming),
                FromBoard::Steered(steered) => self.json(format::STEERED, time_us, &steered),
                FromBoard::Estimates(estimates) => {
                    self.json(format::ESTIMATES, time_us, &EstimatesRow::from(&estimates).at(time_us))
                }
                _ => Ok(()),
            };
        }
        self.decoder = decoder;
        outcome
    }

    /// Ends the present chunk and hands everything to the operating system.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn flush(&mut self) -> Result<(), DataError> {
        self.mcap.flush().map_err(|error| failed(&self.path, error))
    }

    /// [`Writer::flush`], and on to the disk: survives a power cut.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn sync(&mut self) -> Result<(), DataError> {
        self.flush()?;
        self.file.sync_data().map_err(|error| DataError::io(&self.path, &error))
    }

    /// Ends the file with its index.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn finish(mut self) -> Result<(), DataError> {
        self.mcap.finish().map_err(|error| failed(&self.path, error))?;
        let mut buffer = self.mcap.into_inner().into_inner();
        buffer.flush().map_err(|error| DataError::io(&self.path, &error))
    }
}

fn failed(path: &Path, error: McapError) -> DataError {
    DataError::file(path, describe(error))
}

/// The operating system's words, where it is the cause.
pub(super) fn describe(error: McapError) -> String {
    match error {
        McapError::Io(error) => error.to_string(),
        error => error.to_string(),
    }
}
