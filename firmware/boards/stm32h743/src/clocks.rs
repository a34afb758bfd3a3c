//! The clock tree: 480 MHz from the 8 MHz that the ST-LINK puts on HSE.

use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, HSIPrescaler, Hse, HseMode, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
    VoltageScale,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, pac};

/// HSE counts as dead after so many looks, some 20 ms at 64 MHz.
const HSE_LOOKS: u32 = 100_000;

/// What the core runs from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum Source {
    /// HSE: as good as the crystal of the ST-LINK, some 20 ppm.
    External,
    /// HSI, 1 %: there is no clock on HSE. Good enough to steer and talk; between two edges of the
    /// pulse per second it drifts by up to 10 ms, 15 m of range.
    Internal,
}

/// Looks whether there is a clock on HSE; the HAL would wait for it for ever.
pub fn source() -> Source {
    pac::RCC.cr().modify(|w| {
        w.set_hsebyp(true);
        w.set_hseon(true);
    });
    for _ in 0..HSE_LOOKS {
        if pac::RCC.cr().read().hserdy() {
            return Source::External;
        }
    }
    pac::RCC.cr().modify(|w| w.set_hseon(false));
    Source::Internal
}

/// Core 480 MHz (VOS0), AXI and AHB 240 MHz, APB 120 MHz, timers 240 MHz (RM0433 8.5, DS12110 5.3.1).
pub fn config(source: Source) -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hsi = Some(HSIPrescaler::DIV1);
    rcc.hse = (source == Source::External).then_some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
    rcc.csi = false;
    rcc.hsi48 = None;
    // 8 MHz into the PLL either way: 8 × 120 = 960 MHz, half of it for the core, an eighth for SPI
    rcc.pll1 = Some(Pll {
        source: if source == Source::External { PllSource::HSE } else { PllSource::HSI },
        prediv: if source == Source::External { PllPreDiv::DIV1 } else { PllPreDiv::DIV8 },
        mul: PllMul::MUL120,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV8),
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
    config
}
