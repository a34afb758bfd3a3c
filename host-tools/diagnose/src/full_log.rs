//! Selection where a log's dynamics are run: hypotheses are columns of one pass of the filter, so that nothing is
//! accepted at first.

use crate::candidates::{Instance, set_of};
use crate::found::FoundEffect;
use crate::judged;
use crate::noise_effects::noise_effects;
use crate::prepared_log::{DataPart, JointFit, PreparedLog};
use crate::scores::{whiteness, whiteness_p};
use crate::search;
use crate::selection::{self, COST, Evidence, MOST_EFFECTS, Round, Selectable, Selected, Worth};
use crate::verdict::LEAST_WHITENESS_P;
use backseat_logs::stats::chi_square_tail;
use rayon::prelude::*;

/// Lasting effects that another selection may begin with, of which the best is taken.
const MOST_STARTS: usize = 8;

/// A log with the declared model, and what is noise and not motion.
pub struct FullLog<'a> {
    /// The log.
    pub log_data: &'a mut PreparedLog,
    /// Outliers and waves, as the effects accepted show them.
    pub noise_effects: Vec<FoundEffect>,
    /// Whether effects are looked for that begin and end.
    pub has_events: bool,
    /// Effects that are not asked again: the data that choose do not bear them out.
    pub barred: Vec<&'static str>,
}

impl FullLog<'_> {
    /// Selects from nothing; `None` if the filter diverges.
    pub fn select(&mut self, progress: &mut dyn FnMut(&str)) -> Option<Selected<JointFit>> {
        progress("noise");
        let residuals = self.log_data.declared.residuals.clone();
        self.noise_effects = noise_effects(self.log_data, &residuals)?;
        let declared = self.log_data.fit(&[], DataPart::Train)?;
        selection::select(self, (Vec::new(), declared), progress)
    }

    /// Goes on from what is left of a selection.
    pub fn go_on(&mut self, accepted: Vec<Instance>, progress: &mut dyn FnMut(&str)) -> Option<Selected<JointFit>> {
        let fit = self.log_data.fit(&accepted, DataPart::Train)?;
        selection::select(self, (accepted, fit), progress)
    }

    /// Whether a hypothesis is significant, and possible for the vehicle: linear fits may leave what it can be (a drag
    /// that drives).
    fn stands(&self, accepted: &[Instance], round: &Round, e: &Evidence) -> bool {
        let set = || e.instance.apply(&set_of(&self.log_data.scope.declared, accepted));
        let length_m = self.log_data.setup.parameters.length_m;
        !self.barred.contains(&e.instance.candidate.effect)
            && round.is_significant(e)
            && e.instance.is_resolved()
            && judged::is_possible(&e.instance, &e.sigmas(), length_m)
            && self.log_data.setup.model(&set()).is_some()
    }
}

impl Selectable for FullLog<'_> {
    type Fit = JointFit;

    fn round(&self, accepted: &[Instance], _: &JointFit) -> Option<Round> {
        search::round(self.log_data, accepted)
    }

    /// Events with their times refined, where they come near what lasts.
    fn standing(&self, accepted: &[Instance], round: &Round) -> Vec<Evidence> {
        if accepted.len() >= MOST_EFFECTS {
            return Vec::new();
        }
        let stands = |e: &Evidence| self.stands(accepted, round, e);
        let lasting = round.ladder.iter().filter(|e| e.instance.candidate.span.is_none()).cloned();
        let mut standing: Vec<Evidence> = lasting.filter(stands).collect();
        if !self.has_events {
            return standing;
        }
        let least = standing.first().map_or(0.0, Evidence::score);
        standing.extend(search::refined_events(self.log_data, accepted, round, least).into_iter().filter(stands));
        standing
    }

    fn fit(&self, effects: &mut Vec<Instance>, _: &JointFit, part: DataPart) -> Option<JointFit> {
        let joint = self.log_data.fit(effects, part)?;
        effects.clone_from(&joint.instances);
        Some(joint)
    }

    fn cost(&self, effects: &[Instance], joint: &JointFit) -> f64 {
        let numbers: usize = effects.iter().map(|instance| instance.candidate.degrees()).sum();
        joint.seen_square + COST * numbers as f64
    }

    /// By Wald's test at the joint fit: a joint test would need the covariance of the sizes; the sum bounds it well
    /// enough to drop what is nothing.
    fn worth(&self, effects: &[Instance], place: usize, joint: &JointFit) -> Worth {
        let (own, sizes) = (effects[place].candidate, effects[place].sizes.len());
        let at = joint.instances.iter().position(|instance| instance.candidate == own).unwrap_or(place);
        let sizes_of = joint.instances[at].sizes.iter().zip(joint.sigmas_of(at));
        let square: f64 = sizes_of.map(|(x, s)| (x / s).powi(2)).sum();
        let is_needed = joint.instances.len() < 2 || own.is_stuck();
        let p = if is_needed { 0.0 } else { chi_square_tail(square, sizes) };
        Worth::by_chance(p, square - COST * sizes as f64)
    }

    /// If what is left is not white: of the lasting effects of the first round that were not accepted the one that, fitted
    /// alone, explains most. The derivative of a large one says little of that: the lift of half a kilogram is borne by
    /// the square of heave.
    fn another_start(&self, selected: &Selected<JointFit>) -> Option<Instance> {
        let left = whiteness(self.log_data, &selected.fit.pass, DataPart::Seen);
        if whiteness_p(&left) >= LEAST_WHITENESS_P {
            return None;
        }
        let round = selected.rounds.first()?;
        let is_accepted =
            |e: &Evidence| selected.accepted.iter().any(|a| a.candidate.effect == e.instance.candidate.effect);
        let lasting = round.ladder.iter().filter(|e| e.instance.candidate.span.is_none() && !is_accepted(e));
        let standing: Vec<&Evidence> = lasting.filter(|e| self.stands(&[], round, e)).take(MOST_STARTS).collect();
        let alone = |e: &Evidence| {
            let mut effects = vec![e.instance.clone()];
            let fit = self.fit(&mut effects, &selected.fit, DataPart::Seen)?;
            Some((self.cost(&effects, &fit), effects.pop()?))
        };
        let fits = standing.into_par_iter().filter_map(alone);
        fits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, instance)| instance)
    }

    /// Outliers and waves show better once the rest is explained.
    fn settle(&mut self, joint: &JointFit) -> Option<()> {
        self.noise_effects = noise_effects(self.log_data, &joint.pass.residuals)?;
        Some(())
    }
}
