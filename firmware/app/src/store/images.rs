//! Two banks of flash for two images of the firmware: the one that runs, and the one before it or the next.
//!
//! The chip maps one of its banks to where it starts from, by an option that a reset brings into effect. An update
//! writes the other bank, checks it, and exchanges the banks. The new image is on trial until the host confirms it:
//! each start is a mark in flash, and when all of [`TRIAL_STARTS`] are used up the board exchanges the banks again.
//!
//! Nothing is ever written to the image that runs, and the other bank becomes the one that starts only as a whole: with
//! the power cut at any moment a whole image starts. Between an update and its confirmation no other is taken, so that
//! the image before it stays.
//!
//! | place in a bank | content |
//! |---|---|
//! | from 0 | the image |
//! | the last 4 KB, first word | what an update says of it: magic, length, CRC-32, build ID, zeros, CRC-32 of these |
//! | the words behind | marks |
//!
//! An image that a programmer wrote has no such word with its build ID, and is never on trial.

use super::record::{WORD, digest};
use backseat_wire::hostlink::{CRC, Image, Images, Refusal, StoredImage};
use core::ops::Range;
use embedded_storage::nor_flash::NorFlash;

/// So often an image may start without being confirmed.
pub const TRIAL_STARTS: u8 = 3;

/// Of a bank, behind the image, bytes.
const TRAILER: u32 = 4096;
const MAGIC: [u8; 4] = *b"BSIM";
const STARTED: [u8; WORD] = [0x55; WORD];
const CONFIRMED: [u8; WORD] = [0; WORD];
const BLANK: [u8; WORD] = [0xFF; WORD];

/// Where an image of this chip runs.
#[derive(Clone, Debug)]
pub struct Chip {
    /// First address of the bank that starts.
    pub flash: u32,
    /// Where the first stack may begin.
    pub stack: Range<u32>,
}

/// Which image is to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// This one.
    Run,
    /// The one before: the board exchanges the banks and resets.
    Return,
}

/// An image on its way in.
struct Transfer {
    image: Image,
    written: u32,
}

/// The images in a flash whose first half is what of the running bank belongs to the image, the second half the same of
/// the other bank.
pub struct ImageFlash<F> {
    flash: F,
    /// Bytes of a half.
    area: u32,
    chip: Chip,
    /// Of the image that runs.
    build: u32,
    transfer: Option<Transfer>,
}

/// What is marked of an image.
struct Marks {
    free: Option<u32>,
    starts: u8,
    confirmed: bool,
}

impl<F: NorFlash> ImageFlash<F> {
    const SECTOR: u32 = {
        assert!(WORD.is_multiple_of(F::WRITE_SIZE) && WORD.is_multiple_of(F::READ_SIZE));
        assert!(F::ERASE_SIZE >= TRAILER as usize);
        F::ERASE_SIZE as u32
    };

    /// Takes all of `flash`, whole sectors in each half; `build`: of the image that runs.
    pub fn new(flash: F, chip: Chip, build: u32) -> Self {
        let sectors = flash.capacity() as u32 / 2 / Self::SECTOR;
        Self { area: sectors * Self::SECTOR, flash, chip, build, transfer: None }
    }

    /// Gives the flash back.
    pub fn release(self) -> F {
        self.flash
    }

    /// At start, before anything that may fail: counts it, if the image is on trial.
    pub fn start(&mut self) -> Start {
        let Some(starts) = self.trial() else { return Start::Run };
        // an image that cannot be counted would be on trial for ever
        let counted = starts < TRIAL_STARTS && self.mark(0, &STARTED).is_ok();
        if counted || !self.is_image(self.area) { Start::Run } else { Start::Return }
    }

    /// For the host.
    pub fn report(&mut self) -> Images {
        let other = self.header(self.area).map(|image| {
            let Marks { starts, confirmed, .. } = self.marks(self.area);
            StoredImage { image, starts, confirmed }
        });
        Images { trial: self.trial(), other }
    }

    /// Whether the image that runs is on trial.
    pub fn is_on_trial(&mut self) -> bool {
        self.trial().is_some()
    }

    /// An image comes next. What was in the other bank no longer counts as one.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn begin(&mut self, image: Image) -> Result<(), Refusal> {
        if self.is_on_trial() {
            return Err(Refusal::OnTrial);
        }
        if image.length < WORD as u32 || image.length > self.area - TRAILER {
            return Err(Refusal::NotAnImage);
        }
        self.transfer = None;
        self.erase(2 * self.area - Self::SECTOR)?;
        self.transfer = Some(Transfer { image, written: 0 });
        Ok(())
    }

    /// The next bytes, whole words but for the last ones; those that were written last may come once more.
    ///
    /// # Errors
    /// [`Refusal`].
    pub fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Refusal> {
        let Some(Transfer { image, written }) = self.transfer else { return Err(Refusal::Sequence) };
        let end = u32::try_from(bytes.len()).ok().and_then(|length| offset.checked_add(length));
        let end = end.filter(|end| *end <= image.length).ok_or(Refusal::Sequence)?;
        let is_whole = bytes.len().is_multiple_of(WORD) || end == image.length;
        if bytes.is_empty() || !is_whole || offset != written && end != written {
            return Err(Refusal::Sequence);
        }
        if offset == 0 && !bytes.first_chunk().is_some_and(|begin| self.begins_image(begin)) {
            return Err(Refusal::NotAnImage);
        }
        let is_new = offset == written;
        // a word that was half written cannot be written again: from here on the transfer is whole or it has ended
        self.transfer = None;
        for (place, part) in (self.area + offset..).step_by(WORD).zip(bytes.chunks(WORD)) {
            let mut word = BLANK;
            word.iter_mut().zip(part).for_each(|(place, byte)| *place = *byte);
            // the last sector was erased at the beginning
            if is_new && place.is_multiple_of(Self::SECTOR) && place != 2 * self.area - Self::SECTOR {
                self.erase(place)?;
            }
            if is_new {
                self.flash.write(place, &word).map_err(|_| Refusal::StoreFailed)?;
            }
            if self.word(place) != Some(word) {
                return Err(Refusal::StoreFailed);
            }
        }
        self.transfer = Some(Transfer { image, written: end });
        Ok(())
    }

    /// All have come. The banks are to be exchanged now.
    ///
    /// # Errors
    /// [`Refusal`]; the image that runs stays.
    pub fn commit(&mut self) -> Result<(), Refusal> {
        let Some(Transfer { image, written }) = self.transfer else { return Err(Refusal::Sequence) };
        if written != image.length {
            return Err(Refusal::Sequence);
        }
        self.transfer = None;
        let mut crc = digest();
        for begin in (0..image.length).step_by(WORD) {
            let word = self.word(self.area + begin).ok_or(Refusal::ImageDamaged)?;
            let length = (image.length - begin).min(WORD as u32) as usize;
            crc.update(word.get(..length).unwrap_or_default());
        }
        if crc.finalize() != image.crc {
            return Err(Refusal::ImageDamaged);
        }
        let place = self.trailer(self.area);
        self.flash.write(place, &encode(&image)).map_err(|_| Refusal::StoreFailed)?;
        if self.header(self.area) == Some(image) { Ok(()) } else { Err(Refusal::StoreFailed) }
    }

    /// The image that runs stays.
    ///
    /// # Errors
    /// [`Refusal::StoreFailed`]: it is on trial as before.
    pub fn confirm(&mut self) -> Result<(), Refusal> {
        if self.is_on_trial() {
            self.mark(0, &CONFIRMED).map_err(|()| Refusal::StoreFailed)?;
        }
        if self.is_on_trial() { Err(Refusal::StoreFailed) } else { Ok(()) }
    }

    /// How often the image that runs has started, if it is on trial.
    fn trial(&mut self) -> Option<u8> {
        self.header(0).filter(|image| image.build == self.build)?;
        let Marks { starts, confirmed, .. } = self.marks(0);
        (!confirmed).then_some(starts)
    }

    /// What an update says of the image in the half that begins here.
    fn header(&mut self, half: u32) -> Option<Image> {
        decode(&self.word(self.trailer(half))?)
    }

    fn trailer(&self, half: u32) -> u32 {
        half + self.area - TRAILER
    }

    /// A word that is neither blank nor a confirmation was to be a mark, whatever it reads as.
    fn marks(&mut self, half: u32) -> Marks {
        let mut marks = Marks { free: None, starts: 0, confirmed: false };
        for place in (self.trailer(half)..half + self.area).step_by(WORD).skip(1) {
            match self.word(place) {
                Some(BLANK) => {
                    marks.free = Some(place);
                    break;
                }
                Some(CONFIRMED) => marks.confirmed = true,
                _ => marks.starts = marks.starts.saturating_add(1),
            }
        }
        marks
    }

    fn mark(&mut self, half: u32, mark: &[u8; WORD]) -> Result<(), ()> {
        let place = self.marks(half).free.ok_or(())?;
        self.flash.write(place, mark).map_err(|_| ())
    }

    /// Whether an image begins in the half that begins here.
    fn is_image(&mut self, half: u32) -> bool {
        self.word(half).is_some_and(|word| word.first_chunk().is_some_and(|begin| self.begins_image(begin)))
    }

    /// Whether an image for this chip begins with these words of its vector table: first stack, and where it starts.
    fn begins_image(&self, begin: &[u8; 8]) -> bool {
        let [a, b, c, d, e, f, g, h] = *begin;
        let (stack, reset) = (u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h]));
        let code = self.chip.flash..self.chip.flash.saturating_add(self.area - TRAILER);
        self.chip.stack.contains(&stack) && stack.is_multiple_of(8) && reset % 2 == 1 && code.contains(&reset)
    }

    fn word(&mut self, place: u32) -> Option<[u8; WORD]> {
        let mut word = [0; WORD];
        self.flash.read(place, &mut word).ok().map(|()| word)
    }

    fn erase(&mut self, from: u32) -> Result<(), Refusal> {
        self.flash.erase(from, from + Self::SECTOR).map_err(|_| Refusal::StoreFailed)
    }
}

fn encode(image: &Image) -> [u8; WORD] {
    let mut word = [0; WORD];
    let parts = [MAGIC, image.length.to_le_bytes(), image.crc.to_le_bytes(), image.build.to_le_bytes()];
    word.as_chunks_mut::<4>().0.iter_mut().zip(parts).for_each(|(place, part)| *place = part);
    let crc = CRC.checksum(&word[..WORD - 4]);
    word[WORD - 4..].copy_from_slice(&crc.to_le_bytes());
    word
}

fn decode(word: &[u8; WORD]) -> Option<Image> {
    let [_, length, crc, build, ..] = word.as_chunks::<4>().0 else { return None };
    let [length, crc, build] = [length, crc, build].map(|part| u32::from_le_bytes(*part));
    let image = Image { length, crc, build };
    (*word == encode(&image)).then_some(image)
}
