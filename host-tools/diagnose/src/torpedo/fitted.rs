//! A model that was fitted, and which of its effects are needed.

use crate::candidates::{Candidate, Instance};
use crate::selection::{self, COST, Ground, PREDICTIVE_GAIN, Refusal, Round, Selectable, Worth};
use crate::split::DataPart;
use backseat_identify::short_runs::{Draft, Fit, Problem, Unknown};

/// Lengths of the windows as the fit proceeds: short ones converge from afar.
pub(super) const LENGTHS_S: [f64; 3] = [5.0, 10.0, 20.0];

/// What was fitted to which runs, and the fit.
pub(super) struct Fitted<'a> {
    pub(super) problem: Problem<'a>,
    pub(super) fit: Fit,
}

impl Fitted<'_> {
    /// Places of the numbers of an effect.
    pub(super) fn places(&self, effect: &str) -> Vec<usize> {
        let unknowns = self.problem.unknowns.iter().enumerate();
        unknowns.filter(|(_, unknown)| unknown.effect == effect).map(|(place, _)| place).collect()
    }

    /// The model that was fitted.
    pub(super) fn draft(&self) -> Draft {
        self.problem.base.with(&self.problem.unknowns, &self.fit.values)
    }

    /// What was fitted, with its values: where another fit starts.
    pub(super) fn start(&self) -> Option<(&[Unknown], &[f64])> {
        Some((&self.problem.unknowns, &self.fit.values))
    }
}

/// Fits all runs from the values of the same unknowns in another fit, or from the prior.
pub(super) fn fitted<'a>(problem: Problem<'a>, start: Option<(&[Unknown], &[f64])>) -> Result<Fitted<'a>, String> {
    fitted_over(if start.is_some() { &LENGTHS_S[2..] } else { &LENGTHS_S[..] }, problem, start)
}

/// The same over windows of these lengths in turn.
pub(super) fn fitted_over<'a>(
    lengths_s: &[f64],
    problem: Problem<'a>,
    start: Option<(&[Unknown], &[f64])>,
) -> Result<Fitted<'a>, String> {
    let from = |unknown: &Unknown| {
        let (known, values) = start?;
        known.iter().position(|other| other.name == unknown.name).map(|place| values[place])
    };
    let value = |unknown: &Unknown| from(unknown).unwrap_or_else(|| unknown.first_guess());
    let values: Vec<f64> = problem.unknowns.iter().map(value).collect();
    let fit = problem.fit(&|_| true, &values, lengths_s).ok_or(NO_FIT)?;
    Ok(Fitted { problem, fit })
}

const NO_FIT: &str = "no run is deeper than 0.5 m at speed for 3 s, or the fit does not converge";

/// Effects of runs, of which some are in question.
struct Runs<'q, P> {
    problem: P,
    asked: &'q [&'static str],
}

/// Of the effects `kept` those that are needed, and their fit; only those `asked` are in question.
pub(super) fn needed<'a>(
    asked: &[&'static str],
    kept: &[&'static str],
    fit: Fitted<'a>,
    problem: impl Fn(&[&'static str]) -> Problem<'a> + Sync,
    progress: &mut dyn FnMut(&str),
) -> Result<(Vec<&'static str>, Fitted<'a>), String> {
    let instance = |effect: &&'static str| Instance {
        candidate: Candidate { effect, member: None, span: None },
        sizes: Vec::new(),
    };
    let start = (kept.iter().map(instance).collect(), fit);
    let selected = selection::select(&mut Runs { problem, asked }, start, progress).ok_or(NO_FIT)?;
    Ok((names(&selected.accepted), selected.fit))
}

fn names(effects: &[Instance]) -> Vec<&'static str> {
    effects.iter().map(|effect| effect.candidate.effect).collect()
}

impl<'a, P: Fn(&[&'static str]) -> Problem<'a> + Sync> Selectable for Runs<'_, P> {
    type Fit = Fitted<'a>;

    /// All are fitted at first: none is missed.
    fn round(&self, _: &[Instance], _: &Fitted<'a>) -> Option<Round> {
        Some(Round::default())
    }

    fn fit(&self, effects: &mut Vec<Instance>, from: &Fitted<'a>, _: DataPart) -> Option<Fitted<'a>> {
        fitted((self.problem)(&names(effects)), from.start()).ok()
    }

    fn cost(&self, _: &[Instance], fit: &Fitted<'a>) -> f64 {
        fit.fit.cost
    }

    fn worth(&self, effects: &[Instance], place: usize, fitted: &Fitted<'a>) -> Worth {
        let (left, own) = (names(effects), effects[place].candidate.effect);
        let mut gaussian = fitted.fit.gaussian();
        let mut gone: Vec<&'static str> = fitted.problem.unknowns.iter().map(|unknown| unknown.effect).collect();
        gone.retain(|effect| !effect.is_empty() && !left.contains(effect));
        gone.dedup();
        for effect in gone {
            gaussian = gaussian.without(&fitted.places(effect)).unwrap_or(gaussian);
        }
        let places = fitted.places(own);
        let gain = gaussian.gain(&places);
        let score = gain - COST * places.len() as f64;
        let surplus = if self.asked.contains(&own) { score - PREDICTIVE_GAIN } else { f64::INFINITY };
        Worth { surplus, score }
    }

    /// One that runs to its limit stands for something else.
    fn refusal(&self, effects: &[Instance], fitted: &Fitted<'a>) -> Option<Refusal> {
        let draft = fitted.draft();
        let is_on_limit =
            |effect: &str| fitted.places(effect).iter().any(|&at| draft.is_on_limit(fitted.problem.unknowns[at].place));
        let place =
            names(effects).into_iter().position(|effect| self.asked.contains(&effect) && is_on_limit(effect))?;
        Some(Refusal { place, note: String::new(), ground: Ground::Unfounded })
    }
}
