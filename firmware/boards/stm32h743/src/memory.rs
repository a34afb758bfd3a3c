//! What lies where. DTCM, which the core reaches without wait states and DMA not at all, holds the filter (state,
//! covariances, scratch, bank: what a step works on) and the stack. AXI SRAM holds what DMA has to reach, and the rest
//! of the app, which does not fit beside the filter.
//!
//! The data cache stays off, so that what DMA writes is what the core reads. DTCM needs none.

use crate::card::Card;
use backseat_app::parameters::Settings;
use backseat_app::{App, Pump};
use backseat_core::navigation::Navigator;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::zerocopy_channel::Channel;

/// Received bytes that may wait in a ring: 0.18 s at 115,200 baud; the pump looks every millisecond.
const RING: usize = 2048;
/// Bytes of one transfer to a port. The next one waits for the end of a tick, and so for that of a step: a board that is
/// overloaded has a few a second, and still has to tell the host so ten times a second.
pub const STAGE: usize = 1024;

/// Bytes that may wait for the card: six seconds of all ports at usual rates.
const LOG: usize = 65_536;

/// The board log on its way to the card.
pub type LogQueue = heapless::spsc::Queue<u8, LOG>;

/// A set on its way from the app to thread mode, which stores it.
pub type SettingsChannel = Channel<'static, CriticalSectionRawMutex, Settings>;

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
    /// Place of the set that was found in flash, and later of one that is to be stored.
    pub settings: &'static mut [Settings; 1],
    /// The way of a set to thread mode.
    pub to_store: &'static mut MaybeUninit<SettingsChannel>,
    /// Place of the card and its block.
    pub card: &'static mut MaybeUninit<Card>,
}

/// Not zeroed by the start-up code (`memory.x`, NOLOAD).
#[unsafe(link_section = ".axisram.dma")]
static mut DMA: MaybeUninit<DmaMemory> = MaybeUninit::uninit();
#[unsafe(link_section = ".axisram.log")]
static mut QUEUE: MaybeUninit<LogQueue> = MaybeUninit::uninit();
#[unsafe(link_section = ".axisram.app")]
static mut APP: MaybeUninit<App> = MaybeUninit::uninit();
/// In DTCM. A new filter is zero bytes alone: of another one this section refuses to be assembled. So it neither takes
/// flash nor passes over the stack.
#[unsafe(link_section = ".bss.filter")]
static mut FILTER: Navigator = Navigator::new();
#[unsafe(link_section = ".axisram.pump")]
static mut PUMP: MaybeUninit<Pump> = MaybeUninit::uninit();
#[unsafe(link_section = ".axisram.settings")]
static mut SETTINGS: MaybeUninit<[Settings; 1]> = MaybeUninit::uninit();
static mut TO_STORE: MaybeUninit<SettingsChannel> = MaybeUninit::uninit();
#[unsafe(link_section = ".axisram.card")]
static mut CARD: MaybeUninit<Card> = MaybeUninit::uninit();
static TAKEN: AtomicBool = AtomicBool::new(false);

unsafe extern "C" {
    // of memory.x, around the sections `.bss.axisram`
    static mut _axi_zero_start: u64;
    static mut _axi_zero_end: u64;
}

/// Hands it out, as new, once. What passes over the stack here is not to stay in the caller's frame.
#[inline(never)]
pub fn take() -> Option<Memory> {
    if TAKEN.swap(true, Ordering::AcqRel) {
        return None;
    }
    // SAFETY: nobody else gets here again. Bytes of 0 are a DmaMemory, and with the filter's place an app: the QEMU
    // image, whose app is a variable of zero bytes, refuses to be assembled otherwise.
    unsafe {
        let (dma, log, app, pump) = (&raw mut DMA, &raw mut QUEUE, (&raw mut APP).cast::<App>(), &raw mut PUMP);
        app.write_bytes(0, 1);
        app.byte_add(App::FILTER_PLACE).cast::<*mut Navigator>().write(&raw mut FILTER);
        let (settings, to_store, card) = (&raw mut SETTINGS, &raw mut TO_STORE, &raw mut CARD);
        dma.write(MaybeUninit::zeroed());
        let zero = &raw mut _axi_zero_start;
        zero.write_bytes(0, (&raw mut _axi_zero_end).offset_from_unsigned(zero));
        Some(Memory {
            dma: (*dma).assume_init_mut(),
            log: (*log).write(LogQueue::new()),
            app: &mut *app,
            pump: (*pump).write(Pump::new()),
            settings: (*settings).write([Settings::DEFAULT]),
            to_store: &mut *to_store,
            card: &mut *card,
        })
    }
}
