//! Angular rates against the attitude that they turn: Euler's kinematic equations, of no vehicle.

use super::grid::Grid;
use super::relation::{Demand, Outcome, Relation, State};
use super::slope::{Equation, Slope};
use crate::log::Column;
use crate::stats::median;

/// Changes are compared over so long, s: rolling and waves need short, slow turns and late sensors long.
const OVER_S: [f64; 3] = [1.0, 4.0, 12.0];
/// No gyro of a vehicle is biased by more than a degree a second.
const LARGEST_BIAS_RADPS: f64 = 0.02;
/// A turn within the longest of these times that no noise and no bias makes, rad, and the fewest of them.
const LARGE_TURN_RAD: f64 = 0.5;
const ENOUGH: usize = 5;
/// Length of a stretch, s: errors of gyro and attitude forget each other within a second or two.
const STRETCH_S: f64 = 5.0;
/// A sensor that lags, or that smooths, halves a gain at most; degrees are a factor of 57.
const DEMAND: Demand = Demand { gain: [0.4, 2.5], correlation: 0.3, stretch_s: STRETCH_S };

pub const RELATIONS: [Relation; 3] = [
    Relation {
        name: "roll rate against roll",
        needs: &[Column::Roll, Column::P],
        uses: &[],
        test: |grid| angle_by_rate(grid, Column::Roll, Column::P),
    },
    Relation {
        name: "pitch rate against pitch",
        needs: &[Column::Pitch, Column::Q],
        uses: &[],
        test: |grid| angle_by_rate(grid, Column::Pitch, Column::Q),
    },
    Relation {
        name: "yaw rate against heading",
        needs: &[Column::Heading, Column::R],
        uses: &[],
        test: |grid| angle_by_rate(grid, Column::Heading, Column::R),
    },
];

/// Changes of the angle on the integral of the rate; of a heeled or pitched vehicle the difference is within the demand.
fn angle_by_rate(grid: &Grid, angle: Column, rate: Column) -> Outcome {
    let Some([angles, rates]) = grid.all([angle, rate]) else { return Outcome::untested("no such columns") };
    let slope = |over_s: f64, is_turning: bool| {
        let over = grid.cells(over_s, 2);
        let stretch = grid.cells(STRETCH_S, 2 * over);
        let seconds = over as f64 * grid.cell_s;
        let equations = (0..grid.len.saturating_sub(over)).step_by(over).map(|at| {
            let sums = rates[at..at + over].iter().zip(&rates[at + 1..=at + over]).map(|(a, b)| 0.5 * (a + b));
            // of a steady turn nothing is left beside a free bias: turns faster than any bias are looked at without
            let others = [if is_turning { 0.0 } else { 1.0 }, 0.0, 0.0, 0.0];
            let (y, x) = (angles[at + over] - angles[at], sums.sum::<f64>() * grid.cell_s);
            Equation { stretch: at / stretch, y, x, others }
        });
        let is_used = |e: &Equation| !is_turning || e.x.abs().max(e.y.abs()) > LARGEST_BIAS_RADPS * seconds;
        Slope::of(equations.filter(is_used).collect())
    };
    let slopes = OVER_S.map(|over_s| slope(over_s, false));
    let slopes = slopes.into_iter().chain(OVER_S[1..].iter().map(|over_s| slope(*over_s, true)));
    let outcome = Outcome::of(slopes, rate.name(), &format!("the change of {}", angle.name()), &DEMAND);
    if matches!(outcome.state, State::Absent | State::Untested) {
        return large_turns(grid, (angle, angles), rates).unwrap_or(outcome);
    }
    outcome
}

/// Turns that no noise makes: an angle that does not follow them is something else. A vehicle that dives while it turns
/// rolls by its rate and not by its angle, φ̇ = p + ψ̇ sin θ: by so much a turn has to be larger.
fn large_turns(grid: &Grid, (angle, angles): (Column, &[f64]), rates: &[f64]) -> Option<Outcome> {
    let (turned, leaned) = match angle {
        Column::Roll => (Column::Heading, Column::Pitch),
        Column::Pitch => (Column::Heading, Column::Roll),
        _ => (Column::Pitch, Column::Roll),
    };
    let others = grid.all([turned, leaned]);
    if others.is_none() && angle != Column::Heading {
        return None;
    }
    let over = grid.cells(OVER_S[2], 2);
    let by_others = |at: usize| {
        let of = |[turned, leaned]: [&[f64]; 2]| {
            (at..at + over).map(|k| ((turned[k + 1] - turned[k]) * leaned[k].sin()).abs()).sum()
        };
        others.map_or(0.0, of)
    };
    let turns = (0..grid.len.saturating_sub(over)).step_by(over).filter_map(|at| {
        let x = rates[at..at + over].iter().sum::<f64>() * grid.cell_s;
        let ratio = (angles[at + over] - angles[at]) / x;
        (x.abs() - by_others(at) > LARGE_TURN_RAD && ratio.is_finite()).then_some(ratio)
    });
    let ratios: Vec<f64> = turns.collect();
    let typical = median(&ratios).filter(|_| ratios.len() >= ENOUGH)?;
    (!(DEMAND.gain[0]..=DEMAND.gain[1]).contains(&typical)).then(|| {
        let evidence = format!(
            "in {} turns of more than {LARGE_TURN_RAD} rad by the rate the angle changes by {typical:.2} of that (median)",
            ratios.len()
        );
        Outcome::new(State::Contradicted, evidence)
    })
}
