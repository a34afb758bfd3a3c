//! Effects of the board's catalogue, and beside them those that only the analysis of a log knows, as they enter the
//! model of a vehicle in six degrees of freedom and its sensors.
//!
//! The latter are entries of [`LOG_CATALOGUE`](backseat_core::effects::LOG_CATALOGUE): a compass that lags, a DVL that
//! is late or elsewhere, an antenna or a transducer that is elsewhere, a depth cell with a wrong scale, soft iron, the
//! torque of the propeller, inputs that are late. Late readings need what
//! the vehicle did before: [`Lateness`] follows its motion as the model moves it, so that no innovation is counted twice.

pub use crate::acoustic_path::PathAt;

use crate::acoustic_path::turned_about_down;
use backseat_core::dynamics::{ActuatorInput, Attitude};
use backseat_core::effects::{EffectError, EffectSet, SensorChannel, Step};
use backseat_core::parameters::Installation;
use backseat_core::state::{self, P, PSI, U, VehicleState};
use backseat_estimation::inputs;
use backseat_logs::log::{Column, Log};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::collections::VecDeque;

/// Most numbers of one entry.
const MOST: usize = 3;

/// The entries, with the sensors that show each; torque and late inputs move the hull itself.
const ENTRIES: [(&str, &[SensorChannel]); 11] = [
    ("heading_lag", &[SensorChannel::Attitude]),
    ("soft_iron", &[SensorChannel::Attitude]),
    ("dvl_delay", &[SensorChannel::Dvl]),
    ("dvl_lever_arm", &[SensorChannel::Dvl]),
    ("depth_scale", &[SensorChannel::Depth]),
    ("propeller_torque", &[]),
    ("gnss_lever_arm", &[SensorChannel::Gnss]),
    ("transducer_lever_arm", &[SensorChannel::Range, SensorChannel::TwoWayRange]),
    ("input_delay", &[]),
    ("usbl_turn", &[SensorChannel::Usbl]),
    ("transponder_place", &[SensorChannel::Range, SensorChannel::TwoWayRange]),
];
const HEADING_LAG: usize = 0;
const SOFT_IRON: usize = 1;
const DVL_DELAY: usize = 2;
const DVL_ARM: usize = 3;
const DEPTH_SCALE: usize = 4;
const TORQUE: usize = 5;
const GNSS_ARM: usize = 6;
const TRANSDUCER_ARM: usize = 7;
const INPUT_DELAY: usize = 8;
const USBL_TURN: usize = 9;
/// Number, north, east.
const PLACE: usize = 10;

/// Values of all effects; all zero is the declared model.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Effects {
    /// Those of the board's catalogue.
    pub board: EffectSet,
    /// The others, in the order of [`ENTRIES`].
    log: [[f64; MOST]; ENTRIES.len()],
}

impl From<EffectSet> for Effects {
    fn from(board: EffectSet) -> Self {
        Self { board, ..Self::default() }
    }
}

/// Whether the model has this entry beside those of the board's catalogue.
#[must_use]
pub fn is_known(name: &str) -> bool {
    ENTRIES.iter().any(|(entry, _)| *entry == name)
}

/// Errors of readings that `[installation]` of a vehicle file has no place for.
const OF_READINGS: [usize; 5] = [HEADING_LAG, SOFT_IRON, DEPTH_SCALE, USBL_TURN, PLACE];

/// Whether it is an error of readings that `[installation]` of a vehicle file has no place for.
#[must_use]
pub fn is_of_readings(name: &str) -> bool {
    OF_READINGS.iter().any(|entry| ENTRIES[*entry].0 == name)
}

/// Whether it makes actuators late.
#[must_use]
pub fn is_of_inputs(name: &str) -> bool {
    name == ENTRIES[INPUT_DELAY].0
}

impl Effects {
    /// With all values of one entry, plausible or not.
    ///
    /// # Errors
    /// [`EffectError::Unknown`]: no such entry, or another number of values.
    pub fn with(mut self, effect: &str, values: &[f64]) -> Result<Self, EffectError> {
        match ENTRIES.iter().position(|(name, _)| *name == effect) {
            Some(entry) => {
                self.log[entry].get_mut(..values.len()).ok_or(EffectError::Unknown)?.copy_from_slice(values);
                Ok(self)
            }
            None => Ok(Self { board: self.board.with(effect, values)?, ..self }),
        }
    }

    /// Sensors that read something else than with `other`, and whether the vehicle moves otherwise.
    #[must_use]
    pub fn differences(&self, other: &Self) -> (Vec<SensorChannel>, bool) {
        let (mut sensors, mut in_process) = (Vec::new(), false);
        for (index, info, values) in self.board.active() {
            if values != other.board.values(index) {
                in_process |= info.hooks.plant.is_some() || info.hooks.input.is_some();
                sensors.extend(info.hooks.measure.iter().flat_map(|measure| measure.channels));
            }
        }
        for ((values, others), (_, shown_by)) in self.log.iter().zip(&other.log).zip(ENTRIES) {
            if values != others {
                in_process |= shown_by.is_empty();
                sensors.extend(shown_by);
            }
        }
        (sensors, in_process)
    }

    /// Roll moment per newton of thrust, m: the hull rolls against the propeller.
    #[must_use]
    pub fn torque_arm_m(&self) -> f64 {
        self.log[TORQUE][0]
    }

    /// Where the transducer is, less where it is declared, m.
    #[must_use]
    pub fn transducer_arm_m(&self) -> [f64; 3] {
        self.log[TRANSDUCER_ARM]
    }

    /// By how much actuators are behind their commands, s.
    #[must_use]
    pub fn input_delay_s(&self) -> f64 {
        self.log[INPUT_DELAY][0]
    }

    /// Whether some sensor is late.
    #[must_use]
    pub fn is_late(&self) -> bool {
        self.log[HEADING_LAG][0] != 0.0 || self.log[DVL_DELAY][0] != 0.0
    }

    /// What these entries make of a perfect reading, in place, of a vehicle at `x`; returns ∂(read)/∂(true).
    pub fn read(
        &self,
        late: &Lateness,
        sensor: SensorChannel,
        (x, path): (&VehicleState, PathAt),
        reading: &mut [f64; 3],
    ) -> [[f64; 3]; 3] {
        let mut slope = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        match sensor {
            SensorChannel::Attitude => {
                let [sin2, cos2, _] = self.log[SOFT_IRON];
                if [sin2, cos2] != [0.0; 2] {
                    let (sin, cos) = (2.0 * reading[2]).sin_cos();
                    reading[2] += sin2 * sin + cos2 * cos;
                    slope[2][2] += 2.0 * (sin2 * cos - cos2 * sin);
                }
                reading[2] -= late.heading_rad;
            }
            SensorChannel::Dvl => {
                let arm = swing(x.fixed_rows::<3>(P).into(), self.log[DVL_ARM]);
                for axis in 0..3 {
                    reading[axis] += arm[axis] - late.velocity_mps[axis];
                }
            }
            SensorChannel::Depth => {
                let scale = 1.0 + self.log[DEPTH_SCALE][0];
                reading[0] *= scale;
                slope[0][0] = scale;
            }
            SensorChannel::Gnss if self.log[GNSS_ARM] != [0.0; MOST] => {
                let arm = Attitude::new(&state::attitude(x)).rotation() * Vector3::from(self.log[GNSS_ARM]);
                reading[0] += arm.x;
                reading[1] += arm.y;
            }
            SensorChannel::Range | SensorChannel::TwoWayRange => {
                reading[0] += (0..3).map(|axis| path.body[axis] * self.log[TRANSDUCER_ARM][axis]).sum::<f64>();
                let [number, north_m, east_m] = self.log[PLACE];
                if path.station.is_some_and(|station| f64::from(station) == number) {
                    reading[0] -= path.ned[0] * north_m + path.ned[1] * east_m;
                }
            }
            SensorChannel::Usbl if self.log[USBL_TURN][0] != 0.0 => {
                slope = turned_about_down(self.log[USBL_TURN][0], path.ned);
                let before = *reading;
                *reading = slope.map(|row| (0..3).map(|axis| row[axis] * before[axis]).sum());
            }
            _ => {}
        }
        slope
    }

    /// What fixes and ranges by sound would be of an array that is not turned, and of transponders that are where they are
    /// declared: the declared place is corrected.
    fn correct_positioning(&self, log: &mut Log) {
        let ([turn_rad, ..], [number, north_m, east_m]) = (self.log[USBL_TURN], self.log[PLACE]);
        for row in &mut log.rows {
            if let Some(usbl) = row.usbl().filter(|_| turn_rad != 0.0) {
                let bearing_rad = usbl.bearing_rad - turn_rad;
                row.set_all(Column::UsblRange, &[usbl.range_m, bearing_rad, usbl.elevation_rad]);
            }
            if row.station().is_some_and(|station| f64::from(station) == number) {
                for (column, by_m) in [(Column::StationX, north_m), (Column::StationY, east_m)] {
                    if let Some(declared) = row.get(column) {
                        row.set(column, declared + by_m);
                    }
                }
            }
        }
    }

    /// The log as perfect sensors would have it: at its place, in time, without scale. Effects of the board's catalogue
    /// and those of the motion change nothing here.
    #[must_use]
    pub fn corrected<'a>(&self, log: Cow<'a, Log>) -> Cow<'a, Log> {
        let mut log = log;
        let has = |entries: &[usize]| entries.iter().any(|entry| self.log[*entry] != [0.0; MOST]);
        if has(&[HEADING_LAG, SOFT_IRON, DEPTH_SCALE]) {
            self.correct_readings(log.to_mut());
        }
        if has(&[USBL_TURN, PLACE]) {
            self.correct_positioning(log.to_mut());
        }
        let [delay_s, ..] = self.log[DVL_DELAY];
        let moved = Installation {
            dvl_arm_m: self.log[DVL_ARM],
            dvl_delay_s: delay_s.max(0.0),
            gnss_arm_m: self.log[GNSS_ARM],
            ..Installation::DEFAULT
        };
        if moved == Installation::DEFAULT {
            return log;
        }
        // It was moved to the centre by what is declared; this is the rest.
        let mut raw = log.into_owned();
        raw.at_centre = false;
        Cow::Owned(inputs::at_centre(&raw, &moved).into_owned())
    }

    fn correct_readings(&self, log: &mut Log) {
        let ([lag_s, ..], [sin2, cos2, _]) = (self.log[HEADING_LAG], self.log[SOFT_IRON]);
        let scale = 1.0 + self.log[DEPTH_SCALE][0];
        let mut euler = [0.0; 3];
        let (mut behind, mut before_us) = (Lag::default(), None);
        for row in &mut log.rows {
            euler = row.attitude_rad().unwrap_or(euler);
            if let Some([_, q, r]) = row.rates_radps() {
                let dt_s = before_us.map_or(0.0, |us: u64| row.time_us.saturating_sub(us) as f64 * 1e-6);
                before_us = Some(row.time_us);
                let [roll, pitch, _] = euler;
                behind.advance(lag_s, dt_s, (q * roll.sin() + r * roll.cos()) / pitch.cos());
            }
            if let Some(heading) = row.get(Column::Heading) {
                let read = heading + behind.0;
                // The iron acts by the true heading: ψ = read - iron(ψ), whose terms shrink by twice the iron's size.
                let mut heading = read;
                for _ in 0..12 {
                    let (sin, cos) = (2.0 * heading).sin_cos();
                    heading = read - sin2 * sin - cos2 * cos;
                }
                row.set(Column::Heading, heading);
            }
            if let Some(depth_m) = row.get(Column::Depth) {
                row.set(Column::Depth, depth_m / scale);
            }
        }
    }
}

/// ω × arm, m/s.
fn swing([p, q, r]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [q * z - r * y, r * x - p * z, p * y - q * x]
}

/// A first-order lag: by how much its output is behind a quantity that moves at a rate.
#[derive(Clone, Copy, Debug, Default)]
struct Lag(f64);

impl Lag {
    /// Exact where the rate is constant over the time `h_s`; a lag below zero leads by rate times lag.
    fn advance(&mut self, lag_s: f64, h_s: f64, rate: f64) {
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

/// By how much late sensors are behind the vehicle, as the model moves it between readings.
#[derive(Clone, Debug, Default)]
pub struct Lateness {
    heading_lag: Lag,
    heading_rad: f64,
    /// Velocity of the DVL over ground in body axes, m/s, less what readings corrected of the vehicle's: (time in s, value).
    path: VecDeque<(f64, [f64; 3])>,
    moved_mps: [f64; 3],
    velocity_mps: [f64; 3],
}

impl Lateness {
    /// Over a step that the vehicle made with the derivative `f` to the state `x`; `water_mps` is that of the water in body
    /// axes after it.
    pub fn advance(
        &mut self,
        effects: &Effects,
        step: &Step,
        (f, x): (&VehicleState, &VehicleState),
        water_mps: [f64; 3],
    ) {
        self.heading_lag.advance(effects.log[HEADING_LAG][0], step.h_s, f[PSI]);
        self.heading_rad = self.heading_lag.0;
        let [delay_s, ..] = effects.log[DVL_DELAY];
        let swing_of = |state: &VehicleState| swing(state.fixed_rows::<3>(P).into(), effects.log[DVL_ARM]);
        if delay_s <= 0.0 {
            let turned = swing_of(f);
            self.velocity_mps = [0, 1, 2].map(|axis| delay_s * (f[U + axis] + turned[axis]));
            return;
        }
        let swung = swing_of(x);
        let to_s = step.t_s + step.h_s;
        for axis in 0..3 {
            self.moved_mps[axis] += f[U + axis] * step.h_s;
        }
        let now = [0, 1, 2].map(|axis| self.moved_mps[axis] + water_mps[axis] + swung[axis]);
        self.path.push_back((to_s, now));
        let then_s = to_s - delay_s;
        while self.path.get(1).is_some_and(|(t_s, _)| *t_s <= then_s) {
            self.path.pop_front();
        }
        let [(from_s, from), (next_s, next)] = [0, 1].map(|place| self.path.get(place).copied().unwrap_or((to_s, now)));
        let share = if next_s > from_s { ((then_s - from_s) / (next_s - from_s)).clamp(0.0, 1.0) } else { 0.0 };
        self.velocity_mps = [0, 1, 2].map(|axis| now[axis] - from[axis] - share * (next[axis] - from[axis]));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::effects::{LOG_CATALOGUE, find_of_log};
    use backseat_core::state::R;
    use backseat_logs::log::LogRow;

    #[test]
    fn every_entry_is_one_of_the_catalogue_and_is_kept() {
        let none = Effects::default();
        for (name, _) in ENTRIES {
            let count = find_of_log(name).expect(name).parameters.len();
            assert!(LOG_CATALOGUE.iter().any(|info| info.name == name), "{name}");
            let some = none.with(name, &[0.1, 0.2, 0.3][..count]).unwrap();
            assert_ne!(some, none, "{name}");
            assert_eq!(some.with(name, &[0.0; 3][..count]).unwrap(), none);
        }
        assert!(none.with("thrust_curve", &[0.0; 3]).is_err());
        assert_ne!(none.with("depth_bias", &[0.1]).unwrap().board, EffectSet::NONE);
    }

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
        let effects = Effects::default().with("heading_lag", &[1.5]).unwrap().with("dvl_delay", &[0.33]).unwrap();
        let mut late = Lateness::default();
        let (h_s, end_s) = (0.05, 6.0);
        let mut t_s: f64 = 0.0;
        while t_s < end_s - 1e-9 {
            // ψ = 0.1 t, u = sin t.
            let mut f = VehicleState::zeros();
            (f[PSI], f[U]) = (0.1, ((t_s + h_s).sin() - t_s.sin()) / h_s);
            late.advance(&effects, &Step { t_s, h_s }, (&f, &VehicleState::zeros()), [0.0; 3]);
            t_s += h_s;
        }
        let lag = 0.15 * (1.0 - (-end_s / 1.5_f64).exp());
        assert!((late.heading_rad - lag).abs() < 1e-12);
        // Straight lines between steps of 50 ms: h² / 8.
        let delay = t_s.sin() - (t_s - 0.33_f64).sin();
        assert!((late.velocity_mps[0] - delay).abs() < 4e-4, "{} {delay}", late.velocity_mps[0]);
    }

    /// A DVL half a metre ahead of a vehicle that turns at r = 0.2 cos t reads its sway of 0.33 s ago.
    #[test]
    fn val_a_late_dvl_swings_late() {
        let effects = Effects::default().with("dvl_delay", &[0.33]).unwrap();
        let effects = effects.with("dvl_lever_arm", &[0.5, 0.0, 0.0]).unwrap();
        let (mut late, mut x, mut t_s, h_s) = (Lateness::default(), VehicleState::zeros(), 0.0_f64, 0.05);
        while t_s < 6.0 - 1e-9 {
            t_s += h_s;
            x[R] = 0.2 * t_s.cos();
            late.advance(&effects, &Step { t_s: t_s - h_s, h_s }, (&VehicleState::zeros(), &x), [0.0; 3]);
        }
        let mut reading = [0.0; 3];
        effects.read(&late, SensorChannel::Dvl, (&x, PathAt::default()), &mut reading);
        // Straight lines between steps of 50 ms: h² / 8 of 0.1.
        assert!((reading[1] - 0.1 * (t_s - 0.33).cos()).abs() < 4e-5, "{reading:?}");
        assert_eq!((reading[0], reading[2]), (0.0, 0.0));
    }

    /// An array turned by 0.2 rad reads a vehicle to the north-east of it and below further to the right; the correction
    /// gives it back, and both are one turn.
    #[test]
    fn val_a_turned_array_is_turned_back() {
        let effects = Effects::default().with("usbl_turn", &[0.2]).unwrap();
        let truth = Vector3::new(300.0, 200.0, 40.0);
        let read = Vector3::new(
            300.0 * 0.2_f64.cos() - 200.0 * 0.2_f64.sin(),
            300.0 * 0.2_f64.sin() + 200.0 * 0.2_f64.cos(),
            40.0,
        );
        let mut row = LogRow::new(0);
        row.set_all(Column::UsblNorth, read.as_slice());
        let mut log = Log::default();
        log.rows.push(row);
        let corrected = effects.corrected(Cow::Borrowed(&log)).rows[0].usbl().unwrap().vector_m();
        assert!((Vector3::from(corrected) - truth).amax() < 1e-9, "{corrected:?}"); // rounding of 300 m
        // in the triad of what was read
        let along = read.normalize();
        let axes = backseat_core::navigation::triad(&along);
        let mut reading = axes.map(|axis| axis.dot(&truth));
        let at = (&VehicleState::zeros(), PathAt { ned: along.into(), ..PathAt::default() });
        effects.read(&Lateness::default(), SensorChannel::Usbl, at, &mut reading);
        assert!((Vector3::from(reading) - Vector3::new(read.norm(), 0.0, 0.0)).amax() < 1e-9, "{reading:?}");
    }

    #[test]
    fn val_a_log_is_corrected() {
        let effects = [("heading_lag", &[2.0][..]), ("soft_iron", &[0.03, -0.02]), ("depth_scale", &[0.02])];
        let effects = effects.iter().fold(Effects::default(), |all, (name, values)| all.with(name, values).unwrap());
        let mut log = Log::default();
        let mut lagged = 0.0;
        for k in 0..400_u64 {
            let t_s = 0.05 * k as f64;
            // ψ = 0.1 t behind a lag of two seconds, on iron.
            let psi = 0.1 * t_s;
            lagged = if k == 0 { 0.0 } else { psi - 0.2 * (1.0 - (-t_s / 2.0).exp()) };
            let iron = 0.03 * (2.0 * psi).sin() - 0.02 * (2.0 * psi).cos();
            let mut row = LogRow::new(k * 50_000);
            row.set_all(Column::Roll, &[0.0, 0.0, lagged + iron]).set_all(Column::P, &[0.0, 0.0, 0.1]);
            log.rows.push(row.set(Column::Depth, 10.2).clone());
        }
        let last = log.rows.len() - 1;
        assert!((lagged - 1.995).abs() > 0.1, "the lag shows");
        let corrected = effects.corrected(Cow::Borrowed(&log));
        assert!((corrected.rows[last].get(Column::Heading).unwrap() - 1.995).abs() < 1e-12);
        assert!((corrected.rows[last].get(Column::Depth).unwrap() - 10.0).abs() < 1e-12);
        assert!(matches!(Effects::default().corrected(Cow::Borrowed(&log)), Cow::Borrowed(_)));
    }
}
