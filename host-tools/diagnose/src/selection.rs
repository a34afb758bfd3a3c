//! Which effects are accepted: one engine for every log, whatever model it is compared with.
//!
//! Each step does the first of these that there is to do, and fits what is accepted together again: what is not needed
//! beside the others is dropped, the weakest first; what cannot be is refused; what is missed is added, the one that
//! explains most of the candidates that are significant. It ends where there is nothing to do. Nothing is added any
//! more where the last addition made another effect superfluous. A model whose hypotheses are columns of one pass
//! begins with nothing accepted; one whose joint fit moves every entry freely begins with all.

use crate::borne_out::LEAST_EXPECTED;
use crate::candidates::Instance;
use crate::split::DataPart;
use rayon::prelude::*;

/// Probability of naming any effect where there is none, over all that are tried.
pub const FAMILY_ERROR: f64 = 2e-3;
/// Most effects that are accepted one by one.
pub const MOST_EFFECTS: usize = 4;
/// Blocks that a log must have for each number of an effect: with fewer, anything fits.
pub const BLOCKS_A_NUMBER: usize = 4;
/// Cost of a fitted number where gains are compared (Akaike).
pub const COST: f64 = 2.0;
/// Gain beyond that cost from which an effect of runs stays in the model that predicts them: what is certain over all
/// that was asked is told when it is named.
pub const PREDICTIVE_GAIN: f64 = 8.0;
/// Candidates whose gain falls short of the best by less than this, a number and a share, are fitted in full: by so
/// much a derivative may promise too much.
const CLOSE: (f64, f64) = (40.0, 0.1);
/// Most of them.
const MOST_CLOSE: usize = 4;
/// By how much a second selection must explain more than the first, its numbers counted.
const BETTER: f64 = 10.0;

/// What one hypothesis is worth beside the accepted effects.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// What.
    pub instance: Instance,
    /// By how much Σ e² falls over the blocks that choose and those that train.
    pub gain: f64,
    /// Divisor of the gain for residuals that are still coloured.
    pub inflation: f64,
    /// Numbers fitted.
    pub degrees: usize,
    /// Gain of the values fitted on the training blocks, on the choosing ones.
    pub held_gain: f64,
    /// Probability under the null, before the number of hypotheses is considered.
    pub p: f64,
    /// The same of what it adds to the entry whose higher order it is; 0 where it is none.
    pub p_beside_lower: f64,
    /// Whether beside that entry the log determines its numbers to less than what is plausible for them.
    pub is_determined: bool,
}

impl Evidence {
    /// Gain less the cost of its numbers.
    #[must_use]
    pub fn score(&self) -> f64 {
        self.gain - COST * self.degrees as f64
    }

    /// Probability under the null, beside the entry whose higher order it is as well.
    #[must_use]
    pub fn chance(&self) -> f64 {
        self.p.max(self.p_beside_lower)
    }

    /// About one sigma of each size: the whole is √gain of its own from zero.
    #[must_use]
    pub fn sigmas(&self) -> Vec<f64> {
        let whole = self.instance.sizes.iter().map(|size| size * size).sum::<f64>().sqrt();
        vec![whole / (self.gain / self.inflation.max(1.0)).max(1.0).sqrt(); self.instance.sizes.len()]
    }
}

/// Every hypothesis beside the accepted effects.
#[derive(Clone, Debug, Default)]
pub struct Round {
    /// Every hypothesis, best first; of events the best span.
    pub ladder: Vec<Evidence>,
    /// Of every event the best span without an end and the best with one, best first.
    pub events: Vec<Evidence>,
    /// Number of hypotheses tried, all spans counted.
    pub tried: usize,
}

impl Round {
    /// Whether a hypothesis stands after the number of those tried, and on data it was not fitted to. Of an event these may
    /// say nothing: a compass that jumps shows it at one instant.
    #[must_use]
    pub fn is_significant(&self, evidence: &Evidence) -> bool {
        let least = if evidence.instance.candidate.span.is_some() { -LEAST_EXPECTED } else { 0.0 };
        evidence.chance() * (self.tried as f64) < FAMILY_ERROR && evidence.held_gain > least
    }
}

/// What an accepted effect is worth beside the other accepted ones.
#[derive(Clone, Copy, Debug)]
pub struct Worth {
    /// What speaks for it beyond what is asked of it: below zero it is dropped, the least first.
    pub surplus: f64,
    /// Gain less the cost of its numbers: of several that say nothing the least goes first.
    pub score: f64,
}

impl Worth {
    /// By a probability by chance; times the number tried, where that was not asked when the effect was accepted.
    #[must_use]
    pub fn by_chance(p: f64, score: f64) -> Self {
        Self { surplus: (FAMILY_ERROR / p).ln(), score }
    }
}

/// An effect that is not named.
pub struct Refusal {
    /// Its place among those accepted.
    pub place: usize,
    /// In a sentence.
    pub note: String,
    /// Why.
    pub ground: Ground,
}

/// Why an effect is not named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ground {
    /// It is significant, and of a size that this vehicle cannot have.
    Impossible,
    /// Too little speaks for it.
    Unfounded,
    /// The data that judge speak against it.
    Refuted,
}

/// A log with a model, whose effects are selected.
pub trait Selectable: Sync {
    /// Effects fitted together.
    type Fit: Send + Sync;

    /// Every candidate beside those accepted.
    fn round(&self, accepted: &[Instance], fit: &Self::Fit) -> Option<Round>;
    /// Those that may be accepted.
    fn standing(&self, _accepted: &[Instance], round: &Round) -> Vec<Evidence> {
        round.ladder.iter().filter(|evidence| round.is_significant(evidence)).cloned().collect()
    }
    /// Fits effects together on a part, and puts their sizes into them; `None` where no values are possible.
    fn fit(&self, effects: &mut Vec<Instance>, from: &Self::Fit, part: DataPart) -> Option<Self::Fit>;
    /// Σ e² of a fit, or what takes its place, and the cost of its numbers.
    fn cost(&self, effects: &[Instance], fit: &Self::Fit) -> f64;
    /// Of one of the effects of a fit, beside those that are left of them.
    fn worth(&self, effects: &[Instance], place: usize, fit: &Self::Fit) -> Worth;
    /// The effect that cannot be accepted, if there is one: it is not asked again.
    fn refusal(&self, _effects: &[Instance], _fit: &Self::Fit) -> Option<Refusal> {
        None
    }
    /// Where effects may hide each other: what another selection should begin with.
    fn another_start(&self, _selected: &Selected<Self::Fit>) -> Option<Instance> {
        None
    }
    /// After each effect that was added and stands.
    fn settle(&mut self, _fit: &Self::Fit) -> Option<()> {
        Some(())
    }
}

/// What the selection has come to.
pub struct Selected<F> {
    /// With their values.
    pub accepted: Vec<Instance>,
    /// Fitted together.
    pub fit: F,
    /// The hypotheses of every round.
    pub rounds: Vec<Round>,
    /// Entries that are significant with a size that this vehicle cannot have, with the reason.
    pub refused: Vec<(&'static str, String)>,
}

/// Selects from what is accepted at first, and its fit; `None` where the model cannot be fitted.
pub fn select<M: Selectable>(
    model: &mut M,
    (accepted, fit): (Vec<Instance>, M::Fit),
    progress: &mut dyn FnMut(&str),
) -> Option<Selected<M::Fit>> {
    let start = Selected { accepted, fit, rounds: Vec::new(), refused: Vec::new() };
    rounds(model, start, progress, M::settle)
}

/// Where two effects hide each other, the first may take up so much of the second that its derivative no longer shows
/// it: another selection begins with another effect, and what explains more stays.
pub fn in_another_order<M: Selectable>(
    model: &mut M,
    first: Selected<M::Fit>,
    progress: &mut dyn FnMut(&str),
) -> Option<Selected<M::Fit>> {
    let Some(start) = model.another_start(&first) else { return Some(first) };
    progress("another order");
    let mut accepted = vec![start];
    let Some(fit) = model.fit(&mut accepted, &first.fit, DataPart::Train) else { return Some(first) };
    let second = Selected { accepted, fit, rounds: first.rounds[..1].to_vec(), refused: Vec::new() };
    let second = rounds(model, second, progress, |_, _| Some(()))?;
    if model.cost(&second.accepted, &second.fit) + BETTER < model.cost(&first.accepted, &first.fit) {
        model.settle(&second.fit)?;
        return Some(second);
    }
    Some(first)
}

fn rounds<M: Selectable>(
    model: &mut M,
    mut selected: Selected<M::Fit>,
    progress: &mut dyn FnMut(&str),
    settle: impl Fn(&mut M, &M::Fit) -> Option<()>,
) -> Option<Selected<M::Fit>> {
    let mut barred: Vec<&'static str> = Vec::new();
    let (mut is_added, mut is_last) = (false, false);
    loop {
        let Selected { accepted, fit, rounds, refused } = &mut selected;
        let mut gone = Vec::new();
        while let Some(place) = superfluous(model, accepted, fit) {
            gone.push(accepted.remove(place).candidate.effect);
        }
        // What is dropped beside what was added would be found again.
        is_last |= is_added && !gone.is_empty();
        if gone.is_empty()
            && let Some(refusal) = model.refusal(accepted, fit)
        {
            let effect = accepted.remove(refusal.place).candidate.effect;
            gone.push(effect);
            barred.push(effect);
            if refusal.ground == Ground::Impossible {
                refused.push((effect, refusal.note));
            }
        }
        if !gone.is_empty() {
            progress(&format!("without {}", gone.join(", ")));
            *fit = model.fit(accepted, fit, DataPart::Train)?;
            is_added = false;
            continue;
        }
        if is_last {
            return Some(selected);
        }
        if is_added {
            settle(model, fit)?;
        }
        progress(&format!("hypotheses, round {}", rounds.len() + 1));
        let round = model.round(accepted, fit)?;
        let mut standing = model.standing(accepted, &round);
        standing.retain(|evidence| !barred.contains(&evidence.instance.candidate.effect));
        rounds.push(round);
        let Some(added) = best(model, accepted, fit, standing) else { return Some(selected) };
        progress("refit");
        let mut with = accepted.clone();
        with.push(added);
        let Some(joint) = model.fit(&mut with, fit, DataPart::Train) else { return Some(selected) };
        (*accepted, *fit, is_added) = (with, joint, true);
    }
}

/// The best of those that stand, fitted in full where several come close.
fn best<M: Selectable>(
    model: &M,
    accepted: &[Instance],
    fit: &M::Fit,
    mut standing: Vec<Evidence>,
) -> Option<Instance> {
    standing.sort_by(|a, b| b.score().total_cmp(&a.score()));
    let top = standing.first()?.score();
    standing.retain(|evidence| evidence.score() > top - CLOSE.0 - CLOSE.1 * top);
    standing.truncate(MOST_CLOSE);
    if standing.len() == 1 {
        return standing.pop().map(|evidence| evidence.instance);
    }
    let full = |evidence: Evidence| {
        let mut with = accepted.to_vec();
        with.push(evidence.instance);
        let joint = model.fit(&mut with, fit, DataPart::Seen)?;
        Some((model.cost(&with, &joint), with.pop()?))
    };
    let best = standing.into_par_iter().filter_map(full).min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, instance)| instance)
}

/// The weakest, if it is not needed beside the others.
fn superfluous<M: Selectable>(model: &M, effects: &[Instance], fit: &M::Fit) -> Option<usize> {
    let weaker = |a: &Worth, b: &Worth| a.surplus.total_cmp(&b.surplus).then(a.score.total_cmp(&b.score));
    let all = (0..effects.len()).map(|place| (model.worth(effects, place, fit), place));
    let (weakest, place) = all.min_by(|a, b| weaker(&a.0, &b.0))?;
    (weakest.surplus <= 0.0).then_some(place)
}
