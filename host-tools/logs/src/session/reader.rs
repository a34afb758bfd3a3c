//! Reading a session, or a board's log, up to where it was cut off.

use super::board_log::BoardLog;
use super::format::{self, Direction, Note, Parameters, Start, Tick};
use super::index::Index;
use super::passed::{Passed, Source};
use super::record::parse_record;
use super::{Attachment, Clock, Damage, Entry, Event, Meta};
use crate::DataError;
use mcap::records::{MessageHeader, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError};
use serde::de::DeserializeOwned;
use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// No chunk is larger, unpacked: a broken length must not become a huge buffer.
const MAX_CHUNK: usize = 1 << 26;

/// Reads a file's events in the order in which they were written.
pub struct Reader {
    meta: Meta,
    source: Box<dyn Source + Send>,
}

impl Reader {
    /// Opens a session file, or a log of a board's memory card.
    ///
    /// # Errors
    /// If it cannot be read, or is neither.
    pub fn open(path: &Path) -> Result<Self, DataError> {
        let io = |error| DataError::io(path, &error);
        let mut file = crate::kinds::open(path)?;
        let mut magic = Vec::new();
        (&mut file).take(MAGIC.len() as u64).read_to_end(&mut magic).map_err(io)?;
        file.rewind().map_err(io)?;
        if magic.is_empty() {
            return Err(DataError::file(path, "is empty"));
        }
        if !MAGIC.starts_with(&magic) {
            let log = BoardLog::open(path, file)?;
            let meta = Meta::new(log.program(), Clock::Board);
            return Ok(Self { meta, source: Box::new(log) });
        }
        let (session, meta) = Session::open(path, file)?;
        Ok(Self { meta, source: Box::new(session) })
    }

    /// The session's description.
    pub fn meta(&self) -> &Meta {
        &self.meta
    }

    /// The files that belong to the session, as far as they have been passed: those at its front from the start.
    pub fn attachments(&self) -> &[Attachment] {
        &self.source.so_far().attachments
    }

    /// Bytes read so far, and in all: for a progress bar.
    pub fn position(&self) -> (u64, u64) {
        let passed = self.source.so_far();
        (passed.read, passed.length)
    }

    /// What was left out so far; complete when the events have come to their end.
    pub fn damage(&self) -> Damage {
        self.source.so_far().damage
    }
}

impl Iterator for Reader {
    type Item = Result<Entry, DataError>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.source.so_far().waiting.is_empty() && !self.source.so_far().ended {
            if let Err(error) = self.source.advance() {
                self.source.passed().ended = true;
                return Some(Err(error));
            }
        }
        self.source.passed().waiting.pop_front().map(Ok)
    }
}

/// An MCAP file, from its start to its end or cut.
struct Session {
    passed: Passed,
    records: LinearReader,
    index: Index,
    topics: HashMap<u16, String>,
    meta: Option<Meta>,
}

impl Source for Session {
    fn passed(&mut self) -> &mut Passed {
        &mut self.passed
    }

    fn so_far(&self) -> &Passed {
        &self.passed
    }

    /// Takes in one record.
    fn advance(&mut self) -> Result<(), DataError> {
        let from = self.passed.whole;
        let (opcode, record) = loop {
            match self.records.next_event() {
                None => {
                    self.passed.ended = true;
                    return Ok(());
                }
                Some(Ok(LinearReadEvent::ReadRequest(need))) => {
                    let count = self.passed.file.read(self.records.insert(need));
                    let count = count.map_err(|error| DataError::io(&self.passed.path, &error))?;
                    self.records.notify_read(count);
                    self.passed.read += count as u64;
                }
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    self.passed.whole += (1 + 8 + data.len()) as u64;
                    break (opcode, data.to_vec());
                }
                // The end is missing, or a length makes no sense: what is behind is found by the index alone.
                Some(Err(_)) => {
                    if let Some(start) = self.index.behind(from) {
                        return self.go_on_at(start);
                    }
                    self.passed.damage.unfinished = true;
                    self.passed.damage.cut_bytes = self.passed.length.saturating_sub(self.passed.whole);
                    self.passed.ended = true;
                    return Ok(());
                }
            }
        };
        if opcode == op::CHUNK {
            match self.chunk(&record) {
                Ok(entries) => self.passed.waiting.extend(entries),
                Err(Broken::Chunk) => match self.swallowed(from) {
                    Some(start) => self.go_on_at(start)?,
                    None => self.passed.damage.broken_records += 1,
                },
                Err(Broken::Message(message)) => return Err(DataError::file(&self.passed.path, message)),
            }
            return Ok(());
        }
        if let Some(start) = self.swallowed(from) {
            return self.go_on_at(start);
        }
        match parse_record(opcode, &record) {
            Ok(Record::Metadata(metadata)) if metadata.name == format::METADATA => {
                let meta = format::from_metadata(metadata.metadata);
                self.meta = Some(meta.map_err(|message| DataError::file(&self.passed.path, message))?);
            }
            Ok(Record::Attachment { header, data, .. }) => self.passed.attachments.push(Attachment {
                name: header.name,
                media_type: header.media_type,
                bytes: data.into_owned(),
            }),
            Ok(_) => {}
            Err(_) => self.passed.damage.broken_records += 1,
        }
        Ok(())
    }
}

impl Session {
    /// Reads up to the first event.
    fn open(path: &Path, file: File) -> Result<(Self, Meta), DataError> {
        let mut passed = Passed::open(path, file, MAGIC.len() as u64)?;
        let length = passed.length;
        let mut index = Index::read(&mut passed.file, length).map_err(|error| DataError::io(path, &error))?;
        let records = LinearReader::new_with_options(options(length));
        let topics = std::mem::take(&mut index.topics);
        let mut session = Self { passed, records, index, topics, meta: None };
        while session.passed.waiting.is_empty() && !session.passed.ended {
            session.advance()?;
        }
        let meta = session.meta.clone().ok_or_else(|| {
            DataError::file(path, "an MCAP file, but not a session of this program: its description is missing")
        })?;
        Ok((session, meta))
    }

    /// A chunk that begins within the record from there to here: the record's length is wrong.
    fn swallowed(&self, from: u64) -> Option<u64> {
        self.index.behind(from).filter(|start| *start < self.passed.whole)
    }

    /// Leaves a broken record out and goes on with a chunk behind its beginning.
    fn go_on_at(&mut self, start: u64) -> Result<(), DataError> {
        self.passed.damage.broken_records += 1;
        self.passed.file.seek(SeekFrom::Start(start)).map_err(|error| DataError::io(&self.passed.path, &error))?;
        self.records = LinearReader::new_with_options(options(self.passed.length).with_skip_start_magic(true));
        (self.passed.whole, self.passed.read) = (start, start);
        Ok(())
    }

    /// The events of a chunk whose CRC is right.
    fn chunk(&mut self, chunk: &[u8]) -> Result<Vec<Entry>, Broken> {
        if let Record::Chunk { header, data } = parse_record(op::CHUNK, chunk)?
            && header.compression.is_empty()
            && !is_row_of_records(&data)
        {
            return Err(Broken::Chunk);
        }
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(MAX_CHUNK);
        let mut records = LinearReader::new_with_options(options);
        let mut head = vec![op::CHUNK];
        head.extend((chunk.len() as u64).to_le_bytes());
        let mut source = head.chain(chunk);
        let mut entries = Vec::new();
        while let Some(event) = records.next_event() {
            match event? {
                LinearReadEvent::ReadRequest(need) => {
                    let count = source.read(records.insert(need)).map_err(McapError::Io)?;
                    records.notify_read(count);
                }
                LinearReadEvent::Record { opcode, data } => match parse_record(opcode, data)? {
                    Record::Channel(channel) => {
                        self.topics.insert(channel.id, channel.topic);
                    }
                    Record::Message { header, data } => {
                        let topic = self.topics.get(&header.channel_id).ok_or(Broken::Chunk)?;
                        let entry = entry(topic, &header, &data);
                        let place = || format!("{topic} at {} ns", header.log_time);
                        entries.extend(entry.map_err(|what| Broken::Message(format!("{}: {what}", place())))?);
                    }
                    _ => {}
                },
            }
        }
        Ok(entries)
    }
}

/// Chunks come whole, and no record is longer than the file.
fn options(length: u64) -> LinearReaderOptions {
    let limit = usize::try_from(length).unwrap_or(usize::MAX);
    LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(limit)
}

/// The part of an MCAP file that the crate's own streams (0.26) read without a panic and within bounds: up to the first
/// record that is broken or larger, unpacked, than `limit`; and what that is, `None` where it is the end.
pub(crate) fn sound_part(bytes: &[u8], limit: u64) -> (&[u8], Option<String>) {
    let mut at = MAGIC.len();
    while let Some((&opcode, rest)) = bytes.get(at..).and_then(<[u8]>::split_first) {
        let part = bytes.get(..at).unwrap_or_default();
        let Some((length, body)) = rest.split_first_chunk() else { return (part, Some("cut off".to_owned())) };
        let whole = usize::try_from(u64::from_le_bytes(*length)).ok().and_then(|length| body.get(..length));
        let Some(body) = whole else {
            // two times, size unpacked, CRC, length of the compression's name: the beginning of a packed chunk is read
            let size = body.get(16..).and_then(<[u8]>::first_chunk).map(|size| u64::from_le_bytes(*size));
            let is_packed = opcode == op::CHUNK && body.get(28..32).is_some_and(|length| length != [0; 4]);
            if is_packed && size.is_some_and(|size| size <= limit) {
                return (bytes, None);
            }
            return (part, Some("cut off".to_owned()));
        };
        match parse_record(opcode, body) {
            Ok(Record::Chunk { header, .. }) if header.uncompressed_size > limit => {
                let size = header.uncompressed_size;
                return (part, Some(format!("a chunk of {size} bytes; at most {limit} are read")));
            }
            Ok(Record::Chunk { header, data }) if header.compression.is_empty() && !is_row_of_records(&data) => {
                return (part, Some("a broken chunk".to_owned()));
            }
            Ok(_) => {}
            Err(error) => return (part, Some(format!("a broken record: {error}"))),
        }
        at += 1 + 8 + body.len();
        // what stands behind is an index
        if opcode == op::DATA_END {
            break;
        }
    }
    (bytes.get(..at).unwrap_or(bytes), None)
}

/// Whether these bytes are records to their end: the crate's reader (0.26) subtracts with overflow where the last one
/// of an uncompressed chunk is longer than the chunk.
fn is_row_of_records(mut bytes: &[u8]) -> bool {
    while let Some((length, rest)) = bytes.get(1..).and_then(<[u8]>::split_first_chunk) {
        let Some(next) = usize::try_from(u64::from_le_bytes(*length)).ok().and_then(|length| rest.get(length..)) else {
            return false;
        };
        bytes = next;
    }
    bytes.is_empty()
}

/// Why a chunk gives no events.
enum Broken {
    /// Its bytes are not what was written.
    Chunk,
    /// They are, but make no sense.
    Message(String),
}

impl From<McapError> for Broken {
    fn from(_: McapError) -> Self {
        Self::Chunk
    }
}

/// The event of a message; none of topics that repeat others.
fn entry(topic: &str, header: &MessageHeader, data: &[u8]) -> Result<Option<Entry>, String> {
    let time_us = header.log_time / 1000;
    let event = match topic {
        format::CLOCK => match json(data)? {
            Tick::Pps { .. } => Event::Edge,
            Tick::Oscillator { oscillator, .. } => Event::Oscillator(oscillator),
            Tick::Fittings { readings, .. } => Event::Fittings(readings),
            Tick::Restart { .. } => Event::Restart,
            Tick::Step { digest, .. } => {
                let digest = u64::from_str_radix(&digest, 16).map_err(|_| format!("digest `{digest}`"))?;
                Event::Step { digest }
            }
        },
        format::PARAMETERS => Event::Parameters(json::<Parameters>(data)?.values),
        format::NOTE => match json(data)? {
            Note { lost: Some(records), .. } => Event::Lost(records),
            Note { note, .. } => Event::Note(note),
        },
        format::START => {
            let Start { firmware, parameter_schema, image, restart, record, .. } = json(data)?;
            Event::Start { firmware, parameter_schema, image, restart, record }
        }
        _ => match format::port_of(topic) {
            Some((port, Direction::Rx)) => Event::Received { port, bytes: data.to_vec() },
            Some((port, Direction::Tx)) => Event::Sent { port, bytes: data.to_vec() },
            None => return Ok(None),
        },
    };
    Ok(Some(Entry { time_us, event }))
}

fn json<T: DeserializeOwned>(data: &[u8]) -> Result<T, String> {
    serde_json::from_slice(data).map_err(|error| error.to_string())
}
