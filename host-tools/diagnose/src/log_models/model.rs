//! What a log model is: predicted scalars (rows) from what was logged and a vector θ of the effects' sizes.

use crate::prepared_log::FORECAST_SHARE;
use crate::samples::ResidualChannel;

/// One scalar: measured minus predicted, and the derivative of the prediction by θ.
#[derive(Clone, Debug)]
pub struct Row {
    /// Time since the log's start, s.
    pub t_s: f64,
    /// Which scalar.
    pub channel: ResidualChannel,
    /// Measured minus predicted, in the channel's unit.
    pub residual: f64,
    /// ∂predicted/∂θ.
    pub slopes: Vec<f64>,
}

/// An entry of the catalogue with the columns of θ that are its sizes.
pub type Entry = (&'static str, Vec<usize>);
/// Columns outside the catalogue, with their meaning.
pub type Nameless = (&'static str, Vec<usize>);

/// A model of a log.
pub trait LogModel: Sync {
    /// Length of θ.
    fn columns(&self) -> usize;
    /// Rows at θ, in order of time within each channel.
    fn rows(&self, theta: &[f64]) -> Vec<Row>;
    /// Columns that every fit has: numbers of the plain model that nobody declares.
    fn calibrated(&self) -> Vec<usize>;
    /// Entries of the catalogue that this log can test.
    fn entries(&self) -> Vec<Entry>;
    /// Terms outside the catalogue that may explain the remaining residual.
    fn nameless(&self) -> Vec<Nameless>;
    /// Whether effects hide each other, so that none stands out alone: they are then fitted together first, and those
    /// that are not needed are dropped.
    fn is_coupled(&self) -> bool {
        false
    }
    /// Where a joint fit begins: values that a vehicle may have, at which every column shows.
    fn guess(&self) -> Vec<f64> {
        vec![0.0; self.columns()]
    }
    /// Share at the end of the log that is held out as a forecast.
    fn forecast_share(&self) -> f64 {
        FORECAST_SHARE
    }
    /// Length of a block, s.
    fn block_s(&self) -> f64;
    /// Errors of velocity and position at θ.
    fn measures(&self, theta: &[f64]) -> Measures;
}

/// What is scored beside whiteness.
#[derive(Clone, Debug, Default)]
pub struct Measures {
    /// (time in s, error of a velocity in m/s).
    pub velocity: Vec<(f64, f64)>,
    /// (time in s, error of a position in m).
    pub position: Vec<(f64, f64)>,
    /// What the position is compared with.
    pub against: Option<&'static str>,
    /// Accelerations, whose unexplained share is reported.
    pub unexplained: Vec<Unexplained>,
}

/// An acceleration and what a model leaves of it.
#[derive(Clone, Debug)]
pub struct Unexplained {
    /// Which.
    pub name: &'static str,
    /// (time in s, residual, measured), m/s² or rad/s².
    pub values: Vec<(f64, f64, f64)>,
}
