//! The board log on a microSD card: FAT, a new file `LOGnnnnn.BSL` at every start.
//!
//! Works in thread mode, where waiting for the card delays nothing. Once a second the directory
//! learns the file's length, so that a power cut costs a second of it. A card that fails or is full is asked
//! again; if it holds the file as it was left, the log goes on there.
//!
//! What ended runs before, where it was the firmware itself, are lines of `CRASHES.TXT`, which only grows. Backup SRAM
//! keeps them until they are there.

use crate::backup::CrashSlots;
use backseat_app::store::{forget_crashes, kept_crashes};
use backseat_wire::hostlink::LogState;
use core::fmt::Write;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::peripherals::{PA5, PA6, PB5, PD14, SPI1};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, Spi};
use embassy_stm32::time::Hertz;
use embassy_time::{Delay, Duration, Instant};
use embedded_hal_bus::spi::ExclusiveDevice;
use embedded_sdmmc::sdcard::AcquireOpts;
use embedded_sdmmc::{
    Mode, RawDirectory, RawFile, SdCard, SdCardError, TimeSource, Timestamp, VolumeIdx, VolumeManager,
};
use heapless::String;
use heapless::spsc::Consumer;

/// Until the card is identified at most 400 kHz: the HAL makes 375 of it ...
const SLOW: Hertz = Hertz(375_000);
/// ... and after: short wires carry it.
const FAST: Hertz = Hertz(12_000_000);
/// How often a card that does not answer is asked again at once ...
const TRIES: u32 = 4;
/// ... and after that every so often.
const RETRY: Duration = Duration::from_secs(10);
const BLOCK: usize = 512;
/// Blocks written before the store is looked at again.
const BLOCKS_AT_ONCE: usize = 8;
const FLUSH: Duration = Duration::from_secs(1);
const MAX_FILES: u32 = 100_000;
const CRASHES: &str = "CRASHES.TXT";
/// Longest line of it, bytes.
const CRASH_LINE: usize = 320;

type Bus = ExclusiveDevice<Spi<'static, Blocking, Master>, Output<'static>, Delay>;
type Volumes = VolumeManager<SdCard<Bus, Delay>, NoClock>;

/// Files are distinguished by their numbers: at start the board does not know the date.
struct NoClock;

impl TimeSource for NoClock {
    fn get_timestamp(&self) -> Timestamp {
        Timestamp { year_since_1970: 10, zero_indexed_month: 0, zero_indexed_day: 0, hours: 0, minutes: 0, seconds: 0 }
    }
}

type Error = embedded_sdmmc::Error<SdCardError>;

/// What is known of the card.
#[expect(clippy::large_enum_variant, reason = "there is one, in a static")]
pub enum Card {
    /// Left alone until the next start.
    Absent,
    /// It does not answer, or failed.
    Silent(SilentCard),
    /// It has an open file.
    Open(LogFile),
}

/// A card that is asked again.
pub struct SilentCard {
    device: SdCard<Bus, Delay>,
    /// How often at once.
    tries: u32,
    /// Else not before.
    next: Instant,
    /// The file that it held when it failed.
    left: Option<LeftFile>,
    /// It had no room.
    full: bool,
}

/// A file as the directory of the card knows it.
#[derive(Clone, Copy, PartialEq, Eq)]
struct LeftFile {
    number: u32,
    bytes: u32,
}

impl Card {
    /// Sets up the bus; the card has to be in its socket by now.
    pub fn new(
        spi: Peri<'static, SPI1>,
        clock: Peri<'static, PA5>,
        miso: Peri<'static, PA6>,
        mosi: Peri<'static, PB5>,
        select: Peri<'static, PD14>,
    ) -> Self {
        let spi = Spi::new_blocking(spi, clock, mosi, miso, Config::default());
        let select = Output::new(select, Level::High, Speed::High);
        let Ok(bus) = ExclusiveDevice::new(spi, select, Delay);
        // One try blocks thread mode for 0.3 s where there is no card.
        let options = AcquireOpts { acquire_retries: 0, ..AcquireOpts::default() };
        let device = SdCard::new_with_options(bus, Delay, options);
        Self::Silent(SilentCard { device, tries: TRIES, next: Instant::MIN, left: None, full: false })
    }

    /// Asks the card, opens its next file, or writes to it: a part of the work, so that others come in between.
    pub fn serve(&mut self, queue: &mut Consumer<'static, u8>) {
        if let Self::Silent(SilentCard { tries, next, .. }) = self
            && (*tries > 0 || Instant::now() >= *next)
        {
            self.look();
        }
        // at once: a card without room would else count as one that is written until the next time
        if let Self::Open(file) = self
            && let Err(error) = file.write(queue)
        {
            self.close(&error);
        }
    }

    /// The supply falls: what waits is written, and the directory learns the length, while there is time.
    pub fn save(&mut self, queue: &mut Consumer<'static, u8>) {
        if let Self::Open(file) = self {
            file.flushed = Instant::MIN;
            self.serve(queue);
        }
    }

    /// What becomes of the log.
    pub const fn state(&self) -> LogState {
        match self {
            Self::Silent(SilentCard { tries: 1.., .. }) => LogState::Searching,
            Self::Silent(SilentCard { full: true, .. }) => LogState::Full,
            Self::Absent | Self::Silent(_) => LogState::Failed,
            Self::Open(_) => LogState::Writing,
        }
    }

    /// Its file passes over the stack here and in `close`, nowhere else.
    #[inline(never)]
    fn look(&mut self) {
        let Self::Silent(card) = core::mem::replace(self, Self::Absent) else { return };
        let SilentCard { device, tries, left, .. } = card;
        let silent =
            |device, tries, full| Self::Silent(SilentCard { device, tries, next: Instant::now() + RETRY, left, full });
        *self = match identify(&device) {
            Err(_) => silent(device, tries.saturating_sub(1), false),
            Ok(bytes) => match LogFile::open(device, left) {
                Ok(file) => {
                    defmt::info!("card of {=u64} MB, LOG{=u32:05}.BSL", bytes / 1_000_000, file.number);
                    Self::Open(file)
                }
                Err((device, error)) => {
                    defmt::warn!("card: {}", error);
                    silent(device, 0, lacks_room(&error))
                }
            },
        };
    }

    #[inline(never)]
    fn close(&mut self, error: &Error) {
        let Self::Open(mut file) = core::mem::replace(self, Self::Absent) else { return };
        defmt::warn!("card: {}, no log for now", error);
        // one that was pulled lacks room as well, and cannot be told the length
        let full = lacks_room(error) && file.flush().is_ok();
        let left = Some(LeftFile { number: file.number, bytes: file.flushed_bytes });
        let (device, NoClock) = file.volumes.free();
        *self = Self::Silent(SilentCard { device, tries: 0, next: Instant::now() + RETRY, left, full });
    }
}

const fn lacks_room(error: &Error) -> bool {
    matches!(error, Error::DiskFull | Error::NotEnoughSpace)
}

/// Sets the bus to a frequency.
fn clock(device: &SdCard<Bus, Delay>, hz: Hertz) -> Result<(), SdCardError> {
    let mut config = Config::default();
    config.frequency = hz;
    device.spi(|bus| bus.bus_mut().set_config(&config)).map_err(|()| SdCardError::Transport)
}

/// Identifies a card that may be new: slowly, and then lets it be fast. Its size, bytes.
fn identify(device: &SdCard<Bus, Delay>) -> Result<u64, SdCardError> {
    device.mark_card_uninit();
    clock(device, SLOW)?;
    // 74 clocks at least before the first command, the card not selected (SD physical layer 6.4.1)
    device.spi(|bus| bus.bus_mut().blocking_write(&[0xFF_u8; 10])).map_err(|_| SdCardError::Transport)?;
    let bytes = device.num_bytes()?;
    clock(device, FAST)?;
    Ok(bytes)
}

/// An open file.
pub struct LogFile {
    volumes: Volumes,
    file: RawFile,
    /// Of its name.
    number: u32,
    block: [u8; BLOCK],
    /// Bytes in `block`.
    length: usize,
    flushed: Instant,
    /// Length that the directory knows, bytes.
    flushed_bytes: u32,
}

impl LogFile {
    /// The next file of a card, or the one that was left, if it is as it was: the card may have been changed.
    ///
    /// # Errors
    /// The card with the reason: no FAT volume, a full directory, another card.
    fn open(device: SdCard<Bus, Delay>, left: Option<LeftFile>) -> Result<Self, (SdCard<Bus, Delay>, Error)> {
        let volumes = VolumeManager::new(device, NoClock);
        match open_file(&volumes, left) {
            Ok((file, LeftFile { number, bytes: flushed_bytes })) => {
                Ok(Self { volumes, file, number, block: [0; BLOCK], length: 0, flushed: Instant::now(), flushed_bytes })
            }
            Err(error) => Err((volumes.free().0, error)),
        }
    }

    /// Writes what waits, whole blocks but once a second.
    ///
    /// # Errors
    /// The card failed, or is full.
    fn write(&mut self, queue: &mut Consumer<'static, u8>) -> Result<(), Error> {
        for _ in 0..BLOCKS_AT_ONCE {
            while self.length < BLOCK
                && let Some(byte) = queue.dequeue()
            {
                self.block[self.length] = byte;
                self.length += 1;
            }
            if self.length < BLOCK {
                break;
            }
            self.put()?;
        }
        if self.flushed.elapsed() >= FLUSH {
            self.flushed = Instant::now();
            self.put()?;
            self.flush()?;
        }
        Ok(())
    }

    /// The directory learns the length.
    fn flush(&mut self) -> Result<(), Error> {
        self.volumes.flush_file(self.file)?;
        self.flushed_bytes = self.volumes.file_length(self.file)?;
        Ok(())
    }

    fn put(&mut self) -> Result<(), Error> {
        let length = core::mem::take(&mut self.length);
        self.volumes.write(self.file, &self.block[..length])
    }
}

fn open_file(volumes: &Volumes, left: Option<LeftFile>) -> Result<(RawFile, LeftFile), Error> {
    let volume = volumes.open_raw_volume(VolumeIdx(0))?;
    let root = volumes.open_root_dir(volume)?;
    let (mut next, mut as_left) = (0, false);
    volumes.iterate_dir(root, |entry| {
        if entry.name.extension() == b"BSL"
            && let Some(number) = entry.name.base_name().strip_prefix(b"LOG").and_then(number)
        {
            next = next.max(number + 1);
            as_left |= left == Some(LeftFile { number, bytes: entry.size });
        }
    })?;
    let (file, mode) = match left {
        Some(_) if !as_left => return Err(Error::NotFound),
        Some(left) => (left, Mode::ReadWriteAppend),
        None => (LeftFile { number: next % MAX_FILES, bytes: 0 }, Mode::ReadWriteCreate),
    };
    tell_crashes(volumes, root, file.number)?;
    let mut name: String<12> = String::new();
    let _ = write!(name, "LOG{:05}.BSL", file.number);
    Ok((volumes.open_file_in_dir(root, name.as_str(), mode)?, file))
}

/// Lines of what is kept; once they are in the file nothing is.
#[inline(never)]
fn tell_crashes(volumes: &Volumes, root: RawDirectory, number: u32) -> Result<(), Error> {
    let mut slots = CrashSlots::open();
    let kept = kept_crashes(&slots);
    if kept.is_empty() {
        return Ok(());
    }
    let crashes = volumes.open_file_in_dir(root, CRASHES, Mode::ReadWriteCreateOrAppend)?;
    for crash in &kept {
        let mut line: String<CRASH_LINE> = String::new();
        let _ = write!(line, "before LOG{number:05}: {crash}\r\n");
        volumes.write(crashes, line.as_bytes())?;
    }
    volumes.close_file(crashes)?;
    forget_crashes(&mut slots);
    Ok(())
}

/// A number of digits alone.
fn number(digits: &[u8]) -> Option<u32> {
    core::str::from_utf8(digits).ok()?.parse().ok()
}
