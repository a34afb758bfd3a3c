//! The parameter store in a file: the two copies of a board's flash, by the same code.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Bytes of a sector; a copy takes one.
pub const SECTOR: usize = 16_384;
/// Both.
const CAPACITY: usize = 2 * SECTOR;

/// A file that behaves as a flash of two sectors.
///
/// A copy is committed by its first word, which is written last: what was written before is on the disk before it, and
/// it is itself when the write returns. A process or a computer that ends at any moment leaves the old set or the new
/// one.
#[derive(Debug)]
pub struct FileFlash {
    file: File,
}

/// What the file refused.
#[derive(Debug)]
pub struct FileError(pub io::Error);

impl FileFlash {
    /// Opens the file; one that does not exist, or is shorter, is erased flash as far as it is missing.
    ///
    /// # Errors
    /// When it cannot be opened, read or extended.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        let length = usize::try_from(file.metadata()?.len()).unwrap_or(CAPACITY);
        if length < CAPACITY {
            file.write_all_at(&vec![0xFF; CAPACITY - length], length as u64)?;
            file.sync_all()?;
        }
        Ok(Self { file })
    }
}

impl NorFlashError for FileError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for FileFlash {
    type Error = FileError;
}

impl ReadNorFlash for FileFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FileError> {
        self.file.read_exact_at(bytes, u64::from(offset)).map_err(FileError)
    }

    fn capacity(&self) -> usize {
        CAPACITY
    }
}

impl NorFlash for FileFlash {
    const WRITE_SIZE: usize = 32;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FileError> {
        let length = to.saturating_sub(from) as usize;
        self.file.write_all_at(&vec![0xFF; length], u64::from(from)).map_err(FileError)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FileError> {
        let commits = (offset as usize).is_multiple_of(SECTOR);
        let write = || {
            if commits {
                self.file.sync_data()?;
            }
            self.file.write_all_at(bytes, u64::from(offset))?;
            if commits { self.file.sync_data() } else { Ok(()) }
        };
        write().map_err(FileError)
    }
}
