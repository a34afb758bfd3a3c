//! Instructions by TIMER0, and the stack by paint.

use core::hint::black_box;
use core::sync::atomic::{Ordering, compiler_fence};
use cortex_m::register::msp;

const CONTROL: *mut u32 = 0x4000_0000 as *mut u32;
const VALUE: *mut u32 = 0x4000_0004 as *mut u32;
const RELOAD: *mut u32 = 0x4000_0008 as *mut u32;
/// cortex-m-rt's colour.
const PAINT: u32 = 0xcccc_cccc;
/// What this module's own frames may take while it paints, bytes.
const OWN: u32 = 512;

unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Starts the timer.
pub fn start() {
    // SAFETY: the machine's TIMER0, which nothing else uses here; it counts down from `RELOAD`.
    unsafe {
        RELOAD.write_volatile(u32::MAX);
        VALUE.write_volatile(u32::MAX);
        CONTROL.write_volatile(1);
    }
}

#[inline(always)]
fn ticks() -> u32 {
    compiler_fence(Ordering::SeqCst);
    // SAFETY: reading has no effect.
    let ticks = unsafe { VALUE.read_volatile() };
    compiler_fence(Ordering::SeqCst);
    ticks
}

/// Result and instructions of `work`: an instruction takes 64 ns of the machine's time (`-icount shift=6`), a tick 40
/// ns.
#[inline(always)]
pub fn count<T>(work: impl FnOnce() -> T) -> (T, u32) {
    let before = ticks();
    let result = black_box(work());
    let after = ticks();
    let ticks = before.wrapping_sub(after);
    (result, (u64::from(ticks) * 40 / 64) as u32)
}

/// The largest of several counts.
#[derive(Clone, Copy, Default)]
pub struct Worst(pub u32);

impl Worst {
    #[inline(always)]
    pub fn count<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let (result, instructions) = count(work);
        self.0 = self.0.max(instructions);
        result
    }
}

fn end() -> *mut u32 {
    (&raw const _stack_end).cast_mut()
}

/// Paints what is free of the stack.
#[inline(never)]
pub fn paint() {
    let top = (msp::read() - OWN) as *mut u32;
    let mut word = end();
    while word < top {
        // SAFETY: between the statics' end and the frames in use, with a margin.
        unsafe {
            word.write_volatile(PAINT);
            word = word.add(1);
        }
    }
}

/// Bytes of stack ever in use since it was painted, those of the callers included.
#[inline(never)]
pub fn stack_used() -> u32 {
    let top = &raw const _stack_start;
    let mut word = end().cast_const();
    // SAFETY: memory of the stack.
    while word < top && unsafe { word.read_volatile() } == PAINT {
        // SAFETY: stays within the stack.
        word = unsafe { word.add(1) };
    }
    top as u32 - word as u32
}
