//! What depth and attitude do not tell: while no position and no velocity is heard, and at the surface.
//!
//! They go on, and the model correlates them with speed, water and place. What they seem to tell of these over hours is
//! mostly the error of the model in heave and pitch, whose mean is not zero; at the surface, what waves do with depth and
//! pitch together. So these states are only considered (S. F. Schmidt 1966): the gain on them is zero, and their
//! uncertainty stays in P.

use super::cekf::Filter;
use crate::navigation::algebra::layout::EFFECTS;
use crate::navigation::interface::config::ProcessModel;
use crate::navigation::interface::effect_states::StateParameter;
use crate::navigation::interface::measurement::Sensor;
use crate::state::{U, V, X, Y, Z};

/// From so long a silence on, µs: ten packets.
const SILENCE_US: u64 = 300_000_000;
/// Square of the frequency of the semidiurnal tide, 12.42 h, rad²/s².
const TIDE_OMEGA2: f64 = {
    let omega = core::f64::consts::TAU / (12.42 * 3600.0);
    omega * omega
};

impl Filter {
    /// Takes down that a sensor was used.
    pub(super) fn hear(&mut self, sensor: Sensor) {
        if !matches!(sensor, Sensor::Depth | Sensor::Attitude | Sensor::Rates | Sensor::ShipGnss) {
            self.heard_us = self.time_us;
        }
    }

    /// No position and no velocity has been used for five minutes.
    pub(in crate::navigation) fn is_alone(&self) -> bool {
        self.time_us.saturating_sub(self.heard_us) > SILENCE_US
    }

    /// Whether a sensor reads what waves do at the surface.
    pub(super) fn is_moved_by_waves(&self, sensor: Sensor) -> bool {
        matches!(sensor, Sensor::Depth | Sensor::Attitude | Sensor::Rates)
            && self.config.process_model == ProcessModel::Dynamic
            && self.config.is_at_surface(self.x.vehicle[Z])
    }

    /// Gives back what an update took from the uncertainty of what its sensor does not tell, and takes the gain on it. A
    /// filter that knows its vehicle knows the speed from the model, and goes on as before where it is alone.
    #[cold]
    #[inline(never)]
    pub(super) fn consider(&mut self, by_waves: bool) {
        let is_uncertain = |parameter| matches!(parameter, StateParameter::LogFactor(_));
        if !by_waves && !self.config.effect_states.iter().any(|state| is_uncertain(state.parameter)) {
            return;
        }
        let effects = (EFFECTS..).zip(self.config.effect_states.iter());
        // buoyancy and trim go on: they take what the surface does in heave and pitch
        let is_untold = |parameter: StateParameter| {
            parameter.is_told_by_place() || by_waves && !matches!(parameter, StateParameter::Effect(_))
        };
        let untold = effects.filter(|(_, state)| is_untold(state.parameter)).map(|(at, _)| 1 << at);
        let first = 1 << X | 1 << Y | 1 << U | u64::from(by_waves) << V;
        let mut considered: u64 = untold.fold(first, |bits, bit| bits | bit);
        while considered != 0 {
            let i = considered.trailing_zeros() as usize;
            let gain = self.gain.get(i).copied().unwrap_or_default();
            let mut others = considered;
            while others != 0 {
                let j = others.trailing_zeros() as usize;
                self.p.add(i, j, gain * self.w.get(j).copied().unwrap_or_default());
                others &= others - 1;
            }
            if let Some(gain) = self.gain.get_mut(i) {
                *gain = 0.0;
            }
            considered &= considered - 1;
        }
    }

    /// The last update left states as they were that are only considered: the place is always among them.
    pub(super) fn considers(&self) -> bool {
        let of = |numbers: &[f64]| numbers.get(X).is_some_and(|number| *number != 0.0);
        of(&self.w) && !of(&self.gain)
    }

    /// What the rate of the current takes of the current within a step.
    pub(super) fn turn_of_tide(&self, step_s: f64) -> f64 {
        if self.is_alone() { -TIDE_OMEGA2 * step_s } else { 0.0 }
    }

    /// The rates of the current over a step: the tide turns, r' = -ω² c. While somebody is heard they only walk.
    #[cold]
    #[inline(never)]
    pub(super) fn turn_tide(&mut self, current: usize, rate: usize, step_s: f64) {
        let a = self.turn_of_tide(step_s);
        for (current, rate) in [(current, rate), (current + 1, rate + 1)] {
            self.x.add_tail(rate, a * self.x.get(current));
            let variance = a * (2.0 * self.p.get(rate, current) + a * self.p.get(current, current));
            for j in (0..self.dimension()).filter(|j| *j != rate) {
                self.p.add(rate, j, a * self.p.get(current, j));
            }
            self.p.add(rate, rate, variance);
        }
    }
}
