//! The watch: follows the nominal filter, closes a block every twenty seconds, and weighs the causes step by step.

mod judgement;

use super::candidate::Candidate;
use super::causes::CAUSES;
use super::columns::{COLUMNS, DECLARED_SIGMA};
use super::evidence::Factor;
use super::onset::{BLOCK_US, Onset};
use super::scatter::Scatter;
use super::sensitivities::{ONSETS, Sensitivities};
use super::separate::Pair;
use super::statement::{Named, Statement};
use super::taken::{Taken, numbers};
use super::used::Used;
use crate::dynamics::ActuatorInput;
use crate::navigation::filter::cekf::Filter;
use crate::navigation::interface::measurement::{Measurement, Sensor};
use crate::state::{VehicleState, Z};

/// Innovations count this deep, m: nearer to the surface the model does not hold ...
const DEEP_M: f64 = 2.0;
/// ... and only once the vehicle has been there for so long, µs.
const SETTLED_US: u64 = 60_000_000;

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
    /// Since when the first is stated.
    said_us: u64,
    /// The second is one that was stated before the first began.
    is_kept: bool,
    /// What the causes taken leave to all columns, χ².
    left: f64,
    /// What the first of them explains, χ².
    explained: f64,
    /// The onset that is the best of the cause that is the most probable, stated or not.
    best_us: u64,
    /// Only onsets behind this one are weighed, and nothing before it counts: behind a first cause. 0: all.
    since_us: u64,
    /// The causes taken leave more than is their own.
    too_much: bool,
    /// For how many blocks ranges have been wrong in a way of their own.
    unlisted: u16,
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
            said_us: 0,
            is_kept: false,
            left: 0.0,
            explained: 0.0,
            best_us: 0,
            since_us: 0,
            too_much: false,
            unlisted: 0,
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
        (self.deep_us, self.counted_us, self.stated, self.is_kept) = (0, 0, 0, false);
        self.best_us = 0;
        self.scatter = Scatter::NONE;
        self.stage = Stage::Idle;
        (self.unexplained, self.is_new, self.was_named) = (false, false, false);
        (self.leading, self.streaks, self.left_over, self.unlisted) = ([0; 2], [0; 2], 0, 0);
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
        let Self { sensitivities, taken, used, best_us, .. } = self;
        if sensitivities.kept == ONSETS {
            // the one behind it ends the block in which a change began: its size counts from there
            let is_taken = |before: &Onset, own: &Onset| {
                let mut needed = taken.iter().map(|taken| taken.time_us).chain([*best_us]);
                needed.any(|time_us| time_us == own.time_us || time_us == before.time_us)
            };
            let is_used = |own: &Onset| used.is_used() && used.onset_us == own.time_us;
            sensitivities.thin(now_us, |before, own| is_used(own) || is_taken(before, own));
        }
        self.sensitivities.keep_onset(now_us, self.scatter.colour());
        self.factor.compute(&self.sensitivities.sums, [None; 2], &DECLARED_SIGMA);
        (self.taken, self.since_us) = ([Taken::NONE; 2], 0);
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
        let Some(before) = sensitivities.onsets().last() else { return };
        let none = [Taken::NONE; 2];
        let taken = if self.since_us > 0 { &none } else { taken };
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
}

impl Default for Naming {
    fn default() -> Self {
        Self::new()
    }
}
