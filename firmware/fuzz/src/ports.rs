//! Serial ports in memory, for a board on its own clock.

use std::collections::VecDeque;
use std::convert::Infallible;

/// One port.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    pub(crate) to_board: VecDeque<u8>,
    pub(crate) from_board: Vec<u8>,
}

impl embedded_io::ErrorType for Memory {
    type Error = Infallible;
}

impl embedded_io::Read for Memory {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let count = buffer.len().min(self.to_board.len());
        for (slot, byte) in buffer.iter_mut().zip(self.to_board.drain(..count)) {
            *slot = byte;
        }
        Ok(count)
    }
}

impl embedded_io::ReadReady for Memory {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(!self.to_board.is_empty())
    }
}

impl embedded_io::Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        self.from_board.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl embedded_io::WriteReady for Memory {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }
}
