//! Memory that DMA reaches: AXI SRAM. All other RAM is DTCM, which it does not reach.
//!
//! The data cache stays off, so that what DMA writes is what the core reads. DTCM needs none.

use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

/// Received bytes that may wait in a ring: 0.18 s at 115,200 baud; the pump looks every millisecond.
const RING: usize = 2048;
/// Bytes of one transfer to a port.
const STAGE: usize = 128;

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
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Hands them out, zeroed, once.
pub fn take() -> Option<&'static mut DmaMemory> {
    if TAKEN.swap(true, Ordering::AcqRel) {
        return None;
    }
    // SAFETY: bytes of 0 are a DmaMemory, and nobody else gets here again.
    unsafe {
        let place = &raw mut DMA;
        place.write(MaybeUninit::zeroed());
        Some((*place).assume_init_mut())
    }
}
