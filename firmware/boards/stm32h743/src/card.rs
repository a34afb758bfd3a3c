//! The board log on a microSD card: FAT, a new file `LOGnnnnn.BSL` at every start.
//!
//! Works in thread mode, where waiting for the card delays nothing. Once a second the directory
//! learns the file's length, so that a power cut costs a second of it.

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
use embedded_sdmmc::{Mode, RawFile, SdCard, SdCardError, TimeSource, Timestamp, VolumeIdx, VolumeManager};
use heapless::String;
use heapless::spsc::Consumer;

/// Until the card is identified at most 400 kHz: the HAL makes 375 of it ...
const SLOW: Hertz = Hertz(375_000);
/// ... and after: short wires carry it.
const FAST: Hertz = Hertz(12_000_000);
/// How often a card that does not answer is asked again.
const TRIES: u32 = 4;
const BLOCK: usize = 512;
/// Blocks written before the store is looked at again.
const BLOCKS_AT_ONCE: usize = 8;
const FLUSH: Duration = Duration::from_secs(1);
const MAX_FILES: u32 = 100_000;

type Bus = ExclusiveDevice<Spi<'static, Blocking, Master>, Output<'static>, Delay>;
type Volumes = VolumeManager<SdCard<Bus, Delay>, NoClock>;

/// What the card needs of the chip.
pub struct Resources {
    pub spi: Peri<'static, SPI1>,
    pub clock: Peri<'static, PA5>,
    pub miso: Peri<'static, PA6>,
    pub mosi: Peri<'static, PB5>,
    pub select: Peri<'static, PD14>,
}

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
    /// There is none, or it failed.
    Absent,
    /// It has not answered yet; how often it is still asked.
    Unknown(SdCard<Bus, Delay>, u32),
    /// It has an open file.
    Open(LogFile),
}

impl Card {
    /// Sets up the bus; the card has to be in its socket by now.
    pub fn new(resources: Resources) -> Self {
        let Resources { spi, clock, miso, mosi, select } = resources;
        let mut config = Config::default();
        config.frequency = SLOW;
        let mut spi = Spi::new_blocking(spi, clock, mosi, miso, config);
        let select = Output::new(select, Level::High, Speed::High);
        // 74 clocks at least before the first command, the card not selected (SD physical layer 6.4.1)
        if let Err(error) = spi.blocking_write(&[0xFF_u8; 10]) {
            defmt::warn!("no log: {}", error);
            return Self::Absent;
        }
        let Ok(device) = ExclusiveDevice::new(spi, select, Delay);
        // One try blocks thread mode for 0.3 s where there is no card.
        let options = AcquireOpts { acquire_retries: 0, ..AcquireOpts::default() };
        Self::Unknown(SdCard::new_with_options(device, Delay, options), TRIES)
    }

    /// Asks the card, opens its next file, or writes to it: a part of the work, so that others come in between.
    pub fn serve(&mut self, queue: &mut Consumer<'static, u8>) {
        match self {
            Self::Absent => {}
            Self::Unknown(..) => self.look(),
            Self::Open(file) => {
                if let Err(error) = file.write(queue) {
                    *self = absent(&error);
                }
            }
        }
    }

    /// Its file passes over the stack here and nowhere else.
    #[inline(never)]
    fn look(&mut self) {
        let Self::Unknown(card, tries) = core::mem::replace(self, Self::Absent) else { return };
        match (card.num_bytes(), tries) {
            (Ok(bytes), _) => *self = LogFile::open(card, bytes).map_or_else(|error| absent(&error), Self::Open),
            (Err(error), 0) => *self = absent(&error),
            (Err(_), 1..) => *self = Self::Unknown(card, tries - 1),
        }
    }
}

fn absent(error: &impl core::fmt::Debug) -> Card {
    defmt::warn!("card: {}, no log from here on", defmt::Debug2Format(error));
    Card::Absent
}

/// An open file.
pub struct LogFile {
    volumes: Volumes,
    file: RawFile,
    block: [u8; BLOCK],
    /// Bytes in `block`.
    length: usize,
    flushed: Instant,
}

impl LogFile {
    /// The next file of a card of so many bytes.
    ///
    /// # Errors
    /// No FAT volume, or a full directory.
    fn open(card: SdCard<Bus, Delay>, bytes: u64) -> Result<Self, Error> {
        let mut config = Config::default();
        config.frequency = FAST;
        // a frequency that the HAL made once it makes again
        let _ = card.spi(|device| device.bus_mut().set_config(&config));

        let volumes = VolumeManager::new(card, NoClock);
        let volume = volumes.open_raw_volume(VolumeIdx(0))?;
        let root = volumes.open_root_dir(volume)?;
        let mut next = 0;
        volumes.iterate_dir(root, |entry| {
            if entry.name.extension() == b"BSL"
                && let Some(number) = entry.name.base_name().strip_prefix(b"LOG").and_then(number)
            {
                next = next.max(number + 1);
            }
        })?;
        let mut name: String<12> = String::new();
        let _ = core::fmt::write(&mut name, format_args!("LOG{:05}.BSL", next % MAX_FILES));
        let file = volumes.open_file_in_dir(root, name.as_str(), Mode::ReadWriteCreate)?;
        defmt::info!("card of {=u64} MB, {=str}", bytes / 1_000_000, name.as_str());
        Ok(Self { volumes, file, block: [0; BLOCK], length: 0, flushed: Instant::now() })
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
            self.volumes.flush_file(self.file)?;
        }
        Ok(())
    }

    fn put(&mut self) -> Result<(), Error> {
        let length = core::mem::take(&mut self.length);
        self.volumes.write(self.file, &self.block[..length])
    }
}

/// A number of digits alone.
fn number(digits: &[u8]) -> Option<u32> {
    core::str::from_utf8(digits).ok()?.parse().ok()
}
