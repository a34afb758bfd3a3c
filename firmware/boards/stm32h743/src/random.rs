//! A number that no earlier start has had, from the chip's generator of random numbers (RM0433 34).

use embassy_stm32::pac;

/// Looks before the generator counts as not answering: a number takes 213 cycles of 48 MHz at most, some 4.4 µs.
const LOOKS: u32 = 100_000;

/// 64 random bits; 0 where the generator does not answer. It and its oscillator are off again afterwards.
pub fn number() -> u64 {
    pac::RCC.cr().modify(|w| w.set_hsi48on(true));
    pac::RCC.ahb2enr().modify(|w| w.set_rngen(true));
    pac::RNG.cr().write(|w| w.set_rngen(true));
    // the first after switching on is only there for the second to differ from
    let words = [word(), word(), word()];
    pac::RNG.cr().write(|w| w.set_rngen(false));
    pac::RCC.ahb2enr().modify(|w| w.set_rngen(false));
    pac::RCC.cr().modify(|w| w.set_hsi48on(false));
    match words {
        [Some(first), Some(low), Some(high)] if first != low && low != high => u64::from(high) << 32 | u64::from(low),
        _ => 0,
    }
}

fn word() -> Option<u32> {
    let there = (0..LOOKS).any(|_| pac::RNG.sr().read().drdy());
    let fault = pac::RNG.sr().read();
    (there && !fault.seis() && !fault.ceis()).then(|| pac::RNG.dr().read())
}
