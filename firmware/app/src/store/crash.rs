//! The record of a crash, in memory that survives a reset: written by the handler that ends the run.

use backseat_wire::hostlink::{CRC, Crash};

/// Bytes of a record, a multiple of the word of any backup memory.
pub const CRASH_BYTES: usize = 96;
/// Layout of the record.
const VERSION: u16 = 1;

/// The record as bytes, its CRC included.
#[must_use]
pub fn encode_crash(crash: &Crash) -> [u8; CRASH_BYTES] {
    let mut bytes = [0; CRASH_BYTES];
    // the longest record fits: see the test
    if postcard::to_slice_crc32(&(VERSION, crash), &mut bytes, CRC.digest()).is_err() {
        bytes = [0; CRASH_BYTES];
    }
    bytes
}

/// The record, unless its bytes were cut off, corrupted, or never written.
#[must_use]
pub fn decode_crash(bytes: &[u8]) -> Option<Crash> {
    let ((version, crash), _) = postcard::take_from_bytes_crc32::<(u16, Crash)>(bytes, CRC.digest()).ok()?;
    (version == VERSION).then_some(crash)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_record_fits_and_a_wrong_bit_is_noticed() {
        let [build, time_us, pc, lr, sp, cfsr, hfsr, address] = [u32::MAX; 8];
        let panic = Crash::at("/home/somebody/firmware/boards/stm32h743/src/main.rs", u32::MAX);
        let crash = Crash { build, time_us, pc, lr, sp, cfsr, hfsr, address, exception: u16::MAX, ..panic };
        let bytes = encode_crash(&crash);
        assert_eq!(decode_crash(&bytes), Some(crash));
        let length = CRASH_BYTES - bytes.iter().rev().take_while(|byte| **byte == 0).count();
        for bit in 0..8 * length {
            let mut bad = bytes;
            bad[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(decode_crash(&bad), None, "bit {bit}");
        }
        assert_eq!(decode_crash(&[0; CRASH_BYTES]), None);
    }

    #[test]
    fn it_is_told_in_words() {
        let panic = Crash { exception: 37, time_us: 12_300_000, build: 0xAB, ..Crash::at("boards/x/src/main.rs", 7) };
        let told = std::format!("{panic}");
        assert_eq!(told, "panic at boards/x/src/main.rs:7, exception 37, 12.3 s after its start, image 000000ab");
        let fault = Crash { pc: 0x0801_AAB9, lr: 0x0801_0001, cfsr: 0x400, ..Crash::default() };
        let told = std::format!("{fault}");
        assert!(told.starts_with("fault at 0x0801aab9, called from 0x08010001, status 0x400"), "{told}");
    }
}
