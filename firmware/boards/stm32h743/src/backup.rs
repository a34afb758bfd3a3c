//! The records of restart and crash in backup SRAM, which keeps its bytes through a reset.

use backseat_app::store::{CRASH_BYTES, RECORD_BYTES, RestartRecord, decode_crash, newest};
use backseat_wire::hostlink::Crash;
use embassy_stm32::pac;

/// Backup SRAM, 4 KB (RM0433 2.3.2).
const BASE: usize = 0x3880_0000;
const WORDS: usize = RECORD_BYTES / 4;
const _: () = assert!(RECORD_BYTES.is_multiple_of(4) && CRASH_BYTES.is_multiple_of(4));
/// Behind the restart record's two slots, in words.
const CRASH: usize = 2 * WORDS;

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
        let slots = [0, 1].map(|slot| read::<RECORD_BYTES>(slot * WORDS));
        newest([&slots[0], &slots[1]])
    }

    /// Writes a record to its slot.
    pub fn write(&mut self, record: &RestartRecord) {
        write(record.slot() * WORDS, &record.encode());
    }

    /// What ended the run before, if it was the firmware; it is told once.
    pub fn take_crash(&mut self) -> Option<Crash> {
        let crash = decode_crash(&read::<CRASH_BYTES>(CRASH))?;
        write_crash(&[0; CRASH_BYTES]);
        Some(crash)
    }
}

/// Writes the record of a crash; before the memory is switched on nothing is kept.
pub fn write_crash(record: &[u8; CRASH_BYTES]) {
    write(CRASH, record);
}

fn read<const N: usize>(first: usize) -> [u8; N] {
    let mut bytes = [0; N];
    for (i, place) in bytes.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        // SAFETY: within the backup SRAM, which is used here alone.
        *place = unsafe { word(first + i).read_volatile() }.to_le_bytes();
    }
    bytes
}

fn write(first: usize, bytes: &[u8]) {
    for (i, part) in bytes.as_chunks::<4>().0.iter().enumerate() {
        // Whole words: a part of one waits in the ECC unit, and a reset would lose it (AN5342).
        // SAFETY: as above.
        unsafe { word(first + i).write_volatile(u32::from_le_bytes(*part)) };
    }
    cortex_m::asm::dsb();
}

fn word(i: usize) -> *mut u32 {
    (BASE as *mut u32).wrapping_add(i)
}
