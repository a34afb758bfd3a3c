//! The watch: follows the nominal filter, closes a block every twenty seconds, and weighs the causes step by step.

use super::candidate::Candidate;
use super::causes::{ALL, CAUSES, Cause};
use super::columns::COLUMNS;
use super::evidence::{Factor, Number, Weighed};
use super::onset::{Onset, REMEMBERED};
use super::scatter::Scatter;
use super::sensitivities::{ONSETS, Sensitivities};
use super::separate::Pair;
use super::statement::{Named, Statement};
use super::taken::{Taken, colour_of, numbers};
use super::used::Used;
use crate::dynamics::ActuatorInput;
use crate::navigation::filter::cekf::Filter;
use crate::navigation::interface::measurement::{Measurement, Sensor};
use crate::state::{VehicleState, Z};

/// Length of a block, µs of counted time.
const BLOCK_US: u64 = 20_000_000;
/// Innovations count this deep, m: nearer to the surface the model does not hold ...
const DEEP_M: f64 = 2.0;
/// ... and only once the vehicle has been there for so long, µs.
const SETTLED_US: u64 = 60_000_000;
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
/// A second cause explains at least this share of what the first one does: less may be what is not linear in that.
const SECOND_SHARE: f64 = 0.3;
/// It is stated once it has been the most probable after so many blocks in a row: three minutes.
const DWELL: u16 = 9;
/// What no cause explains is stated after so many: five minutes.
const UNEXPLAINED_DWELL: u16 = 15;
/// Evidence counts to this share of itself: the model is linear in the causes to some hundredths.
const NOT_LINEAR_SHARE: f64 = 0.01;
/// A rival is stated that is at least so probable.
const RIVAL: f64 = 0.01;

/// What is to be done in the next step.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    Idle = 0,
    /// Weigh all causes since an onset.
    Weigh,
    /// Open a column that may have changed beside what is taken as there.
    Open,
}

/// Names what has changed. Some 110 kB: lives in a static; new, all of its bytes are zero.
pub struct Naming {
    sensitivities: Sensitivities,
    started: bool,
    start_us: u64,
    pub(super) last_us: u64,
    /// Deep enough for so long, µs.
    deep_us: u64,
    counted_us: u64,
    scatter: Scatter,
    factor: Factor,
    stage: Stage,
    place: usize,
    candidates: [Candidate; CAUSES],
    /// What is taken as there while others are weighed.
    taken: [Taken; 2],
    /// What they are, as weighed last.
    fresh: [Named; 2],
    /// What has been there, and for how many blocks.
    leading: [u8; 2],
    streaks: [u16; 2],
    /// For how many blocks too much has been left.
    left_over: u16,
    /// What is stated.
    named: [Named; 2],
    /// How many of them.
    stated: usize,
    /// What the causes taken leave to all columns, χ².
    left: f64,
    /// What the first of them explains, χ².
    explained: f64,
    unexplained: bool,
    /// It has been weighed anew.
    is_new: bool,
    /// The last statement named something.
    was_named: bool,
    /// The cause that the filter or the controller uses.
    used: Used,
    /// The two causes that are the most probable.
    pub(super) pair: Pair,
}

impl Naming {
    /// Before the first step.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            sensitivities: Sensitivities::new(),
            started: false,
            start_us: 0,
            last_us: 0,
            deep_us: 0,
            counted_us: 0,
            scatter: Scatter::NONE,
            factor: Factor::NONE,
            stage: Stage::Idle,
            place: 0,
            candidates: [Candidate::ZERO; CAUSES],
            taken: [Taken::NONE; 2],
            fresh: [Named::NONE; 2],
            leading: [0; 2],
            streaks: [0; 2],
            left_over: 0,
            named: [Named::NONE; 2],
            stated: 0,
            left: 0.0,
            explained: 0.0,
            unexplained: false,
            is_new: false,
            was_named: false,
            used: Used::NONE,
            pair: Pair::NONE,
        }
    }

    /// Forgets everything: the filter has started again.
    pub fn restart(&mut self) {
        self.started = false;
    }

    fn start(&mut self, time_us: u64) {
        self.sensitivities.restart();
        (self.start_us, self.last_us) = (time_us, time_us);
        (self.deep_us, self.counted_us, self.stated) = (0, 0, 0);
        self.scatter = Scatter::NONE;
        self.factor.forget();
        self.stage = Stage::Idle;
        (self.unexplained, self.is_new, self.was_named) = (false, false, false);
        (self.leading, self.streaks, self.left_over) = ([0; 2], [0; 2], 0);
        self.taken = [Taken::NONE; 2];
        self.used = Used::NONE;
        self.pair.forget();
        self.started = true;
    }

    pub(super) fn hours(&self, time_us: u64) -> f64 {
        time_us.saturating_sub(self.start_us) as f64 / 3.6e9
    }

    pub(super) fn onsets(&self) -> &[Onset] {
        self.sensitivities.onsets()
    }

    fn counts(&self) -> bool {
        self.deep_us > SETTLED_US
    }

    /// Call it before the filter moves; the observer that is to see the nominal filter move. `None`: it does not run.
    /// `x`: the vehicle as it is known best, for what the causes do to it.
    pub fn will_predict(
        &mut self,
        filter: Option<&Filter>,
        x: &VehicleState,
        input: &ActuatorInput,
    ) -> &mut Sensitivities {
        self.sensitivities.watches = filter.is_some();
        match filter {
            Some(filter) => {
                if !self.started {
                    self.start(filter.time_us());
                }
                let hours = self.hours(filter.time_us());
                self.sensitivities.will_predict(filter, x, input, hours);
            }
            None => self.started = false,
        }
        &mut self.sensitivities
    }

    /// Call it before the filter fuses a measurement; the observer that is to see the nominal filter fuse it.
    #[inline(never)]
    pub fn will_fuse(&mut self, filter: Option<&Filter>, measurement: &Measurement) -> &mut Sensitivities {
        if let Some(filter) = filter {
            let hours = self.hours(filter.time_us());
            // what another vehicle says is no evidence of this one's state
            let counts = self.started && self.counts() && measurement.sensor() != Sensor::Peer;
            self.sensitivities.will_fuse(filter, measurement, hours, counts);
        }
        &mut self.sensitivities
    }

    /// For clones that come and go.
    pub fn observer(&mut self) -> &mut Sensitivities {
        &mut self.sensitivities
    }

    /// Call it once a step, behind the filter.
    #[inline(never)]
    pub fn step(&mut self, filter: Option<&Filter>) {
        let Some(filter) = filter.filter(|_| self.started) else { return };
        let now_us = filter.time_us();
        let since_us = now_us.saturating_sub(self.last_us);
        self.last_us = now_us;
        self.deep_us = if filter.state()[Z] > DEEP_M { self.deep_us.saturating_add(since_us) } else { 0 };
        if self.counts() {
            self.counted_us += since_us;
        }
        match self.stage {
            Stage::Idle if self.is_block_full() && !filter.has_clones() => self.close_block(now_us),
            Stage::Idle => {}
            Stage::Weigh => self.weigh(),
            Stage::Open => self.open(),
        }
    }

    fn is_block_full(&self) -> bool {
        self.counted_us >= BLOCK_US || (self.sensitivities.kept == 0 && self.counts())
    }

    /// What is stated: once after each block while something is, and once more when nothing is any longer.
    #[inline(never)]
    pub fn take_statement(&mut self) -> Option<Statement> {
        if !core::mem::take(&mut self.is_new) {
            return None;
        }
        let statement = self.statement()?;
        let is_named = statement.unexplained || statement.named.iter().any(Option::is_some);
        let was_named = core::mem::replace(&mut self.was_named, is_named);
        (is_named || was_named).then_some(statement)
    }

    /// What was stated last; `None` before the first block.
    #[must_use]
    pub fn statement(&self) -> Option<Statement> {
        let time_us = self.sensitivities.onsets().last()?.time_us;
        let mut named = [None; 2];
        for (slot, own) in named.iter_mut().zip(&self.named).take(self.stated) {
            *slot = Some(*own);
        }
        Some(Statement { time_us, named, unexplained: self.unexplained })
    }

    /// Somebody uses a cause from now on, or none.
    pub fn follow(&mut self, named: Option<&Named>) {
        let Self { sensitivities, used, start_us, .. } = self;
        let onset = named.and_then(|named| sensitivities.onsets().iter().find(|own| own.time_us == named.since_us));
        *used = match (named, onset, sensitivities.onsets().last()) {
            (Some(named), Some(onset), Some(newest)) => Used::new(named, onset, &newest.sums, *start_us),
            _ => Used::NONE,
        };
    }

    /// By how much the cause in use has predicted better than none since it is used, ln of the likelihood ratio.
    #[must_use]
    pub fn gain(&self) -> Option<f64> {
        let onsets = self.sensitivities.onsets();
        let onset = onsets.iter().find(|own| self.used.is_used() && own.time_us == self.used.onset_us)?;
        Some(self.used.gain(onset, &onsets.last()?.sums, self.start_us))
    }

    /// Scatter of the scores over that of white innovations.
    pub(super) fn colour(&self) -> [f64; COLUMNS] {
        self.scatter.colour()
    }

    /// Keeps the sums as those of an onset, and begins to weigh.
    #[inline(never)]
    fn close_block(&mut self, now_us: u64) {
        self.counted_us = 0;
        self.see_scatter();
        if self.sensitivities.kept == ONSETS {
            self.thin(now_us);
        }
        self.sensitivities.keep_onset(now_us, self.scatter.colour());
        self.factor.compute(&self.sensitivities.sums);
        self.taken = [Taken::NONE; 2];
        self.begin_weighing();
    }

    fn begin_weighing(&mut self) {
        self.candidates = [Candidate::NONE; CAUSES];
        self.place = 0;
        self.stage = Stage::Weigh;
    }

    /// The last block's scores against what the estimate before it expects.
    fn see_scatter(&mut self) {
        let Self { scatter, factor, sensitivities, taken, .. } = self;
        let Some(before) = sensitivities.onsets().last().filter(|_| factor.is_computed()) else { return };
        let beside = numbers(taken, sensitivities.onsets(), self.start_us, false);
        let total = &sensitivities.sums;
        for j in 0..COLUMNS {
            let direction = [(j, 1.0), (0, 0.0)];
            let products = total.times_since(&before.sums, &direction);
            let own = products.get(j).copied().unwrap_or(0.0);
            let (more, mean) = factor.expected(&products, &beside);
            let sigma = libm::sqrt(own + more);
            let left = if own > 1.0e-9 { (total.score_since(&before.sums, &direction) - mean) / sigma } else { 0.0 };
            if let (Some(squares), Some(lagged), Some(last)) =
                (scatter.squares.get_mut(j), scatter.lagged.get_mut(j), scatter.last.get_mut(j))
            {
                *squares += left * left;
                *lagged += left * *last;
                *last = left;
            }
        }
        scatter.blocks += 1.0;
    }

    /// Leaves out the onset that is missed least: its neighbours are the closest, measured by its age.
    fn thin(&mut self, now_us: u64) {
        let mut least = (f64::INFINITY, 0);
        for (i, [before, own, after]) in self.sensitivities.onsets().array_windows().enumerate() {
            let is_needed = self.used.is_used() && self.used.onset_us == own.time_us;
            if !is_needed && self.taken.iter().all(|taken| taken.time_us != own.time_us) {
                let age_us = now_us.saturating_sub(own.time_us).saturating_add(BLOCK_US);
                let gap = after.time_us.saturating_sub(before.time_us) as f64 / age_us as f64;
                if gap < least.0 {
                    least = (gap, i + 1);
                }
            }
        }
        self.sensitivities.forget_onset(least.1);
    }

    /// Weighs all causes since one onset.
    #[inline(never)]
    fn weigh(&mut self) {
        let Self { sensitivities, factor, candidates, place, taken, start_us, .. } = self;
        let Some((newest, earlier)) = sensitivities.onsets().split_last() else { return };
        let Some(onset) = earlier.get(*place) else { return self.conclude() };
        let before_us = place.checked_sub(1).and_then(|i| earlier.get(i)).map_or(*start_us, |before| before.time_us);
        let spacing_h = onset.time_us.saturating_sub(before_us) as f64 / 3.6e9;
        let onset_h = onset.time_us.saturating_sub(*start_us) as f64 / 3.6e9;
        *place += 1;
        let mut beside = numbers(taken, sensitivities.onsets(), *start_us, false);
        let there = beside.len();
        if there == 0 {
            for number in (0..REMEMBERED.len()).map(|m| Number::State(m, onset)) {
                factor.take(&newest.sums, &number, &beside);
                // there is room
                let _ = beside.push(number);
            }
        }
        for (cause, candidate) in ALL.iter().zip(candidates) {
            let colour = colour_of(*cause, onset_h, &onset.colour);
            let weighed = factor.weigh(&newest.sums, (*cause, onset_h), onset, &beside, colour);
            if cause.is_possible(&weighed.size) {
                candidate.take(onset.time_us, spacing_h, &weighed);
            }
        }
        factor.close(there);
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
        let first = self.taken.first().filter(|_| number > 0).and_then(Taken::cause);
        let least = libm::log(LEAST_ODDS / RATE_PER_H) + if number > 0 { SECOND_SHARE * self.explained } else { 0.0 };
        let cause = ALL.get(place).filter(|_| candidate.log_sum > least);
        let cause = cause.filter(|cause| cause.fin().is_none() || cause.fin() != first.and_then(Cause::fin));
        let (Some(cause), Some(slot), Some(taken)) = (cause, self.fresh.get_mut(number), self.taken.get_mut(number))
        else {
            if number == 0 {
                self.pair.forget();
            }
            return self.state(number);
        };
        let Weighed { size, sigma, gain, .. } = candidate.weighed;
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
            self.explained = gain;
            self.pair.see(&self.candidates, width);
        }
        self.take_as_there(number == 0);
        (self.place, self.left, self.stage) = (0, 0.0, Stage::Open);
    }

    /// Takes the causes as there; of a single one what it has done to the estimate within its first block is left open.
    /// With two onsets the products of that are not known.
    fn take_as_there(&mut self, states: bool) {
        let Self { sensitivities, factor, taken, start_us, .. } = self;
        let Some(newest) = sensitivities.onsets().last() else { return };
        let beside = numbers(taken, sensitivities.onsets(), *start_us, states);
        factor.close(0);
        for (i, number) in beside.iter().enumerate() {
            factor.take(&newest.sums, number, beside.get(..i).unwrap_or_default());
        }
    }

    /// Lets one more column change since the first onset taken.
    #[inline(never)]
    fn open(&mut self) {
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
        let too_much = self.left > MOST_LEFT + MOST_LEFT_SHARE * self.explained;
        self.left_over = if too_much { self.left_over.saturating_add(1) } else { 0 };
        if too_much && number < self.taken.len() {
            // perhaps there is a second one
            self.take_as_there(false);
            self.begin_weighing();
        } else {
            self.state(number);
        }
    }

    /// States what has lasted; `number` causes are taken as there.
    fn state(&mut self, number: usize) {
        for (k, taken) in self.taken.iter().enumerate() {
            let (Some(leading), Some(streak)) = (self.leading.get_mut(k), self.streaks.get_mut(k)) else { return };
            *streak = if taken.place == *leading { streak.saturating_add(1) } else { 1 };
            *leading = taken.place;
            if *streak < DWELL || k > self.stated {
                continue;
            }
            match (taken.place, self.named.get_mut(k), self.fresh.get(k)) {
                (1.., Some(named), Some(fresh)) => {
                    *named = *fresh;
                    self.stated = self.stated.max(k + 1);
                }
                _ => self.stated = self.stated.min(k),
            }
        }
        if number == 0 {
            self.left_over = 0;
        }
        self.unexplained = self.left_over >= UNEXPLAINED_DWELL;
        self.stage = Stage::Idle;
        self.is_new = true;
    }
}

impl Default for Naming {
    fn default() -> Self {
        Self::new()
    }
}
