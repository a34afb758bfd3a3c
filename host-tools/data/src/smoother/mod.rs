//! Fixed-interval smoothing: the best estimate of every time from the measurements of the whole log.
//!
//! The modified Bryson-Frazier form (Bierman, "Fixed interval smoothing with discrete measurements", Int. J. Control
//! 18(1), 1973): after a forward pass of the filter, the adjoint λ and its covariance Λ run backwards through the same
//! steps, and the smoothed estimate is x̂ − P λ with covariance P − P Λ P. Nothing of the size of P is inverted, so that
//! delayed states, of which P is singular, need no special case, and a step back costs about as much as a step forward.
//!
//! The forward pass keeps the calls that moved the filter and a copy of the filter every few hundred of them
//! ([`Recording`]). Backwards, one stretch after the other is filtered again from its copy, which repeats the first pass
//! bit for bit, and its steps are kept only until they are smoothed: the tool needs some kB for each second of a log.

mod adjoint;
mod recording;

pub use recording::Recording;

use crate::filter::TrackSample;
use adjoint::Adjoint;
use backseat_core::navigation::{LinearStep, MAX_STATES, Navigator, Observer};
use backseat_core::state::VEHICLE_STATES;

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
    covariance: Vec<Vector>,
}

impl Filtered {
    fn of(navigator: &Navigator) -> Self {
        let states = navigator.dimension();
        let mut x = [0.0; STRIDE];
        let mut covariance = vec![[0.0; STRIDE]; states];
        for (i, (x, row)) in x.iter_mut().zip(&mut covariance).enumerate() {
            *x = navigator.state_at(i);
            row.iter_mut().enumerate().for_each(|(j, p)| *p = navigator.covariance(i, j));
        }
        let (current, fixed_current_mps) = (navigator.current_place(), navigator.current());
        Self { time_us: navigator.time_us(), states, current, fixed_current_mps, x, covariance }
    }
}

/// One step of the forward pass, as the way back needs it.
enum Step {
    /// Columns of the vehicle's rows of Φ, and entries (row, column, value) elsewhere.
    Transition(Vec<[f64; VEHICLE_STATES]>, Vec<(usize, usize, f64)>),
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

/// The steps of one stretch.
#[derive(Default)]
struct Steps(Vec<Step>);

impl Observer for Steps {
    fn observe(&mut self, step: &LinearStep<'_>) {
        self.0.push(match step {
            LinearStep::Transition(transition) => {
                let mut columns = vec![[0.0; VEHICLE_STATES]; transition.live()];
                transition.vehicle_rows(&mut columns);
                Step::Transition(columns, transition.others().collect())
            }
            LinearStep::Update(update) => Step::Update {
                row: update.row().collect(),
                gain: update.gain.to_vec(),
                innovation: update.innovation,
                variance: update.variance,
            },
            LinearStep::Append(states) => {
                Step::Append(states.at, (0..states.count()).map(|i| states.row(i).collect()).collect())
            }
            LinearStep::Insert { at, count } => Step::Insert(*at, *count),
            LinearStep::Remove { at, count } => Step::Remove(*at, *count),
        });
    }
}

impl Recording {
    /// The smoothed estimate at every time that was marked, in order of time.
    #[must_use]
    pub fn smooth(&self) -> Vec<TrackSample> {
        let mut adjoint = Adjoint::new();
        let mut smoothed = Vec::new();
        for stretch in (0..self.stretches()).rev() {
            for step in self.repeat(stretch).0.iter().rev() {
                match step {
                    Step::Transition(columns, others) => adjoint.transition(columns, others),
                    Step::Update { row, gain, innovation, variance } => {
                        adjoint.update(row, gain, *innovation, *variance);
                    }
                    Step::Append(at, rows) => adjoint.append(*at, rows),
                    Step::Insert(at, count) => adjoint.insert(*at, *count),
                    Step::Remove(at, count) => adjoint.remove(*at, *count),
                    Step::Sample(filtered) => smoothed.push(adjoint.smoothed(filtered)),
                }
            }
        }
        smoothed.reverse();
        smoothed
    }
}
