//! The slip of a hull in turns: it drifts outwards, for only water from outside pushes it round.

use super::grid::Grid;
use super::relation::{Demand, Outcome, Relation, State};
use super::slope::{Equation, Slope};
use crate::log::Column;

const STRETCH_S: f64 = 10.0;
/// A DVL so far ahead of the centre of gravity, m, sees no slip outwards.
const AHEAD_M: f64 = 0.3;

/// The place of the DVL decides as well.
pub const RELATION: Relation = Relation {
    name: "sway against slip in turns",
    needs: &[Column::DvlU, Column::DvlV, Column::Heading],
    uses: &[],
    test: slip,
};

fn slip(grid: &Grid) -> Outcome {
    let Some([u, v, heading]) = grid.all([Column::DvlU, Column::DvlV, Column::Heading]) else {
        return Outcome::untested("no such columns");
    };
    let over = grid.cells(2.0, 2);
    let stretch = grid.cells(STRETCH_S, 3 * over);
    let equations = (0..grid.len.saturating_sub(over)).step_by(over).map(|at| {
        let rate = (heading[at + over] - heading[at]) / (over as f64 * grid.cell_s);
        let part = &v[at..=at + over];
        let ahead = if u[at] < 0.0 { -1.0 } else { 1.0 };
        let sway = part.iter().sum::<f64>() / part.len() as f64;
        Equation { stretch: at / stretch, y: -sway, x: rate * ahead, others: [1.0, 0.0, 0.0, 0.0] }
    });
    let demand = Demand { gain: [0.0, f64::INFINITY], correlation: 0.5, stretch_s: STRETCH_S };
    let slope = Slope::of(equations.collect());
    let is_small = slope.as_ref().is_none_or(|slope| slope.gain > -AHEAD_M);
    let correlation = slope.as_ref().map(|slope| slope.correlation);
    let outcome = Outcome { correlation, ..Outcome::of([slope], "the yaw rate", "-dvl_v_mps", &demand) };
    if outcome.state == State::Contradicted && is_small { Outcome::untested(outcome.evidence) } else { outcome }
}
