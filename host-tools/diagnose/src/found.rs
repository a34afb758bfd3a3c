//! An effect that was found, and how sure it is.

use crate::alternatives::Alternative;
use crate::candidates::{Candidate, Instance};
use backseat_core::effects::ParameterKind;
use backseat_logs::stats::Z_95;

/// One parameter of a found effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterEstimate {
    /// Name, as in the catalogue.
    pub name: &'static str,
    /// Unit, as in the catalogue.
    pub unit: &'static str,
    /// What kind of number.
    pub kind: ParameterKind,
    /// Fitted on the training blocks.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
}

impl ParameterEstimate {
    /// A size with its interval, by one sigma.
    #[must_use]
    pub fn size(name: &'static str, unit: &'static str, value: f64, sigma: f64) -> Self {
        let ci95 = [value - Z_95 * sigma, value + Z_95 * sigma];
        Self { name, unit, kind: ParameterKind::Size, value, ci95 }
    }

    /// The sizes of an entry by their values and one sigma of each.
    #[must_use]
    pub fn sizes(candidate: &Candidate, sizes: impl Iterator<Item = (f64, f64)>) -> Vec<Self> {
        let parameters = candidate.info().parameters.iter().zip(sizes);
        parameters.map(|(parameter, (value, sigma))| Self::size(parameter.name, parameter.unit, value, sigma)).collect()
    }
}

/// An effect that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundEffect {
    /// The effect with its values.
    pub instance: Instance,
    /// Its parameters with intervals, in the order of the catalogue.
    pub values: Vec<ParameterEstimate>,
    /// Probability of so much evidence where there is none, after the number of hypotheses tried.
    pub p_value: f64,
    /// By how much Σ e² falls by it, over the whole log.
    pub gain: f64,
    /// Gain per held-out block: mean and 95 % interval.
    pub held_gain: Option<(f64, [f64; 2])>,
    /// Entries that the data cannot exclude in its place, best first.
    pub alternatives: Vec<Alternative>,
}

impl FoundEffect {
    /// Entries of another name that the data cannot exclude in its place, best first.
    pub fn possible_alternatives(&self) -> impl Iterator<Item = &Alternative> {
        let own = self.instance.candidate.effect;
        self.alternatives.iter().filter(move |other| other.is_possible() && other.instance.candidate.effect != own)
    }
}
