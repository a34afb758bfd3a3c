//! What the sums say: all causes since all onsets, then everything beside the one that is taken as there, step by step.

use super::super::candidate::Candidate;
use super::super::causes::{ALL, Cause};
use super::super::columns::DECLARED_SIGMA;
use super::super::evidence::Weighed;
use super::super::statement::Named;
use super::super::taken::{Taken, colour_of, numbers};
use super::{Naming, Stage};

/// Each cause begins so often, 1/h.
const RATE_PER_H: f64 = 1.0e-3;
/// A cause is stated once it is so much more probable than no change (by Ville's inequality that happens without a cause
/// in one of so many times 1 / (rate · causes · hours) dives) ...
const LEAST_ODDS: f64 = 100.0;
/// ... and what it leaves to all columns together is at most this: χ² of 32 numbers, once in ten thousand ...
const MOST_LEFT: f64 = 73.0;
/// ... and this share of what it explains: large changes are not linear.
const MOST_LEFT_SHARE: f64 = 0.15;
/// One sigma of a size by what is not linear, as a share of it.
const NOT_LINEAR: f64 = 0.1;
/// A second cause has to be more probable than a first one by this, ln: what is not linear in the first looked like one of
/// up to 37 in 150 flights, and true ones had 55 to 515 (seeds 610001 to 610210).
const SECOND_RARER: f64 = 30.0;
/// It is stated once it has been the most probable after so many blocks in a row: three minutes ...
const DWELL: u16 = 9;
/// ... or forty seconds, where nothing else is as probable as a rival.
const SURE_DWELL: u16 = 2;
/// What no cause explains is stated after so many: five minutes ...
const UNEXPLAINED_DWELL: u16 = 15;
/// ... or twenty, where it lasts from range to range: what a cause does to them does so at first, and comes out later.
const LASTING_DWELL: u16 = 60;
/// An error of ranges in a way of their own begins so many times more rarely than a cause.
const UNLISTED_RARER: f64 = 100.0;
/// Evidence counts to this share of itself: the model is linear in the causes to some hundredths.
const NOT_LINEAR_SHARE: f64 = 0.01;
/// A rival is stated that is at least so probable.
const RIVAL: f64 = 0.01;

impl Naming {
    /// Weighs all causes since one onset.
    #[inline(never)]
    pub(super) fn weigh(&mut self) {
        let Self { sensitivities, factor, candidates, place, since_us, start_us, .. } = self;
        let Some((newest, earlier)) = sensitivities.onsets().split_last() else { return };
        let Some(onset) = earlier.get(*place) else { return self.conclude() };
        if onset.time_us <= *since_us {
            *place += 1;
            return;
        }
        let before_us = place.checked_sub(1).and_then(|i| earlier.get(i)).map_or(*start_us, |before| before.time_us);
        let spacing_h = onset.time_us.saturating_sub(before_us) as f64 / 3.6e9;
        let onset_h = onset.time_us.saturating_sub(*start_us) as f64 / 3.6e9;
        *place += 1;
        let states = factor.take_states(&newest.sums, onset);
        for (cause, candidate) in ALL.iter().zip(candidates) {
            let colour = colour_of(*cause, onset_h, &onset.colour);
            let weighed = factor.weigh(&newest.sums, (*cause, onset_h), onset, &states, colour);
            if cause.is_possible(&weighed.size) {
                candidate.take(onset.time_us, spacing_h, &weighed);
            }
        }
        factor.close(0);
    }

    /// What a cause is by the data from the next onset on. It began somewhere between the two, not where the first has it:
    /// for seconds in which it was whole, an elevator that stands came out with half its angle. What is between them counts
    /// for nothing, neither for the cause nor for what was there from the start.
    #[inline(never)]
    fn weigh_later(&mut self, cause: Cause, since_us: u64) -> Option<Weighed> {
        let Self { sensitivities, factor, start_us, .. } = self;
        let (newest, earlier) = sensitivities.onsets().split_last()?;
        let at = earlier.iter().position(|onset| onset.time_us == since_us)?;
        let [first, onset] = earlier.get(at..)?.first_chunk()?;
        // those between them were not kept: what is left out would be more than what remains
        if onset.time_us.saturating_sub(first.time_us) > newest.time_us.saturating_sub(onset.time_us) {
            return None;
        }
        factor.compute(&newest.sums, [Some(&first.sums), Some(&onset.sums)], &DECLARED_SIGMA);
        let onset_h = onset.time_us.saturating_sub(*start_us) as f64 / 3.6e9;
        let states = factor.take_states(&newest.sums, onset);
        let colour = colour_of(cause, onset_h, &onset.colour);
        let weighed = factor.weigh(&newest.sums, (cause, onset_h), onset, &states, colour);
        factor.compute(&newest.sums, [None; 2], &DECLARED_SIGMA);
        cause.is_possible(&weighed.size).then_some(weighed)
    }

    /// All causes are weighed: takes the most probable one as there, if it is probable enough.
    fn conclude(&mut self) {
        let number = self.taken.iter().filter(|taken| taken.place > 0).count();
        let mut best = (0, Candidate::NONE);
        for (i, candidate) in self.candidates.iter().enumerate() {
            if candidate.log_sum > best.1.log_sum {
                best = (i, *candidate);
            }
        }
        let (place, candidate) = best;
        if number == 0 {
            self.best_us = candidate.time_us;
        }
        let first = self.taken.first().filter(|_| number > 0).and_then(Taken::cause);
        let least = libm::log(LEAST_ODDS / RATE_PER_H);
        let least = match number {
            0 => least.max(self.weigh_unlisted(least)),
            _ => least + SECOND_RARER,
        };
        let cause = ALL.get(place).filter(|_| candidate.log_sum > least);
        let cause = cause.filter(|cause| first.is_none_or(|first| !first.is_of_the_same(**cause)));
        let later = cause.filter(|_| number == 0).and_then(|cause| self.weigh_later(*cause, candidate.time_us));
        let (Some(cause), Some(slot), Some(taken)) = (cause, self.fresh.get_mut(number), self.taken.get_mut(number))
        else {
            if number == 0 {
                self.pair.forget();
            }
            return self.state(number);
        };
        let Weighed { size, sigma, .. } = later.unwrap_or(candidate.weighed);
        let linear = size.map(|size| NOT_LINEAR * size);
        let sigma = [libm::hypot(sigma[0], linear[0]), libm::hypot(sigma[1], linear[1])];
        let width = 1.0 + NOT_LINEAR_SHARE * candidate.log_sum.max(0.0);
        let relative = |other: &Candidate| libm::exp((other.log_sum - candidate.log_sum) / width);
        let sum: f64 = self.candidates.iter().map(relative).sum();
        let probability = 1.0 / sum;
        let others = self.candidates.iter().zip(ALL).filter(|(_, other)| other != cause);
        let rival = others.max_by(|(a, _), (b, _)| a.log_sum.total_cmp(&b.log_sum));
        let rival = rival.filter(|(rival, _)| relative(rival) / sum > RIVAL).map(|(_, rival)| rival);
        *slot = Named { cause: *cause, size, sigma, since_us: candidate.time_us, probability, rival };
        *taken = Taken { place: place as u8 + 1, time_us: candidate.time_us };
        if number == 0 {
            self.explained = candidate.weighed.gain;
            self.pair.see(&self.candidates, width);
        }
        self.since_us = 0;
        self.take_as_there(number == 0);
        (self.place, self.left, self.stage) = (0, 0.0, Stage::Open);
    }

    /// Ranges that are wrong in a way of their own. Returns what a cause has to exceed to be the more probable.
    fn weigh_unlisted(&mut self, least: f64) -> f64 {
        let odds = self.sensitivities.ranges.odds();
        let own = odds.against_declared - libm::log(UNLISTED_RARER);
        let leads = self.candidates.iter().all(|candidate| candidate.log_sum < own);
        self.unlisted = match (leads && odds.against_no_change > least, odds.is_scatter) {
            (false, _) => 0,
            // scatter is none of the causes: a quarter of the time
            (true, true) => self.unlisted.saturating_add(LASTING_DWELL / UNEXPLAINED_DWELL),
            (true, false) => self.unlisted.saturating_add(1),
        };
        own
    }

    /// Takes the causes as there; of a single one what it has done to the estimate within its first block is left open.
    /// With two onsets the products of that are not known.
    fn take_as_there(&mut self, states: bool) {
        let Self { sensitivities, factor, taken, start_us, .. } = self;
        let Some(newest) = sensitivities.onsets().last() else { return };
        let beside = numbers(taken, sensitivities.onsets(), *start_us, states);
        factor.compute(&newest.sums, [None; 2], &DECLARED_SIGMA);
        for (i, number) in beside.iter().enumerate() {
            factor.take(&newest.sums, number, beside.get(..i).unwrap_or_default());
        }
    }

    /// Lets one more column change since the first onset taken.
    #[inline(never)]
    pub(super) fn open(&mut self) {
        let Self { sensitivities, factor, place, taken, start_us, left, .. } = self;
        let onsets = sensitivities.onsets();
        let number = taken.iter().filter(|taken| taken.place > 0).count();
        let beside = numbers(taken, onsets, *start_us, number == 1);
        let since_us = taken.iter().take(number).map(|taken| taken.time_us).min().unwrap_or(0);
        let onset = onsets.iter().find(|onset| onset.time_us == since_us);
        if let (Some(newest), Some(onset), Some(colour)) =
            (onsets.last(), onset, onset.and_then(|onset| onset.colour.get(*place)))
        {
            *left += factor.open(&newest.sums, *place, onset, &beside) / colour;
            *place += 1;
            return;
        }
        factor.close(beside.len());
        drop(beside);
        self.too_much = self.left > MOST_LEFT + MOST_LEFT_SHARE * self.explained;
        if number == 1 { self.seek_second() } else { self.state(number) }
    }

    /// Seeks a second cause behind the first. What is not linear in that lasts, and is no change: nothing counts but what came
    /// since, and what the first one may have changed is open.
    fn seek_second(&mut self) {
        let Self { sensitivities, factor, taken, start_us, since_us, .. } = self;
        let onsets = sensitivities.onsets();
        let first = taken.first().and_then(|taken| Some((taken.cause()?, taken.time_us)));
        let behind = first.and_then(|(_, time_us)| onsets.iter().find(|onset| onset.time_us > time_us));
        let (Some((cause, time_us)), Some(behind), Some(newest)) = (first, behind, onsets.last()) else {
            return self.state(1);
        };
        let onset_h = time_us.saturating_sub(*start_us) as f64 / 3.6e9;
        let mut sigma = DECLARED_SIGMA;
        for part in cause.parts(onset_h).into_iter().flatten() {
            for (column, weight) in part.direction {
                if let Some(own) = sigma.get_mut(column) {
                    *own = libm::hypot(*own, weight * libm::hypot(part.mean, part.sigma));
                }
            }
        }
        *since_us = behind.time_us;
        factor.compute(&newest.sums, [None, Some(&behind.sums)], &sigma);
        self.begin_weighing();
    }

    /// States what has lasted; `number` causes are taken as there.
    fn state(&mut self, number: usize) {
        for (k, taken) in self.taken.into_iter().enumerate() {
            let (Some(leading), Some(streak)) = (self.leading.get_mut(k), self.streaks.get_mut(k)) else { return };
            *streak = if taken.place == *leading { streak.saturating_add(1) } else { 1 };
            *leading = taken.place;
            let is_sure = taken.place > 0 && self.fresh.get(k).is_some_and(|fresh| fresh.rival.is_none());
            if *streak < if is_sure { SURE_DWELL } else { DWELL } || k > self.stated {
                continue;
            }
            match (k, self.fresh.get(k).filter(|_| taken.place > 0)) {
                (0, Some(fresh)) => self.name_first(*fresh),
                (0, None) => (self.stated, self.is_kept) = (0, false),
                (_, Some(fresh)) => {
                    self.named[1] = *fresh;
                    (self.stated, self.is_kept) = (2, false);
                }
                (_, None) if self.is_kept => {}
                (_, None) => self.stated = self.stated.min(1),
            }
        }
        let too_much = number > 0 && self.too_much;
        self.left_over = if too_much { self.left_over.saturating_add(1) } else { 0 };
        self.unexplained = self.left_over >= UNEXPLAINED_DWELL || self.unlisted >= LASTING_DWELL;
        self.stage = Stage::Idle;
        self.is_new = true;
    }

    /// Of another first cause than before what was stated before that one began stays beside it: what the stronger one does
    /// to the innovations hides it, and does not refute it.
    fn name_first(&mut self, fresh: Named) {
        let [first, second] = &mut self.named;
        let before = core::mem::replace(first, fresh);
        if self.stated > 0 && before.cause == fresh.cause {
            return;
        }
        self.is_kept = self.stated > 0 && fresh.since_us > self.said_us && !fresh.cause.is_of_the_same(before.cause);
        if self.is_kept {
            *second = before;
        }
        self.stated = if self.is_kept { 2 } else { 1 };
        self.said_us = self.last_us;
    }
}
