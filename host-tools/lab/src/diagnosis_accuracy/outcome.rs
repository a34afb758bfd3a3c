//! Verdict on a finished run: was the right cause named?

use super::plan::Class;
use super::run::{DiagnosedLog, Injected};
use super::separability::Separability;

/// Outcome of a verdict for one true effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Named, and nothing else is possible.
    Named,
    /// Ambiguous, with the true effect named or among those possible.
    Listed,
    /// Other effects are named, and it is not among those possible.
    Other,
    /// Nothing was found.
    Nothing,
    /// Structure was found that no entry accounts for.
    Unexplained,
}

impl Answer {
    pub const ALL: [Self; 5] = [Self::Named, Self::Listed, Self::Other, Self::Nothing, Self::Unexplained];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Named => "named",
            Self::Listed => "ambiguous, lists it",
            Self::Other => "other",
            Self::Nothing => "none",
            Self::Unexplained => "unexplained",
        }
    }
}

/// One true effect and the answer of `diagnose`.
pub struct JudgedEffect<'a> {
    pub run: &'a DiagnosedLog,
    pub truth: &'a Injected,
    pub answer: Answer,
    /// Of a single effect: it is named, and before all others. Of a pair: it is named.
    pub first: bool,
    pub separability: Option<&'a Separability>,
}

impl DiagnosedLog {
    /// Its true effects of the catalogue, if logs of its kind can judge them all.
    pub fn cases(&self) -> impl Iterator<Item = JudgedEffect<'_>> {
        let is_scored = self.class != Class::Outside && self.not_judged.is_none();
        self.injected.iter().filter(move |_| is_scored).map(|truth| self.case(truth))
    }

    fn case<'a>(&'a self, truth: &'a Injected) -> JudgedEffect<'a> {
        let own = truth.effect.as_str();
        let place = self.found.iter().position(|found| found.effect == own);
        let is_listed = self.found.iter().flat_map(|found| &found.ambiguous_with).any(|label| effect_of(label) == own);
        let answer = match self.verdict.as_str() {
            "none" => Answer::Nothing,
            _ if self.is_left_open() => Answer::Unexplained,
            "ambiguous" if place.is_some() || is_listed => Answer::Listed,
            "explained" if place.is_some() => Answer::Named,
            _ => Answer::Other,
        };
        JudgedEffect {
            run: self,
            truth,
            answer,
            first: place.is_some_and(|place| place == 0 || matches!(self.class, Class::Pair | Class::Triple)),
            separability: self.separability.iter().find(|of| of.effect == own),
        }
    }

    /// Whether the log is said not to be explained, in one of the three words for it.
    pub fn is_left_open(&self) -> bool {
        matches!(self.verdict.as_str(), "unexplained" | "implausible" | "undecided")
    }

    /// Whether held-out errors of the declared model are a fifth above those of the same log without the effect:
    /// velocity after ten seconds, or position.
    pub fn raises_error(&self) -> bool {
        let raises = |with: Option<f64>, without: Option<f64>| with.zip(without).is_some_and(|(a, b)| a >= 1.2 * b);
        raises(self.declared.velocity_mps, self.declaring_truth.velocity_mps)
            || raises(self.declared.position_m, self.declaring_truth.position_m)
    }
}

impl DiagnosedLog {
    /// Of a cause that is no entry: how far it is from every entry.
    pub fn apart(&self) -> Option<&Separability> {
        self.separability.first()
    }
}

impl JudgedEffect<'_> {
    pub fn separability(&self) -> Option<f64> {
        self.separability.map(|of| of.value)
    }

    /// The size of the effect: the length of all its numbers that are sizes of one kind.
    pub fn amplitude(&self) -> f64 {
        let is_size = |name: &str| !["fin", "time_s", "until_s", "period_s", "scale"].contains(&name);
        self.truth.parameters.iter().filter(|(name, _)| is_size(name)).map(|(_, v)| v * v).sum::<f64>().sqrt()
    }

    /// Something is found, be it only structure outside the catalogue.
    pub fn is_detected(&self) -> bool {
        self.answer != Answer::Nothing
    }
}

/// The effect of a label that may name a fin.
fn effect_of(label: &str) -> &str {
    label.split(' ').next().unwrap_or(label)
}
