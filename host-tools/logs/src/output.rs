//! Results are written whole or not at all, and replace an existing file only on request.

use crate::DataError;
use std::io::{BufWriter, Write};
use std::path::Path;

/// What to do with a file that is there already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Existing {
    /// Leave it and fail.
    Keep,
    /// Replace it.
    Replace,
}

/// Fails if `path` exists and is to be kept: to be called before the work, not after it.
///
/// # Errors
/// If the file exists.
pub fn check(path: &Path, existing: Existing) -> Result<(), DataError> {
    if existing == Existing::Keep && path.exists() {
        return Err(DataError::file(path, "exists already"));
    }
    Ok(())
}

/// Writes a file under a temporary name beside its place and moves it there when it is complete.
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
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
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
