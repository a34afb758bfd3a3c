//! Pins of last-resort hardware, by their traits: a board names its pins, the parameters say what is fitted to them.

use crate::parameters::{Fitted, FittingSettings};
use backseat_wire::hostlink::FittingReadings;
use embedded_hal::digital::{InputPin, OutputPin};

/// A pin with its polarity.
#[derive(Debug)]
struct Wired<P> {
    pin: P,
    active_high: bool,
}

impl<P> Wired<P> {
    fn new(fitted: Fitted, make: impl FnOnce() -> P) -> Option<Self> {
        fitted.is_fitted().then(|| Self { pin: make(), active_high: fitted == Fitted::High })
    }
}

impl<P: InputPin> Wired<P> {
    fn is_active(&mut self) -> Option<bool> {
        self.pin.is_high().ok().map(|high| high == self.active_high)
    }
}

impl<P: OutputPin> Wired<P> {
    fn set(&mut self, active: bool) {
        // a pin that refuses is seen when it is read
        let _ = self.pin.set_state((active == self.active_high).into());
    }
}

/// The pins that are fitted; those of outputs are read back.
#[derive(Debug)]
pub struct FittedPins<O, I> {
    abort_line: Option<Wired<O>>,
    drop_weight: Option<Wired<O>>,
    leak: Option<Wired<I>>,
}

impl<O: OutputPin + InputPin, I: InputPin> FittedPins<O, I> {
    /// As the parameters at the start of the board have it; a pin of what is not fitted is not made. Outputs rest.
    pub fn new(
        settings: &FittingSettings,
        abort_line: impl FnOnce() -> O,
        drop_weight: impl FnOnce() -> O,
        leak: impl FnOnce() -> I,
    ) -> Self {
        let mut pins = Self {
            abort_line: Wired::new(settings.abort_line, abort_line),
            drop_weight: Wired::new(settings.drop_weight, drop_weight),
            leak: Wired::new(settings.leak, leak),
        };
        pins.set([false; 2]);
        pins
    }

    /// Abort line and drop weight.
    pub fn set(&mut self, [aborts, falls]: [bool; 2]) {
        for (wired, active) in [(&mut self.abort_line, aborts), (&mut self.drop_weight, falls)] {
            if let Some(wired) = wired {
                wired.set(active);
            }
        }
    }

    /// What all of them say; the supply is the board's to add.
    pub fn read(&mut self) -> FittingReadings {
        FittingReadings {
            abort_line: self.abort_line.as_mut().and_then(Wired::is_active),
            drop_weight: self.drop_weight.as_mut().and_then(Wired::is_active),
            leak: self.leak.as_mut().and_then(Wired::is_active),
            supply_v: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;
    use embedded_hal::digital::ErrorType;

    struct Level(bool);

    impl ErrorType for Level {
        type Error = Infallible;
    }

    impl OutputPin for Level {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.0 = false;
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Infallible> {
            self.0 = true;
            Ok(())
        }
    }

    impl InputPin for Level {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            Ok(self.0)
        }

        fn is_low(&mut self) -> Result<bool, Infallible> {
            Ok(!self.0)
        }
    }

    #[test]
    fn polarity_is_of_the_pin_and_what_is_not_fitted_is_not_touched() {
        let settings = FittingSettings { drop_weight: Fitted::Low, leak: Fitted::Low, ..FittingSettings::NONE };
        let mut pins =
            FittedPins::new(&settings, || -> Level { panic!("not fitted") }, || Level(false), || Level(true));
        let read = |drop_weight, leak| FittingReadings {
            drop_weight: Some(drop_weight),
            leak: Some(leak),
            ..FittingReadings::default()
        };
        assert_eq!(pins.read(), read(false, false), "an output that acts low rests high");
        pins.set([true, true]);
        if let Some(leak) = &mut pins.leak {
            leak.pin.0 = false;
        }
        assert_eq!(pins.read(), read(true, true));
        assert!(!pins.drop_weight.unwrap().pin.0);
    }
}
