//! Faults of the board under test: resets, its clock, its memory.

use super::{BoardFault, Fault, FaultKind};
use backseat_link::Reset;
use backseat_wire::hostlink::ResetCause;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

/// The board's clock against the simulation's, and its resets.
#[derive(Clone, Debug)]
pub struct Board {
    /// In order of time.
    resets: Vec<(u64, u64, ResetCause)>,
    clocks: Vec<(Fault, i64)>,
    flash: Vec<(u64, u8)>,
    /// Simulated time of the board's time zero, µs.
    zero_us: u64,
    /// No board until then, µs.
    down_until_us: u64,
}

impl Board {
    /// The board of a scenario, powered up at time zero.
    pub fn new(faults: &[Fault]) -> Self {
        let mut board =
            Self { resets: Vec::new(), clocks: Vec::new(), flash: Vec::new(), zero_us: 0, down_until_us: 0 };
        for fault in faults {
            match fault.kind {
                FaultKind::Board(BoardFault::Reset { cause, down_us }) => {
                    board.resets.push((fault.from_us, down_us, cause))
                }
                FaultKind::Board(BoardFault::Clock { offset_us }) => board.clocks.push((fault.clone(), offset_us)),
                FaultKind::Board(BoardFault::Flash { copies }) => board.flash.push((fault.from_us, copies)),
                _ => {}
            }
        }
        board.resets.sort_by_key(|(from_us, ..)| *from_us);
        board
    }

    /// Whether there are resets: then the board has to be one that can be reset.
    #[must_use]
    pub fn is_reset(faults: &[Fault]) -> bool {
        faults.iter().any(|fault| matches!(fault.kind, FaultKind::Board(BoardFault::Reset { .. })))
    }

    /// Whether the board itself is touched: resets, its clock, its memory.
    #[must_use]
    pub fn is_touched(faults: &[Fault]) -> bool {
        faults.iter().any(|fault| matches!(fault.kind, FaultKind::Board(_)))
    }

    /// The reset that is due by now, once.
    pub fn reset(&mut self, now_us: u64) -> Option<Reset> {
        let (from_us, down_us, cause) = *self.resets.first().filter(|(from_us, ..)| *from_us <= now_us)?;
        self.resets.remove(0);
        self.down_until_us = from_us + down_us;
        self.zero_us = self.down_until_us;
        let corrupted = self.flash.extract_if(.., |(time_us, _)| *time_us <= now_us).map(|(_, copies)| copies).max();
        Some(Reset { cause, corrupted: corrupted.unwrap_or(0) })
    }

    /// Whether there is a board: it takes its first step after its time zero.
    pub fn is_up(&self, now_us: u64) -> bool {
        now_us > self.down_until_us
    }

    /// What the board's clock shows, µs. Time zero would mean a fresh start by the host's wish.
    pub fn local_us(&self, time_us: u64) -> u64 {
        let offset_us: i64 = self.clocks.iter().filter(|(fault, _)| fault.acts(time_us)).map(|(_, by_us)| by_us).sum();
        time_us.saturating_sub(self.zero_us).saturating_add_signed(offset_us).max(1)
    }
}

/// Bytes of a sector; a copy of the parameters takes one.
const SECTOR: usize = 16_384;

/// The flash of a board, in memory, with two sectors.
#[derive(Clone, Debug)]
pub struct Flash {
    bytes: Vec<u8>,
}

impl Default for Flash {
    fn default() -> Self {
        Self { bytes: vec![0xFF; 2 * SECTOR] }
    }
}

impl Flash {
    /// Turns over a bit in the middle of the values of so many copies.
    pub fn corrupt(&mut self, copies: u8) {
        for copy in 0..usize::from(copies.min(2)) {
            self.bytes[copy * SECTOR + 1000] ^= 0x10;
        }
    }
}

/// Never.
#[derive(Clone, Copy, Debug)]
pub struct NoError;

impl NorFlashError for NoError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Flash {
    type Error = NoError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NoError> {
        let from = offset as usize;
        bytes.copy_from_slice(self.bytes.get(from..from + bytes.len()).ok_or(NoError)?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 32;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NoError> {
        self.bytes.get_mut(from as usize..to as usize).ok_or(NoError)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NoError> {
        let from = offset as usize;
        self.bytes.get_mut(from..from + bytes.len()).ok_or(NoError)?.copy_from_slice(bytes);
        Ok(())
    }
}
