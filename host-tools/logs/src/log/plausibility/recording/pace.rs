//! How fast headings and speeds change, which tells the unit of the time where nothing else has one.

use super::grid::Grid;
use super::relation::{Outcome, Relation, State};
use crate::log::Column;
use crate::stats::percentile;

/// Changes over so many cells: noise averages out.
const OVER: usize = 4;
/// Of the fastest changes these count.
const FAST: f64 = 0.95;
/// Turn rate of what moves on water and in it, rad/s, and acceleration, m/s²: from the slowest ship to a small robot.
const TURN_RADPS: [f64; 2] = [0.003, 1.5];
const ACCELERATION_MPS2: [f64; 2] = [3e-4, 2.5];
const ENOUGH: usize = 100;

pub const RELATIONS: [Relation; 2] = [
    Relation {
        name: "heading against the time",
        needs: &[Column::Heading],
        uses: &[],
        test: |grid| pace(grid, Column::Heading, TURN_RADPS, "rad/s"),
    },
    Relation {
        name: "speed against the time",
        needs: &[Column::DvlU],
        uses: &[],
        test: |grid| pace(grid, Column::DvlU, ACCELERATION_MPS2, "m/s^2"),
    },
];

/// Contradicted by what is too fast alone: a straight line is slow at any unit.
fn pace(grid: &Grid, column: Column, [slow, fast]: [f64; 2], unit: &str) -> Outcome {
    let Some(values) = grid.get(column) else { return Outcome::untested("no such column") };
    let seconds = OVER as f64 * grid.cell_s;
    let steps = values.windows(OVER + 1).map(|window| (window[OVER] - window[0]).abs() / seconds);
    let steps: Vec<f64> = steps.filter(|step| step.is_finite()).collect();
    let Some(fastest) = percentile(&steps, FAST).filter(|_| steps.len() >= ENOUGH) else {
        return Outcome::untested(format!("{} readings of {} without a gap", steps.len(), column.name()));
    };
    let state = match fastest {
        rate if rate > fast => State::Contradicted,
        rate if rate >= slow => State::Holds,
        _ => State::Untested,
    };
    let evidence = format!(
        "one in twenty changes of {} over {seconds:.3} s is faster than {fastest:.4} {unit} (expected {slow} to {fast})",
        column.name()
    );
    Outcome::new(state, evidence)
}
