//! The last two sectors of flash bank 2, as `embedded-storage`.
//!
//! The program is in bank 1 (`memory.x` ends there), so that it runs on while bank 2 is erased or
//! written. That takes seconds, and is done in thread mode, below everything that is in a hurry.
//! The HAL's driver would keep interrupts out for as long.

use crate::supply;
use cortex_m::peripheral::SCB;
use embassy_stm32::Peri;
use embassy_stm32::pac;
use embassy_stm32::peripherals::FLASH;
use embassy_time::{Duration, Instant};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

const SECTOR: u32 = 128 * 1024;
const BANK_2: u32 = 0x0810_0000;
/// Sectors 6 and 7 of bank 2.
const FIRST_SECTOR: u32 = 6;
const BASE: u32 = BANK_2 + FIRST_SECTOR * SECTOR;
const CAPACITY: usize = 2 * SECTOR as usize;
/// A flash word: 256 bits and their ECC, programmed as one (RM0433 4.3.9).
const WORD: usize = 32;
/// Keys of FLASH_KEYR (RM0433 4.9.2).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// 32 bits at once (RM0433 4.9.4, PSIZE).
const PARALLELISM: u8 = 2;
/// Longest erase of a sector (DS12110, flash memory programming) is 4 s.
const ERASE_TIMEOUT: Duration = Duration::from_secs(8);
const WRITE_TIMEOUT: Duration = Duration::from_millis(10);

/// What the flash refuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum Error {
    /// The supply is too low to erase or write.
    Supply,
    /// Not aligned, or beyond the end.
    Arguments,
    /// More wrong bits in a word than can be corrected: an interrupted write.
    Uncorrectable,
    /// The controller refused or failed; its status register.
    Controller(u32),
    /// The controller does not come to an end.
    Timeout,
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// The parameter store's sectors.
pub struct StoreFlash {
    _flash: Peri<'static, FLASH>,
}

impl StoreFlash {
    /// Takes them.
    pub fn new(flash: Peri<'static, FLASH>) -> Self {
        Self { _flash: flash }
    }
}

impl ErrorType for StoreFlash {
    type Error = Error;
}

impl ReadNorFlash for StoreFlash {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        check_read(self, offset, bytes.len()).map_err(|_| Error::Arguments)?;
        for (address, word) in (BASE + offset..).step_by(WORD).zip(bytes.as_chunks_mut::<WORD>().0) {
            read_word(address, word)?;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        CAPACITY
    }
}

impl NorFlash for StoreFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        check_erase(self, from, to).map_err(|_| Error::Arguments)?;
        for sector in from / SECTOR..to / SECTOR {
            program(ERASE_TIMEOUT, |bank| {
                bank.cr().modify(|w| {
                    w.set_ser(true);
                    w.set_psize(PARALLELISM);
                    w.set_snb((FIRST_SECTOR + sector) as u8);
                });
                bank.cr().modify(|w| w.set_start(true));
            })?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        check_write(self, offset, bytes.len()).map_err(|_| Error::Arguments)?;
        for (address, word) in (BASE + offset..).step_by(WORD).zip(bytes.as_chunks::<WORD>().0) {
            program(WRITE_TIMEOUT, |bank| {
                bank.cr().modify(|w| {
                    w.set_pg(true);
                    w.set_psize(PARALLELISM);
                });
                cortex_m::asm::dsb();
                // No interrupt comes between the parts of a word: none of them writes to flash.
                for (i, part) in word.as_chunks::<4>().0.iter().enumerate() {
                    // SAFETY: the address is one of the store's sectors, which no memory of the
                    // program is in, and writes to flash are this driver's alone.
                    unsafe { (address as *mut u32).add(i).write_volatile(u32::from_le_bytes(*part)) };
                }
                cortex_m::asm::dsb();
            })?;
        }
        Ok(())
    }
}

/// One operation of bank 2, from unlocking to locking.
fn program(timeout: Duration, start: impl FnOnce(pac::flash::Bank)) -> Result<(), Error> {
    if !supply::is_good() {
        return Err(Error::Supply);
    }
    let bank = pac::FLASH.bank(1);
    let deadline = Instant::now() + timeout;
    let wait = || {
        while bank.sr().read().bsy() || bank.sr().read().qw() {
            if Instant::now() > deadline {
                return Err(Error::Timeout);
            }
        }
        Ok(())
    };
    wait()?;
    clear_errors(bank);
    if bank.cr().read().lock() {
        KEYS.iter().for_each(|key| bank.keyr().write_value(*key));
    }
    start(bank);
    let ended = wait();
    let status = bank.sr().read();
    bank.cr().modify(|w| {
        w.set_pg(false);
        w.set_ser(false);
    });
    bank.cr().modify(|w| w.set_lock(true));
    clear_errors(bank);
    ended?;
    let failed = status.wrperr() || status.pgserr() || status.strberr() || status.incerr() || status.operr();
    if failed { Err(Error::Controller(status.0)) } else { Ok(()) }
}

fn clear_errors(bank: pac::flash::Bank) {
    bank.ccr().write(|w| {
        w.set_clr_eop(true);
        w.set_clr_wrperr(true);
        w.set_clr_pgserr(true);
        w.set_clr_strberr(true);
        w.set_clr_incerr(true);
        w.set_clr_operr(true);
        w.set_clr_rdperr(true);
        w.set_clr_rdserr(true);
        w.set_clr_sneccerr(true);
        w.set_clr_dbeccerr(true);
    });
}

/// Reads a word that may be half written. Its ECC is then wrong in more than one bit, and the bus
/// answers with an error (RM0433 4.7.10), which would be a hard fault at every start from now on.
fn read_word(address: u32, bytes: &mut [u8; WORD]) -> Result<(), Error> {
    const IGNORE_BUS_FAULTS: u32 = 1 << 8; // CCR.BFHFNMIGN
    const BUS_FAULTS: u32 = 0xFF00; // CFSR.BFSR
    let bank = pac::FLASH.bank(1);
    clear_errors(bank);
    // SAFETY: only CCR and CFSR are touched, and with interrupts masked nobody else does so.
    let scb = unsafe { &*SCB::PTR };
    cortex_m::interrupt::free(|_| {
        // SAFETY: FAULTMASK is raised for the reads alone; with it and BFHFNMIGN a load that the
        // bus refuses gives any value (ARMv7-M B3.2.8). The address is one of the store's sectors.
        unsafe {
            scb.ccr.modify(|w| w | IGNORE_BUS_FAULTS);
            core::arch::asm!("cpsid f", "dsb", "isb");
            for (i, place) in bytes.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                *place = ((address as *const u32).add(i)).read_volatile().to_le_bytes();
            }
            core::arch::asm!("dsb", "cpsie f", "isb");
            scb.ccr.modify(|w| w & !IGNORE_BUS_FAULTS);
            scb.cfsr.write(BUS_FAULTS);
        }
    });
    let bad = bank.sr().read().dbeccerr();
    clear_errors(bank);
    if bad { Err(Error::Uncorrectable) } else { Ok(()) }
}
