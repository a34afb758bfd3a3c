//! By how much the vehicle moves otherwise than the nominal filter believes, as the sensors say on average.
//!
//! A filter that holds a broken fin for whole turns the vehicle too much in every step, and readings turn it back: it is
//! off in rates, pitch and heave for good, and the inflow at the fins with it, by a degree or two. Averages over some
//! seconds are not:
//!
//!   rates, pitch   ν (1 − ½ h K)       the estimate's error, halfway between before and after the reading is fused
//!   sinking        Σ K_z ν per second  what readings move the depth by, its own and all others
//!   heave          δw = sinking + u δθ

use crate::navigation::algebra::observer::ScalarUpdate;
use crate::navigation::interface::measurement::Sensor;
use crate::state::{P, THETA, U, VehicleState, W, Z};

/// Averages forget within this time, s: the vehicle pitches and turns within less.
const FORGETS_S: f64 = 10.0;

/// A sum that forgets, and how much it has seen.
#[derive(Clone, Copy)]
struct Mean {
    sum: f64,
    weight: f64,
}

impl Mean {
    const ZERO: Self = Self { sum: 0.0, weight: 0.0 };

    fn forget(&mut self, share: f64) {
        self.sum -= share * self.sum;
        self.weight -= share * self.weight;
    }

    fn take(&mut self, value: f64) {
        self.sum += value;
        self.weight += 1.0;
    }

    /// One value of zero beside what it has seen.
    fn value(&self, one: f64) -> f64 {
        self.sum / (self.weight + one)
    }
}

/// What the scalars of the measurement under way say.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Says {
    Nothing = 0,
    Rates,
    Attitude,
}

/// Motion by the sensors less motion by the filter.
pub(super) struct Motion {
    says: Says,
    rates: [Mean; 3],
    pitch: Mean,
    /// Metres, and seconds.
    sinking: Mean,
}

impl Motion {
    pub(super) const NONE: Self =
        Self { says: Says::Nothing, rates: [Mean::ZERO; 3], pitch: Mean::ZERO, sinking: Mean::ZERO };

    /// Time passes.
    pub(super) fn step(&mut self, step_s: f64) {
        let share = (step_s / FORGETS_S).min(1.0);
        self.rates.iter_mut().chain([&mut self.pitch, &mut self.sinking]).for_each(|mean| mean.forget(share));
        self.sinking.weight += step_s;
    }

    /// A measurement is about to be fused.
    pub(super) fn will_fuse(&mut self, sensor: Sensor) {
        self.says = match sensor {
            Sensor::Rates => Says::Rates,
            Sensor::Attitude => Says::Attitude,
            _ => Says::Nothing,
        };
    }

    /// A scalar of it has been.
    pub(super) fn take(&mut self, axis: u8, update: &ScalarUpdate<'_>) {
        let off = update.innovation * (1.0 - 0.5 * update.row.dot(update.gain));
        match (self.says, axis) {
            (Says::Rates, axis) => {
                self.rates.iter_mut().skip(usize::from(axis)).take(1).for_each(|mean| mean.take(off))
            }
            (Says::Attitude, 1) => self.pitch.take(off),
            _ => {}
        }
        self.sinking.sum += update.gain.get(Z).copied().unwrap_or(0.0) * update.innovation;
    }

    /// The state that moves as the sensors say.
    pub(super) fn of(&self, x: &VehicleState) -> VehicleState {
        let mut x = *x;
        let pitch_rad = self.pitch.value(1.0);
        x[W] += self.sinking.value(0.1) + x[U] * pitch_rad;
        x[THETA] += pitch_rad;
        for (axis, rate) in self.rates.iter().enumerate() {
            x[P + axis] += rate.value(1.0);
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::navigation::algebra::row::Row;
    use crate::state::{Q, VEHICLE_STATES};

    /// Half a minute of readings, ten a second, with the same innovation.
    fn seen(sensor: Sensor, axis: u8, state: usize, innovation: f64, gain: f64) -> VehicleState {
        let mut motion = Motion::NONE;
        let (row, mut gains) = (Row::unit(state), [0.0; VEHICLE_STATES]);
        gains[state] = gain;
        for _ in 0..300 {
            motion.step(0.1);
            motion.will_fuse(sensor);
            motion.take(axis, &ScalarUpdate { row: &row, gain: &gains, innovation, variance: 1.0, considers: false });
        }
        let mut x = VehicleState::zeros();
        x[U] = 1.5;
        motion.of(&x)
    }

    #[test]
    fn val_a_filter_that_is_turned_back_in_every_step_is_off_by_the_middle_of_before_and_after() {
        // from 0.01 before to 0.005 rad/s after
        let rate = seen(Sensor::Rates, 1, Q, 0.01, 0.5)[Q];
        assert!((rate / 0.0075 - 1.0).abs() < 0.02, "{rate}");
        let pitch = seen(Sensor::Attitude, 1, THETA, 0.02, 0.0);
        assert!((pitch[THETA] / 0.02 - 1.0).abs() < 0.02 && (pitch[W] / 0.03 - 1.0).abs() < 0.02, "{pitch}");
    }

    #[test]
    fn val_what_depth_is_moved_by_is_sinking() {
        // 0.1 m of innovation, a hundredth of it taken, ten times a second
        let sinking = seen(Sensor::Depth, 0, Z, 0.1, 0.01)[W];
        assert!((sinking / 0.01 - 1.0).abs() < 0.02, "{sinking}");
    }
}
