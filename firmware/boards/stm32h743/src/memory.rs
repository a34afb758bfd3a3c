//! AXI SRAM: what DMA has to reach, and what is large and in no hurry. All other RAM is DTCM, which
//! DMA does not reach.
//!
//! The data cache stays off, so that what DMA writes is what the core reads. DTCM needs none.

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

/// Not zeroed by the start-up code (`memory.x`, NOLOAD).
#[unsafe(link_section = ".axisram.dma")]
static mut DMA: MaybeUninit<DmaMemory> = MaybeUninit::uninit();
#[unsafe(link_section = ".axisram.log")]
static mut QUEUE: MaybeUninit<LogQueue> = MaybeUninit::uninit();
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Hands out both, empty, once.
pub fn take() -> Option<(&'static mut DmaMemory, &'static mut LogQueue)> {
    if TAKEN.swap(true, Ordering::AcqRel) {
        return None;
    }
    // SAFETY: nobody else gets here again, and bytes of 0 are a DmaMemory.
    unsafe {
        let (dma, queue) = (&raw mut DMA, &raw mut QUEUE);
        dma.write(MaybeUninit::zeroed());
        Some(((*dma).assume_init_mut(), (*queue).write(LogQueue::new())))
    }
}
