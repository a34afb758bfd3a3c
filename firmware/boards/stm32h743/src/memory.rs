//! AXI SRAM: what DMA has to reach, and what is large: the app as well, which with the robust filter does not fit into
//! DTCM beside the stack. All other RAM is DTCM, which DMA does not reach.
//!
//! The data cache stays off, so that what DMA writes is what the core reads. DTCM needs none.

use backseat_app::parameters::Settings;
use backseat_app::{App, Pump};
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

/// Received bytes that may wait in a ring: 0.18 s at 115,200 baud; the pump looks every millisecond.
const RING: usize = 2048;
/// Bytes of one transfer to a port.
const STAGE: usize = 128;

/// Bytes that may wait for the card: six seconds of all ports at usual rates.
const LOG: usize = 65_536;

/// The board log on its way to the card.
pub type LogQueue = heapless::spsc::Queue<u8, LOG>;

/// Buffers of the five UARTs.
pub struct DmaMemory {
    /// Written round and round.
    pub receive: [[u8; RING]; 5],
    /// Read once each.
    pub transmit: [[u8; STAGE]; 5],
}

/// All of it.
pub struct Memory {
    /// Buffers of the UARTs.
    pub dma: &'static mut DmaMemory,
    /// Board log on its way to the card.
    pub log: &'static mut LogQueue,
    /// The app.
    pub app: &'static mut App,
    /// The pump: bytes on their way, and a lock-step message.
    pub pump: &'static mut Pump,
    /// The set that was found in flash.
    pub stored: &'static mut Settings,
}

/// Not zeroed by the start-up code (`memory.x`, NOLOAD).
#[unsafe(link_section = ".axisram.dma")]
static mut DMA: MaybeUninit<DmaMemory> = MaybeUninit::uninit();
#[unsafe(link_section = ".axisram.log")]
static mut QUEUE: MaybeUninit<LogQueue> = MaybeUninit::uninit();
/// In flash: by value the first app would pass over the stack.
static NEW: App = App::new();
#[unsafe(link_section = ".axisram.app")]
static mut APP: MaybeUninit<App> = MaybeUninit::uninit();
#[unsafe(link_section = ".axisram.pump")]
static mut PUMP: MaybeUninit<Pump> = MaybeUninit::uninit();
#[unsafe(link_section = ".axisram.stored")]
static mut STORED: MaybeUninit<Settings> = MaybeUninit::uninit();
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Hands it out, as new, once. What passes over the stack here is not to stay in the caller's frame.
#[inline(never)]
pub fn take() -> Option<Memory> {
    if TAKEN.swap(true, Ordering::AcqRel) {
        return None;
    }
    // SAFETY: nobody else gets here again, bytes of 0 are a DmaMemory, and an app holds no reference to itself.
    unsafe {
        let (dma, log, app, pump) = (&raw mut DMA, &raw mut QUEUE, &raw mut APP, &raw mut PUMP);
        let stored = &raw mut STORED;
        dma.write(MaybeUninit::zeroed());
        app.cast::<App>().copy_from_nonoverlapping(&raw const NEW, 1);
        Some(Memory {
            dma: (*dma).assume_init_mut(),
            log: (*log).write(LogQueue::new()),
            app: (*app).assume_init_mut(),
            pump: (*pump).write(Pump::new()),
            stored: (*stored).write(Settings::DEFAULT),
        })
    }
}
