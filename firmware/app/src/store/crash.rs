//! The records of crashes, in memory that survives a reset: written by the handler that ends the run, kept until a
//! memory card has them.
//!
//! Slots are written in turn. Of more crashes than there are slots the oldest makes room, and is counted.

use backseat_wire::hostlink::{CRC, Crash, KeptCrash, Task};
use heapless::Vec;

/// Crashes that are kept.
pub const CRASHES: usize = 8;
/// Words of a slot: version, number and what was kept, their CRC-32, and a last one that is not 0 where it has been told.
/// Spelt out, because a handler of faults is to be small.
pub const CRASH_WORDS: usize = 24;
/// Layout of the record.
const VERSION: u32 = 2;

/// A slot.
pub type CrashSlot = [u32; CRASH_WORDS];

/// Where the slots are; they are read before they are written.
pub trait CrashMemory {
    /// One of [`CRASHES`].
    fn read(&self, slot: usize) -> CrashSlot;
    /// Word by word: a reset may come in between.
    fn write(&mut self, slot: usize, words: &CrashSlot);
}

/// What a slot holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Record {
    /// Counts crashes since the memory was last empty; from 1.
    sequence: u32,
    kept: KeptCrash,
}

impl Record {
    fn encode(&self) -> CrashSlot {
        let Self { sequence, kept: KeptCrash { crash, overwritten } } = *self;
        let Crash { build, time_us, pc, lr, sp, cfsr, hfsr, address, exception, line, file, .. } = crash;
        let Crash { stack_overflow, task, step, stacks: [interrupts, thread], .. } = crash;
        let what = u32::from(exception) | (task as u32) << 16 | u32::from(stack_overflow) << 24;
        let mut words = [0; CRASH_WORDS];
        let numbers = [VERSION, sequence, overwritten, build, time_us, pc, lr, sp, cfsr, hfsr, address, what, line];
        let letters = file.as_chunks().0.iter().map(|part| u32::from_le_bytes(*part));
        let numbers = numbers.into_iter().chain([step, interrupts, thread]).chain(letters);
        words.iter_mut().zip(numbers).for_each(|(place, number)| *place = number);
        let crc = crc(&words);
        let [.., place, _] = &mut words;
        *place = crc;
        words
    }

    /// The record, unless its words were cut off, corrupted, or never written.
    fn decode(words: &CrashSlot) -> Option<Self> {
        let [version, sequence, overwritten, build, time_us, pc, lr, sp, cfsr, hfsr, address, what, line, ..] = *words;
        let [.., step, interrupts, thread, a, b, c, d, e, f, found, _] = *words;
        if version != VERSION || found != crc(words) {
            return None;
        }
        let task = match what >> 16 & 0xFF {
            0 => Task::Thread,
            1 => Task::App,
            _ => Task::Interrupt,
        };
        let (exception, stack_overflow) = (what as u16, what >> 24 != 0);
        let mut file = [0; 24];
        file.as_chunks_mut().0.iter_mut().zip([a, b, c, d, e, f]).for_each(|(place, part)| *place = part.to_le_bytes());
        let stacks = [interrupts, thread];
        let registers = Crash { build, time_us, pc, lr, sp, cfsr, hfsr, address, exception, ..Crash::default() };
        let crash = Crash { line, file, stack_overflow, task, step, stacks, ..registers };
        Some(Self { sequence, kept: KeptCrash { crash, overwritten } })
    }
}

/// Of all words before it.
fn crc(words: &CrashSlot) -> u32 {
    let [record @ .., _, _] = words;
    let mut crc = CRC.digest();
    record.iter().for_each(|word| crc.update(&word.to_le_bytes()));
    crc.finalize()
}

#[inline(never)]
fn read<M: CrashMemory>(memory: &M, slot: usize) -> Option<Record> {
    Record::decode(&memory.read(slot))
}

fn newest<M: CrashMemory>(memory: &M) -> Option<(usize, Record)> {
    let mut newest: Option<(usize, Record)> = None;
    for slot in 0..CRASHES {
        let Some(record) = read(memory, slot) else { continue };
        if newest.is_none_or(|(_, newest)| record.sequence > newest.sequence) {
            newest = Some((slot, record));
        }
    }
    newest
}

/// Keeps a crash, in the place of the oldest where there is no other.
#[inline(never)]
pub fn keep_crash<M: CrashMemory>(memory: &mut M, crash: &Crash) {
    let last = newest(memory).map(|(_, record)| record);
    let sequence = last.map_or(1, |last| last.sequence.wrapping_add(1));
    let slot = sequence as usize % CRASHES;
    let occupied = read(memory, slot).is_some();
    let overwritten = last.map_or(0, |last| last.kept.overwritten).saturating_add(u32::from(occupied));
    memory.write(slot, &Record { sequence, kept: KeptCrash { crash: *crash, overwritten } }.encode());
}

/// The crash that ended the run before, if it was one; once.
#[inline(never)]
pub fn take_last_crash<M: CrashMemory>(memory: &mut M) -> Option<Crash> {
    let (slot, record) = newest(memory)?;
    let mut words = memory.read(slot);
    let [.., told] = &mut words;
    if *told != 0 {
        return None;
    }
    *told = u32::MAX;
    memory.write(slot, &words);
    Some(record.kept.crash)
}

/// All that are kept, the oldest first.
#[inline(never)]
pub fn kept_crashes<M: CrashMemory>(memory: &M) -> Vec<KeptCrash, CRASHES> {
    let mut kept = Vec::new();
    let Some((last, Record { sequence: newest, .. })) = newest(memory) else { return kept };
    // from the slot behind the newest on, round to it; what is older than a round was left by a reset in between
    for slot in (last + 1..=last + CRASHES).map(|slot| slot % CRASHES) {
        if let Some(record) = read(memory, slot).filter(|record| newest - record.sequence < CRASHES as u32) {
            // there are as many places as slots
            let _ = kept.push(record.kept);
        }
    }
    kept
}

/// A card has them.
pub fn forget_crashes<M: CrashMemory>(memory: &mut M) {
    (0..CRASHES).for_each(|slot| memory.write(slot, &[0; CRASH_WORDS]));
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Memory([CrashSlot; CRASHES]);

    impl CrashMemory for Memory {
        fn read(&self, slot: usize) -> CrashSlot {
            self.0[slot]
        }

        fn write(&mut self, slot: usize, words: &CrashSlot) {
            self.0[slot] = *words;
        }
    }

    fn crash(pc: u32) -> Crash {
        Crash { pc, ..Crash::default() }
    }

    #[test]
    fn a_record_comes_back_and_a_wrong_bit_is_noticed() {
        let [build, time_us, pc, lr, sp, cfsr, hfsr, address, step, sequence] = [u32::MAX; 10];
        let panic = Crash::at("/home/somebody/firmware/boards/stm32h743/src/main.rs", u32::MAX);
        let (stacks, stack_overflow, task) = ([u32::MAX; 2], true, Task::Interrupt);
        let registers = Crash { build, time_us, pc, lr, sp, cfsr, hfsr, address, exception: u16::MAX, ..panic };
        let crash = Crash { stack_overflow, task, step, stacks, ..registers };
        let record = Record { sequence, kept: KeptCrash { crash, overwritten: u32::MAX } };
        let words = record.encode();
        assert_eq!(Record::decode(&words), Some(record));
        for bit in 0..32 * (CRASH_WORDS - 1) {
            let mut bad = words;
            bad[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(Record::decode(&bad), None, "bit {bit}");
        }
        assert_eq!(Record::decode(&[0; CRASH_WORDS]), None);
    }

    /// In memory that was never written, as it is at power-on.
    #[test]
    fn crashes_in_a_row_are_kept_until_a_card_has_them() {
        let mut memory = Memory([[0xA5A5_A5A5; CRASH_WORDS]; CRASHES]);
        assert_eq!(take_last_crash(&mut memory), None);
        for round in 0..2 {
            for n in 1..=20 {
                keep_crash(&mut memory, &crash(n));
                assert_eq!(take_last_crash(&mut memory), Some(crash(n)), "round {round}");
                assert_eq!(take_last_crash(&mut memory), None, "it is told once");
                let first = n.saturating_sub(CRASHES as u32) + 1;
                let kept = kept_crashes(&memory);
                let wanted = (first..=n).map(|pc| {
                    let overwritten = pc.saturating_sub(CRASHES as u32);
                    KeptCrash { crash: crash(pc), overwritten }
                });
                assert!(kept.iter().copied().eq(wanted), "{kept:?}");
            }
            forget_crashes(&mut memory);
            assert_eq!((take_last_crash(&mut memory), kept_crashes(&memory).len()), (None, 0));
        }
    }

    #[test]
    fn a_record_that_a_reset_cut_off_leaves_the_others() {
        for words in 0..CRASH_WORDS {
            let mut memory = Memory([[0; CRASH_WORDS]; CRASHES]);
            (1..=9).for_each(|n| keep_crash(&mut memory, &crash(n)));
            let before = memory.0[2];
            keep_crash(&mut memory, &crash(10));
            memory.0[2][words..].copy_from_slice(&before[words..]);
            let kept = kept_crashes(&memory);
            let pcs: std::vec::Vec<u32> = kept.iter().map(|kept| kept.crash.pc).collect();
            let others = [3, 4, 5, 6, 7, 8, 9];
            let whole = pcs[..] == [2, 3, 4, 5, 6, 7, 8, 9] || pcs[..] == [3, 4, 5, 6, 7, 8, 9, 10];
            assert!(whole || pcs[..] == others, "{words} words: {pcs:?}");
        }
    }

    #[test]
    fn it_is_told_in_words() {
        let panic = Crash { exception: 37, time_us: 12_300_000, build: 0xAB, ..Crash::at("boards/x/src/main.rs", 7) };
        let told = std::format!("{}", Crash { task: Task::Interrupt, step: 123, stacks: [4_000, 5_000], ..panic });
        let rest = ", in an interrupt (exception 37), step 123, stacks 4000 and 5000 bytes, 12.3 s after its start";
        assert_eq!(told, std::format!("panic at boards/x/src/main.rs:7{rest}, image 000000ab"));
        let fault = Crash { pc: 0x0801_AAB9, lr: 0x0801_0001, cfsr: 0x400, ..Crash::default() };
        let told = std::format!("{fault}");
        assert!(told.starts_with("fault at 0x0801aab9, called from 0x08010001, status 0x400"), "{told}");
        let full = KeptCrash { crash: Crash { stack_overflow: true, pc: 0, ..fault }, overwritten: 2 };
        let told = std::format!("{full}");
        assert!(told.starts_with("stack overflow near 0x08010001, status 0x400"), "{told}");
        assert!(told.ends_with("; 2 before it were not kept"), "{told}");
    }
}
