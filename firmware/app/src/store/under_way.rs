//! "Under way" in flash: memory that survives a reset, but not the loss of the supply, forgets it with the rest.
//!
//! A mark is a word, appended in the second half of the place of the newest copy, of those that are written. A new copy
//! begins with none, and is saved at rest alone.

use super::flash::{ParameterFlash, WRITTEN, newest_of};
use super::record::{WORD, WORDS};
use embedded_storage::nor_flash::NorFlash;

const UNDER_WAY: [u8; WORD] = [0x55; WORD];
const ENDED: [u8; WORD] = [0; WORD];
const FREE: [u8; WORD] = [0xFF; WORD];

/// Why a mark was not made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MarkError<E> {
    /// The flash refused to write.
    Flash(E),
    /// All words are used; the next set that is saved brings new ones.
    Full,
}

impl<F: NorFlash> ParameterFlash<F> {
    /// Words of a half that hold no copy.
    pub(super) const fn holds_marks(half: usize) -> bool {
        half / 2 >= WORDS * WORD
    }

    /// The last mark says that a mission is under way. One that was cut off counts as well: rather a stop too many.
    pub fn is_under_way(&mut self) -> bool {
        let (_, last) = self.marks();
        last.is_some_and(|mark| mark != Some(ENDED))
    }

    /// Keeps that a mission is under way, or is not any longer. Takes as long as the flash takes to write a word.
    ///
    /// # Errors
    /// [`MarkError`].
    pub fn mark_under_way(&mut self, under_way: bool) -> Result<(), MarkError<F::Error>> {
        let (free, _) = self.marks();
        let mark = if under_way { &UNDER_WAY } else { &ENDED };
        self.flash.write(free.ok_or(MarkError::Full)?, mark).map_err(MarkError::Flash)
    }

    /// The first free place, and the last mark: `Some(None)` when it cannot be read.
    fn marks(&mut self) -> (Option<u32>, Option<Option<[u8; WORD]>>) {
        let newest = newest_of(&self.copies()[..WRITTEN]);
        let (start, end) = (self.half * newest + self.half / 2, self.half * (newest + 1));
        let mut last = None;
        for place in (start..end).step_by(WORD) {
            let mut word = [0; WORD];
            let read = self.flash.read(place, &mut word);
            if read.is_ok() && word == FREE {
                return (Some(place), last);
            }
            last = Some(read.is_ok().then_some(word));
        }
        (None, last)
    }
}
