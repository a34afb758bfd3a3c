//! Effects of the board's catalogue, and beside them those that only the analysis of a log knows, as they enter the
//! model of a vehicle in six degrees of freedom and its sensors.
//!
//! The latter are entries of [`LOG_CATALOGUE`](backseat_core::effects::LOG_CATALOGUE): a compass that lags, a DVL that
//! is late or elsewhere, an antenna or a transducer that is elsewhere, a depth cell with a wrong scale, soft iron, the
//! torque of the propeller, inputs that are late; current, compass and buoyancy that change under way. Late readings need
//! what the vehicle did before: [`Lateness`] follows its motion as the model moves it, so that no innovation is counted
//! twice.

pub use crate::acoustic_path::PathAt;

use crate::acoustic_path::turned_about_down;
use crate::lateness::{Delays, Lag, Lateness, swing};
use backseat_core::dynamics::Attitude;
use backseat_core::effects::{EffectError, EffectSet, ParameterId, SensorChannel, is_on};
use backseat_core::parameters::Installation;
use backseat_core::state::{self, P, VehicleState};
use backseat_estimation::inputs;
use backseat_logs::log::{Column, Log};
use nalgebra::Vector3;
use std::borrow::Cow;

/// Most numbers of one entry.
const MOST: usize = 4;

/// The entries, with the sensors that show each; those without a sensor move the vehicle itself.
const ENTRIES: [(&str, &[SensorChannel]); 15] = [
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
    ("heading_change", &[SensorChannel::Attitude]),
    ("current_change", &[]),
    ("buoyancy_change", &[]),
    ("thrust_change", &[]),
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
/// Size, onset, end.
const HEADING_CHANGE: usize = 11;
/// A change of one of the board's entries: its sizes, then onset and end.
struct Change {
    /// Its place.
    entry: usize,
    /// Effect and parameter of the board that each size adds to.
    adds_to: &'static [(&'static str, &'static str)],
}
const CHANGES: [Change; 3] = [
    Change { entry: 12, adds_to: &[("water_current", "north_mps"), ("water_current", "east_mps")] },
    Change { entry: 13, adds_to: &[("buoyancy_offset", "kg")] },
    Change { entry: 14, adds_to: &[("thrust_loss", "k_n_s2_per_rad_m")] },
];

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
const OF_READINGS: [usize; 6] = [HEADING_LAG, SOFT_IRON, DEPTH_SCALE, USBL_TURN, PLACE, HEADING_CHANGE];

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

    /// Sizes, onset and end of a change, s.
    fn change(&self, change: &Change) -> (&[f64], f64, f64) {
        let (sizes, times) = self.log[change.entry].split_at(change.adds_to.len());
        (sizes, times[0], times[1])
    }

    /// Those of the board's catalogue at a time since the start of the log, s, with the changes that are there then.
    #[must_use]
    pub fn board_at(&self, t_s: f64) -> EffectSet {
        let mut board = self.board;
        for change in &CHANGES {
            let (sizes, onset_s, end_s) = self.change(change);
            for ((effect, parameter), size) in change.adds_to.iter().zip(sizes) {
                if let Some(id) = ParameterId::find(effect, parameter).filter(|_| is_on(t_s, onset_s, end_s)) {
                    board.set(id, board.get(id) + size);
                }
            }
        }
        board
    }

    /// Times at which [`Self::board_at`] changes, s, ascending.
    #[must_use]
    pub fn change_times_s(&self) -> Vec<f64> {
        let present =
            CHANGES.iter().map(|change| self.change(change)).filter(|(sizes, ..)| sizes.iter().any(|s| *s != 0.0));
        let times = present.flat_map(|(_, onset_s, end_s)| [Some(onset_s), (end_s > 0.0).then_some(end_s)]);
        let mut times: Vec<f64> = times.flatten().collect();
        times.sort_by(f64::total_cmp);
        times
    }

    /// What the compass reads more at a time since the start of the log, s, because something came near it, rad.
    fn heading_change_rad(&self, t_s: f64) -> f64 {
        let [rad, onset_s, end_s, _] = self.log[HEADING_CHANGE];
        if is_on(t_s, onset_s, end_s) { rad } else { 0.0 }
    }

    /// Which sensors are late.
    #[must_use]
    pub fn delays(&self) -> Delays {
        let [[heading_lag_s, ..], [dvl_s, ..]] = [self.log[HEADING_LAG], self.log[DVL_DELAY]];
        Delays { heading_lag_s, dvl_s, dvl_arm_m: first_three(self.log[DVL_ARM]) }
    }

    /// Roll moment per newton of thrust, m: the hull rolls against the propeller.
    #[must_use]
    pub fn torque_arm_m(&self) -> f64 {
        self.log[TORQUE][0]
    }

    /// Where the transducer is, less where it is declared, m.
    #[must_use]
    pub fn transducer_arm_m(&self) -> [f64; 3] {
        first_three(self.log[TRANSDUCER_ARM])
    }

    /// By how much actuators are behind their commands, s.
    #[must_use]
    pub fn input_delay_s(&self) -> f64 {
        self.log[INPUT_DELAY][0]
    }

    /// What these entries make of a perfect reading at `t_s`, in place, of a vehicle at `x`; returns ∂(read)/∂(true).
    pub fn read(
        &self,
        t_s: f64,
        late: &Lateness,
        sensor: SensorChannel,
        (x, path): (&VehicleState, PathAt),
        reading: &mut [f64; 3],
    ) -> [[f64; 3]; 3] {
        let mut slope = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        match sensor {
            SensorChannel::Attitude => {
                let [sin2, cos2, ..] = self.log[SOFT_IRON];
                if [sin2, cos2] != [0.0; 2] {
                    let (sin, cos) = (2.0 * reading[2]).sin_cos();
                    reading[2] += sin2 * sin + cos2 * cos;
                    slope[2][2] += 2.0 * (sin2 * cos - cos2 * sin);
                }
                reading[2] += self.heading_change_rad(t_s) - late.heading_rad;
            }
            SensorChannel::Dvl => {
                let arm = swing(x.fixed_rows::<3>(P).into(), first_three(self.log[DVL_ARM]));
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
                let arm =
                    Attitude::new(&state::attitude(x)).rotation() * Vector3::from(first_three(self.log[GNSS_ARM]));
                reading[0] += arm.x;
                reading[1] += arm.y;
            }
            SensorChannel::Range | SensorChannel::TwoWayRange => {
                reading[0] += (0..3).map(|axis| path.body[axis] * self.log[TRANSDUCER_ARM][axis]).sum::<f64>();
                let [number, north_m, east_m, _] = self.log[PLACE];
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
        let ([turn_rad, ..], [number, north_m, east_m, _]) = (self.log[USBL_TURN], self.log[PLACE]);
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
        if has(&[HEADING_LAG, SOFT_IRON, DEPTH_SCALE, HEADING_CHANGE]) {
            self.correct_readings(log.to_mut());
        }
        if has(&[USBL_TURN, PLACE]) {
            self.correct_positioning(log.to_mut());
        }
        let [delay_s, ..] = self.log[DVL_DELAY];
        let moved = Installation {
            dvl_arm_m: first_three(self.log[DVL_ARM]),
            dvl_delay_s: delay_s.max(0.0),
            gnss_arm_m: first_three(self.log[GNSS_ARM]),
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
        let ([lag_s, ..], [sin2, cos2, ..]) = (self.log[HEADING_LAG], self.log[SOFT_IRON]);
        let start_us = log.rows.first().map_or(0, |row| row.time_us);
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
                let t_s = (row.time_us - start_us) as f64 * 1e-6;
                let read = heading + behind.0 - self.heading_change_rad(t_s);
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

fn first_three([x, y, z, _]: [f64; MOST]) -> [f64; 3] {
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::effects::{LOG_CATALOGUE, find_of_log};
    use backseat_logs::log::LogRow;

    #[test]
    fn every_entry_is_one_of_the_catalogue_and_is_kept() {
        let none = Effects::default();
        for (name, _) in ENTRIES {
            let count = find_of_log(name).expect(name).parameters.len();
            assert!(LOG_CATALOGUE.iter().any(|info| info.name == name), "{name}");
            let some = none.with(name, &[0.1, 0.2, 0.3, 0.4][..count]).unwrap();
            assert_ne!(some, none, "{name}");
            assert_eq!(some.with(name, &[0.0; MOST][..count]).unwrap(), none);
        }
        assert!(none.with("thrust_curve", &[0.0; 3]).is_err());
        assert_ne!(none.with("depth_bias", &[0.1]).unwrap().board, EffectSet::NONE);
    }

    /// What changes is there from its onset to its end, of the board's entries on top of what lasts.
    #[test]
    fn val_changes_come_and_go() {
        let effects = [
            ("water_current", &[0.1, 0.2][..]),
            ("current_change", &[0.05, -0.1, 100.0, 200.0]),
            ("buoyancy_change", &[-0.3, 150.0, 0.0]),
            ("heading_change", &[0.08, 120.0, 180.0]),
        ];
        let effects = effects.iter().fold(Effects::default(), |all, (name, values)| all.with(name, values).unwrap());
        assert_eq!(effects.change_times_s(), [100.0, 150.0, 200.0]);
        for (t_s, north_mps, kg, rad) in [
            (99.0, 0.1, 0.0, 0.0),
            (100.0, 0.15, 0.0, 0.0),
            (150.0, 0.15, -0.3, 0.08),
            (180.0, 0.15, -0.3, 0.0),
            (200.0, 0.1, -0.3, 0.0),
        ] {
            let (board, mut reading) = (effects.board_at(t_s), [0.0; 3]);
            let at = (&VehicleState::zeros(), PathAt::default());
            effects.read(t_s, &Lateness::default(), SensorChannel::Attitude, at, &mut reading);
            let value = |effect, parameter| board.get(ParameterId::find(effect, parameter).unwrap());
            let now = [value("water_current", "north_mps"), value("buoyancy_offset", "kg"), reading[2]];
            for (now, then) in now.iter().zip([north_mps, kg, rad]) {
                assert!((now - then).abs() < 1e-12, "{t_s}: {now} {then}"); // rounding
            }
        }
        assert!(Effects::default().change_times_s().is_empty());
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
        effects.read(0.0, &Lateness::default(), SensorChannel::Usbl, at, &mut reading);
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
