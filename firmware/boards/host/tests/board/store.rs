//! The parameter store in a file, cut at every write.

use backseat_app::parameters::{Settings, find};
use backseat_app::store::ParameterFlash;
use backseat_host::{FileError, FileFlash};
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use std::io;
use std::path::Path;

/// A file whose process is killed in the middle of the write number `left`.
struct Killed {
    flash: FileFlash,
    left: usize,
}

impl Killed {
    fn dies(&mut self) -> bool {
        let dies = self.left == 0;
        self.left = self.left.saturating_sub(1);
        dies
    }
}

impl ErrorType for Killed {
    type Error = FileError;
}

impl ReadNorFlash for Killed {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FileError> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Killed {
    const WRITE_SIZE: usize = FileFlash::WRITE_SIZE;
    const ERASE_SIZE: usize = FileFlash::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FileError> {
        if self.dies() {
            self.flash.erase(from, from + (to - from) / 2)?;
            return Err(FileError(io::Error::other("killed")));
        }
        self.flash.erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FileError> {
        if self.dies() {
            self.flash.write(offset, &bytes[..bytes.len() / 2])?;
            return Err(FileError(io::Error::other("killed")));
        }
        self.flash.write(offset, bytes)
    }
}

fn settings(depth_max_m: f64) -> Settings {
    let mut settings = Settings::DEFAULT;
    find("safety.depth_max_m").unwrap().set(&mut settings, depth_max_m);
    settings
}

/// The set in the file, by whoever opens it next.
fn found(path: &Path) -> Option<f64> {
    let mut settings = Settings::DEFAULT;
    let mut store = ParameterFlash::new(FileFlash::open(path).unwrap()).unwrap();
    store.load(&mut settings).ok()?;
    Some(settings.app.safety.depth_max_m)
}

#[test]
fn a_process_killed_at_any_write_leaves_the_old_set_or_the_new() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parameters");
    assert_eq!(found(&path), None, "a new file is empty flash");
    ParameterFlash::new(FileFlash::open(&path).unwrap()).unwrap().save(&settings(10.0)).unwrap();
    assert_eq!(found(&path), Some(10.0));
    let mut old = 10.0;
    for left in 0.. {
        let new = 11.0 + left as f64 * 0.25;
        let mut store = ParameterFlash::new(Killed { flash: FileFlash::open(&path).unwrap(), left }).unwrap();
        let saved = store.save(&settings(new)).is_ok();
        let now = found(&path);
        assert!(now == Some(new) || (!saved && now == Some(old)), "killed at write {left}: {now:?} after {old}, {new}");
        if saved {
            assert!(left > 20, "a copy has more writes than that: {left}");
            return;
        }
        old = now.unwrap();
    }
}

#[test]
fn a_file_that_is_cut_short_is_empty_flash() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parameters");
    std::fs::write(&path, [0x55; 100]).unwrap();
    assert_eq!(found(&path), None);
    assert_eq!(std::fs::metadata(&path).unwrap().len(), 2 * backseat_host::SECTOR as u64);
}
