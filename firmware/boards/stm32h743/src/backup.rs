//! The restart record in backup SRAM, which keeps its bytes through a reset.

use backseat_app::store::{RECORD_BYTES, RestartRecord, newest};
use embassy_stm32::pac;

/// Backup SRAM, 4 KB (RM0433 2.3.2).
const BASE: usize = 0x3880_0000;
const WORDS: usize = RECORD_BYTES / 4;
const _: () = assert!(RECORD_BYTES.is_multiple_of(4));

/// Two slots, written in turn.
pub struct BackupMemory(());

impl BackupMemory {
    /// Switches it on; there is one.
    pub fn take() -> Self {
        pac::RCC.ahb4enr().modify(|w| w.set_bkpsramen(true));
        pac::PWR.cr1().modify(|w| w.set_dbp(true));
        // the clock and the protection take effect with the next access
        let _ = pac::RCC.ahb4enr().read();
        while !pac::PWR.cr1().read().dbp() {}
        Self(())
    }

    /// The record of before the reset.
    pub fn read(&self) -> Option<RestartRecord> {
        let slots = [0, 1].map(|slot| {
            let mut bytes = [0; RECORD_BYTES];
            for (i, place) in bytes.as_chunks_mut::<4>().0.iter_mut().enumerate() {
                // SAFETY: within the backup SRAM, which is switched on and used here alone.
                *place = unsafe { word(slot, i).read_volatile() }.to_le_bytes();
            }
            bytes
        });
        newest([&slots[0], &slots[1]])
    }

    /// Writes a record to its slot.
    pub fn write(&mut self, record: &RestartRecord) {
        for (i, part) in record.encode().as_chunks::<4>().0.iter().enumerate() {
            // Whole words: a part of one waits in the ECC unit, and a reset would lose it (AN5342).
            // SAFETY: as above.
            unsafe { word(record.slot(), i).write_volatile(u32::from_le_bytes(*part)) };
        }
        cortex_m::asm::dsb();
    }
}

fn word(slot: usize, i: usize) -> *mut u32 {
    (BASE as *mut u32).wrapping_add(slot * WORDS + i)
}
