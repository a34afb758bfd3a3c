//! One serial port as the pump wants it: `embedded-io`, never blocking.

use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use mio::{Interest, Registry, Token};
use mio_serial::{SerialPortBuilderExt, SerialStream};
use std::io::{self, ErrorKind, Read as _, Write as _};

/// Bytes fetched from the kernel at once.
const BUFFER: usize = 4096;

/// A serial port or pseudo-terminal.
///
/// Readiness is edge-triggered: a port counts as ready from the poll's event until the kernel says
/// that it would block, so that an idle port costs no system call.
pub(crate) struct Serial {
    stream: SerialStream,
    readable: bool,
    writable: bool,
    buffer: Box<[u8; BUFFER]>,
    start: usize,
    end: usize,
}

impl Serial {
    /// Opens a device raw, 8N1, without flow control.
    pub(crate) fn open(path: &str, baud: u32, registry: &Registry, token: Token) -> io::Result<Self> {
        // A pseudo-terminal has no DTR line (ENOTTY), so it must not be asked for one.
        let mut stream = mio_serial::new(path, baud).preserve_dtr_on_open().open_native_async()?;
        registry.register(&mut stream, token, Interest::READABLE | Interest::WRITABLE)?;
        Ok(Self { stream, readable: true, writable: true, buffer: Box::new([0; BUFFER]), start: 0, end: 0 })
    }

    pub(crate) fn set_ready(&mut self, readable: bool, writable: bool) {
        self.readable |= readable;
        self.writable |= writable;
    }

    /// Fetches more when the buffer is empty.
    fn fill(&mut self) -> io::Result<()> {
        while self.start == self.end && self.readable {
            match self.stream.read(&mut self.buffer[..]) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => (self.start, self.end) = (0, count),
                Err(error) if error.kind() == ErrorKind::WouldBlock => self.readable = false,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

impl ErrorType for Serial {
    type Error = io::Error;
}

impl ReadReady for Serial {
    fn read_ready(&mut self) -> Result<bool, Self::Error> {
        self.fill()?;
        Ok(self.start < self.end)
    }
}

impl Read for Serial {
    fn read(&mut self, out: &mut [u8]) -> Result<usize, Self::Error> {
        self.fill()?;
        let count = out.len().min(self.end - self.start);
        out[..count].copy_from_slice(&self.buffer[self.start..self.start + count]);
        self.start += count;
        Ok(count)
    }
}

impl WriteReady for Serial {
    fn write_ready(&mut self) -> Result<bool, Self::Error> {
        Ok(self.writable)
    }
}

impl Write for Serial {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        loop {
            match self.stream.write(bytes) {
                Ok(count) => return Ok(count),
                Err(error) if error.kind() == ErrorKind::WouldBlock => {
                    self.writable = false;
                    return Ok(0);
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}
