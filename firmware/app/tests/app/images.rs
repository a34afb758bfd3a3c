//! Two images in a model of two banks of flash, whose power can be cut at any operation: a whole one always starts.

use crate::random::Random;
use backseat_app::store::{Chip, ImageFlash, Start, TRIAL_STARTS, WORD};
use backseat_wire::hostlink::{CRC, Image, Refusal, UPDATE_CHUNK};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};

const SECTOR: usize = 8192;
const AREA: usize = 3 * SECTOR;
const CHIP: Chip = Chip { flash: 0x0800_0000, stack: 0x2000_0000..0x2002_0000 };

/// The chip: its banks as they lie, and which of them starts. Any operation can be the last.
#[derive(Clone)]
struct Banks {
    bytes: [Vec<u8>; 2],
    /// Programmed since the erase, and readable, by word.
    programmed: [Vec<bool>; 2],
    readable: [Vec<bool>; 2],
    exchanged: bool,
    /// Operations until the power goes.
    left: Option<usize>,
    operations: usize,
    random: Random,
}

impl Banks {
    /// Written by a programmer.
    fn with(image: &[u8]) -> Self {
        let words = AREA / WORD;
        let mut bytes = [vec![0xFF; AREA], vec![0xFF; AREA]];
        bytes[0][..image.len()].copy_from_slice(image);
        let [programmed, readable] = [false, true].map(|fill| [vec![fill; words], vec![fill; words]]);
        Self { bytes, programmed, readable, exchanged: false, left: None, operations: 0, random: Random(1) }
    }

    fn cut_after(self, operations: usize, random: u64) -> Self {
        Self { left: Some(operations), operations: 0, random: Random(random), ..self }
    }

    fn powered(self) -> Self {
        Self { left: None, operations: 0, ..self }
    }

    /// Bank and place in it.
    fn at(&self, offset: usize) -> (usize, usize) {
        let other = offset / AREA;
        (other ^ usize::from(self.exchanged), offset % AREA)
    }

    /// Whether the operation is done, and whether the power is there after it.
    fn operate(&mut self) -> Result<bool, NorFlashErrorKind> {
        self.operations += 1;
        match &mut self.left {
            Some(0) => Err(NorFlashErrorKind::Other),
            Some(left @ 1) => {
                *left = 0;
                Ok(false)
            }
            Some(left) => {
                *left -= 1;
                Ok(true)
            }
            None => Ok(true),
        }
    }

    /// The option takes effect as a whole or not at all.
    fn exchange(&mut self) -> Result<(), NorFlashErrorKind> {
        let whole = self.operate()?;
        if whole || self.random.below(2) == 0 {
            self.exchanged = !self.exchanged;
        }
        if whole { Ok(()) } else { Err(NorFlashErrorKind::Other) }
    }

    /// Of the bank that starts.
    fn begins_with(&self, image: &[u8]) -> bool {
        let (bank, _) = self.at(0);
        self.bytes[bank].starts_with(image) && self.readable[bank][..image.len() / WORD].iter().all(|word| *word)
    }
}

impl ErrorType for Banks {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Banks {
    const READ_SIZE: usize = WORD;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let (bank, at) = self.at(offset as usize);
        if self.left == Some(0) || !self.readable[bank][at / WORD] {
            return Err(NorFlashErrorKind::Other);
        }
        bytes.copy_from_slice(&self.bytes[bank][at..at + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * AREA
    }
}

impl NorFlash for Banks {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        assert_eq!((from as usize % SECTOR, to - from), (0, SECTOR as u32));
        assert!(from as usize >= AREA, "the image that runs is erased");
        let whole = self.operate()?;
        let (bank, at) = self.at(from as usize);
        for word in at / WORD..(at + SECTOR) / WORD {
            // cut off, it leaves any of the old, the new, and what cannot be read
            let outcome = if whole { 0 } else { self.random.below(3) };
            if outcome == 0 {
                self.bytes[bank][word * WORD..(word + 1) * WORD].fill(0xFF);
            }
            (self.programmed[bank][word], self.readable[bank][word]) = (outcome != 0, outcome != 2);
        }
        if whole { Ok(()) } else { Err(NorFlashErrorKind::Other) }
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        assert_eq!((offset as usize % WORD, bytes.len()), (0, WORD));
        let whole = self.operate()?;
        let (bank, at) = self.at(offset as usize);
        let word = at / WORD;
        assert!(!self.programmed[bank][word], "word {word} is written twice");
        let outcome = if whole { 0 } else { self.random.below(4) };
        for (place, byte) in self.bytes[bank][at..].iter_mut().zip(bytes) {
            *place = match outcome {
                0 => *byte,
                1 => *place,
                _ => byte | self.random.word() as u8,
            };
        }
        (self.programmed[bank][word], self.readable[bank][word]) = (outcome != 1, outcome != 3);
        if whole { Ok(()) } else { Err(NorFlashErrorKind::Other) }
    }
}

/// An image of this length: a vector table, its build ID, noise.
fn image(build: u32, length: usize) -> Vec<u8> {
    let mut random = Random(build.into());
    let mut bytes: Vec<u8> = (0..length).map(|_| random.word() as u8).collect();
    for (place, word) in bytes.chunks_mut(4).zip([0x2000_6000, 0x0800_0299, build]) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    bytes
}

fn announced(bytes: &[u8]) -> Image {
    let build = u32::from_le_bytes(*bytes[8..].first_chunk().unwrap());
    Image { length: bytes.len() as u32, crc: CRC.checksum(bytes), build }
}

/// Starts whatever image the chip starts, and again when it exchanges the banks, until one runs.
fn start(mut banks: Banks) -> ImageFlash<Banks> {
    for _ in 0..2 {
        let (bank, _) = banks.at(0);
        let build = u32::from_le_bytes(*banks.bytes[bank][8..].first_chunk().unwrap());
        let mut images = ImageFlash::new(banks, CHIP, build);
        if images.start() == Start::Run {
            return images;
        }
        banks = images.release();
        if banks.exchange().is_err() {
            return ImageFlash::new(banks, CHIP, build);
        }
    }
    panic!("neither image runs");
}

/// The update as the host sends it; on success the banks are exchanged.
fn update(mut images: ImageFlash<Banks>, bytes: &[u8]) -> (Banks, Result<(), Refusal>) {
    let outcome = (|| {
        images.begin(announced(bytes))?;
        for (offset, chunk) in (0..).step_by(UPDATE_CHUNK).zip(bytes.chunks(UPDATE_CHUNK)) {
            images.write(offset, chunk)?;
        }
        images.commit()
    })();
    let mut banks = images.release();
    let outcome = outcome.and_then(|()| banks.exchange().map_err(|_| Refusal::StoreFailed));
    (banks, outcome)
}

fn running(banks: &Banks, images: &[Vec<u8>]) -> usize {
    images.iter().position(|image| banks.begins_with(image)).expect("what starts is whole")
}

#[test]
fn a_new_image_is_confirmed_or_returns() {
    let [old, new] = [(1, 3_000), (2, 2 * SECTOR + 77)].map(|(build, length)| image(build, length));
    let all = [old.clone(), new.clone()];
    let (banks, outcome) = update(start(Banks::with(&old)), &new);
    assert_eq!((outcome, running(&banks, &all)), (Ok(()), 1));
    for starts in 0..=TRIAL_STARTS {
        let mut banks = banks.clone();
        for _ in 0..starts {
            banks = start(banks).release();
            assert_eq!(running(&banks, &all), 1);
        }
        // not confirmed: the next start but three is that of the old one, which stays
        let mut returned = banks.clone();
        for _ in starts..=TRIAL_STARTS {
            returned = start(returned).release();
        }
        let mut images = start(returned);
        let report = images.report();
        let other = report.other.expect("the image that returned is still there");
        assert_eq!((report.trial, other.starts, other.confirmed), (None, TRIAL_STARTS, false));
        assert_eq!(other.image, announced(&new));
        assert_eq!(running(&images.release(), &all), 0);
        // confirmed in time: it stays
        if (1..=TRIAL_STARTS).contains(&starts) {
            let mut images = ImageFlash::new(banks, CHIP, 2);
            assert_eq!(images.report().trial, Some(starts));
            assert_eq!(images.begin(announced(&old)), Err(Refusal::OnTrial));
            assert_eq!(images.confirm(), Ok(()));
            let mut banks = images.release();
            for _ in 0..2 * TRIAL_STARTS {
                banks = start(banks).release();
            }
            assert_eq!(running(&banks, &all), 1);
            // and the next update goes the other way
            assert_eq!(running(&update(start(banks), &old).0, &all), 0);
        }
    }
}

#[test]
fn what_is_no_image_or_comes_wrong_is_refused() {
    let [old, new] = [1, 2].map(|build| image(build, 3_000));
    let begun = |bytes: &[u8]| {
        let mut images = start(Banks::with(&old));
        images.begin(announced(bytes)).map(|()| images)
    };
    let refusal = |bytes: &[u8]| begun(bytes).err();
    assert_eq!(refusal(&new[..16]), Some(Refusal::NotAnImage));
    assert_eq!(refusal(&image(2, AREA)), Some(Refusal::NotAnImage));
    for (at, value) in [(0, 0x1000_0000_u32), (0, 0x2000_6002), (4, 0x0800_0298), (4, 0x0810_0001)] {
        let mut bytes = new.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        let mut images = begun(&bytes).unwrap();
        assert_eq!(images.write(0, &bytes[..UPDATE_CHUNK]), Err(Refusal::NotAnImage), "{value:#x} at {at}");
    }
    let mut images = begun(&new).unwrap();
    let chunk = |k: usize| &new[k * UPDATE_CHUNK..(k + 1) * UPDATE_CHUNK];
    assert_eq!(images.write(UPDATE_CHUNK as u32, chunk(1)), Err(Refusal::Sequence), "a gap");
    assert_eq!(images.write(0, &[]), Err(Refusal::Sequence));
    assert_eq!(images.write(0, &new[..30]), Err(Refusal::Sequence), "not whole words");
    assert_eq!(images.write(u32::MAX, chunk(1)), Err(Refusal::Sequence));
    assert_eq!(images.commit(), Err(Refusal::Sequence), "nothing has come yet");
    // the answer was lost: the same once more
    assert_eq!([0, 0].map(|_| images.write(0, chunk(0))), [Ok(()); 2]);
    let mut changed = chunk(0).to_vec();
    changed[100] ^= 1;
    assert_eq!(images.write(0, &changed), Err(Refusal::StoreFailed), "not what was written there");
    assert_eq!(images.write(UPDATE_CHUNK as u32, chunk(1)), Err(Refusal::Sequence), "that ends it");
    // another image than was announced
    let mut images = begun(&new).unwrap();
    let mut wrong = new.clone();
    wrong[2_000] ^= 1;
    for (offset, chunk) in (0..).step_by(UPDATE_CHUNK).zip(wrong.chunks(UPDATE_CHUNK)) {
        images.write(offset, chunk).unwrap();
    }
    assert_eq!(images.commit(), Err(Refusal::ImageDamaged));
    assert_eq!(images.report().other, None);
}

/// Whatever operation of an update is the last: the old image starts, or the new one, and the next update succeeds.
#[test]
fn power_cut_at_every_operation_of_an_update() {
    let [old, new, third] = [(1, 3_000), (2, SECTOR + 77), (3, 2 * SECTOR + 1_000)].map(|(b, l)| image(b, l));
    let all = [old.clone(), new.clone(), third.clone()];
    let begin = update(start(Banks::with(&third)), &old).0;
    let mut images = start(begin);
    images.confirm().unwrap();
    let begin = images.release().powered();
    let (whole, outcome) = update(start(begin.clone()), &new);
    assert_eq!(outcome, Ok(()));
    assert!(whole.operations > new.len() / WORD);
    for cut in 1..=whole.operations {
        for random in 0..3 {
            let (banks, outcome) = update(start(begin.clone().cut_after(cut, random)), &new);
            assert!(outcome.is_err(), "operation {cut} is one of the update's");
            let found = running(&banks, &all);
            assert!(found == 0 || found == 1 && cut == whole.operations, "image {found} after operation {cut}");
            let mut images = start(banks.powered());
            images.confirm().unwrap();
            let (banks, outcome) = update(images, &third);
            assert_eq!((outcome, running(&banks, &all)), (Ok(()), 2));
        }
    }
}

/// A board's life with the power cut at random 2,000 times, in updates, trials, returns and confirmations.
#[test]
fn a_whole_image_starts_after_any_series_of_power_cuts() {
    let all: Vec<Vec<u8>> = (1..5).map(|build| image(build, 2_000 + 5_000 * (build as usize % 3))).collect();
    let mut random = Random(41);
    let (mut banks, mut cuts, mut seen) = (Banks::with(&all[0]), 0, [0; 4]);
    let mut kept = 0; // the image that was confirmed last
    while cuts < 2_000 {
        banks = banks.powered().cut_after(1 + random.below(900), random.word());
        let mut images = start(banks);
        let (on_trial, mut may_stay) = (images.is_on_trial(), false);
        // the operator confirms it, starts it anew, or sends another
        banks = if on_trial && random.below(3) == 0 {
            may_stay = true;
            let confirmed = images.confirm();
            let banks = images.release();
            if confirmed.is_ok() {
                kept = running(&banks, &all);
            }
            banks
        } else if on_trial && random.below(2) == 0 {
            images.release()
        } else {
            update(images, &all[random.below(all.len())]).0
        };
        cuts += usize::from(banks.left == Some(0));
        let found = running(&banks, &all);
        seen[found] += 1;
        // any number of starts without the host's word end in the image that was confirmed; a confirmation that the
        // power cut off may count
        let mut later = banks.clone().powered();
        for _ in 0..=TRIAL_STARTS {
            later = start(later).release();
        }
        let mut images = start(later);
        assert!(!images.is_on_trial());
        let stays = running(&images.release(), &all);
        assert!(stays == kept || may_stay && stays == found, "{stays} stays, {kept} was confirmed, {found} ran");
        kept = stays;
    }
    assert!(seen.iter().all(|times| *times > 50), "{seen:?}");
}
