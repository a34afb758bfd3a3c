//! A model that was fitted, and which of its effects the information does not ask for.

use backseat_identify::short_runs::{Draft, Fit, Problem, Unknown};

/// Cost that an effect has to take away, beside 2 for each of its numbers (Akaike).
const LEAST_GAIN: f64 = 8.0;

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

    /// Effects among these to be taken out: one that runs to its limit stands for something else; without such, those that
    /// the information does not ask for.
    pub(super) fn superfluous(&self, effects: &[&'static str]) -> Vec<&'static str> {
        let draft = self.draft();
        let is_on_limit = |effect: &&&'static str| {
            self.places(effect).into_iter().any(|place| draft.is_on_limit(self.problem.unknowns[place].place))
        };
        effects.iter().find(is_on_limit).map_or_else(|| self.idle(effects), |effect| vec![*effect])
    }

    /// Effects among these that the information does not ask for, each beside those that are left.
    fn idle(&self, effects: &[&'static str]) -> Vec<&'static str> {
        let mut left = effects.to_vec();
        let mut idle = Vec::new();
        let mut gaussian = self.fit.gaussian();
        loop {
            let excess = |effect: &&'static str| {
                let places = self.places(effect);
                gaussian.gain(&places) - LEAST_GAIN - 2.0 * places.len() as f64
            };
            let scored = left.iter().map(excess).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((weakest, _)) = scored.filter(|(_, excess)| *excess < 0.0) else { return idle };
            let Some(without) = gaussian.without(&self.places(left[weakest])) else { return idle };
            gaussian = without;
            idle.push(left.remove(weakest));
        }
    }
}
