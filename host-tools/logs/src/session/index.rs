//! Where the chunks of an MCAP file begin, by the index at its end: what stands behind a record of a wrong length.

use super::record::parse_record;
use mcap::MAGIC;
use mcap::records::{Record, op};
use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// A record's head: opcode and length.
const HEAD: u64 = 9;
/// Head and body of the record that says where the index begins.
const FOOTER: u64 = HEAD + 20;
/// A longer index is none: 10⁵ chunks have one of a tenth of it.
const LONGEST: u64 = 1 << 28;

/// Chunks of a file, and the topics of its channels.
#[derive(Debug, Default)]
pub struct Index {
    /// Places of chunks that are where the index says, in order.
    starts: Vec<u64>,
    /// Topics by the channels' numbers.
    pub topics: HashMap<u16, String>,
}

impl Index {
    /// Of a file, which is left where it was; empty for one that is cut off, or whose index is broken.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn read(file: &mut File, length: u64) -> io::Result<Self> {
        let place = file.stream_position()?;
        let index = Self::at_the_end(file, length);
        file.seek(SeekFrom::Start(place))?;
        match index {
            Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => Err(error),
            index => Ok(index.ok().flatten().unwrap_or_default()),
        }
    }

    fn at_the_end(file: &mut File, length: u64) -> io::Result<Option<Self>> {
        let end = length.saturating_sub(FOOTER + MAGIC.len() as u64);
        let footer = bytes(file, end, FOOTER)?;
        let from = match (footer.split_at_checked(HEAD as usize), footer.first()) {
            (Some((_, body)), Some(&op::FOOTER)) => match parse_record(op::FOOTER, body) {
                Ok(Record::Footer(footer)) => footer.summary_start,
                _ => return Ok(None),
            },
            _ => return Ok(None),
        };
        if from == 0 || from > end || end - from > LONGEST {
            return Ok(None);
        }
        let summary = bytes(file, from, end - from)?;
        let mut index = Self::default();
        let mut chunks = Vec::new();
        let mut rest = &summary[..];
        while let Some((&opcode, behind)) = rest.split_first() {
            let Some((size, behind)) = behind.split_first_chunk() else { break };
            let Ok(size) = usize::try_from(u64::from_le_bytes(*size)) else { break };
            let Some((body, behind)) = behind.split_at_checked(size) else { break };
            match parse_record(opcode, body) {
                Ok(Record::ChunkIndex(chunk)) => chunks.push((chunk.chunk_start_offset, chunk.chunk_length)),
                Ok(Record::Channel(channel)) => drop(index.topics.insert(channel.id, channel.topic)),
                _ => {}
            }
            rest = behind;
        }
        chunks.sort_unstable();
        for (start, whole) in chunks {
            // an index is a claim: bytes that were put in or lost in front move everything behind
            let head = bytes(file, start, HEAD)?;
            let expected = whole.saturating_sub(HEAD).to_le_bytes();
            if head.split_first() == Some((&op::CHUNK, &expected[..])) {
                index.starts.push(start);
            }
        }
        Ok(Some(index))
    }

    /// The first chunk behind a place.
    pub fn behind(&self, place: u64) -> Option<u64> {
        self.starts.get(self.starts.partition_point(|start| *start <= place)).copied()
    }
}

fn bytes(file: &mut File, from: u64, count: u64) -> io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(from))?;
    let mut bytes = Vec::new();
    file.take(count).read_to_end(&mut bytes)?;
    Ok(bytes)
}
