//! What the board measures of itself: load, stacks, wrong bits in its memory.
//!
//! Time is that of TIM5, µs: a step takes thousands of them.

use crate::supply;
use backseat_wire::hostlink::{Hardware, Stack};
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_stm32::pac;

/// The load is told of so long, µs.
const WINDOW_US: u64 = 1_000_000;
/// What no stack holds by chance as far as the eye reaches.
const PAINT: u32 = 0xA5A5_A5A5;
/// Above the place where thread mode paints its own stack, bytes: its present frames.
const OWN_FRAMES: usize = 512;
/// RAMECC1 (RM0433 3.3): its monitors of both halves of DTCM, which are written as a whole before anything is read. AXI
/// SRAM is not: what was never written has any code, and its monitor would complain of nothing.
const RAM_MONITORS: [usize; 2] = [0x5200_9060, 0x5200_9080];
/// Of a monitor's CR: errors are kept.
const RAM_LATCH: u32 = 1 << 5;
/// Of its SR.
const fn ram_status(monitor: usize) -> *mut u32 {
    (monitor + 4) as *mut u32
}
/// A single error corrected; a double one.
const RAM_CORRECTED: u32 = 1 << 0;
const RAM_LOST: u32 = 3 << 1;

unsafe extern "C" {
    // of memory.x
    static _stack_start: u32;
    static _stack_end: u32;
    static _thread_stack_start: u32;
    static _thread_stack_end: u32;
}

/// Used at most: interrupts', thread mode's. Thread mode looks, the app tells.
static USED: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];

/// End and start of both.
pub fn stacks() -> [[usize; 2]; 2] {
    let at = |symbol: *const u32| symbol as usize;
    [
        [at(&raw const _stack_end), at(&raw const _stack_start)],
        [at(&raw const _thread_stack_end), at(&raw const _thread_stack_start)],
    ]
}

/// Paints what is unused of both stacks, in thread mode, before any interrupt is enabled.
pub fn paint_stacks() {
    let [[end, start], [own_end, _]] = stacks();
    let own_start = (cortex_m::register::psp::read() as usize).saturating_sub(OWN_FRAMES);
    for (end, start) in [(end, start), (own_end, own_start)] {
        for place in (end..start).step_by(4) {
            // SAFETY: nothing uses the interrupts' stack yet, and thread mode's below its present frames is free.
            unsafe { (place as *mut u32).write_volatile(PAINT) };
        }
    }
}

/// How much of both stacks was ever used, bytes; in thread mode or at the end, as it may take a while.
pub fn stacks_used() -> [u32; 2] {
    stacks().map(|[end, start]| {
        // SAFETY: a stack is readable; what a word holds is of no matter.
        let is_painted = |place: &usize| unsafe { (*place as *const u32).read_volatile() } == PAINT;
        let untouched = (end..start).step_by(4).take_while(is_painted).count();
        (start - end - 4 * untouched) as u32
    })
}

/// Looks at it, for the app to tell.
pub fn look_at_stacks() {
    stacks_used().into_iter().zip(&USED).for_each(|(bytes, used)| used.store(bytes, Ordering::Relaxed));
}

/// Since start.
pub struct Vitals {
    longest_step_us: u32,
    /// Busy in this window, which ends then.
    busy_us: u64,
    ends_us: u64,
    load_permille: u16,
    wrong_bits: [u32; 2],
}

impl Vitals {
    /// Nothing measured yet.
    pub fn new() -> Self {
        for monitor in RAM_MONITORS {
            // SAFETY: registers that nobody else uses; what start-up found is forgotten.
            unsafe {
                (monitor as *mut u32).write_volatile(RAM_LATCH);
                ram_status(monitor).write_volatile(0);
            }
        }
        Self { longest_step_us: 0, busy_us: 0, ends_us: 0, load_permille: 0, wrong_bits: [0; 2] }
    }

    /// The app's level has worked.
    pub fn worked(&mut self, from_us: u64, to_us: u64) {
        self.busy_us += to_us - from_us;
        if to_us >= self.ends_us {
            let window_us = WINDOW_US + (to_us - self.ends_us).min(WINDOW_US);
            self.load_permille = (1000 * self.busy_us / window_us).min(1000) as u16;
            (self.busy_us, self.ends_us) = (0, to_us + WINDOW_US);
        }
    }

    /// A step has run.
    pub fn stepped(&mut self, took_us: u64) {
        self.longest_step_us = self.longest_step_us.max(u32::try_from(took_us).unwrap_or(u32::MAX));
    }

    /// For the host, after each step.
    pub fn report(&mut self, lost_edges: u32) -> Hardware {
        self.look_for_wrong_bits();
        let mut stacks = stacks().map(|[end, start]| Stack { used: 0, room: (start - end) as u32 });
        stacks.iter_mut().zip(&USED).for_each(|(stack, used)| stack.used = used.load(Ordering::Relaxed));
        Hardware {
            supply_dips: supply::dips(),
            brown_out_level: supply::brown_out_level(),
            wrong_bits: self.wrong_bits,
            longest_step_us: self.longest_step_us,
            load_permille: self.load_permille,
            lost_edges,
            stacks,
        }
    }

    /// Flags stay until they are cleared: what is counted are steps with an error, for each memory.
    fn look_for_wrong_bits(&mut self) {
        let [corrected, lost] = &mut self.wrong_bits;
        // The bank that runs. A word of the other one that reads wrong is its reader's own to judge.
        let flash = pac::FLASH.bank(0);
        let status = flash.sr().read();
        *corrected = corrected.saturating_add(u32::from(status.sneccerr1()));
        *lost = lost.saturating_add(u32::from(status.dbeccerr()));
        if status.sneccerr1() || status.dbeccerr() {
            flash.ccr().write(|w| {
                w.set_clr_sneccerr(true);
                w.set_clr_dbeccerr(true);
            });
        }
        for register in RAM_MONITORS.map(ram_status) {
            // SAFETY: a register that nobody else uses.
            let status = unsafe { register.read_volatile() };
            *corrected = corrected.saturating_add(u32::from(status & RAM_CORRECTED != 0));
            *lost = lost.saturating_add(u32::from(status & RAM_LOST != 0));
            if status & (RAM_CORRECTED | RAM_LOST) != 0 {
                // SAFETY: as above; flags are cleared by 0
                unsafe { register.write_volatile(0) };
            }
        }
    }
}
