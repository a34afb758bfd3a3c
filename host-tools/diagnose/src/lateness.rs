//! What comes late: commands that the actuators follow, readings of sensors that lag, as a model moves the vehicle between
//! them.

use backseat_core::dynamics::ActuatorInput;
use backseat_core::effects::Step;
use backseat_core::state::{P, PSI, U, VehicleState, X, Y};
use std::collections::VecDeque;

/// ω × arm, m/s.
pub(crate) fn swing([p, q, r]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [q * z - r * y, r * x - p * z, p * y - q * x]
}

/// A first-order lag: by how much its output is behind a quantity that moves at a rate.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Lag(pub(crate) f64);

impl Lag {
    /// Exact where the rate is constant over the time `h_s`; a lag below zero leads by rate times lag.
    pub(crate) fn advance(&mut self, lag_s: f64, h_s: f64, rate: f64) {
        let settled = rate * lag_s;
        let left = if lag_s > 0.0 { (-h_s / lag_s).exp() } else { 0.0 };
        self.0 = settled + (self.0 - settled) * left;
    }
}

/// Commands of the last steps: when each step ended, s, and what was commanded in it.
#[derive(Clone, Debug, Default)]
pub struct DelayLine(VecDeque<(f64, ActuatorInput)>);

impl DelayLine {
    /// The mean of what was commanded over a step that lies `delay_s` before this one, whose command is `now`.
    pub fn delayed(&mut self, delay_s: f64, step: &Step, now: &ActuatorInput) -> ActuatorInput {
        self.0.push_back((step.t_s + step.h_s, *now));
        let from_s = step.t_s - delay_s;
        let to_s = from_s + step.h_s;
        while self.0.front().is_some_and(|(end_s, _)| *end_s <= from_s) && self.0.len() > 1 {
            self.0.pop_front();
        }
        let mut mean = ActuatorInput::default();
        let mut begin_s = from_s;
        for (end_s, input) in &self.0 {
            let share = (end_s.min(to_s) - begin_s).max(0.0) / step.h_s.max(f64::MIN_POSITIVE);
            mean.propeller_radps += share * input.propeller_radps;
            mean.fins_rad.iter_mut().zip(input.fins_rad).for_each(|(mean, fin)| *mean += share * fin);
            begin_s = begin_s.max(*end_s);
        }
        mean
    }
}

/// By how much a reading that comes late is behind what it is of.
#[derive(Clone, Debug, Default)]
struct Behind<const N: usize> {
    /// What it is of at the ends of the last steps: (time in s, value).
    path: VecDeque<(f64, [f64; N])>,
}

impl<const N: usize> Behind<N> {
    /// After a step that ended at `to_s` with the value `now`: now less then, between steps on straight lines.
    fn advance(&mut self, delay_s: f64, to_s: f64, now: [f64; N]) -> [f64; N] {
        self.path.push_back((to_s, now));
        let then_s = to_s - delay_s;
        while self.path.get(1).is_some_and(|(t_s, _)| *t_s <= then_s) {
            self.path.pop_front();
        }
        let [(from_s, from), (next_s, next)] = [0, 1].map(|place| self.path.get(place).copied().unwrap_or((to_s, now)));
        let share = if next_s > from_s { ((then_s - from_s) / (next_s - from_s)).clamp(0.0, 1.0) } else { 0.0 };
        std::array::from_fn(|axis| now[axis] - from[axis] - share * (next[axis] - from[axis]))
    }
}

/// By how much late sensors are behind the vehicle, as the model moves it between readings.
#[derive(Clone, Debug, Default)]
pub struct Lateness {
    heading_lag: Lag,
    /// Of the heading, rad.
    pub(crate) heading_rad: f64,
    /// Velocity in body axes, m/s, and position, m, less what readings corrected of the vehicle's.
    moved_mps: [f64; 3],
    moved_m: [f64; 2],
    dvl: Behind<3>,
    gnss: Behind<2>,
    /// Of the velocity of the DVL over ground, m/s.
    pub(crate) velocity_mps: [f64; 3],
    /// Of the position, north and east, m.
    pub(crate) position_m: [f64; 2],
}

/// Which sensors are late.
#[derive(Clone, Copy, Debug, Default)]
pub struct Delays {
    /// First-order lag of the heading, s.
    pub heading_lag_s: f64,
    /// By how much the DVL is late, s.
    pub dvl_s: f64,
    /// By how much fixes are late, s.
    pub gnss_s: f64,
    /// Where the DVL is, less where it is declared, m.
    pub dvl_arm_m: [f64; 3],
}

impl Delays {
    /// Whether some sensor is late.
    #[must_use]
    pub fn are_any(&self) -> bool {
        self.heading_lag_s != 0.0 || self.dvl_s != 0.0 || self.gnss_s != 0.0
    }
}

impl Lateness {
    /// Over a step that the vehicle made with the derivative `f` to the state `x`; `water_mps` is that of the water in body
    /// axes after it.
    pub fn advance(
        &mut self,
        delays: &Delays,
        step: &Step,
        (f, x): (&VehicleState, &VehicleState),
        water_mps: [f64; 3],
    ) {
        self.heading_lag.advance(delays.heading_lag_s, step.h_s, f[PSI]);
        self.heading_rad = self.heading_lag.0;
        let to_s = step.t_s + step.h_s;
        let over_ground = [f[X], f[Y]];
        self.moved_m = [0, 1].map(|axis| self.moved_m[axis] + over_ground[axis] * step.h_s);
        self.position_m = if delays.gnss_s > 0.0 {
            self.gnss.advance(delays.gnss_s, to_s, self.moved_m)
        } else {
            over_ground.map(|velocity| delays.gnss_s * velocity)
        };
        let delay_s = delays.dvl_s;
        let swing_of = |state: &VehicleState| swing(state.fixed_rows::<3>(P).into(), delays.dvl_arm_m);
        if delay_s <= 0.0 {
            let turned = swing_of(f);
            self.velocity_mps = [0, 1, 2].map(|axis| delay_s * (f[U + axis] + turned[axis]));
            return;
        }
        let swung = swing_of(x);
        for axis in 0..3 {
            self.moved_mps[axis] += f[U + axis] * step.h_s;
        }
        let now = [0, 1, 2].map(|axis| self.moved_mps[axis] + water_mps[axis] + swung[axis]);
        self.velocity_mps = self.dvl.advance(delay_s, to_s, now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::state::R;

    /// What is commanded comes late, as its mean over the step; before the first command it was the same.
    #[test]
    fn val_late_inputs() {
        let input = |value: f64| ActuatorInput { propeller_radps: value, fins_rad: [value; 4] };
        let (mut line, mut t_s) = (DelayLine::default(), 0.0);
        for k in 0..100_u32 {
            // steps of two lengths; from 0 to 1 with the one that begins at 1.5 s, 0.33 s late
            let h_s = if k % 2 == 0 { 0.02 } else { 0.04 };
            let late = line.delayed(0.33, &Step { t_s, h_s }, &input(if t_s < 1.5 - 1e-9 { 0.0 } else { 1.0 }));
            let expected = ((t_s + h_s - 1.83) / h_s).clamp(0.0, 1.0);
            assert!(
                (late.propeller_radps - expected).abs() < 1e-9 && late.fins_rad[3] == late.propeller_radps,
                "{k} {late:?}"
            );
            t_s += h_s;
        }
    }

    /// A vehicle whose rates change: closed forms of a lag and of a delay.
    #[test]
    fn val_late_sensors_are_behind_by_closed_forms() {
        let delays = Delays { heading_lag_s: 1.5, dvl_s: 0.33, gnss_s: 0.8, ..Delays::default() };
        let mut late = Lateness::default();
        let (h_s, end_s) = (0.05, 6.0);
        let mut t_s: f64 = 0.0;
        while t_s < end_s - 1e-9 {
            // ψ = 0.1 t, u = sin t, x = sin t, y = 2 t
            let mut f = VehicleState::zeros();
            let slope = ((t_s + h_s).sin() - t_s.sin()) / h_s;
            (f[PSI], f[U], f[X], f[Y]) = (0.1, slope, slope, 2.0);
            late.advance(&delays, &Step { t_s, h_s }, (&f, &VehicleState::zeros()), [0.0; 3]);
            t_s += h_s;
        }
        let lag = 0.15 * (1.0 - (-end_s / 1.5_f64).exp());
        assert!((late.heading_rad - lag).abs() < 1e-12);
        // Straight lines between steps of 50 ms: h² / 8.
        let delay = t_s.sin() - (t_s - 0.33_f64).sin();
        assert!((late.velocity_mps[0] - delay).abs() < 4e-4, "{} {delay}", late.velocity_mps[0]);
        let [north_m, east_m] = late.position_m;
        assert!((north_m - (t_s.sin() - (t_s - 0.8_f64).sin())).abs() < 4e-4, "{north_m}");
        assert!((east_m - 1.6).abs() < 1e-9, "{east_m}"); // rounding
    }

    /// A DVL half a metre ahead of a vehicle that turns at r = 0.2 cos t reads its sway of 0.33 s ago.
    #[test]
    fn val_a_late_dvl_swings_late() {
        let delays = Delays { dvl_s: 0.33, dvl_arm_m: [0.5, 0.0, 0.0], ..Delays::default() };
        let (mut late, mut x, mut t_s, h_s) = (Lateness::default(), VehicleState::zeros(), 0.0_f64, 0.05);
        while t_s < 6.0 - 1e-9 {
            t_s += h_s;
            x[R] = 0.2 * t_s.cos();
            late.advance(&delays, &Step { t_s: t_s - h_s, h_s }, (&VehicleState::zeros(), &x), [0.0; 3]);
        }
        let swung = swing([0.0, 0.0, x[R]], delays.dvl_arm_m);
        let reading = [0, 1, 2].map(|axis| swung[axis] - late.velocity_mps[axis]);
        // Straight lines between steps of 50 ms: h² / 8 of 0.1.
        assert!((reading[1] - 0.1 * (t_s - 0.33).cos()).abs() < 4e-5, "{reading:?}");
        assert_eq!((reading[0], reading[2]), (0.0, 0.0));
    }
}
