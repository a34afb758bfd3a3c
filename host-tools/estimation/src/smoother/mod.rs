//! Fixed-interval smoothing: the best estimate of every time from the measurements of the whole log.
//!
//! The modified Bryson-Frazier form (Bierman, "Fixed interval smoothing with discrete measurements", Int. J. Control
//! 18(1), 1973): after a forward pass of the filter, the adjoint λ and its covariance Λ run backwards through the same
//! steps, and the smoothed estimate is x̂ − P λ with covariance P − P Λ P. Nothing of the size of P is inverted, so
//! that delayed states, of which P is singular, need no special case, and a step back costs about as much as a step
//! forward.
//!
//! The forward pass keeps the calls that moved the filter and a copy of the filter every few hundred of them
//! ([`Recording`]). Backwards, one stretch after the other is filtered again from its copy, which repeats the first
//! pass bit for bit, and its steps are kept only until they are smoothed: the tool needs some kB for each second of a
//! log.
//!
//! # Unconfirmed ranges
//! While ranges are unconfirmed, the filter states P and, of the position, a variance that is in no gain: either ranges
//! or dynamics may have been right ([`Filter::covariance`]). λ and Λ belong to P itself. The smoother adds that variance to what it
//! has smoothed by P: the ranges of a whole log cannot confirm themselves.
//!
//! # The bank
//! The filters of a bank know nothing of each other, so each is smoothed by itself. They are mixed as in flight, by the
//! likelihood of their ranges: the evidence at a time is that of the ranges before it and, forgotten at the same pace,
//! of those after it. A filter that failed on the way has no weight from the start.

mod adjoint;
mod recording;
#[cfg(test)]
mod tests;

pub use recording::Recording;

use crate::track::TrackSample;
use adjoint::Adjoint;
use backseat_core::navigation::{Evidence, Filter, LinearStep, MAX_STATES, MEMBERS, Observer};
use backseat_core::state::{PSI, VEHICLE_STATES, VehicleState, X, Y, wrap_angle};
use rayon::prelude::*;

/// One number a state, whole blocks of four.
const STRIDE: usize = MAX_STATES.next_multiple_of(4);
/// Place of every state, zero behind the last.
type Vector = [f64; STRIDE];

/// The filter's estimate at a time that is to be smoothed.
struct Filtered {
    time_us: u64,
    states: usize,
    current: Option<usize>,
    fixed_current_mps: [f64; 2],
    x: Vector,
    /// P itself.
    covariance: Vec<Vector>,
    /// What the filter states beyond P of the position, north and east, m².
    unconfirmed_m2: [f64; 2],
}

impl Filtered {
    fn of(filter: &Filter) -> Self {
        let states = filter.dimension();
        let mut x = [0.0; STRIDE];
        let mut covariance = vec![[0.0; STRIDE]; states];
        for (i, (x, row)) in x.iter_mut().zip(&mut covariance).enumerate() {
            *x = filter.state_at(i);
            row.iter_mut().enumerate().for_each(|(j, p)| *p = filter.propagated_covariance(i, j));
        }
        let (current, fixed_current_mps) = (filter.current_place(), filter.current());
        let unconfirmed_m2 = [X, Y].map(|i| filter.covariance(i, i) - filter.propagated_covariance(i, i));
        Self { time_us: filter.time_us(), states, current, fixed_current_mps, x, covariance, unconfirmed_m2 }
    }
}

/// One step of the forward pass, as the way back needs it.
enum Step {
    /// Number of states, columns of the vehicle's rows of Φ, and entries (row, column, value) elsewhere.
    Transition(usize, Vec<[f64; VEHICLE_STATES]>, Vec<(usize, usize, f64)>),
    Update {
        row: Vec<(usize, f64)>,
        gain: Vec<f64>,
        innovation: f64,
        variance: f64,
    },
    /// Rows of C.
    Append(usize, Vec<Vec<(usize, f64)>>),
    Insert(usize, usize),
    Remove(usize, usize),
    Sample(Box<Filtered>),
}

impl Step {
    fn of(step: &LinearStep<'_>) -> Option<Self> {
        Some(match step {
            LinearStep::Transition(transition) => {
                let mut columns = vec![[0.0; VEHICLE_STATES]; transition.live()];
                transition.vehicle_rows(&mut columns);
                Self::Transition(transition.states(), columns, transition.others().collect())
            }
            LinearStep::Update(update) => Self::Update {
                row: update.row().collect(),
                gain: update.gain.to_vec(),
                innovation: update.innovation,
                // P − P Λ P holds for K = P hᵀ / S. Where states are only considered, the update is taken as a step of the
                // error, C e less K times the reading's noise, and what else the reading says of before is left
                variance: if update.considers { f64::INFINITY } else { update.variance },
            },
            LinearStep::Append(states) => {
                Self::Append(states.at, (0..states.count()).map(|i| states.row(i).collect()).collect())
            }
            LinearStep::Insert { at, count } => Self::Insert(*at, *count),
            LinearStep::Remove { at, count } => Self::Remove(*at, *count),
            LinearStep::Refused(_) => return None,
        })
    }
}

/// The steps of one filter over one stretch.
#[derive(Default)]
struct Steps(Vec<Step>);

impl Observer for Steps {
    fn observe(&mut self, step: &LinearStep<'_>) {
        self.0.extend(Step::of(step));
    }
}

/// One filter of the bank over one stretch.
struct Stretch {
    steps: Steps,
    /// ln of its prior odds against the main filter.
    log_prior: f64,
    /// What ranges and fixes say for it against the main filter: before each sample, and each by itself.
    evidence: Vec<Mark>,
}

#[derive(Clone, Copy)]
enum Mark {
    /// ln of the likelihood ratio so far, at a sample.
    Sample(f64),
    Evidence(Evidence),
}

/// The way back of one filter of the bank.
struct WayBack {
    adjoint: Adjoint,
    /// ln of the likelihood ratio by what follows.
    behind: f64,
}

impl WayBack {
    fn new() -> Self {
        Self { adjoint: Adjoint::new(), behind: 0.0 }
    }

    /// Smooths one stretch, from the last sample to the first, each with ln of its odds; nothing of a filter that failed.
    fn smooth(&mut self, stretch: Option<Stretch>) -> Vec<(TrackSample, f64)> {
        let Some(stretch) = stretch else {
            self.behind = f64::NEG_INFINITY;
            return Vec::new();
        };
        let mut log_odds = Vec::new();
        for evidence in stretch.evidence.iter().rev() {
            match *evidence {
                Mark::Evidence(evidence) => self.behind = evidence.beside(self.behind),
                Mark::Sample(before) => log_odds.push(stretch.log_prior + before + self.behind),
            }
        }
        self.adjoint.back(&stretch.steps.0).into_iter().zip(log_odds).collect()
    }
}

impl Recording {
    /// The smoothed estimate at every time that was marked, in order of time. While one stretch is smoothed, the one
    /// before it is filtered again.
    pub fn smooth(&self) -> Vec<TrackSample> {
        let mut ways: [WayBack; MEMBERS] = std::array::from_fn(|_| WayBack::new());
        let mut smoothed = Vec::new();
        let mut stretches = (0..self.stretches()).rev();
        let mut repeated = stretches.next().map(|stretch| self.repeat(stretch));
        while let Some(filters) = repeated {
            let before = stretches.next();
            let (next, samples) = rayon::join(
                || before.map(|stretch| self.repeat(stretch)),
                || ways.par_iter_mut().zip(filters).map(|(way, stretch)| way.smooth(stretch)).collect::<Vec<_>>(),
            );
            repeated = next;
            let mut mixtures: Vec<Mixture> = Vec::new();
            for samples in samples {
                mixtures.resize_with(mixtures.len().max(samples.len()), Mixture::default);
                mixtures.iter_mut().zip(samples).for_each(|(mixture, sample)| mixture.0.push(sample));
            }
            smoothed.extend(mixtures.iter().filter_map(Mixture::estimate));
        }
        smoothed.reverse();
        smoothed
    }
}

/// Estimates of one time, with ln of their odds.
#[derive(Default)]
struct Mixture(Vec<(TrackSample, f64)>);

impl Mixture {
    /// Mean and covariance.
    fn estimate(&self) -> Option<TrackSample> {
        let best = self.0.iter().map(|(_, log_odds)| *log_odds).fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = self.0.iter().map(|(_, log_odds)| (log_odds - best).exp()).collect();
        let total: f64 = weights.iter().sum();
        let (mut mixed, mut sum) = (self.0.first()?.0, weights.first()? / total);
        for ((sample, _), weight) in self.0.iter().zip(&weights).skip(1) {
            sum += weight / total;
            mixed = mixture(&mixed, sample, weight / total / sum);
        }
        Some(mixed)
    }
}

/// Mean and covariance of two estimates, of which the second has this weight.
fn mixture(a: &TrackSample, b: &TrackSample, weight: f64) -> TrackSample {
    let mut apart = b.state - a.state;
    apart[PSI] = wrap_angle(apart[PSI]);
    let mut state = a.state + apart * weight;
    state[PSI] = wrap_angle(state[PSI]);
    let mixed = |a: f64, b: f64| (1.0 - weight) * a + weight * b;
    let spread = weight * (1.0 - weight);
    TrackSample {
        time_us: a.time_us,
        state,
        sigma: VehicleState::from_fn(|i, _| {
            (mixed(a.sigma[i].powi(2), b.sigma[i].powi(2)) + spread * apart[i].powi(2)).sqrt()
        }),
        cov_xy_m2: mixed(a.cov_xy_m2, b.cov_xy_m2) + spread * apart[X] * apart[Y],
        current_mps: [0, 1].map(|i| mixed(a.current_mps[i], b.current_mps[i])),
    }
}
