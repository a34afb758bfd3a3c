//! The independent watchdog: fed as long as navigation steps in time.

use backseat_app::{App, Pump, STEP_US};
use embassy_stm32::pac;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};

/// Counts of the watchdog's 32 kHz / 32 until it resets: 0.6 s, within the tolerance of its clock.
const RELOAD: u16 = 600;
/// A step later than this is not in time, µs.
const LATE_US: u64 = 3 * STEP_US;

/// It runs on its own clock, from the first instruction on, and cannot be stopped.
pub struct Watchdog(());

impl Watchdog {
    /// Starts it, before clocks and peripherals are touched; a debugger that halts the core halts it.
    pub fn start() -> Self {
        pac::DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
        // RM0433 49.3.3
        let registers = pac::IWDG1;
        registers.kr().write(|w| w.set_key(Key::START));
        registers.kr().write(|w| w.set_key(Key::ENABLE));
        registers.pr().write(|w| w.set_pr(Pr::DIVIDE_BY32));
        registers.rlr().write(|w| w.set_rl(RELOAD));
        registers.kr().write(|w| w.set_key(Key::RESET));
        Self(())
    }

    /// At start, between its parts.
    pub fn feed(&mut self) {
        pac::IWDG1.kr().write(|w| w.set_key(Key::RESET));
    }

    /// Feeds it unless the last step is overdue. Before the first step the pump waits for a
    /// lock-step clock; under such a clock the host decides when to step.
    pub fn feed_if_in_time(&mut self, app: &App, pump: &Pump, now_us: u64) {
        let late = |stepped_us: u64| now_us.saturating_sub(stepped_us) > LATE_US;
        let waits = now_us < backseat_app::START_US + LATE_US;
        if pump.is_lockstep() || app.stepped_us().map_or(waits, |stepped_us| !late(stepped_us)) {
            self.feed();
        }
    }
}
