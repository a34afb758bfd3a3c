//! The catalogue of physical effects a declared model may lack, one file an entry.
//!
//! An entry is a constant [`EffectInfo`]: name, parameters with plausible ranges, signature and confusions, and the
//! [`Hooks`] by which it enters the models. The same entry serves the filter (as a fixed value, or as states where it
//! varies), identification, diagnosis, the vehicle file and the board's parameters. What only the analysis of a log
//! needs stands in [`LOG_CATALOGUE`]. To add an entry: write its file, declare the module and add its `INFO` to
//! [`CATALOGUE`].
//!
//! Every parameter at zero is the declared model. A bias is measured minus true, a ratio measured / true − 1.
//! Effects that are present together apply in the order of the catalogue, which is the order of cause: lag before bias
//! before jam, sound speed before clock. `t_s` is time since the epoch of [`crate::navigation::Navigator::set_epoch`],
//! the start of a log.

pub mod buoyancy_offset;
pub mod clock_drift;
pub mod clock_offset;
pub mod cross_drag;
pub mod depth_bias;
pub mod drag_change;
pub mod dvl_misalignment;
pub mod dvl_scale;
pub mod fin_bias;
pub mod fin_lag;
pub mod fin_stuck;
pub mod gyro_bias;
pub mod heading_bias;
mod hooks;
mod info;
pub mod linear_drag;
mod log_entries;
pub mod pitch_sensor;
pub mod pitch_trim;
pub mod range_outliers;
pub mod roll_trim;
mod set;
pub mod sound_speed;
pub mod thrust_decay;
pub mod thrust_loss;
pub mod water_current;
pub mod water_density;
pub mod waves;

pub use hooks::{
    ActuatorMemory, FinsHook, GateHook, Hooks, InputHook, Measure, Moment, Motion, PlantHook, SensorChannel, Slopes,
    Step, VarianceHook, WaterHook, WrenchHook,
};
pub use info::{Confusion, EffectInfo, Enters, ParameterInfo, ParameterKind};
pub use set::{EffectError, EffectSet, PARAMETERS, ParameterId, parameters};

use crate::dynamics::FINS;

/// Every known effect, in the order in which those present apply. A board's image leaves out the texts for people.
pub static CATALOGUE: &[EffectInfo] = &{
    let mut entries = [ENTRIES[0]; ENTRIES.len()];
    let mut i = 0;
    while i < entries.len() {
        entries[i] = if cfg!(target_os = "none") { ENTRIES[i].without_text() } else { ENTRIES[i] };
        i += 1;
    }
    entries
};

const ENTRIES: &[EffectInfo] = &[
    water_current::INFO,
    // Plant.
    linear_drag::INFO,
    drag_change::INFO,
    thrust_loss::INFO,
    cross_drag::INFO,
    roll_trim::INFO,
    pitch_trim::INFO,
    buoyancy_offset::INFO,
    water_density::INFO,
    // Actuators.
    thrust_decay::INFO,
    fin_lag::INFO,
    fin_bias::INFO,
    fin_stuck::INFO,
    // Sensors.
    heading_bias::INFO,
    pitch_sensor::INFO,
    gyro_bias::INFO,
    depth_bias::INFO,
    dvl_scale::INFO,
    dvl_misalignment::INFO,
    sound_speed::INFO,
    clock_offset::INFO,
    clock_drift::INFO,
    // Noise.
    range_outliers::INFO,
    waves::INFO,
];

/// Entries that only the analysis of a log knows: corrections of the declared installation, and effects in models of
/// whole logs. They are no parameters of a board and no states of its filter.
pub static LOG_CATALOGUE: &[EffectInfo] = log_entries::ENTRIES;

/// Whether an event that begins at `time_s`, and ends at `until_s` unless that is 0, is there at `t_s`.
#[must_use]
pub fn is_on(t_s: f64, time_s: f64, until_s: f64) -> bool {
    t_s >= time_s && (until_s == 0.0 || t_s < until_s)
}

/// Names of the fins, whose parameter values are 1 to 4.
pub const FIN_NAMES: [&str; FINS] = ["top", "bottom", "port", "starboard"];

/// The entry of that name that a board knows.
#[must_use]
pub fn find(name: &str) -> Option<&'static EffectInfo> {
    CATALOGUE.iter().find(|effect| effect.name == name)
}

/// The entry of that name in [`CATALOGUE`] or [`LOG_CATALOGUE`].
#[must_use]
pub fn find_of_log(name: &str) -> Option<&'static EffectInfo> {
    find(name).or_else(|| LOG_CATALOGUE.iter().find(|effect| effect.name == name))
}

/// Value of a parameter of kind [`ParameterKind::Fin`] that means the fin of that name.
#[must_use]
pub fn fin_value(name: &str) -> Option<f64> {
    FIN_NAMES.iter().zip(1_u8..).find(|(fin, _)| **fin == name).map(|(_, value)| f64::from(value))
}

/// Place of the fin that a parameter's value means; `None` for 0 and everything that is no fin.
#[must_use]
pub fn fin_index(value: f64) -> Option<usize> {
    (0..FINS).find(|&index| value == (index + 1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_confusions_known() {
        let all = || CATALOGUE.iter().chain(LOG_CATALOGUE);
        for (i, effect) in all().enumerate() {
            assert!(all().skip(i + 1).all(|other| other.name != effect.name), "{}", effect.name);
            assert!(!effect.parameters.is_empty() && effect.parameters.len() <= 4, "{}", effect.name);
            for confusion in effect.confused_with {
                assert!(find_of_log(confusion.effect).is_some(), "{}: {}", effect.name, confusion.effect);
                assert_ne!(confusion.effect, effect.name);
            }
            for parameter in effect.parameters {
                assert!(parameter.min < parameter.max, "{}.{}", effect.name, parameter.name);
                assert!(parameter.kind != ParameterKind::Size || parameter.min <= 0.0, "{}", effect.name);
            }
        }
        assert!(find("none").is_none());
    }

    #[test]
    fn fins_go_both_ways() {
        assert_eq!(fin_value("port"), Some(3.0));
        assert_eq!(fin_index(3.0), Some(2));
        assert_eq!((fin_value("left"), fin_index(0.0), fin_index(5.0), fin_index(f64::NAN)), (None, None, None, None));
    }
}
