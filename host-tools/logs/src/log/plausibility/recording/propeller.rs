//! Propeller speed against the speed of the vehicle: sign, and metres a turn.

use super::grid::{Grid, SPEEDS};
use super::relation::{Outcome, Relation, State};
use crate::log::Column;
use crate::stats::median;

/// Way of a torpedo or a small vessel for each turn of its propeller, m: 0.4 to 1.2 diameters (Carlton 2018) of 0.05 to
/// 0.25 m. Beyond the second a motor with a gear and a large vessel are left behind as well.
const PER_TURN_M: [f64; 2] = [0.02, 0.3];
const POSSIBLE_M: [f64; 2] = [0.012, 0.5];
/// Below it a vehicle starts, stops or drifts, m/s and share of the highest propeller speed.
const MAKING_WAY_MPS: f64 = 0.3;
const TURNING: f64 = 0.2;
const STRETCH_S: f64 = 20.0;
const ENOUGH: usize = 5;

pub const RELATIONS: [Relation; 2] = [
    Relation { name: "propeller against speed, sign", needs: &[Column::PropRpm], uses: SPEEDS, test: sign },
    Relation { name: "propeller against speed, size", needs: &[Column::PropRpm], uses: SPEEDS, test: size },
];

/// Metres a turn of each stretch, with sign.
fn per_turn(grid: &Grid) -> Result<(Vec<f64>, Column), String> {
    let Some(rpm) = grid.get(Column::PropRpm) else { return Err("no propeller".to_owned()) };
    let Some((column, u)) = grid.speed() else { return Err("no speed is logged".to_owned()) };
    let fastest = rpm.iter().copied().filter(|rpm| !rpm.is_nan()).map(f64::abs).fold(0.0, f64::max);
    let stretch = grid.cells(STRETCH_S, 2);
    let mut found = Vec::new();
    for start in (0..grid.len.saturating_sub(stretch)).step_by(stretch) {
        let part = start..start + stretch;
        let (Some(n), Some(v)) = (middle(&rpm[part.clone()]), middle(&u[part])) else { continue };
        if v.abs() > MAKING_WAY_MPS && n.abs() > TURNING * fastest && fastest > 0.0 {
            found.push(v * 60.0 / n);
        }
    }
    if found.len() < ENOUGH {
        return Err(format!("{} stretches of {STRETCH_S:.0} s with propeller and way on", found.len()));
    }
    Ok((found, column))
}

fn middle(values: &[f64]) -> Option<f64> {
    let known: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    if known.len() * 2 < values.len() { None } else { median(&known) }
}

fn sign(grid: &Grid) -> Outcome {
    let (found, column) = match per_turn(grid) {
        Ok(found) => found,
        Err(why) => return Outcome::untested(why),
    };
    let against = found.iter().filter(|way| **way < 0.0).count();
    let evidence = format!(
        "prop_rpm and {} have opposite signs in {against} of {} stretches of {STRETCH_S:.0} s",
        column.name(),
        found.len()
    );
    let state = match against * 100 / found.len() {
        80.. => State::Contradicted,
        ..20 => State::Holds,
        _ => State::Untested,
    };
    Outcome::new(state, evidence)
}

fn size(grid: &Grid) -> Outcome {
    if grid.is_motor_rpm {
        return Outcome::untested("prop_rpm is that of the motor, before a gear that the log does not state");
    }
    let (found, column) = match per_turn(grid) {
        Ok(found) => found,
        Err(why) => return Outcome::untested(why),
    };
    let per_turn = median(&found).unwrap_or(0.0).abs();
    let evidence = format!(
        "by {} the vehicle goes {per_turn:.4} m for each turn of prop_rpm, median of {} stretches (expected {} to {})",
        column.name(),
        found.len(),
        PER_TURN_M[0],
        PER_TURN_M[1]
    );
    let is_within = |[low, high]: [f64; 2]| (low..=high).contains(&per_turn);
    let state = match (is_within(PER_TURN_M), is_within(POSSIBLE_M)) {
        (true, _) => State::Holds,
        (_, true) => State::Untested,
        _ => State::Contradicted,
    };
    Outcome::new(state, evidence)
}
