//! What a session and a board's log have in common: a file that is read part by part, and what came of it so far.

use super::{Attachment, Damage, Entry};
use crate::DataError;
use std::collections::VecDeque;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A file as far as it was read.
pub struct Passed {
    pub path: PathBuf,
    pub file: File,
    pub length: u64,
    pub read: u64,
    /// Where the last whole record ended.
    pub whole: u64,
    pub waiting: VecDeque<Entry>,
    pub attachments: Vec<Attachment>,
    pub damage: Damage,
    pub ended: bool,
}

impl Passed {
    pub fn open(path: &Path, file: File, whole: u64) -> Result<Self, DataError> {
        let length = file.metadata().map_err(|error| DataError::io(path, &error))?.len();
        let (waiting, attachments, damage) = (VecDeque::new(), Vec::new(), Damage::default());
        Ok(Self { path: path.to_owned(), file, length, read: 0, whole, waiting, attachments, damage, ended: false })
    }
}

/// A file of either kind.
pub trait Source {
    fn passed(&mut self) -> &mut Passed;
    fn so_far(&self) -> &Passed;
    /// Takes in a part of the file.
    fn advance(&mut self) -> Result<(), DataError>;
}
