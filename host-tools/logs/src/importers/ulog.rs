//! Logs of PX4 (ULog, `.ulg`): topics with the names and types of their numbers. Body axes forward, right, down;
//! attitude to north-east-down.
//!
//! PX4's own crate (px4-ulog 0.6) panics where a message is shorter than its kind, so it cannot be given any file.

use super::mapping::ColumnMap;
use super::signals::Signals;
use super::{Imported, whole};
use crate::DataError;
use crate::log::layout;
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "PX4 ULog";

/// Most numbers of a topic; what has more is a picture or broken.
const MAX_FIELDS: usize = 1024;
/// Deepest nesting of types.
const MAX_DEPTH: usize = 8;
/// Bytes before the first message.
const HEADER: usize = 16;

/// A topic that is logged: its name, which of several of that name, and its numbers.
struct Topic {
    name: String,
    which: String,
    /// Name, letter and place of each.
    fields: Vec<(String, u8, usize)>,
}

/// Types and names of the fields of each type of message.
type Types = BTreeMap<String, Vec<(String, String)>>;

/// Whether the beginning of a file is that of such a log.
pub(super) fn is_ulog(beginning: &[u8]) -> bool {
    beginning.starts_with(b"ULog\x01\x12\x35")
}

/// Reads a log.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let bytes = whole(path)?;
    let mut signals = Signals::new(path, map, "ulog")?;
    let (mut types, mut topics) = (Types::new(), BTreeMap::new());
    let mut notes = Vec::new();
    // what is appended after the log was closed begins at places of its own
    let mut ends = vec![bytes.len()];
    let mut at = HEADER;
    while at < bytes.len() {
        let end = ends.iter().copied().filter(|end| *end > at).min().unwrap_or(bytes.len());
        let size = layout::number(b'H', bytes.get(at..).unwrap_or_default(), false).map_or(0, |size| size as usize);
        let Some(message) = bytes.get(at + 2..at + 3 + size).filter(|_| at + 3 + size <= end) else {
            notes.push(format!("byte {at}: the log ends within a message"));
            at = end;
            continue;
        };
        at += 3 + size;
        let (kind, content) = message.split_at(1);
        match kind {
            b"B" => {
                let offset = |k: usize| layout::number(b'Q', content.get(16 + 8 * k..)?, false);
                ends.extend((0..3).filter_map(offset).map(|offset| offset as usize).filter(|offset| *offset > at));
            }
            b"F" => {
                let text = String::from_utf8_lossy(content);
                if let Some((name, fields)) = text.split_once(':') {
                    let field =
                        |field: &str| field.split_once(' ').map(|(kind, name)| (kind.to_owned(), name.to_owned()));
                    types.insert(name.to_owned(), fields.split(';').filter_map(field).collect());
                }
            }
            b"A" => {
                if let Some((number, topic)) = logged(&types, content) {
                    topics.insert(number, topic);
                }
            }
            b"D" => {
                let number = layout::number(b'H', content, false).map(|number| number as u16);
                if let Some(topic) = number.and_then(|number| topics.get(&number)) {
                    take(&mut signals, topic, content.get(2..).unwrap_or_default());
                }
            }
            _ => {}
        }
    }
    signals.finish(NAME, notes)
}

/// Number and topic of a message that says what is logged.
fn logged(types: &Types, content: &[u8]) -> Option<(u16, Topic)> {
    let number = layout::number(b'H', content.get(1..)?, false)? as u16;
    let name = String::from_utf8_lossy(content.get(3..)?).into_owned();
    let (mut fields, mut at) = (Vec::new(), 0);
    flatten(types, &name, "", 0, &mut fields, &mut at)?;
    let which = if content[0] == 0 { String::new() } else { format!("[{}]", content[0]) };
    Some((number, Topic { name, which, fields }))
}

/// The numbers of a type, those of the types in it with the path to them; `None` for one that is unknown or too large.
fn flatten(
    types: &Types,
    name: &str,
    path: &str,
    depth: usize,
    fields: &mut Vec<(String, u8, usize)>,
    at: &mut usize,
) -> Option<()> {
    for (kind, field) in types.get(name).filter(|_| depth < MAX_DEPTH)? {
        let (kind, count) = match kind.split_once('[') {
            Some((kind, count)) => (kind, Some(count.strip_suffix(']')?.parse::<usize>().ok()?)),
            None => (kind.as_str(), None),
        };
        let code = match kind {
            "int8_t" => b'b',
            "uint8_t" | "bool" => b'B',
            "int16_t" => b'h',
            "uint16_t" => b'H',
            "int32_t" => b'i',
            "uint32_t" => b'I',
            "int64_t" => b'q',
            "uint64_t" => b'Q',
            "float" => b'f',
            "double" => b'd',
            "char" => {
                *at = at.checked_add(count.unwrap_or(1))?;
                continue;
            }
            _ => 0,
        };
        for k in 0..count.unwrap_or(1) {
            let element = if count.is_some() { format!("{path}{field}[{k}]") } else { format!("{path}{field}") };
            if fields.len() >= MAX_FIELDS {
                return None;
            }
            if code == 0 {
                flatten(types, kind, &format!("{element}."), depth + 1, fields, at)?;
            } else {
                fields.push((element, code, *at));
                *at += layout::size(code);
            }
        }
    }
    Some(())
}

fn take(signals: &mut Signals<'_>, topic: &Topic, data: &[u8]) {
    if !signals.wants(&topic.name) {
        return;
    }
    let values: Vec<(&str, f64)> = topic
        .fields
        .iter()
        .filter_map(|(name, code, at)| Some((name.as_str(), layout::number(*code, data.get(*at..)?, false)?)))
        .collect();
    let get = |name: &str| values.iter().find(|(field, _)| *field == name).map(|(_, value)| *value);
    let Some(time_us) = get("timestamp").map(|time_us| time_us as i64) else { return };
    if let Some(utc_us) = get("time_utc_usec").filter(|utc_us| (1e15..1e16).contains(utc_us) && signals.shift_us == 0) {
        signals.shift_us = utc_us as i64 - time_us;
    }
    signals.message(time_us, &topic.name, &topic.which, &values);
}
