//! Why the filter does not go over a log, in words.

use backseat_core::navigation::{ConfigError, NavigationError, Navigator};
use backseat_core::parameters::ParameterError;
use backseat_logs::DataError;
use backseat_logs::log::Log;

/// A configuration that the filter refuses, in words.
pub(super) fn refused(log: &Log, error: ConfigError) -> DataError {
    let message = match error {
        ConfigError::OutOfRange(ParameterError { key, value, min, max, .. }) => {
            format!("{key} = {value}: expected {min} to {max}")
        }
        ConfigError::Effect { effect, parameter } => format!("effects.{effect}.{parameter} is outside its range"),
        ConfigError::NotAState { effect, parameter } => {
            format!("the filter cannot estimate effects.{effect}.{parameter}, or not by itself")
        }
        ConfigError::TooManyEffectStates => "more effects are to be estimated than the filter has room for".to_owned(),
        ConfigError::Plant { key } => format!("with its effects, {key} is outside its range"),
        ConfigError::LayoutChange => "the filter refuses other effect states while it runs".to_owned(),
    };
    DataError::file(&log.path, message)
}

/// What stopped a filter, in words.
pub(super) fn failed(log: &Log, navigator: &Navigator, error: NavigationError) -> DataError {
    let t_s = navigator.time_us() as f64 * 1e-6;
    let what = match error {
        NavigationError::GapTooLong => "the log has a gap of more than ten minutes after",
        NavigationError::NotFinite => "the filter's state is no longer finite at",
        NavigationError::NotPositive => "the filter's covariance is no longer positive at",
        NavigationError::NotInitialised => "the filter is not initialised at",
        NavigationError::TimeBackwards => "time goes back after",
        NavigationError::InvalidInput => "a fin angle or the propeller speed is not a finite number at",
    };
    DataError::file(&log.path, format!("{what} t_s {t_s}"))
}
