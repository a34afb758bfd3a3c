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
    /// Correlation of a slope whose size is known beforehand. That of a fin is not: a fin that is stuck, or a controller,
    /// ties its command to any motion.
    pub correlation: Option<f64>,
    /// Whether anything was compared at all.
    pub is_compared: bool,
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
    pub const fn new(state: State, evidence: String) -> Self {
        Self { state, evidence, correlation: None, is_compared: true }
    }

    pub fn untested(why: impl Into<String>) -> Self {
        Self { is_compared: false, ..Self::new(State::Untested, why.into()) }
    }

    /// The most telling of several slopes of `y` on `x`.
    pub fn of(slopes: impl IntoIterator<Item = Option<Slope>>, x: &str, y: &str, demand: &Demand) -> Self {
        let mut slopes: Vec<Slope> = slopes.into_iter().flatten().collect();
        // of those that are sure the closest, of others the least unsure
        slopes.sort_by(|a, b| match (a.is_sure(), b.is_sure()) {
            (true, true) => b.correlation.abs().total_cmp(&a.correlation.abs()),
            _ => a.chance().total_cmp(&b.chance()),
        });
        let Some(slope) = slopes.first() else {
            return Self::untested(format!("{x} and {y} move together in too few stretches"));
        };
        let [low, high] = demand.gain;
        let [all, same] = slope.beyond(0.0);
        let wanted = if high.is_finite() { format!("{low} to {high}") } else { "positive".to_owned() };
        let evidence = format!(
            "{y} on {x} has slope {:.3} ± {:.3} (expected {wanted}), correlation {:.2}, the same sign in {same} of {all} \
             stretches of {:.0} s",
            slope.gain, slope.sigma, slope.correlation, demand.stretch_s
        );
        let is_absent =
            |slope: &Slope| slope.gain < low && slope.is_beyond(low) && slope.correlation.abs() < demand.correlation;
        let is_clear = slope.is_sure() && slope.correlation.abs() >= demand.correlation;
        let (gain, bound) = (slope.gain, slope.other_bound());
        // the closest says how far, any of them how sure
        let is_above = gain > high && slopes.iter().any(|slope| slope.gain > high && slope.is_beyond(high));
        let is_below = bound < low && slopes.iter().any(|slope| slope.gain < low && slope.is_beyond(low));
        let is_beyond = is_above || is_below;
        let state = if is_clear && (gain < 0.0 || is_beyond) {
            State::Contradicted
        } else if is_clear && bound >= low && gain <= high {
            State::Holds
        } else if slopes.iter().any(is_absent) {
            State::Absent
        } else {
            State::Untested
        };
        Self { state, evidence, correlation: high.is_finite().then_some(slope.correlation), is_compared: true }
    }
}
