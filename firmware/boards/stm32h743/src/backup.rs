//! The records of restart and crashes in backup SRAM, which keeps its bytes through a reset.

use backseat_app::store::{CRASH_WORDS, CRASHES, CrashMemory, CrashSlot, RECORD_BYTES, RestartRecord, newest};
use embassy_stm32::pac;

/// Backup SRAM, 4 KB (RM0433 2.3.2).
const BASE: usize = 0x3880_0000;
const WORDS: usize = RECORD_BYTES / 4;
const _: () = assert!(RECORD_BYTES.is_multiple_of(4));
/// Behind the restart record's two slots, in words: those of crashes.
const CRASH: usize = 2 * WORDS;
const _: () = assert!(4 * (CRASH + CRASHES * CRASH_WORDS) <= 4096);
/// How often it is looked whether the protection has gone.
const LOOKS: usize = 1000;

/// Two slots, written in turn.
pub struct BackupMemory(());

impl BackupMemory {
    /// Switches it on; there is one.
    pub fn take() -> Self {
        switch_on();
        Self(())
    }

    /// The record of before the reset.
    pub fn read(&self) -> Option<RestartRecord> {
        let slots = [0, 1].map(|slot| {
            let mut bytes = [0; RECORD_BYTES];
            let words = read::<WORDS>(slot * WORDS);
            bytes.as_chunks_mut().0.iter_mut().zip(words).for_each(|(place, word)| *place = word.to_le_bytes());
            bytes
        });
        newest([&slots[0], &slots[1]])
    }

    /// Writes a record to its slot.
    pub fn write(&mut self, record: &RestartRecord) {
        let mut words = [0; WORDS];
        let bytes = record.encode();
        words.iter_mut().zip(bytes.as_chunks().0).for_each(|(place, part)| *place = u32::from_le_bytes(*part));
        write(record.slot() * WORDS, &words);
    }
}

fn switch_on() {
    pac::RCC.ahb4enr().modify(|w| w.set_bkpsramen(true));
    pac::PWR.cr1().modify(|w| w.set_dbp(true));
    // the clock and the protection take effect with the next access
    let _ = pac::RCC.ahb4enr().read();
    let _ = (0..LOOKS).any(|_| pac::PWR.cr1().read().dbp());
}

/// The slots of crashes: the handler that ends the run writes them, and thread mode, which it interrupts for good.
pub struct CrashSlots(());

impl CrashSlots {
    /// Within reach, however soon after the start.
    pub fn open() -> Self {
        switch_on();
        Self(())
    }
}

impl CrashMemory for CrashSlots {
    fn read(&self, slot: usize) -> CrashSlot {
        read(CRASH + slot % CRASHES * CRASH_WORDS)
    }

    fn write(&mut self, slot: usize, words: &CrashSlot) {
        write(CRASH + slot % CRASHES * CRASH_WORDS, words);
    }
}

fn read<const N: usize>(first: usize) -> [u32; N] {
    let mut words = [0; N];
    for (i, place) in words.iter_mut().enumerate() {
        // SAFETY: within the backup SRAM, which is used here alone.
        *place = unsafe { word(first + i).read_volatile() };
    }
    words
}

fn write(first: usize, words: &[u32]) {
    for (i, value) in words.iter().enumerate() {
        // Whole words: a part of one waits in the ECC unit, and a reset would lose it (AN5342).
        // SAFETY: as above.
        unsafe { word(first + i).write_volatile(*value) };
    }
    cortex_m::asm::dsb();
}

fn word(i: usize) -> *mut u32 {
    (BASE as *mut u32).wrapping_add(i)
}
