//! What physics says of two or more columns, whatever the vehicle, and what a log says of it.

use super::grid::Grid;
use super::slope::Slope;
use crate::log::Column;

/// A relation that holds in every log whose columns are what their names say.
pub struct Relation {
    /// What is compared, in words.
    pub name: &'static str,
    /// Columns of which all must be there.
    pub needs: &'static [Column],
    /// Further columns that are used where they are there.
    pub uses: &'static [Column],
    pub test: fn(&Grid) -> Outcome,
}

/// What a log says of a relation.
#[derive(Clone, Debug)]
pub struct Outcome {
    pub state: State,
    /// The numbers, one sentence without its full stop.
    pub evidence: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// As physics says.
    Holds,
    /// Against physics, beyond chance.
    Contradicted,
    /// Clearly not as physics says, but nothing else either: alone it says nothing, for noise does that too.
    Absent,
    /// The log does not show it.
    Untested,
}

/// What a slope must be.
pub struct Demand {
    /// Gains that some vehicle or sensor can have.
    pub gain: [f64; 2],
    /// Below this correlation a gain says nothing.
    pub correlation: f64,
    /// Length of a stretch, s, for the report.
    pub stretch_s: f64,
}

impl Outcome {
    pub fn untested(why: impl Into<String>) -> Self {
        Self { state: State::Untested, evidence: why.into() }
    }

    /// The most telling of several slopes of `y` on `x`.
    pub fn of(slopes: impl IntoIterator<Item = Option<Slope>>, x: &str, y: &str, demand: &Demand) -> Self {
        let Some(slope) = slopes.into_iter().flatten().max_by(|a, b| a.t().total_cmp(&b.t())) else {
            return Self::untested(format!("{x} and {y} move together in too few stretches"));
        };
        let [low, high] = demand.gain;
        let [all, same] = slope.stretches;
        let wanted = if high.is_finite() { format!("{low} to {high}") } else { "positive".to_owned() };
        let evidence = format!(
            "{y} on {x} has slope {:.3} ± {:.3} (expected {wanted}), correlation {:.2}, the same sign in {same} of {all} \
             stretches of {:.0} s",
            slope.gain, slope.sigma, slope.correlation, demand.stretch_s
        );
        let is_clear = slope.is_sure() && slope.correlation.abs() >= demand.correlation;
        let (gain, bound) = (slope.gain, slope.other_bound());
        let state = if is_clear && gain < 0.0 {
            State::Contradicted
        } else if is_clear && ((gain > high && slope.is_beyond(high)) || (bound < low && slope.is_beyond(low))) {
            State::Contradicted
        } else if is_clear && bound >= low && gain <= high {
            State::Holds
        } else if gain < low && slope.is_beyond(low) && slope.correlation.abs() < demand.correlation {
            State::Absent
        } else {
            State::Untested
        };
        Self { state, evidence }
    }
}
