//! Reset cause, brown-out level, supply voltage detector.
//!
//! When the supply falls below the detector's threshold, an interrupt tells thread mode, which closes the log while it can.

use backseat_wire::hostlink::ResetCause;
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::{interrupt, pac};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

/// Detector threshold 2.85 V, falling (RM0433 6.8.1, PLS): above it flash may be written.
const DETECTOR_LEVEL: u8 = 6;
/// Wanted brown-out level, 2.7 V (RM0433 4.9.8, BOR_LEV).
const BROWN_OUT_LEVEL: u8 = 3;
/// Line of the detector at EXTI; it rises when the supply falls (RM0433 6.6.2, table of EXTI events).
const DETECTOR_LINE: usize = 16;

/// How often the supply has fallen since start.
static DIPS: AtomicU32 = AtomicU32::new(0);
/// To thread mode: it falls now.
pub static FALLS: Signal<CriticalSectionRawMutex, ()> = Signal::new();

#[interrupt]
fn PVD_AVD() {
    pac::EXTI.pr(0).write(|w| w.set_line(DETECTOR_LINE, true));
    DIPS.fetch_add(1, Ordering::Relaxed);
    FALLS.signal(());
}

/// How often the supply has fallen since start.
pub fn dips() -> u32 {
    DIPS.load(Ordering::Relaxed)
}

/// As the option bytes have it.
pub fn brown_out_level() -> u8 {
    pac::FLASH.optsr_cur().read().bor_lev()
}

/// Why the board started; the flags are cleared for the next time.
pub fn reset_cause() -> ResetCause {
    let flags = pac::RCC.rsr().read();
    pac::RCC.rsr().modify(|w| w.set_rmvf(true));
    // Every cause pulls the pin too, and switching on is a brown-out too (RM0433 8.4.4): the most
    // particular one counts.
    match () {
        () if flags.porrstf() => ResetCause::PowerOn,
        () if flags.borrstf() => ResetCause::BrownOut,
        () if flags.iwdg1rstf() || flags.wwdg1rstf() => ResetCause::Watchdog,
        () if flags.sftrstf() => ResetCause::Software,
        () if flags.lpwrrstf() => ResetCause::Other,
        () if flags.pinrstf() => ResetCause::Pin,
        () => ResetCause::Other,
    }
}

/// Starts the supply voltage detector and reports the brown-out level, which is an option byte and
/// stays as it is.
pub fn start() {
    pac::PWR.cr1().modify(|w| {
        w.set_pls(DETECTOR_LEVEL);
        w.set_pvde(true);
    });
    pac::EXTI.rtsr(0).modify(|w| w.set_line(DETECTOR_LINE, true));
    pac::EXTI.imr(0).modify(|w| w.set_line(DETECTOR_LINE, true));
    // SAFETY: what it shares are atomic. Its priority is that of all but the app: none is on top of another.
    unsafe { interrupt::PVD_AVD.enable() };
    let level = brown_out_level();
    if level == BROWN_OUT_LEVEL {
        defmt::info!("brown-out level {=u8}: 2.7 V", level);
    } else {
        defmt::warn!("brown-out level {=u8} instead of {=u8}: see README, option bytes", level, BROWN_OUT_LEVEL);
    }
}

/// The supply is above the detector's threshold.
pub fn is_good() -> bool {
    !pac::PWR.csr1().read().pvdo()
}
