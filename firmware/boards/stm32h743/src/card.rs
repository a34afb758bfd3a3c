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
use embedded_sdmmc::{Mode, RawFile, SdCard, SdCardError, TimeSource, Timestamp, VolumeIdx, VolumeManager};
use heapless::String;
use heapless::spsc::Consumer;

/// Until the card has introduced itself ...
const SLOW: Hertz = Hertz(400_000);
/// ... and after: short wires carry it.
const FAST: Hertz = Hertz(15_000_000);
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

/// Files are told apart by their numbers: at start the board does not know the date.
struct NoClock;

impl TimeSource for NoClock {
    fn get_timestamp(&self) -> Timestamp {
        Timestamp { year_since_1970: 10, zero_indexed_month: 0, zero_indexed_day: 0, hours: 0, minutes: 0, seconds: 0 }
    }
}

type Error = embedded_sdmmc::Error<SdCardError>;

/// A card with an open file.
pub struct Card {
    volumes: Volumes,
    file: RawFile,
    block: [u8; BLOCK],
    /// Bytes in `block`.
    length: usize,
    flushed: Instant,
}

impl Card {
    /// Opens the next file of a card, which has to be in its socket by now.
    ///
    /// # Errors
    /// No card, no FAT volume, or a full directory.
    pub fn open(resources: Resources) -> Result<Self, Error> {
        let Resources { spi, clock, miso, mosi, select } = resources;
        let mut config = Config::default();
        config.frequency = SLOW;
        let spi = Spi::new_blocking(spi, clock, mosi, miso, config);
        let select = Output::new(select, Level::High, Speed::High);
        let Ok(device) = ExclusiveDevice::new(spi, select, Delay);
        let card = SdCard::new(device, Delay);
        let bytes = card.num_bytes().map_err(Error::DeviceError)?;
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
    pub fn write(&mut self, queue: &mut Consumer<'static, u8>) -> Result<(), Error> {
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
