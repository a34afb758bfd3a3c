//! Why the filter refuses something.

use crate::parameters::ParameterError;

/// Why a configuration was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ConfigError {
    /// The named value is not finite or outside its range. A value without a row in the table of parameters is named by
    /// its field of [`super::config::NavigationConfig`].
    OutOfRange(ParameterError),
    /// An effect's value is not plausible.
    Effect {
        /// The effect.
        effect: &'static str,
        /// Its parameter.
        parameter: &'static str,
    },
    /// The filter cannot estimate this parameter, or not without its other axis, or estimates it already.
    NotAState {
        /// The effect.
        effect: &'static str,
        /// Its parameter.
        parameter: &'static str,
    },
    /// More effect states than the filter has room for.
    TooManyEffectStates,
    /// With its effects, a parameter of the vehicle is outside its range.
    Plant {
        /// Key of the vehicle file.
        key: &'static str,
    },
    /// Effect states cannot come or go while the filter runs: configure and initialise again.
    LayoutChange,
}

impl From<ParameterError> for ConfigError {
    fn from(refused: ParameterError) -> Self {
        Self::OutOfRange(refused)
    }
}

/// Why a prediction was refused, or how the filter failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NavigationError {
    /// Not configured or not initialised.
    NotInitialised = 1, // an Option's None is zero
    /// The time lies before the filter's.
    TimeBackwards,
    /// More than [`crate::navigation::MAX_GAP_US`] since the last prediction: initialise again.
    GapTooLong,
    /// The actuator input is not finite.
    InvalidInput,
    /// A state or variance is no longer finite; initialise again.
    NotFinite,
    /// A variance is no longer positive; initialise again.
    NotPositive,
}

/// Why a delayed state was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CloneError {
    /// The filter is not initialised.
    NotInitialised,
    /// The ship is not known yet.
    NoShip,
    /// Both slots are in use: drop one first.
    Full,
}
