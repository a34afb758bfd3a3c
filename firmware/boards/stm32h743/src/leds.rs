//! LD1, LD2, LD3: navigating, link, fault.

use backseat_app::{App, STEP_US};
use backseat_wire::hostlink::{Mode, Port};
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::peripherals::{PB0, PB14, PE1};

/// A frontseat that was not heard for this long is silent, steps.
const SILENT_STEPS: u32 = 20;
/// Half a period of blinking.
const BLINK_US: u64 = 5 * STEP_US;

/// The three user LEDs.
pub struct Leds {
    navigating: Output<'static>,
    link: Output<'static>,
    fault: Output<'static>,
    heard: u32,
    silent_steps: u32,
}

impl Leds {
    /// All off.
    pub fn new(green: Peri<'static, PB0>, yellow: Peri<'static, PE1>, red: Peri<'static, PB14>) -> Self {
        Self {
            navigating: Output::new(green, Level::Low, Speed::Low),
            link: Output::new(yellow, Level::Low, Speed::Low),
            fault: Output::new(red, Level::Low, Speed::Low),
            heard: 0,
            silent_steps: SILENT_STEPS,
        }
    }

    /// After each step; `warning` blinks the fault LED.
    pub fn show(&mut self, app: &App, now_us: u64, warning: bool) {
        let blink = (now_us / BLINK_US).is_multiple_of(2);
        let (mode, _) = app.mode();
        let fault = matches!(mode, Mode::Lost | Mode::Safe) || warning && blink;
        let heard = app.health().accepted(Port::Frontseat);
        self.silent_steps = if heard == self.heard { self.silent_steps.saturating_add(1) } else { 0 };
        self.heard = heard;
        self.navigating.set_level((mode == Mode::Navigating || mode == Mode::Degraded && blink).into());
        self.link.set_level((self.silent_steps < SILENT_STEPS).into());
        self.fault.set_level(fault.into());
    }
}
