//! Sectors of flash as `embedded-storage`: those of the parameter sets, and those of the images.
//!
//! The program runs in the bank at `OWN`, whichever that is (SWAP_BANK, RM0433 4.3.13), and goes on while the other one
//! is erased or written. That takes seconds, and is done in thread mode, below everything that is in a hurry. The HAL's
//! driver would keep interrupts out for as long. Of its own bank only single words are written, the marks of an image
//! on trial; it stands still meanwhile, for some 0.1 ms.

use crate::supply;
use backseat_app::store::{Chip, ImageFlash};
use backseat_wire::hostlink::CRC;
use cortex_m::peripheral::SCB;
use embassy_stm32::pac;
use embassy_time::{Duration, Instant};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

const SECTOR: u32 = 128 * 1024;
/// The bank that runs, and the other one; their registers change places with them.
const OWN: u32 = 0x0800_0000;
const OTHER: u32 = 0x0810_0000;
/// Sectors of a bank that belong to its image; parameter sets have the last two.
const IMAGE_SECTORS: usize = 6;
/// A flash word: 256 bits and their ECC, programmed as one (RM0433 4.3.9).
const WORD: usize = 32;
/// Keys of FLASH_KEYR (RM0433 4.9.2), and of FLASH_OPTKEYR (4.9.3).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
const OPTION_KEYS: [u32; 2] = [0x0819_2A3B, 0x4C5D_6E7F];
/// 32 bits at once (RM0433 4.9.4, PSIZE).
const PARALLELISM: u8 = 2;
/// Longest erase of a sector (DS12110, flash memory programming) is 4 s.
const ERASE_TIMEOUT: Duration = Duration::from_secs(8);
const WRITE_TIMEOUT: Duration = Duration::from_millis(10);
const OPTION_TIMEOUT: Duration = Duration::from_secs(2);

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

/// Addresses of sectors that are one flash, in this order. Used in thread mode alone.
pub struct Sectors(&'static [u32]);

/// Parameter sets: those of the other bank are written, those of the own one read.
pub fn parameter_sets() -> Sectors {
    Sectors(const { &[OTHER + 6 * SECTOR, OTHER + 7 * SECTOR, OWN + 6 * SECTOR, OWN + 7 * SECTOR] })
}

/// The images, of which this one runs.
pub fn images(build: u32) -> ImageFlash<Sectors> {
    const SECTORS: [u32; 2 * IMAGE_SECTORS] = {
        let mut sectors = [0; 2 * IMAGE_SECTORS];
        let mut i = 0;
        while i < IMAGE_SECTORS {
            sectors[i] = OWN + i as u32 * SECTOR;
            sectors[IMAGE_SECTORS + i] = OTHER + i as u32 * SECTOR;
            i += 1;
        }
        sectors
    };
    // the first stack of an image lies in DTCM
    let chip = Chip { flash: OWN, stack: 0x2000_0000..0x2002_0001 };
    ImageFlash::new(Sectors(&SECTORS), chip, build)
}

unsafe extern "C" {
    // of the linker script: where initial values of variables lie in flash, and the variables
    static __sidata: u8;
    static __sdata: u8;
    static __edata: u8;
}

/// CRC-32 of the image that runs: all of flash up to the initial values, which end it. It is millions of instructions:
/// `meanwhile` is called after each sector.
pub fn image_crc(mut meanwhile: impl FnMut()) -> u32 {
    let [values, from, to] = [&raw const __sidata, &raw const __sdata, &raw const __edata].map(|at| at as usize);
    // SAFETY: these bytes are the image, which nothing writes while it runs.
    let image = unsafe { core::slice::from_raw_parts(OWN as *const u8, values + to - from - OWN as usize) };
    let mut crc = CRC.digest();
    for sector in image.chunks(SECTOR as usize) {
        crc.update(sector);
        meanwhile();
    }
    crc.finalize()
}

impl Sectors {
    fn address(&self, offset: u32) -> Result<u32, Error> {
        let sector = self.0.get((offset / SECTOR) as usize).ok_or(Error::Arguments)?;
        Ok(sector + offset % SECTOR)
    }
}

impl ErrorType for Sectors {
    type Error = Error;
}

impl ReadNorFlash for Sectors {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        check_read(self, offset, bytes.len()).map_err(|_| Error::Arguments)?;
        for (offset, word) in (offset..).step_by(WORD).zip(bytes.as_chunks_mut::<WORD>().0) {
            read_word(self.address(offset)?, word)?;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.len() * SECTOR as usize
    }
}

impl NorFlash for Sectors {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        check_erase(self, from, to).map_err(|_| Error::Arguments)?;
        for offset in (from..to).step_by(SECTOR as usize) {
            let address = self.address(offset)?;
            // the program stands in the other one
            let sector = address.checked_sub(OTHER).ok_or(Error::Arguments)? / SECTOR;
            program(address, ERASE_TIMEOUT, |bank| {
                bank.cr().modify(|w| {
                    w.set_ser(true);
                    w.set_psize(PARALLELISM);
                    w.set_snb(sector as u8);
                });
                bank.cr().modify(|w| w.set_start(true));
            })?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        check_write(self, offset, bytes.len()).map_err(|_| Error::Arguments)?;
        for (offset, word) in (offset..).step_by(WORD).zip(bytes.as_chunks::<WORD>().0) {
            let address = self.address(offset)?;
            program(address, WRITE_TIMEOUT, |bank| {
                bank.cr().modify(|w| {
                    w.set_pg(true);
                    w.set_psize(PARALLELISM);
                });
                cortex_m::asm::dsb();
                // No interrupt comes between the parts of a word: none of them writes to flash.
                for (i, part) in word.as_chunks::<4>().0.iter().enumerate() {
                    // SAFETY: the address is in a sector of this flash, and within reach (`guard`) in the other
                    // bank or in the trailer of an image, which no memory of the program is in; writes to flash are
                    // this driver's alone.
                    unsafe { (address as *mut u32).add(i).write_volatile(u32::from_le_bytes(*part)) };
                }
                cortex_m::asm::dsb();
            })?;
        }
        Ok(())
    }
}

/// Registers of the bank that holds an address.
fn bank_of(address: u32) -> pac::flash::Bank {
    pac::FLASH.bank(usize::from(address >= OTHER))
}

/// Waits; before the HAL's timer runs the watchdog ends it.
fn wait_while(timeout: Duration, is_busy: impl Fn() -> bool) -> Result<(), Error> {
    let deadline = pac::RCC.apb1lenr().read().tim2en().then(|| Instant::now() + timeout);
    while is_busy() {
        if deadline.is_some_and(|deadline| Instant::now() > deadline) {
            return Err(Error::Timeout);
        }
    }
    Ok(())
}

/// Has the chip exchange its banks at the next reset.
pub fn exchange_banks() -> Result<(), Error> {
    if !supply::is_good() {
        return Err(Error::Supply);
    }
    let flash = pac::FLASH;
    let exchanged = !flash.optcr().read().swap_bank();
    if flash.optcr().read().optlock() {
        OPTION_KEYS.iter().for_each(|key| flash.optkeyr().write_value(*key));
    }
    flash.optsr_prg().modify(|w| w.set_swap_bank_opt(exchanged));
    flash.optcr().modify(|w| w.set_optstart(true));
    let ended = wait_while(OPTION_TIMEOUT, || flash.optsr_cur().read().opt_busy());
    let now = flash.optsr_cur().read();
    flash.optcr().modify(|w| w.set_optlock(true));
    ended?;
    if now.optchangeerr() || now.swap_bank_opt() != exchanged { Err(Error::Controller(now.0)) } else { Ok(()) }
}

/// One operation of the bank that holds this address, from unlocking to locking.
fn program(address: u32, timeout: Duration, start: impl FnOnce(pac::flash::Bank)) -> Result<(), Error> {
    if !supply::is_good() {
        return Err(Error::Supply);
    }
    let bank = bank_of(address);
    let wait = || wait_while(timeout, || bank.sr().read().bsy() || bank.sr().read().qw());
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
    let bank = bank_of(address);
    clear_errors(bank);
    // SAFETY: only CCR and CFSR are touched, and with interrupts masked nobody else does so.
    let scb = unsafe { &*SCB::PTR };
    cortex_m::interrupt::free(|_| {
        // SAFETY: FAULTMASK is raised for the reads alone; with it and BFHFNMIGN a load that the
        // bus refuses gives any value (ARMv7-M B3.2.8). The address is in a sector of this flash.
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
