//! The clock tree: 480 MHz from the 8 MHz that the ST-LINK puts on HSE, and without them from the internal oscillator.
//!
//! The ST-LINK may start later than this chip does. The board then starts from the internal oscillator and changes over
//! when the 8 MHz come: both ways give every bus the same frequency. Where they end, the chip's clock security system
//! goes on from the internal oscillator, and a handler gives the buses their frequency back.

use backseat_wire::hostlink::Oscillator;
use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m_rt::exception;
use embassy_stm32::pac::rcc::vals::{Pllsrc, Sw};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, HSIPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
    VoltageScale, mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, pac};

/// Looks before something counts as not coming: some 8 ms at 64 MHz. A PLL locks within 0.15 ms (DS12110).
const LOOKS: u32 = 100_000;

/// HSE has ended, and nobody was told yet.
static LOST: AtomicBool = AtomicBool::new(false);

/// The clock on HSE has ended: the core runs from HSI, PLL1 is off (RM0433 8.5.3).
#[exception]
unsafe fn NonMaskableInt() {
    if pac::RCC.cifr().read().hsecssf() {
        pac::RCC.cicr().write(|w| w.set_hsecssc(true));
        defmt::assert!(relock(Pllsrc::HSI, PllPreDiv::DIV8), "no PLL");
        LOST.store(true, Ordering::Relaxed);
    }
}

/// Has HSE watched from now on.
fn watch() {
    pac::RCC.cr().modify(|w| w.set_hsecsson(true));
}

/// Whether the clock on HSE has ended since the last call. It is not asked again until the next start.
pub fn take_lost() -> bool {
    LOST.swap(false, Ordering::Relaxed)
}

/// Switches HSE on and looks whether there is a clock on it; the HAL would wait for it for ever.
pub fn external() -> Oscillator {
    switch_on_external();
    if comes(is_external_ready) { Oscillator::Crystal } else { Oscillator::Internal }
}

/// The bypass first: RM0433 lets it be written while HSE is off alone.
fn switch_on_external() {
    pac::RCC.cr().modify(|w| w.set_hsebyp(true));
    pac::RCC.cr().modify(|w| w.set_hseon(true));
}

fn is_external_ready() -> bool {
    pac::RCC.cr().read().hserdy()
}

fn comes(look: impl Fn() -> bool) -> bool {
    (0..LOOKS).any(|_| look())
}

/// Core 480 MHz (VOS0), AXI and AHB 240 MHz, APB 120 MHz, timers 240 MHz (RM0433 8.5, DS12110 5.3.1).
pub fn config(oscillator: Oscillator) -> Config {
    let external = oscillator == Oscillator::Crystal;
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hsi = Some(HSIPrescaler::DIV1);
    rcc.hse = external.then_some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    rcc.csi = false;
    rcc.hsi48 = None;
    // 8 MHz into the PLL either way: 8 × 120 = 960 MHz, half of it for the core. A tenth for SPI: 96 MHz / 256 are
    // the 400 kHz at most that a card bears until it is identified.
    rcc.pll1 = Some(Pll {
        source: if external { PllSource::HSE } else { PllSource::HSI },
        prediv: if external { PllPreDiv::DIV1 } else { PllPreDiv::DIV8 },
        mul: PllMul::MUL120,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV10),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.d1c_pre = AHBPrescaler::DIV1;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    rcc.voltage_scale = VoltageScale::Scale0;
    // HSI, which is always on: no PLL of its own for a reading in 0.1 s
    rcc.mux.adcsel = mux::Adcsel::PER;
    config
}

/// What the core runs from, after the HAL has set up the tree.
pub struct ClockSource {
    /// HSE has not come yet.
    waits: bool,
}

impl ClockSource {
    /// Goes on waiting for HSE where it has not come: the HAL has switched it off.
    pub fn new(oscillator: Oscillator) -> Self {
        let waits = oscillator == Oscillator::Internal;
        if waits {
            switch_on_external();
        } else {
            watch();
        }
        Self { waits }
    }

    /// Changes over to HSE when it has come; whether it did.
    ///
    /// For a tenth of a millisecond the core runs from HSI at 64 MHz and board time stands nearly still; a byte that is
    /// on a line may be lost.
    pub fn change_over(&mut self) -> bool {
        if !self.waits || !is_external_ready() {
            return false;
        }
        self.waits = false;
        let changed = relock(Pllsrc::HSE, PllPreDiv::DIV1);
        if changed {
            watch();
        } else {
            // a clock that comes and goes: not asked again
            defmt::assert!(relock(Pllsrc::HSI, PllPreDiv::DIV8), "no PLL");
        }
        changed
    }
}

/// Gives PLL1, which is the only one in use, another source; whether it locks. Source and divider can be written while
/// all PLLs are off alone (RM0433 8.7.10).
fn relock(source: Pllsrc, divider: PllPreDiv) -> bool {
    let rcc = pac::RCC;
    rcc.cfgr().modify(|w| w.set_sw(Sw::HSI));
    if !comes(|| rcc.cfgr().read().sws() == Sw::HSI) {
        return false;
    }
    rcc.cr().modify(|w| w.set_pllon(0, false));
    if !comes(|| !rcc.cr().read().pllrdy(0)) {
        return false;
    }
    rcc.pllckselr().modify(|w| {
        w.set_pllsrc(source);
        w.set_divm(0, divider);
    });
    rcc.cr().modify(|w| w.set_pllon(0, true));
    if !comes(|| rcc.cr().read().pllrdy(0)) {
        return false;
    }
    rcc.cfgr().modify(|w| w.set_sw(Sw::PLL1_P));
    comes(|| rcc.cfgr().read().sws() == Sw::PLL1_P)
}
