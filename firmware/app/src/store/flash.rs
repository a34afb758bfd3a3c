//! Two copies of the parameter set in flash, and where an update exchanges two banks, two more in the other bank.
//!
//! A set is saved over the copy that is not the newest usable one: erase, values, read back, and
//! last the header, which commits it. Until then the other copy is the newest; a power cut at any
//! moment leaves the old set or the new one.
//!
//! A board that exchanges its banks writes the copies of the bank that does not run, and reads all four: after the
//! exchange the set is found where it was, and the next one is saved beside it.

use super::record::{Header, Refused, WORD, WORDS, admits_values, decode_values, digest, encode_values};
use crate::parameters::Settings;
use embedded_storage::nor_flash::NorFlash;

/// The flash cannot hold two copies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Geometry;

/// Why a set was not saved; the old one stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SaveError<E> {
    /// The flash refused to erase or to write.
    Flash(E),
    /// What was written does not read back.
    Verify,
}

/// The parameter set in a flash of its own.
#[derive(Debug)]
pub struct ParameterFlash<F> {
    pub(super) flash: F,
    /// Bytes of the place of a copy.
    pub(super) half: u32,
    /// How many places there are; the first [`WRITTEN`] are written, the others only read.
    places: u32,
}

/// Places that are written.
pub(super) const WRITTEN: usize = 2;
/// Most places.
const PLACES: usize = 4;

/// What was found in one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Copy {
    /// Sequence number of an intact copy, be it usable or not.
    sequence: Option<u32>,
    usable: Result<(), Refused>,
}

impl Copy {
    const fn broken(cause: Refused) -> Self {
        Self { sequence: None, usable: Err(cause) }
    }
}

impl<F: NorFlash> ParameterFlash<F> {
    const WORDS_FIT: () = assert!(WORD.is_multiple_of(F::WRITE_SIZE) && WORD.is_multiple_of(F::READ_SIZE));

    /// Takes all of `flash`, half of it for each copy.
    ///
    /// # Errors
    /// [`Geometry`] when a half is not a number of whole sectors or too small for a copy and marks.
    pub fn new(flash: F) -> Result<Self, Geometry> {
        Self::of(flash, WRITTEN)
    }

    /// The same where the first half of `flash` is in the bank that does not run, the second half in the one that runs:
    /// it is only read.
    ///
    /// # Errors
    /// [`Geometry`] as above, of a quarter.
    pub fn in_two_banks(flash: F) -> Result<Self, Geometry> {
        Self::of(flash, PLACES)
    }

    fn of(flash: F, places: usize) -> Result<Self, Geometry> {
        let () = Self::WORDS_FIT;
        let half = flash.capacity() / places;
        if !half.is_multiple_of(F::ERASE_SIZE) || !Self::holds_marks(half) {
            return Err(Geometry);
        }
        let half = u32::try_from(half).map_err(|_| Geometry)?;
        Ok(Self { flash, half, places: places as u32 })
    }

    /// Gives the flash back.
    pub fn release(self) -> F {
        self.flash
    }

    /// Reads the newest usable copy into `settings` and returns its sequence number.
    ///
    /// # Errors
    /// Without a usable copy: what is wrong with the first two. `settings` keeps what it has, or has the defaults when a
    /// copy can no longer be read the second time.
    pub fn load(&mut self, settings: &mut Settings) -> Result<u32, [Refused; 2]> {
        let copies = self.copies();
        if let [Err(first), Err(second), Err(_), Err(_)] = copies.map(|copy| copy.usable) {
            return Err([first, second]);
        }
        let newest = newest_of(&copies);
        // a set is too large for a second one on the stack
        if let Copy { sequence: Some(sequence), usable: Ok(()) } = self.examine(newest, Some(settings)) {
            return Ok(sequence);
        }
        *settings = Settings::DEFAULT;
        Err([Refused::Unreadable; 2])
    }

    /// Saves a set; returns its sequence number. Takes as long as the flash takes to erase a sector.
    ///
    /// # Errors
    /// [`SaveError`]; the old set stays what [`Self::load`] finds.
    pub fn save(&mut self, settings: &Settings) -> Result<u32, SaveError<F::Error>> {
        let copies = self.copies();
        let target = 1 - newest_of(&copies[..WRITTEN]);
        let sequences = copies.iter().filter_map(|copy| copy.sequence);
        let last = sequences.reduce(|a, b| if is_newer(b, a) { b } else { a });
        let sequence = last.map_or(0, |last| last.wrapping_add(1));

        let start = self.half * target;
        self.flash.erase(start, start + self.half).map_err(SaveError::Flash)?;
        let (mut header, mut crc) = Header::new(sequence).encode();
        for word in 1..WORDS {
            let bytes = encode_values(word, settings);
            crc.update(&bytes);
            self.flash.write(start + (word * WORD) as u32, &bytes).map_err(SaveError::Flash)?;
        }
        for word in 1..WORDS {
            let mut bytes = [0; WORD];
            let read = self.flash.read(start + (word * WORD) as u32, &mut bytes);
            if read.is_err() || bytes != encode_values(word, settings) {
                return Err(SaveError::Verify);
            }
        }
        header[28..].copy_from_slice(&crc.finalize().to_le_bytes());
        self.flash.write(start, &header).map_err(SaveError::Flash)?;
        match self.examine(target, None) {
            Copy { sequence: Some(found), usable: Ok(()) } if found == sequence => Ok(sequence),
            _ => Err(SaveError::Verify),
        }
    }

    /// All of them.
    pub(super) fn copies(&mut self) -> [Copy; PLACES] {
        let places = self.places;
        [0, 1, 2, 3].map(|place| if place < places { self.examine(place, None) } else { Copy::broken(Refused::Blank) })
    }

    /// Checks one copy and reads it into `into`, which is only to be used when the copy is usable.
    fn examine(&mut self, half: u32, mut into: Option<&mut Settings>) -> Copy {
        let start = self.half * half;
        let mut word = [0; WORD];
        if self.flash.read(start, &mut word).is_err() {
            return Copy::broken(Refused::Unreadable);
        }
        let (header, expected) = match Header::decode(&word) {
            Ok(found) => found,
            Err(cause) => return Copy::broken(cause),
        };
        // a count that the half cannot hold is not one that was written
        if header.words() * WORD > self.half as usize {
            return Copy::broken(Refused::Damaged);
        }
        let present = header.is_present();
        let mut crc = digest();
        crc.update(&word[..28]);
        let mut in_range = true;
        for i in 1..header.words() {
            if self.flash.read(start + (i * WORD) as u32, &mut word).is_err() {
                return Copy::broken(Refused::Unreadable);
            }
            crc.update(&word);
            if present {
                in_range &= admits_values(&word, i);
                if let Some(settings) = into.as_deref_mut() {
                    decode_values(&word, i, settings);
                }
            }
        }
        if crc.finalize() != expected {
            return Copy::broken(Refused::Damaged);
        }
        let usable = match (present, in_range) {
            (false, _) => Err(Refused::OtherSchema),
            (true, false) => Err(Refused::OutOfRange),
            (true, true) => Ok(()),
        };
        Copy { sequence: Some(header.sequence), usable }
    }
}

/// The place to keep: the newest usable copy, else the newest intact one, else the last.
pub(super) fn newest_of(copies: &[Copy]) -> u32 {
    let rank = |copy: &Copy| (copy.usable.is_ok(), copy.sequence.is_some());
    let is_better = |a: &Copy, b: &Copy| match (a.sequence, b.sequence) {
        (Some(first), Some(second)) if rank(a) == rank(b) => is_newer(first, second),
        _ => rank(a) > rank(b),
    };
    let places = copies.iter().enumerate().rev();
    let newest = places.reduce(|best, next| if is_better(next.1, best.1) { next } else { best });
    newest.map_or(0, |(place, _)| place as u32)
}

/// Whether sequence number `a` came after `b`; right across the wrap.
fn is_newer(a: u32, b: u32) -> bool {
    a.wrapping_sub(b).cast_signed() > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sequence_numbers_wrap() {
        assert!(is_newer(1, 0) && is_newer(0, u32::MAX) && !is_newer(u32::MAX, 0) && !is_newer(7, 7));
    }

    #[test]
    fn the_half_to_keep() {
        let usable = |sequence| Copy { sequence: Some(sequence), usable: Ok(()) };
        let foreign = |sequence| Copy { sequence: Some(sequence), usable: Err(Refused::OtherSchema) };
        let blank = Copy::broken(Refused::Blank);
        for (copies, half) in [
            ([blank, blank], 1),
            ([usable(0), blank], 0),
            ([blank, usable(0)], 1),
            ([usable(1), usable(2)], 1),
            ([usable(0), usable(u32::MAX)], 0),
            // a set for this list goes before a newer one for another
            ([usable(1), foreign(2)], 0),
            ([foreign(2), usable(1)], 1),
            ([foreign(3), foreign(2)], 0),
            ([foreign(3), blank], 0),
        ] {
            assert_eq!(newest_of(&copies), half, "{copies:?}");
        }
        let four = [usable(1), blank, usable(2), foreign(3)];
        assert_eq!((newest_of(&four), newest_of(&four[..WRITTEN])), (2, 0));
    }
}
