//! Commanded fins against what they turn.
//!
//! A controller moves its fins by what it measures, so fins and motion agree or disagree at one time as the controller
//! wants. What a fin does is told by what follows: the change of a rate on the fin, the rate and the angle before it
//! fitted beside (damping and righting moment).

use super::grid::Grid;
use super::relation::{Demand, Outcome, Relation};
use super::slope::{Equation, Slope};
use crate::log::Column;

/// Changes of the rate are looked at over so long, s: fast vehicles need short ones, ships long ones.
const OVER_S: [f64; 3] = [1.0, 3.0, 8.0];
const STRETCH_S: f64 = 20.0;
const DEMAND: Demand = Demand { gain: [0.0, f64::INFINITY], correlation: 0.15, stretch_s: STRETCH_S };

macro_rules! fin {
    ($name:literal, $fin:ident, $sign:literal, $rate:ident) => {
        Relation {
            name: concat!($name, " against the rate that it turns"),
            needs: &[Column::$fin, Column::$rate],
            uses: &[Column::Pitch],
            test: |grid| by_rate(grid, Column::$fin, $sign, Column::$rate),
        }
    };
    ($name:literal, $fin:ident, $sign:literal, angle $angle:ident) => {
        Relation {
            name: concat!($name, " against the angle that it turns"),
            needs: &[Column::$fin, Column::$angle],
            uses: &[],
            test: |grid| by_angle(grid, Column::$fin, $sign, Column::$angle),
        }
    };
}

pub const RELATIONS: [Relation; 11] = [
    fin!("top fin", FinTop, 1.0, R),
    fin!("bottom fin", FinBottom, -1.0, R),
    fin!("port fin", FinPort, 1.0, Q),
    fin!("starboard fin", FinStarboard, -1.0, Q),
    fin!("rudder", Rudder, 1.0, R),
    fin!("top fin", FinTop, 1.0, angle Heading),
    fin!("bottom fin", FinBottom, -1.0, angle Heading),
    fin!("port fin", FinPort, 1.0, angle Pitch),
    fin!("starboard fin", FinStarboard, -1.0, angle Pitch),
    fin!("rudder", Rudder, 1.0, angle Heading),
    Relation {
        name: "fins against the axis that they turn about",
        needs: &[Column::FinTop, Column::FinPort, Column::Q, Column::R],
        uses: &[Column::FinBottom, Column::FinStarboard],
        test: axes,
    },
];

fn by_rate(grid: &Grid, fin: Column, sign: f64, rate: Column) -> Outcome {
    let slopes = OVER_S.map(|over_s| rate_slope(grid, fin, sign, rate, over_s));
    Outcome::of(slopes, &signed(sign, fin), &format!("the change of {} that follows", rate.name()), &DEMAND)
}

fn rate_slope(grid: &Grid, fin: Column, sign: f64, rate: Column, over_s: f64) -> Option<Slope> {
    let [fins, rates] = grid.all([fin, rate])?;
    let angle = if rate == Column::Q { grid.get(Column::Pitch) } else { None };
    let over = grid.cells(over_s, 2);
    let stretch = grid.cells(STRETCH_S, 3 * over);
    let equations = (0..grid.len.saturating_sub(over)).step_by(over.div_ceil(2)).map(|at| Equation {
        stretch: at / stretch,
        y: rates[at + over] - rates[at],
        x: sign * mean(&fins[at..at + over]),
        others: [1.0, rates[at], angle.map_or(0.0, |angle| angle[at]), 0.0],
    });
    Slope::of(within_stretches(equations.collect()))
}

fn by_angle(grid: &Grid, fin: Column, sign: f64, angle: Column) -> Outcome {
    let Some([fins, angles]) = grid.all([fin, angle]) else { return Outcome::untested("no such columns") };
    let slopes = OVER_S.map(|over_s| {
        let over = grid.cells(over_s, 2);
        let (stretch, half) = (grid.cells(STRETCH_S, 3 * over), over / 2);
        let righted = angle == Column::Pitch;
        let equations = (over..grid.len.saturating_sub(over)).step_by(half).map(|at| Equation {
            stretch: at / stretch,
            y: angles[at + over] - 2.0 * angles[at] + angles[at - over],
            x: sign * mean(&fins[at - half..at + half]),
            others: [1.0, angles[at] - angles[at - over], if righted { angles[at] } else { 0.0 }, 0.0],
        });
        Slope::of(within_stretches(equations.collect()))
    });
    Outcome::of(slopes, &signed(sign, fin), &format!("the turn of {} that follows", angle.name()), &DEMAND)
}

/// Each pair of fins must explain more of its own axis than of the other pair's.
fn axes(grid: &Grid) -> Outcome {
    let most = |fin, sign, rate| {
        let slopes = OVER_S.into_iter().filter_map(|over_s| rate_slope(grid, fin, sign, rate, over_s));
        slopes.min_by(|a, b| a.chance().total_cmp(&b.chance()))
    };
    let found = [
        most(Column::FinTop, 1.0, Column::R),
        most(Column::FinPort, 1.0, Column::Q),
        most(Column::FinTop, 1.0, Column::Q),
        most(Column::FinPort, 1.0, Column::R),
    ];
    let [Some(yaw), Some(pitch), Some(crossed_pitch), Some(crossed_yaw)] = found else {
        return Outcome::untested("fins and rates move together in too few stretches");
    };
    let evidence = format!(
        "fin_top_rad has correlation {:.2} with the change of r_radps and {:.2} with that of q_radps, fin_port_rad {:.2} \
         with that of q_radps and {:.2} with that of r_radps",
        yaw.correlation, crossed_pitch.correlation, pitch.correlation, crossed_yaw.correlation
    );
    let outweighs = |a: &Slope, b: &Slope| a.is_sure() && a.correlation.abs() > 2.0 * b.correlation.abs();
    let state = if outweighs(&crossed_pitch, &yaw) && outweighs(&crossed_yaw, &pitch) {
        super::relation::State::Contradicted
    } else if outweighs(&yaw, &crossed_pitch) && outweighs(&pitch, &crossed_yaw) {
        super::relation::State::Holds
    } else {
        super::relation::State::Untested
    };
    Outcome::new(state, evidence)
}

/// Without the mean of each stretch: a trim that changes slowly, by water that enters, holds a fin off its zero and the
/// vehicle off its angle, and turns nothing.
fn within_stretches(mut equations: Vec<Equation>) -> Vec<Equation> {
    let is_number = |e: &Equation| e.y.is_finite() && e.x.is_finite() && e.others.iter().all(|other| other.is_finite());
    equations.retain(is_number);
    for stretch in equations.chunk_by_mut(|a, b| a.stretch == b.stretch) {
        let count = stretch.len() as f64;
        let (y, x) =
            (stretch.iter().map(|e| e.y).sum::<f64>() / count, stretch.iter().map(|e| e.x).sum::<f64>() / count);
        let others = [1, 2, 3].map(|k| stretch.iter().map(|e| e.others[k]).sum::<f64>() / count);
        for equation in stretch {
            equation.y -= y;
            equation.x -= x;
            (1..4).zip(others).for_each(|(k, other)| equation.others[k] -= other);
        }
    }
    equations
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn signed(sign: f64, fin: Column) -> String {
    if sign < 0.0 { format!("-{}", fin.name()) } else { fin.name().to_owned() }
}
