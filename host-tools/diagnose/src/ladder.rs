//! Which effects are accepted: one after the other, each refitted with those before it.

use crate::candidates::{Instance, set_of};
use crate::found::FoundEffect;
use crate::judged;
use crate::noise_effects::noise_effects;
use crate::prepared_log::{DataPart, JointFit, PreparedLog};
use crate::scores::{whiteness, whiteness_p};
use crate::search::{self, Evidence, MOST_EFFECTS, Round};
use crate::verdict::LEAST_WHITENESS_P;
use backseat_logs::stats::chi_square_tail;
use rayon::prelude::*;

/// Effects accepted so far.
#[derive(Clone, Debug, Default)]
pub struct Ladder {
    /// With their values.
    pub accepted: Vec<Instance>,
    /// The hypotheses of every round.
    pub rounds: Vec<Round>,
    /// Fitted together; none where one of them was dropped at the end.
    pub joint: Option<JointFit>,
    /// Outliers and waves beside them.
    pub noise_effects: Vec<FoundEffect>,
}

/// Climbs until nothing significant is left.
///
/// `None` if the filter diverges.
#[must_use]
pub fn climb(log_data: &mut PreparedLog, mut progress: impl FnMut(&str)) -> Option<Ladder> {
    progress("noise");
    let residuals = log_data.declared.residuals.clone();
    let mut ladder = Ladder { noise_effects: noise_effects(log_data, &residuals)?, ..Ladder::default() };
    loop {
        let goes_on = ladder.step(log_data, &mut progress)?;
        if !goes_on {
            return Some(ladder);
        }
        // Outliers and waves show better once the rest is explained.
        let residuals = &ladder.joint.as_ref()?.pass.residuals;
        ladder.noise_effects = noise_effects(log_data, residuals)?;
    }
}

/// Where two effects hide each other, the first may take up so much of the second that its derivative no longer shows it:
/// if what a climb leaves is not white, another begins with the next best hypothesis of the first round, and what explains
/// more stays.
///
/// `None` if the filter diverges.
#[must_use]
pub fn in_another_order(log_data: &mut PreparedLog, ladder: Ladder, mut progress: impl FnMut(&str)) -> Option<Ladder> {
    let Some(other) = ladder.another_start(log_data) else { return Some(ladder) };
    let mut second = Ladder { rounds: ladder.rounds[..1].to_vec(), ..Ladder::default() };
    progress("another order");
    if second.add(log_data, other) {
        while second.step(log_data, &mut progress)? {}
    }
    let (before, after) = (ladder.cost(), second.cost());
    if let Some((before, after)) = before.zip(after)
        && after + BETTER < before
    {
        let residuals = &second.joint.as_ref()?.pass.residuals;
        second.noise_effects = noise_effects(log_data, residuals)?;
        return Some(second);
    }
    Some(ladder)
}

/// By how much the second climb must explain more, its numbers counted.
const BETTER: f64 = 10.0;
/// Cost of a fitted number.
const COST: f64 = 2.0;

impl Ladder {
    /// Accepts the best hypothesis beside those accepted; whether the climb goes on.
    fn step(&mut self, log_data: &PreparedLog, progress: &mut impl FnMut(&str)) -> Option<bool> {
        progress(&format!("hypotheses, round {}", self.accepted.len() + 1));
        let round = search::round(log_data, &self.accepted)?;
        let next = if self.accepted.len() < MOST_EFFECTS { choose(log_data, &self.accepted, &round) } else { None };
        self.rounds.push(round);
        let Some(next) = next else { return Some(false) };
        progress("refit");
        Some(self.add(log_data, next))
    }

    /// Accepts one more; whether it stands, and those before it beside it.
    fn add(&mut self, log_data: &PreparedLog, next: Instance) -> bool {
        self.accepted.push(next);
        let Some(joint) = search::refit(log_data, &self.accepted) else {
            // No values of it are possible on the training blocks.
            self.accepted.pop();
            return false;
        };
        let kept = still_needed(&joint);
        self.accepted.clone_from(&joint.instances);
        self.joint = Some(joint);
        if kept.contains(&false) {
            let mut flags = kept.iter();
            self.accepted.retain(|_| flags.next().copied().unwrap_or(true));
            self.joint = None;
            // What is dropped would be found again: this is the end of the ladder.
            return false;
        }
        true
    }

    /// The best lasting effect of the first round that was not accepted, if what is left is not white.
    fn another_start(&self, log_data: &PreparedLog) -> Option<Instance> {
        if whiteness_p(&whiteness(log_data, &self.joint.as_ref()?.pass, DataPart::Seen)) >= LEAST_WHITENESS_P {
            return None;
        }
        let round = self.rounds.first()?;
        let is_accepted =
            |e: &Evidence| self.accepted.iter().any(|a| a.candidate.effect == e.instance.candidate.effect);
        let standing = round.ladder.iter().filter(|e| e.instance.candidate.span.is_none() && !is_accepted(e));
        standing.filter(|e| stands(log_data, &[], round, e)).map(|e| e.instance.clone()).next()
    }

    fn cost(&self) -> Option<f64> {
        let numbers: usize = self.accepted.iter().map(|instance| instance.candidate.degrees()).sum();
        Some(self.joint.as_ref()?.seen_square + COST * numbers as f64)
    }
}

/// Whether a hypothesis is significant, and possible for the vehicle: linear fits may leave what it can be (a drag that
/// drives).
fn stands(log_data: &PreparedLog, accepted: &[Instance], round: &Round, e: &Evidence) -> bool {
    let set = || e.instance.apply(&set_of(&log_data.scope.declared, accepted));
    let length_m = log_data.setup.parameters.length_m;
    round.is_significant(e)
        && e.instance.is_resolved()
        && judged::is_possible(&e.instance, &e.sigmas(), length_m)
        && log_data.setup.model(&set()).is_some()
}

/// The best hypothesis of a round that stands, fitted in full where several come close.
fn choose(log_data: &PreparedLog, accepted: &[Instance], round: &Round) -> Option<Instance> {
    const CLOSE: (f64, f64) = (40.0, 0.1);
    const MOST: usize = 4;
    let stands = |e: &Evidence| stands(log_data, accepted, round, e);
    let lasting = round.ladder.iter().filter(|e| e.instance.candidate.span.is_none()).cloned();
    let mut standing: Vec<Evidence> = lasting.filter(stands).collect();
    let least = standing.first().map_or(0.0, Evidence::score);
    standing.extend(search::refined_events(log_data, accepted, round, least).into_iter().filter(stands));
    standing.sort_by(|a, b| b.score().total_cmp(&a.score()));
    let top = standing.first()?.score();
    let close: Vec<_> = standing.iter().filter(|e| e.score() > top - CLOSE.0 - CLOSE.1 * top).take(MOST).collect();
    if close.len() == 1 {
        return Some(close[0].instance.clone());
    }
    close
        .into_par_iter()
        .filter_map(|e| {
            let mut instances = accepted.to_vec();
            instances.push(e.instance.clone());
            let joint = log_data.fit(&instances, DataPart::Seen)?;
            Some((joint.seen_square + 2.0 * e.degrees as f64, joint.instances.last()?.clone()))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, instance)| instance)
}

/// Whether each effect is still significant beside the others (Wald's test at the joint fit).
fn still_needed(joint: &JointFit) -> Vec<bool> {
    if joint.instances.len() < 2 {
        return vec![true; joint.instances.len()];
    }
    let mut at = 0;
    joint
        .instances
        .iter()
        .map(|instance| {
            let sizes = instance.sizes.len();
            let square: f64 =
                instance.sizes.iter().zip(&joint.sigmas[at..at + sizes]).map(|(x, s)| (x / s).powi(2)).sum();
            at += sizes;
            // A joint test would need their covariance; the sum bounds it well enough to drop what is nothing.
            instance.candidate.is_stuck() || chi_square_tail(square, sizes) < 1e-3
        })
        .collect()
}
