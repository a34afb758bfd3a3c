//! A port that may vanish and come back.

use crate::PortSettings;
use crate::port::Serial;
use backseat_wire::hostlink::Port;
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use mio::{Registry, Token};
use std::convert::Infallible;
use std::fmt::Display;
use std::io;
use std::time::{Duration, Instant};

/// A port that is gone is tried again this often.
const RETRY: Duration = Duration::from_secs(1);

/// A port, open or gone. While it is gone nothing comes, and what is sent is dropped: a command of the past must not
/// wait for a frontseat that comes back.
pub(crate) struct PtyLine {
    settings: PortSettings,
    index: usize,
    serial: Option<Serial>,
    /// Why it is gone, until it was taken note of.
    pub(crate) lost: Option<String>,
    tried: Instant,
}

impl PtyLine {
    /// Opens a port for the first time.
    pub(crate) fn open(settings: &PortSettings, index: usize, registry: &Registry) -> io::Result<Self> {
        let mut line = Self { settings: settings.clone(), index, serial: None, lost: None, tried: Instant::now() };
        line.serial = Some(line.try_open(registry)?);
        Ok(line)
    }

    fn try_open(&self, registry: &Registry) -> io::Result<Serial> {
        let path = self.settings.path.to_str().ok_or_else(|| io::Error::other("path is not UTF-8"))?;
        Serial::open(path, self.settings.baud, registry, Token(self.index))
    }

    pub(crate) fn is_open(&self) -> bool {
        self.serial.is_some()
    }

    /// Name and path, for messages.
    pub(crate) fn label(&self) -> String {
        format!("{}: {}", Port::NAMES[self.index], self.settings.path.display())
    }

    pub(crate) fn set_ready(&mut self, readable: bool, writable: bool) {
        if let Some(serial) = &mut self.serial {
            serial.set_ready(readable, writable);
        }
    }

    /// It is gone.
    pub(crate) fn close(&mut self, how: impl Display) {
        if self.serial.take().is_some() {
            self.lost = Some(format!("{} vanished ({how})", self.label()));
            self.tried = Instant::now();
        }
    }

    /// Tries to open it again when that is due; true when it is back.
    pub(crate) fn reopen(&mut self, registry: &Registry) -> bool {
        if self.serial.is_some() || self.tried.elapsed() < RETRY {
            return false;
        }
        self.tried = Instant::now();
        self.serial = self.try_open(registry).ok();
        self.serial.is_some()
    }

    /// What `act` does with the open port; `gone` without one, or when it fails, which closes it.
    fn with<T>(&mut self, gone: T, act: impl FnOnce(&mut Serial) -> io::Result<T>) -> Result<T, Infallible> {
        let Some(serial) = &mut self.serial else { return Ok(gone) };
        match act(serial) {
            Ok(value) => Ok(value),
            Err(error) => {
                self.close(error);
                Ok(gone)
            }
        }
    }
}

impl ErrorType for PtyLine {
    type Error = Infallible;
}

impl ReadReady for PtyLine {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        self.with(false, Serial::read_ready)
    }
}

impl Read for PtyLine {
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Infallible> {
        self.with(0, |serial| serial.read(out))
    }
}

impl WriteReady for PtyLine {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        self.with(true, Serial::write_ready)
    }
}

impl Write for PtyLine {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.with(bytes.len(), |serial| serial.write(bytes))
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
