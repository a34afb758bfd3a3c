//! The parameter store in a model of NOR flash whose power can be cut at any operation.

use crate::random::Random;
use backseat_app::parameters::{PARAMETERS, Settings};
use backseat_app::store::{Geometry, MarkError, ParameterFlash, Refused, SaveError, WORD};
use backseat_core::parameters::Kind;
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};

const SECTOR: usize = 8192;
const CAPACITY: usize = 2 * SECTOR;

/// What the operation leaves behind during which the power goes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Torn {
    /// Nothing was done yet.
    Before,
    /// A word: some of its bits are programmed. A sector: its first part is erased, the rest is old.
    Half,
    /// A word: bits at random. A sector: bits at random all over.
    Garbage,
    /// As `Garbage`, and reading it is an error (two wrong bits where the flash corrects one).
    Unreadable,
    /// It was done.
    After,
}

const TORN: [Torn; 5] = [Torn::Before, Torn::Half, Torn::Garbage, Torn::Unreadable, Torn::After];

#[derive(Clone, Copy, Debug, PartialEq)]
enum FlashError {
    PowerIsOff,
    Uncorrectable,
    /// The caller broke a rule of the flash.
    Misuse,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Flash of two sectors. Programming takes a word at a time, once between two erases.
#[derive(Clone)]
struct Flash {
    bytes: Vec<u8>,
    /// Programmed since the erase, and readable, by word.
    programmed: Vec<bool>,
    readable: Vec<bool>,
    /// Operations until the power goes, and how.
    cut: Option<(usize, Torn)>,
    off: bool,
    operations: usize,
    random: u64,
}

impl Flash {
    fn new() -> Self {
        let words = CAPACITY / WORD;
        Self {
            bytes: vec![0xFF; CAPACITY],
            programmed: vec![false; words],
            readable: vec![true; words],
            cut: None,
            off: false,
            operations: 0,
            random: 1,
        }
    }

    fn cut_at(mut self, operation: usize, torn: Torn, random: u64) -> Self {
        self.cut = Some((operation, torn));
        self.random = random;
        self.operations = 0;
        self
    }

    /// Power is back.
    fn powered(mut self) -> Self {
        self.cut = None;
        self.off = false;
        self.operations = 0;
        self
    }

    /// Counts an operation; how it goes.
    fn operate(&mut self) -> Result<Torn, FlashError> {
        if self.off {
            return Err(FlashError::PowerIsOff);
        }
        let torn = match self.cut {
            Some((operation, torn)) if operation == self.operations => torn,
            _ => {
                self.operations += 1;
                return Ok(Torn::After);
            }
        };
        self.off = true;
        Ok(torn)
    }

    fn finish(&self) -> Result<(), FlashError> {
        if self.off { Err(FlashError::PowerIsOff) } else { Ok(()) }
    }

    fn scramble(&mut self, range: std::ops::Range<usize>, readable: bool) {
        let mut random = Random(self.random);
        for byte in &mut self.bytes[range.clone()] {
            *byte = random.word() as u8;
        }
        for word in range.start / WORD..range.end / WORD {
            self.programmed[word] = true;
            self.readable[word] = readable;
        }
    }
}

impl ErrorType for Flash {
    type Error = FlashError;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        let range = offset as usize..offset as usize + bytes.len();
        if self.off {
            return Err(FlashError::PowerIsOff);
        }
        if self.readable[range.start / WORD..range.end.div_ceil(WORD)].contains(&false) {
            return Err(FlashError::Uncorrectable);
        }
        bytes.copy_from_slice(&self.bytes[range]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        let (from, to) = (from as usize, to as usize);
        if !from.is_multiple_of(SECTOR) || to != from + SECTOR {
            return Err(FlashError::Misuse);
        }
        let torn = self.operate()?;
        let erased = match torn {
            Torn::Before => from..from,
            Torn::Half => from..from + SECTOR * Random(self.random).below(16) / 16,
            Torn::Garbage | Torn::Unreadable => {
                self.scramble(from..to, torn == Torn::Garbage);
                return self.finish();
            }
            Torn::After => from..to,
        };
        self.bytes[erased.clone()].fill(0xFF);
        for word in erased.start / WORD..erased.end / WORD {
            self.programmed[word] = false;
            self.readable[word] = true;
        }
        self.finish()
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        let (start, word) = (offset as usize, offset as usize / WORD);
        if !start.is_multiple_of(WORD) || bytes.len() != WORD || self.programmed[word] {
            return Err(FlashError::Misuse);
        }
        let torn = self.operate()?;
        let mut random = Random(self.random);
        match torn {
            Torn::Before => return self.finish(),
            Torn::Garbage | Torn::Unreadable => self.scramble(start..start + WORD, torn == Torn::Garbage),
            Torn::Half | Torn::After => {
                self.programmed[word] = true;
                for (place, byte) in self.bytes[start..].iter_mut().zip(bytes) {
                    // bits only go from 1 to 0; some of them not yet when the power goes
                    let late = if torn == Torn::Half { random.word() as u8 } else { 0 };
                    *place &= byte | late;
                }
            }
        }
        self.finish()
    }
}

/// A set of which every value depends on `seed`.
fn set(seed: u64) -> Settings {
    let mut settings = Settings::DEFAULT;
    let mut random = Random(seed);
    for parameter in PARAMETERS {
        let share = random.below(1000) as f64 / 1000.0;
        let value = parameter.min + share * (parameter.max - parameter.min);
        let whole = parameter.kind == Kind::Whole;
        parameter.set(&mut settings, if whole { libm::floor(value) } else { value });
    }
    settings
}

fn store(flash: Flash) -> ParameterFlash<Flash> {
    ParameterFlash::new(flash).expect("two sectors hold two copies")
}

fn load(flash: Flash) -> Result<Settings, [Refused; 2]> {
    let mut settings = Settings::DEFAULT;
    store(flash).load(&mut settings).map(|_| settings)
}

fn saved(flash: Flash, settings: &Settings) -> Flash {
    let mut store = store(flash);
    store.save(settings).expect("saved");
    store.release()
}

#[test]
fn a_set_comes_back_and_the_newest_wins() {
    let mut flash = Flash::new();
    assert_eq!(load(flash.clone()), Err([Refused::Blank; 2]));
    for generation in 0..9 {
        flash = saved(flash, &set(generation));
        assert_eq!(load(flash.clone()), Ok(set(generation)));
    }
}

/// Every operation of a save, torn in every way, over several generations: after the cut there is
/// the old set or the new one, and the next save works.
#[test]
fn a_power_cut_at_any_operation_leaves_the_old_set_or_the_new() {
    let mut flash = Flash::new();
    let mut old = Err([Refused::Blank; 2]);
    let mut random = Random(7);
    for generation in 0..6 {
        let new = set(generation);
        let complete = saved(flash.clone().powered(), &new);
        // an erase, a write for every word of values and the two halves of the key, and one for the header
        assert_eq!(complete.operations, 2 + (PARAMETERS.len() + 2).div_ceil(4));
        for operation in 0..complete.operations {
            for torn in TORN {
                let mut cut = store(flash.clone().cut_at(operation, torn, random.word()));
                assert_eq!(cut.save(&new), Err(SaveError::Flash(FlashError::PowerIsOff)));
                let after = cut.release().powered();
                let found = load(after.clone());
                let committed = torn == Torn::After && operation + 1 == complete.operations;
                if committed {
                    assert_eq!(found, Ok(new));
                } else if old.is_err() {
                    assert!(found.is_err(), "generation {generation}, operation {operation}, {torn:?}");
                } else {
                    assert_eq!(found, old, "generation {generation}, operation {operation}, {torn:?}");
                }
                assert_eq!(load(saved(after, &set(99))), Ok(set(99)), "operation {operation}, {torn:?}");
            }
        }
        flash = complete;
        old = Ok(new);
    }
}

/// Cuts that follow each other without a save that succeeds in between.
#[test]
fn cut_after_cut() {
    let mut random = Random(2);
    let mut flash = saved(Flash::new(), &set(0));
    let mut present = set(0);
    for seed in 1..2000 {
        let new = set(seed);
        let torn = TORN[random.below(5)];
        let mut cut = store(flash.cut_at(random.below(48), torn, random.word()));
        // beyond the last operation the save succeeds
        let kept = cut.save(&new).is_ok();
        flash = cut.release().powered();
        let found = load(flash.clone()).expect("there always is a set");
        assert!(found == present || found == new, "{torn:?}");
        assert!(!kept || found == new);
        present = found;
    }
}

#[test]
fn a_damaged_copy_gives_way_to_the_older_one() {
    let flash = saved(saved(Flash::new(), &set(1)), &set(2));
    let words = 1 + PARAMETERS.len().div_ceil(4);
    // the second set is in the second sector
    for byte in (0..words * WORD).step_by(7) {
        let mut bad = flash.clone();
        bad.bytes[SECTOR + byte] ^= 0x10;
        assert_eq!(load(bad), Ok(set(1)), "byte {byte}");
    }
    let mut unreadable = flash;
    unreadable.readable[SECTOR / WORD + 5] = false;
    assert_eq!(load(unreadable), Ok(set(1)));
}

/// Flash with one copy in the first sector, whose bytes are changed and whose CRC is made right.
fn forged(change: impl FnOnce(&mut [u8])) -> Flash {
    let mut flash = saved(Flash::new(), &set(1));
    change(&mut flash.bytes);
    let words = 1 + usize::from(u16::from_le_bytes([flash.bytes[6], flash.bytes[7]])).div_ceil(4);
    let end = (words * WORD).min(CAPACITY);
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    digest.update(&flash.bytes[..28]);
    digest.update(&flash.bytes[WORD..end]);
    let sum = digest.finalize().to_le_bytes();
    flash.bytes[28..32].copy_from_slice(&sum);
    flash
}

#[test]
fn copies_are_refused_by_cause() {
    let put = |at: usize, value: &[u8]| {
        let value = value.to_vec();
        move |bytes: &mut [u8]| bytes[at..at + value.len()].copy_from_slice(&value)
    };
    assert_eq!(load(forged(|_| ())), Ok(set(1)));
    let mass = WORD + 8 * PARAMETERS.iter().position(|p| p.name == "vehicle.mass_kg").expect("declared");
    for (flash, cause) in [
        (forged(put(0, b"nope")), Refused::Damaged),
        (forged(put(4, &[0xFE])), Refused::OtherSchema),
        // an older list
        (forged(put(4, &[6])), Refused::OtherSchema),
        (forged(put(6, &[1])), Refused::OtherSchema),
        (forged(put(12, &[0, 0])), Refused::OtherSchema),
        (forged(put(6, &[0xFF, 0xFF])), Refused::Damaged),
        (forged(put(mass, &f64::NAN.to_le_bytes())), Refused::OutOfRange),
        (forged(put(mass, &(-1.0_f64).to_le_bytes())), Refused::OutOfRange),
    ] {
        assert_eq!(load(flash.clone()), Err([cause, Refused::Blank]));
        // saving goes on beside or over it
        assert_eq!(load(saved(flash, &set(5))), Ok(set(5)));
    }
}

/// Firmware with another list keeps its set in the other sector: whoever goes back finds it.
#[test]
fn a_set_for_another_list_is_kept_until_it_is_the_older_one() {
    let foreign = forged(|bytes| bytes[4] = 0xFE);
    let flash = saved(foreign.clone(), &set(3));
    assert_eq!(flash.bytes[..SECTOR], foreign.bytes[..SECTOR]);
    let flash = saved(flash, &set(4));
    assert_eq!(load(flash), Ok(set(4)));
}

/// Marks of a flash: what it says, after its supply was lost and came back.
fn is_under_way(flash: &Flash) -> bool {
    store(flash.clone().powered()).is_under_way()
}

fn marked(flash: Flash, under_way: bool) -> Flash {
    let mut store = store(flash);
    store.mark_under_way(under_way).expect("there is room");
    store.release()
}

#[test]
fn under_way_outlasts_the_supply() {
    for blank in [true, false] {
        let mut flash = if blank { Flash::new() } else { saved(Flash::new(), &set(1)) };
        assert!(!is_under_way(&flash));
        for under_way in [true, false, true] {
            flash = marked(flash, under_way);
            assert_eq!(is_under_way(&flash), under_way);
        }
        assert_eq!(load(flash.clone()).is_ok(), !blank, "the set is left alone");
        // a new set begins without marks
        assert!(!is_under_way(&saved(marked(flash, false), &set(2))));
    }
}

/// A mark that the power cut tears is the old one or the new one, or says under way: never less than what was true.
#[test]
fn a_torn_mark_is_rather_a_stop_too_many() {
    let begin = saved(Flash::new(), &set(1));
    for (before, after) in [(false, true), (true, false)] {
        let flash = marked(begin.clone(), before);
        for torn in TORN {
            for random in 1..20 {
                let mut cut = store(flash.clone().powered().cut_at(0, torn, random));
                assert_eq!(cut.mark_under_way(after), Err(MarkError::Flash(FlashError::PowerIsOff)));
                let found = is_under_way(&cut.release());
                let expected = match torn {
                    Torn::Before => before,
                    Torn::After => after,
                    _ => true,
                };
                assert_eq!(found, expected, "{before} to {after}, {torn:?}");
            }
        }
    }
}

#[test]
fn marks_end_when_the_half_is_full_and_a_save_brings_new_ones() {
    let mut flash = saved(Flash::new(), &set(1));
    for k in 0..SECTOR / 2 / WORD {
        flash = marked(flash, k % 2 == 0);
    }
    let mut full = store(flash);
    assert_eq!(full.mark_under_way(true), Err(MarkError::Full));
    assert_eq!(load(full.release()), Ok(set(1)));
}

/// A board that exchanges its banks: two sectors in each.
struct TwoBanks {
    flash: [Flash; 2],
    exchanged: bool,
}

impl TwoBanks {
    /// As the image that runs sees them: the other bank's, its own.
    fn seen(&self) -> Flash {
        let [mut other, own] = [true, false].map(|other| self.flash[usize::from(other ^ self.exchanged)].clone());
        other.bytes.extend(own.bytes);
        other.programmed.extend(own.programmed);
        other.readable.extend(own.readable);
        other
    }

    /// What was saved into them.
    fn keep(&mut self, mut seen: Flash) {
        let own = seen.bytes.split_off(CAPACITY);
        let words = CAPACITY / WORD;
        seen.programmed.truncate(words);
        seen.readable.truncate(words);
        assert_eq!(own, self.flash[usize::from(self.exchanged)].bytes, "the bank that runs is written");
        self.flash[usize::from(!self.exchanged)] = seen.powered();
    }
}

/// Whatever the order of sets and updates, and wherever the power is cut: the last set that was saved is found.
#[test]
fn the_last_set_outlasts_updates_and_power_cuts() {
    let mut banks = TwoBanks { flash: [Flash::new(), Flash::new()], exchanged: false };
    let (mut random, mut last) = (Random(11), None);
    let operations = saved(Flash::new(), &set(0)).operations;
    for seed in 0..400 {
        if random.below(3) == 0 {
            banks.exchanged = !banks.exchanged;
        }
        let torn = TORN[random.below(TORN.len())];
        let cut = banks.seen().cut_at(random.below(2 * operations), torn, random.word());
        let mut store = ParameterFlash::in_two_banks(cut).expect("four sectors");
        let saved = store.save(&set(seed)).is_ok();
        banks.keep(store.release());
        let mut found = Settings::DEFAULT;
        let is_found = ParameterFlash::in_two_banks(banks.seen()).expect("four sectors").load(&mut found).is_ok();
        let found = is_found.then_some(found);
        assert!(found == last || found == Some(set(seed)), "set {seed}");
        assert!(!saved || found == Some(set(seed)));
        last = found;
    }
    assert!(last.is_some());
}

#[test]
fn a_flash_that_is_too_small_is_refused() {
    let mut flash = Flash::new();
    flash.bytes.truncate(SECTOR);
    assert_eq!(ParameterFlash::new(flash).err(), Some(Geometry));
}

#[test]
fn a_flash_that_does_not_hold_what_it_took_is_noticed() {
    /// Takes every write and keeps nothing.
    struct Worn(Flash);
    impl ErrorType for Worn {
        type Error = FlashError;
    }
    impl ReadNorFlash for Worn {
        const READ_SIZE: usize = 1;
        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
            self.0.read(offset, bytes)
        }
        fn capacity(&self) -> usize {
            CAPACITY
        }
    }
    impl NorFlash for Worn {
        const WRITE_SIZE: usize = WORD;
        const ERASE_SIZE: usize = SECTOR;
        fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
            self.0.erase(from, to)
        }
        fn write(&mut self, _: u32, _: &[u8]) -> Result<(), FlashError> {
            Ok(())
        }
    }
    let mut store = ParameterFlash::new(Worn(saved(Flash::new(), &set(1)))).expect("large enough");
    assert_eq!(store.save(&set(2)), Err(SaveError::Verify));
    assert_eq!(load(store.release().0), Ok(set(1)));
}
