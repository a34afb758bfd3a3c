//! When do the inputs act? Whether each actuator holds its command until the next sample, or moves on and the log merely
//! samples it, decides half a sample of time: taken wrongly, every manoeuvre leaves a residual.
//!
//! The innovations of both are taken, and the share λ of the way from one to the other that leaves least is fitted: 0
//! is held, 1 is moving on. First of all actuators together, then of the fins and of the propeller by themselves: four
//! fins are moved and logged alike. The scatter is that of the blocks, so that an effect that is not found yet does not
//! pass for timing; once noise or effects are found, it is looked at again.

use crate::log_effects::Effects;
use crate::samples::Samples;
use crate::split::{DataPart, Split};
use crate::whitener::{self, Pass, Residual, Setup};
use backseat_core::dynamics::INPUTS;
use backseat_estimation::commands::{ACTUATORS, Hold, HoldKind, InputTiming};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

/// Propeller, fins.
const GROUPS: [Range<usize>; 2] = [0..1, 1..INPUTS];
/// Standard errors by which λ must differ from what is taken.
const BELIEVED: f64 = 5.0;
/// λ from here on is nearer to the other kind.
const MIDDLE: f64 = 0.5;
/// λ beyond this is no timing: something else that looks like it.
const MOST: f64 = 2.0;

/// The timing that the innovations ask for, with these effects, and the pass with it where it was made; `None` where the
/// filter does not run.
///
/// What all actuators together do is the sum of what each group does, as far as innovations are linear in λ.
#[must_use]
pub fn choose(
    (setup, split): (&Setup, &Split),
    samples: &Samples,
    set: &Effects,
    now: &InputTiming,
) -> Option<(InputTiming, Option<Pass>)> {
    if samples.commands.is_incomplete() {
        return Some((*now, None));
    }
    let pass = |timing: &InputTiming| {
        let mut timed = samples.clone();
        timed.act(timing);
        whitener::run(setup, &timed, set, &[])
    };
    let alone = |group: &Range<usize>| {
        let mut one = *now;
        one[group.clone()].iter_mut().for_each(|hold| *hold = turned(*hold));
        Some(pass(&one)?.residuals)
    };
    let (base, single) = rayon::join(|| pass(now), || GROUPS.par_iter().map(alone).collect::<Option<Vec<_>>>());
    let (mut base, mut single): (Pass, Vec<Vec<Residual>>) = (base?, single?);
    let mut timing = *now;
    let [all] = shares(&base.residuals, &[sum(&base.residuals, &single)], split).try_into().ok()?;
    if is_turned(all) {
        timing = now.map(turned);
        base = pass(&timing)?;
        // Of two groups, one turned back leaves the other turned.
        single.reverse();
    }
    let common = timing;
    // Fins and propeller by themselves beside what all do.
    for (group, share) in GROUPS.iter().zip(shares(&base.residuals, &single, split)) {
        if is_turned(share) {
            timing[group.clone()].iter_mut().for_each(|hold| *hold = turned(*hold));
        }
    }
    Some((timing, (timing == common).then_some(base)))
}

/// In a sentence, where some actuator is not held.
#[must_use]
pub fn note(timing: &InputTiming) -> Option<String> {
    let moving: Vec<&str> = ACTUATORS
        .iter()
        .zip(timing)
        .filter(|(_, hold)| hold.kind == HoldKind::Continuous)
        .map(|(name, _)| *name)
        .collect();
    (!moving.is_empty())
        .then(|| format!("the log samples inputs that move on between their samples: {}", moving.join(", ")))
}

/// The other kind of hold.
#[must_use]
pub fn turned(hold: Hold) -> Hold {
    let kind = match hold.kind {
        HoldKind::Held => HoldKind::Continuous,
        HoldKind::Continuous => HoldKind::Held,
    };
    Hold { kind, ..hold }
}

/// The other kind of hold of all fins.
#[must_use]
pub fn fins_turned(timing: InputTiming) -> InputTiming {
    let mut other = timing;
    other[GROUPS[1].clone()].iter_mut().for_each(|hold| *hold = turned(*hold));
    other
}

fn is_turned((share, sigma): (f64, f64)) -> bool {
    (MIDDLE..MOST).contains(&share) && share > BELIEVED * sigma
}

/// The innovations with all changes at once.
fn sum(base: &[Residual], changed: &[Vec<Residual>]) -> Vec<Residual> {
    let with_all = |(k, residual): (usize, &Residual)| {
        let own = residual.normalised();
        let added: f64 = changed.iter().filter_map(|one| Some(one.get(k)?.normalised() - own)).sum();
        Residual { innovation: (own + added) * residual.sigma, ..*residual }
    };
    base.iter().enumerate().map(with_all).collect()
}

/// λ of each alternative, fitted together, with its standard error by blocks.
fn shares(base: &[Residual], others: &[Vec<Residual>], split: &Split) -> Vec<(f64, f64)> {
    let n = others.len();
    let block_s = split.block_s;
    let blocks = base.last().map_or(0, |last| (last.t_s / block_s) as usize + 1);
    let mut information = DMatrix::zeros(n, n);
    let mut scores = vec![DVector::zeros(n); blocks];
    let mut parts = vec![DMatrix::zeros(n, n); blocks];
    for (k, residual) in base.iter().enumerate().filter(|(_, r)| split.is_at(DataPart::Seen, r.t_s)) {
        let e = residual.normalised();
        let difference = DVector::from_fn(n, |i, _| others[i].get(k).map_or(0.0, |other| other.normalised() - e));
        let block = (residual.t_s / block_s) as usize;
        scores[block] -= &difference * e;
        parts[block] += &difference * difference.transpose();
    }
    for part in &parts {
        information += part;
    }
    let score = scores.iter().fold(DVector::zeros(n), |sum, score| sum + score);
    let Some(inverse) = information.cholesky().map(|factor| factor.inverse()) else {
        return vec![(0.0, f64::INFINITY); n];
    };
    let share = &inverse * score;
    let mut scatter = DMatrix::zeros(n, n);
    for (score, part) in scores.iter().zip(&parts) {
        let left = score - part * &share;
        scatter += &left * left.transpose();
    }
    let robust = &inverse * scatter * &inverse;
    (0..n).map(|i| (share[i], inverse[(i, i)].max(robust[(i, i)]).sqrt())).collect()
}
