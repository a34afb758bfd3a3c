//! The independent watchdog. What feeds it is [`backseat_app::StepWatch`]: a navigation step that ran in time.

use embassy_stm32::pac;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};

/// Counts of the watchdog's 32 kHz / 32 until it resets: 0.6 s, within the tolerance of its clock.
const RELOAD: u16 = 600;

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

    /// Another 0.6 s.
    pub fn feed(&mut self) {
        pac::IWDG1.kr().write(|w| w.set_key(Key::RESET));
    }
}
