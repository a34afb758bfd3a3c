//! Structure that no entry accounts for: generic terms of the equations of motion against what is left.

use crate::borne_out::BorneOut;
use crate::candidates::{Instance, own_terms, set_of};
use crate::judged::is_below_steady;
use crate::linear;
use crate::normal_equations::NormalEquations;
use crate::prepared_log::{DataPart, PreparedLog};
use crate::regressors::{GenericTerm, Regressor, Target, Variation, dictionary};
use crate::search::tail;
use crate::whitener::Pass;

/// Probability of finding structure where there is none, over the whole dictionary. Small, because noise that is
/// modestly coloured where it was declared white leaves some: it enters the filter and comes back by the autopilot.
pub const FAMILY_ERROR: f64 = 1e-6;
/// Most terms of a hint.
const MOST_TERMS: usize = 5;

/// A generic term and what it is worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Hint {
    /// Which.
    pub generic: GenericTerm,
    /// Its factor beside the others, in SI units of its target per unit of its factor.
    pub value: f64,
    /// By how much Σ e² falls beside the terms before it, where nothing judges.
    pub gain: f64,
    /// The same on the choosing blocks, fitted on the training ones.
    pub held_gain: f64,
    /// Probability under the null after the size of the dictionary.
    pub p: f64,
}

/// A term of a reduced model that has no name in the catalogue.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedTerm {
    /// What it stands for.
    pub name: &'static str,
    /// Its factors, fitted on the training blocks.
    pub values: Vec<f64>,
    /// Their 95 % intervals.
    pub ci95: Vec<[f64; 2]>,
    /// By how much Σ e² falls beside the terms before it, where nothing judges.
    pub gain: f64,
    /// The same on the choosing blocks, fitted on the training ones.
    pub held_gain: f64,
    /// Probability under the null after the number of terms tried.
    pub p: f64,
}

/// Structure found beside accepted effects: terms in the order in which they explain most.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Structure {
    /// Significant terms, best first (orthogonal matching pursuit).
    pub hints: Vec<Hint>,
    /// The same of a reduced model.
    pub named: Vec<NamedTerm>,
    /// Gain of all of them.
    pub gain: f64,
    /// What the data that judge say of the terms together.
    pub judged: BorneOut,
}

impl Hint {
    /// Whether it is less of a reading than mountings and sensors are steady to: a factor is of order one.
    fn is_negligible(&self) -> bool {
        matches!(self.generic.target, Target::Reading(channel) if is_below_steady(channel.unit(), self.value))
    }
}

impl Structure {
    /// Leaves out terms that the data that judge speak against; which, in a sentence.
    pub fn drop_if_refuted(&mut self) -> Option<String> {
        if self.hints.is_empty() || !self.judged.is_refuted() {
            return None;
        }
        let names: Vec<String> = self.hints.drain(..).map(|hint| hint.generic.name()).collect();
        let reason = "significant where the model was fitted, and the data that judge do not bear it out";
        Some(format!("{} is {reason} ({})", names.join(" with "), self.judged))
    }
}

/// Looks for generic terms beside the accepted effects. In a swell, what swings with it is left out: the autopilot
/// answers the swell, and fins and pitch then follow the noise instead of making it.
#[must_use]
pub fn find(log_data: &PreparedLog, accepted: &[Instance], swell: bool) -> Option<Structure> {
    let set = set_of(&log_data.scope.declared, accepted);
    let own: Vec<Regressor> = accepted.iter().flat_map(|instance| own_terms(instance, &set)).collect();
    let nuisance: Vec<usize> = (0..own.len()).collect();
    let mut dictionary = dictionary(&log_data.scope.present);
    dictionary.retain(|generic| !(swell && generic.factor.swings()));
    let generic = dictionary
        .iter()
        .map(|generic| Regressor { cause: Variation::GenericTerm(*generic), onsets_s: vec![f64::NEG_INFINITY] });
    let pass = log_data.pass(&set, &own.into_iter().chain(generic).collect::<Vec<_>>())?;
    Some(pursue(log_data, &pass, &nuisance, &dictionary))
}

fn pursue(log_data: &PreparedLog, pass: &Pass, nuisance: &[usize], dictionary: &[GenericTerm]) -> Structure {
    let sum = |part| pass.normal.sum(|block| log_data.is_in(part, block));
    let (train, held, whole) = (sum(DataPart::Train), sum(DataPart::Choose), sum(DataPart::Seen));
    let fit = |sum: &NormalEquations, columns: &[usize]| linear::fit(sum, columns, &[]);
    let held_gain =
        |columns: &[usize]| fit(&train, columns).map_or(0.0, |fit| linear::gain_of(&held, columns, &fit.theta, &[]));
    let mut chosen = nuisance.to_vec();
    let mut gain = fit(&whole, &chosen).map_or(0.0, |fit| fit.gain);
    let mut held_so_far = held_gain(&chosen);
    let start = gain;
    let mut structure = Structure::default();
    for _ in 0..MOST_TERMS {
        let best = (nuisance.len()..nuisance.len() + dictionary.len())
            .filter(|column| !chosen.contains(column))
            .filter_map(|column| {
                let columns: Vec<usize> = chosen.iter().copied().chain([column]).collect();
                let fit = fit(&whole, &columns)?;
                Some((column, columns, fit))
            })
            .max_by(|a, b| a.2.gain.total_cmp(&b.2.gain));
        let Some((column, columns, best)) = best else { break };
        let (inflation, blocks) = linear::inflation(&pass.normal, log_data.seen(), &columns, &best, &[]);
        let p = (tail(best.gain - gain, inflation, blocks, 1) * dictionary.len() as f64).min(1.0);
        let held = held_gain(&columns);
        if p > FAMILY_ERROR || held <= held_so_far {
            break;
        }
        structure.hints.push(Hint {
            generic: dictionary[column - nuisance.len()],
            value: best.theta[columns.len() - 1],
            gain: best.gain - gain,
            held_gain: held - held_so_far,
            p,
        });
        (chosen, gain, held_so_far) = (columns, best.gain, held);
    }
    structure.gain = gain - start;
    if let Some(together) = fit(&whole, &chosen) {
        for (hint, value) in structure.hints.iter_mut().zip(&together.theta[nuisance.len()..]) {
            hint.value = *value;
        }
        if let Some(alone) = fit(&whole, nuisance) {
            let columns = (chosen.as_slice(), together.theta.as_slice());
            structure.judged = judged(log_data, pass, (nuisance, &alone.theta), columns);
        }
    }
    if structure.hints.iter().all(Hint::is_negligible) {
        structure.hints.clear();
    }
    structure
}

/// What the blocks that judge say of columns with these values, beside fewer with other values: Σ d² and 2 Σ d e₁ of each.
fn judged(
    log_data: &PreparedLog,
    pass: &Pass,
    (fewer, without): (&[usize], &[f64]),
    (columns, with): (&[usize], &[f64]),
) -> BorneOut {
    let difference: Vec<f64> = with.iter().enumerate().map(|(i, x)| x - without.get(i).unwrap_or(&0.0)).collect();
    let blocks = pass.normal.blocks.iter().enumerate();
    let judging = blocks.filter(|(index, block)| block.count > 0 && log_data.is_in(DataPart::Judge, *index));
    let of = |(_, block): (usize, &NormalEquations)| {
        let gain = linear::gain_of(block, columns, with, &[]) - linear::gain_of(block, fewer, without, &[]);
        let mut square = 0.0;
        for (i, x) in columns.iter().zip(&difference) {
            for (j, y) in columns.iter().zip(&difference) {
                square += x * y * block.information(*i, *j);
            }
        }
        [square, gain - square]
    };
    BorneOut::of_blocks(&judging.map(of).collect::<Vec<_>>())
}
