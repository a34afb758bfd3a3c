//! Reset cause, brown-out level, supply voltage detector.

use backseat_wire::hostlink::ResetCause;
use embassy_stm32::pac;

/// Detector threshold 2.85 V, falling (RM0433 6.8.1, PLS): above it flash may be written.
const DETECTOR_LEVEL: u8 = 6;
/// Wanted brown-out level, 2.7 V (RM0433 4.9.8, BOR_LEV).
const BROWN_OUT_LEVEL: u8 = 3;

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
    let level = pac::FLASH.optsr_cur().read().bor_lev();
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
