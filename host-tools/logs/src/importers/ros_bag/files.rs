//! The messages of a bag, whatever it is stored in: MCAP, SQLite (`.db3`), or a folder of such files.

use super::sqlite::{Database, Value, is_sqlite};
use super::zstd::Zstd;
use crate::DataError;
use crate::session::sound_part;
use mcap::sans_io::LinearReaderOptions;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Largest chunk, unpacked, bytes: writers make them of some megabytes.
const MAX_CHUNK: u64 = 1 << 28;
/// What messages and files that are compressed by themselves begin with.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

/// A message as it was recorded.
pub(super) struct Recorded<'a> {
    pub topic: &'a str,
    pub type_name: &'a str,
    pub encoding: &'a str,
    /// Time of the recorder, µs.
    pub log_us: i64,
    pub data: &'a [u8],
}

/// What a reader makes of a bag's messages.
pub(super) trait Take {
    /// Whether messages of a topic are of use; those that are not are counted.
    fn wants(&mut self, topic: &str, type_name: &str) -> Result<bool, DataError>;
    /// One message that is.
    fn take(&mut self, message: &Recorded<'_>) -> Result<(), DataError>;
}

/// The files of a bag that is a folder, in order of their names; empty for any other folder.
pub(super) fn of_folder(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let is_part = |path: &PathBuf| path.extension().is_some_and(|extension| extension == "mcap" || extension == "db3");
    let mut files: Vec<PathBuf> = entries.filter(is_part).collect();
    // `run_10.db3` is behind `run_9.db3`
    files.sort_by_key(|path| {
        let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let digits = stem.rsplit('_').next().and_then(|number| number.parse::<u64>().ok());
        (digits.unwrap_or(0), stem)
    });
    files
}

/// Hands over the messages of a bag; what was wrong with its files.
pub(super) fn read(path: &Path, take: &mut dyn Take) -> Result<Vec<String>, DataError> {
    let files = if path.is_dir() { of_folder(path) } else { vec![path.to_owned()] };
    let mut notes = Vec::new();
    for file in &files {
        let (count, mut faults) = match super::super::beginning(file)? {
            beginning if is_sqlite(&beginning) => read_db3(file, take)?,
            beginning if super::is_bag(&beginning) == Some(true) => read_mcap(file, take)?,
            _ => return Err(DataError::file(file, "part of a bag, but neither MCAP of ROS 2 nor SQLite")),
        };
        if let (0, [fault], 1) = (count, &faults[..], files.len()) {
            return Err(DataError::file(file, format!("no message can be read: {fault}")));
        }
        if path.is_dir() {
            let name = file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
            faults.iter_mut().for_each(|fault| *fault = format!("{name}: {fault}"));
        }
        notes.extend(faults.into_iter().map(|fault| format!("cut off or broken: the rest is left out ({fault})")));
    }
    if path.is_dir() {
        notes.push(format!("a folder of {} files", files.len()));
    }
    Ok(notes)
}

/// How many messages were read, and what ended the file before its end.
type Outcome = Result<(usize, Vec<String>), DataError>;

fn read_mcap(path: &Path, take: &mut dyn Take) -> Outcome {
    let fail = |message: String| DataError::file(path, message);
    let bytes = std::fs::read(path).map_err(|e| DataError::io(path, &e))?;
    let (sound, fault) = sound_part(&bytes, MAX_CHUNK);
    let options = LinearReaderOptions::default().with_skip_end_magic(true);
    let mut messages = mcap::io::MessageReader::new_with_options(sound, options);
    messages.add_decompressor(Zstd::new()).map_err(|e| fail(e.to_string()))?;
    let (mut count, mut faults) = (0, Vec::from_iter(fault));
    for message in messages {
        let message = match message {
            Ok(message) => message,
            Err(error) => {
                faults.push(error.to_string());
                break;
            }
        };
        count += 1;
        let topic = &message.channel.topic;
        let type_name = message.channel.schema.as_ref().map_or("", |schema| schema.name.as_str());
        if take.wants(topic, type_name)? {
            let encoding = &message.channel.message_encoding;
            let log_us = (message.log_time / 1000) as i64;
            take.take(&Recorded { topic, type_name, encoding, log_us, data: &message.data })?;
        }
    }
    Ok((count, faults))
}

/// A bag in SQLite: a table of topics, and one of messages.
fn read_db3(path: &Path, take: &mut dyn Take) -> Outcome {
    let fail = |message: String| DataError::file(path, message);
    let mut database = Database::open(path).map_err(fail)?;
    let mut table = |name: &str| match database.table(name).map_err(fail)? {
        Some(table) => Ok(table),
        None => Err(fail(format!("an SQLite file without a table {name}; expected a ROS 2 bag"))),
    };
    let (topics, messages) = (table("topics")?, table("messages")?);
    let [name, kind, encoding] = ["name", "type", "serialization_format"].map(|column| topics.place(column));
    let (name, kind, encoding) = (name.map_err(fail)?, kind.map_err(fail)?, encoding.map_err(fail)?);
    let mut known: BTreeMap<i64, [String; 3]> = BTreeMap::new();
    let rows = database.table_rows(&topics, &mut |database, row| {
        let values = database.values(row, 1 + name.max(kind).max(encoding))?;
        let text = |place: usize| values.get(place).and_then(Value::text).unwrap_or_default();
        known.insert(row.id, [text(name), text(kind), text(encoding)]);
        Ok(())
    });
    rows.map_err(fail)?;
    let [topic, time, data] = ["topic_id", "timestamp", "data"].map(|column| messages.place(column));
    let (topic, time, data) = (topic.map_err(fail)?, time.map_err(fail)?, data.map_err(fail)?);
    let (mut count, mut refused) = (0, None);
    let rows = database.table_rows(&messages, &mut |database, row| {
        let head = database.values(row, 1 + topic.max(time))?;
        let number = |place: usize| head.get(place).and_then(Value::integer);
        let (Some([topic, type_name, encoding]), Some(log_ns)) =
            (number(topic).and_then(|id| known.get(&id)), number(time))
        else {
            return Ok(());
        };
        count += 1;
        let result = match take.wants(topic, type_name) {
            Ok(true) => {
                let values = database.values(row, 1 + data)?;
                let Some(Value::Bytes(data)) = values.get(data) else { return Ok(()) };
                if data.starts_with(&ZSTD) {
                    return Err("messages are compressed one by one; first `ros2 bag convert` without it".to_owned());
                }
                take.take(&Recorded { topic, type_name, encoding, log_us: log_ns / 1000, data })
            }
            other => other.map(drop),
        };
        result.map_err(|error| {
            let message = error.to_string();
            refused = Some(error);
            message
        })
    });
    if let Some(error) = refused {
        return Err(error);
    }
    let mut faults: Vec<String> = rows.err().into_iter().collect();
    let beside = path.with_extension("db3-wal");
    if std::fs::metadata(&beside).is_ok_and(|wal| wal.len() > 0) {
        faults.push(format!(
            "the newest rows are still in {}: first `ros2 bag reindex` or open it by sqlite3",
            beside.display()
        ));
    }
    Ok((count, faults))
}
