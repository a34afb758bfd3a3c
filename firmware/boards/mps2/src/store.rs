//! The parameter store: the board's own two copies, in RAM that a reset leaves alone and power-off does not.

use backseat_app::App;
use backseat_app::parameters::Settings;
use backseat_app::store::{ParameterFlash, WORD};
use core::sync::atomic::{AtomicBool, Ordering};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// In the machine's PSRAM, behind the AXI region of `memory.x`: QEMU writes every section of the image anew at a reset,
/// so that it must be in none.
const BASE: usize = 0x6010_0000;
/// Two sectors, as on the STM32H743.
const SECTOR: usize = 128 * 1024;
const CAPACITY: usize = 2 * SECTOR;
const ERASED: u8 = 0xFF;

/// RAM that behaves as NOR flash: erased by the sector, and writing only clears bits.
struct RamFlash(&'static mut [u8; CAPACITY]);

impl ErrorType for RamFlash {
    type Error = NorFlashErrorKind;
}

impl RamFlash {
    fn part(&mut self, from: u32, length: usize) -> Result<&mut [u8], NorFlashErrorKind> {
        let from = from as usize;
        self.0.get_mut(from..from + length).ok_or(NorFlashErrorKind::OutOfBounds)
    }
}

impl ReadNorFlash for RamFlash {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        bytes.copy_from_slice(self.part(offset, bytes.len())?);
        Ok(())
    }

    fn capacity(&self) -> usize {
        CAPACITY
    }
}

impl NorFlash for RamFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        self.part(from, (to - from) as usize)?.fill(ERASED);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        for (place, byte) in self.part(offset, bytes.len())?.iter_mut().zip(bytes) {
            *place &= byte;
        }
        Ok(())
    }
}

/// Whether the memory is in use.
static OPEN: AtomicBool = AtomicBool::new(false);

/// The store; there is one.
pub struct Store(Option<ParameterFlash<RamFlash>>);

impl Store {
    /// Opens it once, and hands the app what a reset has left there.
    #[inline(never)] // its settings are on the stack no longer than this
    pub fn open(app: &mut App) -> Self {
        if OPEN.swap(true, Ordering::AcqRel) {
            return Self(None);
        }
        // SAFETY: the machine has 16 MB of RAM from 0x6000_0000 on, of which the image has no section here; any bytes
        // are valid, and nobody gets here twice.
        let ram = unsafe { &mut *(BASE as *mut [u8; CAPACITY]) };
        let Ok(mut flash) = ParameterFlash::new(RamFlash(ram)) else { return Self(None) };
        let mut stored = Settings::DEFAULT;
        let found = flash.load(&mut stored);
        match found {
            Ok(sequence) => defmt::info!("parameter set {=u32}, from before the reset", sequence),
            Err(_) => defmt::info!("default parameters; what is stored is lost at power-off"),
        }
        if !app.restore(found.is_ok().then_some(&stored)) {
            defmt::error!("the stored parameters do not fit together: defaults");
        }
        Self(Some(flash))
    }

    /// Stores what the host wants stored.
    pub fn serve(&mut self, app: &mut App) {
        let (Some(flash), Some(settings)) = (&mut self.0, app.to_store()) else { return };
        let kept = flash.save(settings);
        match kept {
            Ok(sequence) => defmt::info!("parameter set {=u32} kept, until power-off", sequence),
            Err(_) => defmt::error!("parameters not kept"),
        }
        app.stored(kept.is_ok());
    }
}
