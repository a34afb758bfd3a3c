//! Effects of the board's catalogue, and beside them those that only the analysis of a log knows, as they enter the
//! model of a vehicle in six degrees of freedom and its sensors.
//!
//! The latter are entries of [`LOG_CATALOGUE`](backseat_core::effects::LOG_CATALOGUE): a compass that lags, a DVL that
//! is late or elsewhere, an antenna or a transducer that is elsewhere, a depth cell with a wrong scale, soft iron, the
//! torque of the propeller, inputs that are late; changes of the board's entries under way. Late readings need what the
//! vehicle did before: [`Lateness`] follows its motion as the model moves it, so that no innovation is counted twice.

mod corrected;

pub use crate::acoustic_path::PathAt;

use crate::acoustic_path::turned_about_down;
use crate::actuators::Slowness;
use crate::lateness::{Delays, Lateness, swing};
use backseat_core::dynamics::Attitude;
use backseat_core::effects::{EffectError, EffectSet, ParameterId, ParameterKind, SensorChannel, is_on};
use backseat_core::state::{self, P, VehicleState};
use nalgebra::Vector3;

/// Most numbers of one entry.
const MOST: usize = 4;

/// The entries, with the sensors that show each; those without a sensor move the vehicle itself.
const ENTRIES: [(&str, &[SensorChannel]); 22] = [
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
    ("pitch_change", &[SensorChannel::Attitude]),
    ("dvl_change", &[SensorChannel::Dvl]),
    ("clock_change", &[SensorChannel::Range]),
    ("fin_bias_change", &[]),
    ("gnss_delay", &[SensorChannel::Gnss]),
    ("fin_rate", &[]),
    ("propeller_lag", &[]),
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
const HEADING_CHANGE: usize = 11;
const PITCH_CHANGE: usize = 15;
const DVL_CHANGE: usize = 16;
const GNSS_DELAY: usize = 19;
const FIN_RATE: usize = 20;
const PROPELLER_LAG: usize = 21;
/// A change of the board's entries under way: its sizes, then onset and end.
struct Change {
    /// Its place.
    entry: usize,
    /// Effect and parameter of the board that each size adds to.
    adds_to: &'static [(&'static str, &'static str)],
}
const CHANGES: [Change; 8] = [
    Change { entry: HEADING_CHANGE, adds_to: &[("heading_bias", "const_rad")] },
    Change { entry: 12, adds_to: &[("water_current", "north_mps"), ("water_current", "east_mps")] },
    Change { entry: 13, adds_to: &[("buoyancy_offset", "kg"), ("pitch_trim", "rad")] },
    Change { entry: 14, adds_to: &[("thrust_loss", "k_n_s2_per_rad_m")] },
    Change { entry: PITCH_CHANGE, adds_to: &[("pitch_sensor", "bias_rad")] },
    Change { entry: DVL_CHANGE, adds_to: &[("dvl_scale", "ratio"), ("dvl_misalignment", "yaw_rad")] },
    Change { entry: 17, adds_to: &[("clock_offset", "s")] },
    Change { entry: 18, adds_to: &[("fin_bias", "fin"), ("fin_bias", "rad")] },
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
const OF_READINGS: [usize; 9] =
    [HEADING_LAG, SOFT_IRON, DEPTH_SCALE, USBL_TURN, PLACE, HEADING_CHANGE, PITCH_CHANGE, DVL_CHANGE, GNSS_DELAY];

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
                    // which fin it is does not add up
                    let before = if id.info().kind == ParameterKind::Fin { 0.0 } else { board.get(id) };
                    board.set(id, before + size);
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

    /// What is left of them for a log that is [`Self::corrected`].
    #[must_use]
    pub fn beyond_readings(mut self) -> Self {
        OF_READINGS.iter().for_each(|entry| self.log[*entry] = [0.0; MOST]);
        self
    }

    /// Which sensors are late.
    #[must_use]
    pub fn delays(&self) -> Delays {
        let [heading_lag_s, dvl_s, gnss_s] = [HEADING_LAG, DVL_DELAY, GNSS_DELAY].map(|entry| self.log[entry][0]);
        Delays { heading_lag_s, dvl_s, gnss_s, dvl_arm_m: first_three(self.log[DVL_ARM]) }
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

    /// How slow actuators are to come to where they are commanded.
    #[must_use]
    pub fn slowness(&self) -> Slowness {
        Slowness { fins_s_per_rad: self.log[FIN_RATE][0], propeller_s: self.log[PROPELLER_LAG][0] }
    }

    /// By how much actuators are behind their commands, s.
    #[must_use]
    pub fn input_delay_s(&self) -> f64 {
        self.log[INPUT_DELAY][0]
    }

    /// What these entries make of a perfect reading, in place, of a vehicle at `x`, but for changes of the board's;
    /// returns ∂(read)/∂(true).
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
                let [sin2, cos2, ..] = self.log[SOFT_IRON];
                if [sin2, cos2] != [0.0; 2] {
                    let (sin, cos) = (2.0 * reading[2]).sin_cos();
                    reading[2] += sin2 * sin + cos2 * cos;
                    slope[2][2] += 2.0 * (sin2 * cos - cos2 * sin);
                }
                reading[2] -= late.heading_rad;
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
            SensorChannel::Gnss => {
                let arm =
                    Attitude::new(&state::attitude(x)).rotation() * Vector3::from(first_three(self.log[GNSS_ARM]));
                for axis in 0..2 {
                    reading[axis] += arm[axis] - late.position_m[axis];
                }
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
}

fn first_three([x, y, z, _]: [f64; MOST]) -> [f64; 3] {
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::effects::{LOG_CATALOGUE, find_of_log};

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
            ("buoyancy_change", &[-0.3, 0.1, 150.0, 0.0]),
            ("heading_change", &[0.08, 120.0, 180.0]),
        ];
        let effects = effects.iter().fold(Effects::default(), |all, (name, values)| all.with(name, values).unwrap());
        assert_eq!(effects.change_times_s(), [100.0, 120.0, 150.0, 180.0, 200.0]);
        for (t_s, north_mps, kg, rad) in [
            (99.0, 0.1, 0.0, 0.0),
            (100.0, 0.15, 0.0, 0.0),
            (150.0, 0.15, -0.3, 0.08),
            (180.0, 0.15, -0.3, 0.0),
            (200.0, 0.1, -0.3, 0.0),
        ] {
            let board = effects.board_at(t_s);
            let value = |effect, parameter| board.get(ParameterId::find(effect, parameter).unwrap());
            let now = [("water_current", "north_mps"), ("buoyancy_offset", "kg"), ("heading_bias", "const_rad")];
            let now = now.map(|(effect, parameter)| value(effect, parameter));
            for (now, then) in now.iter().zip([north_mps, kg, rad]) {
                assert!((now - then).abs() < 1e-12, "{t_s}: {now} {then}"); // rounding
            }
        }
        assert!(Effects::default().change_times_s().is_empty());
    }
}
