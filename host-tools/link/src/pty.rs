//! A pseudo-terminal: our end is a file, the backseat's end a path like any serial port.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::{Errno, FdFlags, fcntl_setfd, ioctl_fionbio};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::io;
use std::os::fd::OwnedFd;

/// One virtual serial cable.
#[derive(Debug)]
pub struct Pty {
    ours: OwnedFd,
    // Held open so that our end does not read "hung up" before the backseat has opened its own.
    _theirs: OwnedFd,
    path: String,
}

impl Pty {
    /// Opens a pseudo-terminal in raw mode (8 bits, no echo, no translation).
    ///
    /// # Errors
    /// What the operating system refuses.
    pub fn open() -> io::Result<Self> {
        let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        // A child that inherited our end would keep the line from hanging up.
        fcntl_setfd(&ours, FdFlags::CLOEXEC)?;
        grantpt(&ours)?;
        unlockpt(&ours)?;
        let path = ptsname(&ours, Vec::new())?.into_string().map_err(io::Error::other)?;
        let theirs = rustix::fs::open(&path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        let mut attributes = tcgetattr(&theirs)?;
        attributes.make_raw();
        tcsetattr(&theirs, OptionalActions::Now, &attributes)?;
        Ok(Self { ours, _theirs: theirs, path })
    }

    /// The path the backseat opens.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Writes all of `bytes`, waiting while the other end's buffer is full.
    ///
    /// # Errors
    /// When the other end does not take them within five seconds.
    pub fn write_all(&self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            self.wait(PollFlags::OUT, 5_000)?
                .then_some(())
                .ok_or_else(|| io::Error::new(io::ErrorKind::TimedOut, format!("{} takes no more bytes", self.path)))?;
            let written = rustix::io::write(&self.ours, bytes)?;
            bytes = &bytes[written..];
        }
        Ok(())
    }

    /// Neither reading nor [`Self::offer`] waits from here on.
    ///
    /// # Errors
    /// What the operating system refuses.
    pub fn never_block(&self) -> io::Result<()> {
        Ok(ioctl_fionbio(&self.ours, true)?)
    }

    /// Writes as much of `bytes` as the other end has room for.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn offer(&self, bytes: &[u8]) -> io::Result<usize> {
        match rustix::io::write(&self.ours, bytes) {
            Err(Errno::AGAIN) => Ok(0),
            written => Ok(written?),
        }
    }

    /// Reads what is there, waiting up to `timeout_ms` for the first byte; 0 when none came.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn read(&self, buffer: &mut [u8], timeout_ms: u32) -> io::Result<usize> {
        if !self.wait(PollFlags::IN, timeout_ms)? {
            return Ok(0);
        }
        Ok(rustix::io::read(&self.ours, buffer)?)
    }

    fn wait(&self, flags: PollFlags, timeout_ms: u32) -> io::Result<bool> {
        let timeout =
            Timespec { tv_sec: i64::from(timeout_ms / 1000), tv_nsec: i64::from(timeout_ms % 1000) * 1_000_000 };
        let mut fds = [PollFd::new(&self.ours, flags)];
        match poll(&mut fds, Some(&timeout)) {
            Ok(n) => Ok(n > 0),
            Err(rustix::io::Errno::INTR) => Ok(false),
            Err(e) => Err(e.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};

    #[test]
    fn every_byte_value_passes_both_ways_unchanged() {
        let pty = Pty::open().unwrap();
        let mut theirs = std::fs::OpenOptions::new().read(true).write(true).open(pty.path()).unwrap();
        let all: Vec<u8> = (0..=255).collect();
        pty.write_all(&all).unwrap();
        let mut got = vec![0; 256];
        theirs.read_exact(&mut got).unwrap();
        assert_eq!(got, all);
        theirs.write_all(&all).unwrap();
        let mut got = Vec::new();
        while got.len() < 256 {
            let mut buffer = [0; 64];
            let n = pty.read(&mut buffer, 1000).unwrap();
            assert!(n > 0, "timed out");
            got.extend_from_slice(&buffer[..n]);
        }
        assert_eq!(got, all);
    }
}
