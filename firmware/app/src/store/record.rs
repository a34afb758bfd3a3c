//! One copy of the parameter set, in words as flash programs them.
//!
//! | word | bytes | content |
//! |---|---|---|
//! | 0 | 0..4 | magic |
//! | | 4..6 | [`PARAMETER_SCHEMA`] |
//! | | 6..8 | number of values |
//! | | 8..12 | sequence number: the newer copy has the larger one, modulo 2³² |
//! | | 12..16 | fingerprint of the list: CRC-32 of schema, names and units |
//! | | 16..28 | reserved, 0 |
//! | | 28..32 | CRC-32 of bytes 0..28 and of all words that follow |
//! | 1.. | 8 each | values (f64) in the order of the list, the two halves of the acoustic key, 0 to the end of the word |
//!
//! Numbers are little-endian. Word 0 is written last and commits the copy.

use crate::parameters::{PARAMETER_SCHEMA, PARAMETERS, Settings};
use backseat_wire::hostlink::CRC;
use crc::Digest;

/// What is programmed at once: a flash word of the STM32H743 (RM0433 4.3.9), bytes.
pub const WORD: usize = 32;
/// Values in a word.
const VALUES: usize = 4;
/// Words of a copy of the present list, header included.
pub(super) const WORDS: usize = 1 + SLOTS.div_ceil(VALUES);
/// Values of a copy: the list, and the key, which is in no list.
const SLOTS: usize = PARAMETERS.len() + 2;

const MAGIC: u32 = u32::from_le_bytes(*b"BSPS");

/// Why a copy is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refused {
    /// Flash does not give its bytes (two wrong bits in a word, on the STM32H743).
    Unreadable,
    /// Never written, or erased.
    Blank,
    /// Cut off, or corrupt.
    Damaged,
    /// Intact, but written for another parameter list.
    OtherSchema,
    /// Intact, but a value is not within its range.
    OutOfRange,
}

/// Word 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub schema: u16,
    pub count: u16,
    pub sequence: u32,
    pub fingerprint: u32,
}

impl Header {
    /// Of a copy of the present list.
    pub fn new(sequence: u32) -> Self {
        Self { schema: PARAMETER_SCHEMA, count: SLOTS as u16, sequence, fingerprint: FINGERPRINT }
    }

    /// The word without its CRC, and the CRC so far.
    pub fn encode(&self) -> ([u8; WORD], Digest<'static, u32>) {
        let mut word = [0; WORD];
        word[0..4].copy_from_slice(&MAGIC.to_le_bytes());
        word[4..6].copy_from_slice(&self.schema.to_le_bytes());
        word[6..8].copy_from_slice(&self.count.to_le_bytes());
        word[8..12].copy_from_slice(&self.sequence.to_le_bytes());
        word[12..16].copy_from_slice(&self.fingerprint.to_le_bytes());
        let mut crc = digest();
        crc.update(&word[..28]);
        (word, crc)
    }

    /// The header and the CRC that header and values have to have.
    pub fn decode(word: &[u8; WORD]) -> Result<(Self, u32), Refused> {
        if word.iter().all(|byte| *byte == 0xFF) {
            return Err(Refused::Blank);
        }
        let u16_at = |at: [usize; 2]| u16::from_le_bytes(at.map(|i| word[i]));
        let u32_at = |at: [usize; 4]| u32::from_le_bytes(at.map(|i| word[i]));
        if u32_at([0, 1, 2, 3]) != MAGIC {
            return Err(Refused::Damaged);
        }
        let header = Self {
            schema: u16_at([4, 5]),
            count: u16_at([6, 7]),
            sequence: u32_at([8, 9, 10, 11]),
            fingerprint: u32_at([12, 13, 14, 15]),
        };
        Ok((header, u32_at([28, 29, 30, 31])))
    }

    /// Words of the copy, this one included.
    pub fn words(&self) -> usize {
        1 + usize::from(self.count).div_ceil(VALUES)
    }

    /// Whether the values belong to the present list.
    pub fn is_present(&self) -> bool {
        *self == Self::new(self.sequence)
    }
}

pub(super) fn digest() -> Digest<'static, u32> {
    CRC.digest()
}

/// Distinguishes lists whose schema number was not raised: CRC-32 of the number, names and units.
pub const FINGERPRINT: u32 = {
    let mut crc = CRC.digest();
    crc.update(&PARAMETER_SCHEMA.to_le_bytes());
    let mut at = 0;
    while at < PARAMETERS.len() {
        crc.update(PARAMETERS[at].name.as_bytes());
        crc.update(&[0]);
        crc.update(PARAMETERS[at].unit().as_bytes());
        crc.update(&[0]);
        at += 1;
    }
    crc.finalize()
};

/// Word `index` of a copy, one of values (from 1 on).
pub(super) fn encode_values(index: usize, settings: &Settings) -> [u8; WORD] {
    let mut word = [0; WORD];
    for (place, slot) in word.as_chunks_mut::<8>().0.iter_mut().zip(slots(index)) {
        *place = match PARAMETERS.get(slot) {
            Some(parameter) => parameter.get(settings).to_le_bytes(),
            None => {
                let half = slot - PARAMETERS.len();
                settings.app.acoustic_key.halves().get(half).copied().unwrap_or_default()
            }
        };
    }
    word
}

/// Whether the values of a word are in range.
pub(super) fn admits_values(word: &[u8; WORD], index: usize) -> bool {
    let values = word.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes));
    values.zip(slots(index)).all(|(value, slot)| PARAMETERS.get(slot).is_none_or(|parameter| parameter.admits(value)))
}

/// Takes a word of values over.
pub(super) fn decode_values(word: &[u8; WORD], index: usize, settings: &mut Settings) {
    for (bytes, slot) in word.as_chunks::<8>().0.iter().zip(slots(index)) {
        match PARAMETERS.get(slot) {
            Some(parameter) => parameter.set(settings, f64::from_le_bytes(*bytes)),
            None => settings.app.acoustic_key = settings.app.acoustic_key.with_half(slot - PARAMETERS.len(), *bytes),
        }
    }
}

/// The values of a word.
fn slots(index: usize) -> core::ops::Range<usize> {
    let first = index.saturating_sub(1) * VALUES;
    first..first + VALUES
}

const _: () = assert!(SLOTS <= u16::MAX as usize);
const _: () = assert!(VALUES * size_of::<f64>() == WORD);

#[cfg(test)]
mod tests {
    use super::*;

    /// A log of another version is refused by its number alone: whoever changes the list raises the number, and writes
    /// the new fingerprint here.
    #[test]
    fn regress_another_list_has_another_version() {
        assert_eq!((PARAMETER_SCHEMA, FINGERPRINT), (14, 3_289_613_011), "raise PARAMETER_SCHEMA");
    }
}
