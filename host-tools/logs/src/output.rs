//! Results are written whole or not at all, and replace an existing file only on request.

use crate::DataError;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// What to do with a file that is there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// Leave it and fail.
    Keep,
    /// Replace it.
    Replace,
}

/// Fails if `path` exists and is to be kept, or cannot be written: to be called before the work, not after it.
///
/// # Errors
/// If the file exists, is a folder, or nothing can be written where it is to be.
pub fn check(path: &Path, existing: Existing) -> Result<(), DataError> {
    if path.is_dir() {
        return Err(DataError::file(path, "is a folder; expected the name of a file"));
    }
    if existing == Existing::Keep && path.exists() {
        return Err(DataError::file(path, "exists already"));
    }
    check_folder(&folder_of(path))
}

/// Fails if no file can be written into `folder`, or the folders that it lacks cannot be made: by trying, in the part of
/// it that exists.
///
/// # Errors
/// What the operating system reports.
pub fn check_folder(folder: &Path) -> Result<(), DataError> {
    let Some(existing) = folder.ancestors().find(|folder| folder.exists()) else { return check_folder(Path::new(".")) };
    if !existing.is_dir() {
        return Err(DataError::file(existing, "is a file; expected a folder"));
    }
    tempfile::tempfile_in(existing).map_err(|e| DataError::io(existing, &e))?;
    Ok(())
}

/// The folder that a file is in.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Writes a file under a temporary name beside its place and moves it there when it is complete. The folder is made if
/// need be.
///
/// # Errors
/// If the file exists and is to be kept, or cannot be written.
pub fn write(
    path: &Path,
    existing: Existing,
    content: impl FnOnce(&mut dyn Write) -> std::io::Result<()>,
) -> Result<(), DataError> {
    check(path, existing)?;
    let fail = |e: std::io::Error| DataError::io(path, &e);
    let folder = folder_of(path);
    std::fs::create_dir_all(&folder).map_err(|e| DataError::io(&folder, &e))?;
    let mut builder = tempfile::Builder::new();
    // A temporary file is private by default; a result is for whom the umask lets read it.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut buffer = BufWriter::new(builder.tempfile_in(folder).map_err(fail)?);
    content(&mut buffer).map_err(fail)?;
    let file = buffer.into_inner().map_err(|e| fail(e.into_error()))?;
    let moved = match existing {
        Existing::Keep => file.persist_noclobber(path),
        Existing::Replace => file.persist(path),
    };
    moved.map_err(|e| fail(e.error))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_written_is_told_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        let complaint = |path: &Path| check(path, Existing::Replace).map_err(|e| e.message);
        assert_eq!(complaint(&file.join("track.csv")), Err("is a file; expected a folder".to_owned()));
        assert_eq!(complaint(&file.join("deeper/track.csv")), Err("is a file; expected a folder".to_owned()));
        assert_eq!(complaint(folder.path()), Err("is a folder; expected the name of a file".to_owned()));
        // the kernel's own tree takes no files from anybody
        assert!(complaint(Path::new("/proc/track.csv")).is_err());
        for fine in ["track.csv", "new/folder/track.csv", "file"] {
            let path = folder.path().join(fine);
            assert_eq!(complaint(&path), Ok(()), "{fine}");
            write(&path, Existing::Replace, |w| w.write_all(b"x")).unwrap();
        }
        assert_eq!(check(Path::new("no_such_folder/track.csv"), Existing::Keep), Ok(()));
    }

    #[test]
    fn keeps_replaces_and_leaves_no_half_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("result.txt");
        write(&path, Existing::Keep, |w| w.write_all(b"first")).unwrap();
        let refused = write(&path, Existing::Keep, |w| w.write_all(b"second")).unwrap_err();
        assert!(refused.to_string().contains("exists already"));
        write(&path, Existing::Replace, |w| w.write_all(b"third")).unwrap();
        let broken = write(&path, Existing::Replace, |w| {
            w.write_all(b"half")?;
            Err(std::io::Error::other("disk full"))
        });
        assert!(broken.unwrap_err().to_string().contains("disk full"));
        assert_eq!(std::fs::read(&path).unwrap(), b"third");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
