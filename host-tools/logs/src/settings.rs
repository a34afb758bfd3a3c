//! The text of a file of settings: vehicle file, scenario, mission, mapping and the like, all of them TOML.

use crate::DataError;
use std::io::{ErrorKind, Read};
use std::path::Path;

/// Longest file, bytes: a thousand times what any of them has.
const MAX_BYTES: u64 = 16 << 20;

/// Reads a file of settings.
///
/// # Errors
/// A file that cannot be read, is no text, or is longer than any settings are.
pub fn read(path: &Path) -> Result<String, DataError> {
    let mut text = String::new();
    let mut file = crate::kinds::open(path)?.take(MAX_BYTES + 1);
    let result = file.read_to_string(&mut text);
    if file.limit() == 0 {
        let message = format!("more than {} MiB: not a file of settings", MAX_BYTES >> 20);
        return Err(DataError::file(path, message));
    }
    match (result, crate::kinds::of(path)) {
        (Ok(_), _) => Ok(text),
        (Err(_), Some((what, _))) => Err(DataError::file(path, format!("{what}; expected a file of settings (TOML)"))),
        (Err(error), None) if error.kind() == ErrorKind::InvalidData => {
            Err(DataError::file(path, "no text; expected a file of settings (TOML)"))
        }
        (Err(error), None) => Err(DataError::io(path, &error)),
    }
}

/// Line and column, from 1, of a byte of a text.
#[must_use]
pub fn place(text: &str, byte: usize) -> (u64, u64) {
    let before = text.get(..byte).unwrap_or(text);
    let line = before.bytes().filter(|&byte| byte == b'\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    (line as u64, column as u64)
}
