//! Averages over the runs, and how often they lie where a consistent filter's would.

use super::block::Block;
use super::chi_square::Band;
use super::ensemble::{Ensemble, ErrorSample, Square, measurement_names};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// How averages lie to their pointwise 95 % bands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Inside {
    /// Of the block or the sensor.
    pub name: String,
    /// Degrees of freedom of one normalised square.
    pub degrees: u64,
    /// Time in s (of a measurement: its number) and average over the runs, over the degrees of freedom: 1 is expected.
    pub averages: Vec<(f64, f64)>,
    /// Pointwise band of these averages.
    pub band: Band,
    /// Mean of all.
    pub mean: f64,
    /// Band of that mean for innovations, which are independent of one another; none for errors, which are not.
    pub mean_band: Option<Band>,
    /// Share inside the pointwise band, below it and above it.
    pub shares: [f64; 3],
}

impl Inside {
    fn of(name: &str, degrees: u64, runs: u64, averages: Vec<(f64, f64)>) -> Option<Self> {
        let band = per_degree(runs, degrees);
        let count = averages.len() as f64;
        let share = |of: &dyn Fn(f64) -> bool| averages.iter().filter(|(_, value)| of(*value)).count() as f64 / count;
        let shares = [share(&|v| band.holds(v)), share(&|v| v < band.low), share(&|v| v > band.high)];
        let mean = averages.iter().map(|(_, value)| value).sum::<f64>() / count;
        (!averages.is_empty()).then_some(Self {
            name: name.to_owned(),
            degrees,
            averages,
            band,
            mean,
            mean_band: None,
            shares,
        })
    }
}

/// Band of an average over `averaged` squares of `degrees` degrees of freedom, over these degrees.
fn per_degree(averaged: u64, degrees: u64) -> Band {
    let band = Band::of_mean(averaged, degrees);
    Band { low: band.low / degrees as f64, high: band.high / degrees as f64 }
}

/// ANEES of each block that there is, second by second where every run has an estimate, from `from_s` on.
#[must_use]
pub fn blocks(ensemble: &Ensemble, from_s: usize) -> Vec<Inside> {
    let runs = ensemble.runs.len();
    let seconds = ensemble.runs.iter().map(|run| run.samples.len()).min().unwrap_or(0);
    let moments: Vec<(usize, Vec<&ErrorSample>)> = (from_s..seconds)
        .filter_map(|second| {
            let samples: Option<Vec<&ErrorSample>> =
                ensemble.runs.iter().map(|run| run.samples[second].as_ref()).collect();
            samples.map(|samples| (second, samples))
        })
        .collect();
    let effects = moments.first().map_or(0, |(_, samples)| samples[0].error.len() - 12);
    Block::ALL
        .iter()
        .enumerate()
        .filter_map(|(place, block)| {
            let degrees = block.states(effects).len();
            let average = |samples: &[&ErrorSample]| {
                samples.iter().map(|sample| sample.nees[place]).sum::<f64>() / (runs * degrees) as f64
            };
            let averages = moments.iter().map(|(second, samples)| (*second as f64, average(samples)));
            // A block that is never reported has no average.
            let averages = averages.filter(|(_, average)| !average.is_nan()).collect();
            (degrees > 0).then(|| Inside::of(block.name(), degrees as u64, runs as u64, averages)).flatten()
        })
        .collect()
}

/// ANIS of each kind of measurement, the k-th of all runs together.
#[must_use]
pub fn innovations(ensemble: &Ensemble) -> Vec<Inside> {
    let of_sensor = |name: &'static str| {
        let runs: Vec<&[Square]> =
            ensemble.runs.iter().map(|run| run.squares.get(name).map_or(&[][..], Vec::as_slice)).collect();
        let count = runs.iter().map(|run| run.len()).min()?;
        let degrees = u64::from(runs[0].first()?.1);
        let per = (runs.len() as u64 * degrees) as f64;
        let averages = (0..count).map(|k| (k as f64, runs.iter().map(|run| run[k].0).sum::<f64>() / per)).collect();
        let mut inside = Inside::of(name, degrees, runs.len() as u64, averages)?;
        inside.mean_band = Some(per_degree((runs.len() * count) as u64, degrees));
        Some(inside)
    };
    measurement_names().filter_map(of_sensor).collect()
}

/// Root mean squared errors over the runs at each whole second: horizontal position, attitude, velocity in NED.
#[must_use]
pub fn errors(ensemble: &Ensemble) -> Vec<[f64; 3]> {
    let seconds = ensemble.runs.iter().map(|run| run.samples.len()).min().unwrap_or(0);
    let squared = |sample: &ErrorSample| {
        let sum = |at: Range<usize>| sample.error.rows_range(at).norm_squared();
        [sum(0..2), sum(3..6), sample.velocity_ned_mps.iter().map(|v| v * v).sum()]
    };
    (0..seconds)
        .map(|second| {
            let samples: Vec<[f64; 3]> =
                ensemble.runs.iter().filter_map(|run| run.samples[second].as_ref().map(squared)).collect();
            core::array::from_fn(|i| (samples.iter().map(|s| s[i]).sum::<f64>() / samples.len() as f64).sqrt())
        })
        .collect()
}
