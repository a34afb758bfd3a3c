//! Last-resort hardware of the simulated vehicle: what the board's pins read, and what its outputs do.

use crate::faults::{Fault, FaultKind, FittingFault};
use crate::quantity::{self, settings};
use backseat_wire::hostlink::{FittingReadings, Fittings};

settings! {
    /// `[fittings]`: what is fitted, with the parameters of the board that say so.
    #[derive(Copy)]
    pub struct FittedParts {
        /// An abort line.
        abort_line: bool = false,
        /// What the drop weight weighs in water, kg, part of the vehicle's mass; 0: there is none.
        drop_weight_kg: f64 as "quantity::non_negative" = 0.0,
        /// A leak detector.
        leak_detector: bool = false,
        /// The vehicle's supply, V; 0: it is not measured.
        supply_v: f64 as "quantity::non_negative" = 0.0,
        /// Below it the supply is at its end, V.
        supply_last_v: f64 as "quantity::non_negative" = 0.0,
    }
}

impl FittedParts {
    /// The board's parameters; none where nothing is fitted.
    pub(crate) fn parameters(&self) -> Vec<(String, f64)> {
        let flag = |fitted: bool| f64::from(u8::from(fitted));
        if *self == Self::default() {
            return Vec::new();
        }
        [
            ("app.abort_line", flag(self.abort_line)),
            ("app.drop_weight", flag(self.drop_weight_kg > 0.0)),
            ("app.leak_detector", flag(self.leak_detector)),
            ("app.supply_measured", flag(self.supply_v > 0.0)),
            ("app.supply_last_v", self.supply_last_v),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .into()
    }

    /// What the pins read at a time, with the outputs as the board has last told of them.
    pub(crate) fn read(&self, time_us: u64, faults: &[Fault], told: &Fittings) -> FittingReadings {
        let acting = || faults.iter().filter(|fault| fault.acts(time_us)).map(|fault| fault.kind);
        let is_wet = acting().any(|kind| kind == FaultKind::Fitting(FittingFault::Leak));
        let dip_v = acting().find_map(|kind| match kind {
            FaultKind::Fitting(FittingFault::SupplyDip { supply_v }) => Some(supply_v),
            _ => None,
        });
        FittingReadings {
            abort_line: self.abort_line.then_some(told.aborts),
            drop_weight: (self.drop_weight_kg > 0.0).then_some(told.released.is_some()),
            leak: self.leak_detector.then_some(is_wet),
            supply_v: (self.supply_v > 0.0).then_some(dip_v.unwrap_or(self.supply_v) as f32),
        }
    }
}
