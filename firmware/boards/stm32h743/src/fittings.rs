//! Last-resort hardware: its pins, and the voltage of the vehicle's supply.
//!
//! | what | pin | in reset and before the start |
//! |---|---|---|
//! | abort line, output | PE9 | floats: a resistor on the carrier holds it at rest |
//! | drop weight, output | PE11 | the same |
//! | leak detector, input | PE13, pulled to where it is dry | |
//! | supply, analogue input | PC0 (ADC1_INP10) | |
//!
//! What is fitted, and at which level it acts, are parameters; they are read once, at start. A pin of what is not
//! fitted is left as reset leaves it.

use backseat_app::App;
use backseat_app::fitted::FittedPins;
use backseat_app::parameters::Fitted;
use backseat_wire::hostlink::FittingReadings;
use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, SampleTime};
use embassy_stm32::gpio::{Flex, Input, Pull, Speed};
use embassy_stm32::peripherals::{ADC1, PC0, PE9, PE11, PE13};

/// Reference over full scale, V: 16 bits.
const VOLTS_PER_COUNT: f32 = 3.3 / 65_536.0;

/// What is fitted.
pub struct FittedHardware {
    pins: FittedPins<Flex<'static>, Input<'static>>,
    supply: Option<(Adc<'static, ADC1>, Peri<'static, PC0>)>,
    /// The supply over the voltage at the pin.
    ratio: f32,
}

impl FittedHardware {
    /// By the parameters; outputs rest.
    pub fn new(
        app: &App,
        abort_line: Peri<'static, PE9>,
        drop_weight: Peri<'static, PE11>,
        leak: Peri<'static, PE13>,
        (adc, supply): (Peri<'static, ADC1>, Peri<'static, PC0>),
    ) -> Self {
        let settings = &app.parameters().app.fittings;
        let dry = if settings.leak == Fitted::Low { Pull::Up } else { Pull::Down };
        // an output that acts low is high before it drives
        let output = |mut pin: Flex<'static>, fitted: Fitted| {
            pin.set_level((fitted == Fitted::Low).into());
            pin.set_as_output(Speed::Low);
            pin
        };
        Self {
            pins: FittedPins::new(
                settings,
                || output(Flex::new(abort_line), settings.abort_line),
                || output(Flex::new(drop_weight), settings.drop_weight),
                || Input::new(leak, dry),
            ),
            supply: settings.supply.then(|| (Adc::new(adc), supply)),
            ratio: settings.supply_ratio as f32,
        }
    }

    /// After each step: sets the outputs, and reads all of it; `None` where nothing is fitted. Under a host's clock
    /// nothing is at sea, and the outputs rest.
    pub fn exchange(&mut self, app: &App, lockstep: bool) -> Option<FittingReadings> {
        self.pins.set(if lockstep { [false; 2] } else { app.fitting_outputs() });
        let ratio = self.ratio;
        let supply_v = self.supply.as_mut().map(|(adc, pin)| {
            let counts = adc.blocking_read(pin, SampleTime::CYCLES387_5);
            ratio * VOLTS_PER_COUNT * f32::from(counts)
        });
        let readings = FittingReadings { supply_v, ..self.pins.read() };
        (!lockstep && readings != FittingReadings::default()).then_some(readings)
    }
}
