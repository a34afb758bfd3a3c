//! What a log model is: predicted scalars (rows) from what was logged and a vector θ of the effects' sizes.

use super::layout::Layout;
use crate::remaining::Remaining;
use crate::samples::ResidualChannel;
use crate::split::FORECAST_SHARE;
use backseat_core::effects;
use backseat_core::navigation::SensorNoise;
use backseat_logs::stats::rms;

/// One scalar: measured minus predicted, and the derivative of the prediction by θ.
#[derive(Clone, Debug)]
pub struct Row {
    /// Time since the log's start, s.
    pub t_s: f64,
    /// Which scalar.
    pub channel: ResidualChannel,
    /// Rows of one sequence follow each other without a gap; noise begins anew with each. A run has its own.
    pub sequence: u32,
    /// Measured minus predicted, in the channel's unit.
    pub residual: f64,
    /// ∂predicted/∂θ.
    pub slopes: Vec<f64>,
}

/// An entry of the catalogue with the columns of θ that are its sizes.
pub type Entry = (&'static str, Vec<usize>);
/// Columns outside the catalogue, with their meaning.
pub type OutsideTerm = (&'static str, Vec<usize>);

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
    fn outside_catalogue(&self) -> Vec<OutsideTerm>;
    /// Beginning and end of each run, s since the log's start; none: the log is one run.
    fn runs(&self) -> Vec<[f64; 2]> {
        Vec::new()
    }
    /// Where the joint fit begins: values that a vehicle may have, at which every column shows.
    fn guess(&self) -> Vec<f64> {
        vec![0.0; self.columns()]
    }
    /// Columns in which the rows are so far from linear that the joint fit is to begin at other values as well.
    fn starts(&self) -> Vec<(usize, &'static [f64])> {
        Vec::new()
    }
    /// Of all θ that give the same rows as this one, the one that a vehicle can have.
    fn of_those_alike(&self, theta: Vec<f64>) -> Vec<f64> {
        theta
    }
    /// What is known of a column before the log: mean and one sigma; `None`: of entries half of what the catalogue takes
    /// as plausible, of other columns nothing.
    fn prior(&self, _column: usize) -> Option<[f64; 2]> {
        None
    }
    /// In a sentence, where a number that is always fitted comes out as none can be: what it may stand in for.
    fn at_odds(&self, _theta: &[f64], _sigmas: &[f64]) -> Option<String> {
        None
    }
    /// Least and largest value that an entry's column may have on this vehicle; beyond, something else is the cause.
    fn limits(&self, entry: &'static str, place: usize) -> [f64; 2] {
        catalogue_range(entry, place)
    }
    /// Whether the rows of a channel are sums since the beginning of their sequence, as positions are of velocities.
    fn is_summed(&self, _channel: ResidualChannel) -> bool {
        false
    }
    /// Entries that may begin or end within a log.
    fn events(&self) -> Vec<&'static str> {
        Vec::new()
    }
    /// Share at the end of each run that judges as a forecast.
    fn forecast_share(&self) -> f64 {
        FORECAST_SHARE
    }
    /// Length of a block, s.
    fn block_s(&self) -> f64;
    /// Errors of velocity and position where the rows leave these residuals.
    fn measures(&self, rows: &[Row], layout: &Layout) -> Measures;
    /// What is left on the data that judges, beside what the sensors can make: of each channel its root mean square.
    fn remaining(&self, rows: &[Row], layout: &Layout, sensors: &SensorNoise) -> Vec<Remaining> {
        let of = |channel: ResidualChannel| {
            let judged = rows.iter().filter(|row| row.channel == channel && layout.is_judged(row.t_s));
            let left = rms(&judged.map(|row| row.residual).collect::<Vec<_>>())?;
            let what = format!("{} error", channel.name());
            Some(Remaining { what, unit: channel.unit(), left, most: channel.sensor().most(sensors) })
        };
        ResidualChannel::ALL.into_iter().filter(|channel| !self.is_summed(*channel)).filter_map(of).collect()
    }
}

/// What the catalogue takes as plausible of a size of an entry.
#[must_use]
pub fn catalogue_range(entry: &str, place: usize) -> [f64; 2] {
    let sizes = effects::find_of_log(entry).map_or(&[][..], |info| info.parameters);
    sizes.get(place).map_or([f64::NEG_INFINITY, f64::INFINITY], |parameter| [parameter.min, parameter.max])
}

/// What is scored beside whiteness.
#[derive(Clone, Debug, Default)]
pub struct Measures {
    /// (time in s, error of a velocity in m/s).
    pub velocity: Vec<(f64, f64)>,
    /// (time in s, error of a position in m); not a number where the position begins anew.
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
