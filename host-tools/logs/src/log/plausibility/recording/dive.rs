//! Depth against pitch, speed and heave: ż = −u sin θ + (v sin φ + w cos φ) cos θ.

use super::grid::Grid;
use super::relation::{Demand, Outcome, Relation, State};
use super::slope::{Equation, Slope};
use crate::log::Column;
use crate::stats::percentile;

/// Changes of depth are compared over so long, s: a noisy depth needs long ones, a heave that swings short ones.
const OVER_S: [f64; 4] = [1.0, 2.5, 6.0, 15.0];
const STRETCH_S: f64 = 10.0;
/// At the surface depth is noise and waves, m.
const DIVE_M: f64 = 0.5;

pub const RELATIONS: [Relation; 2] = [
    Relation {
        name: "depth against pitch",
        needs: &[Column::Depth, Column::Pitch],
        uses: &[Column::DvlU, Column::DvlW, Column::SpeedLog, Column::WaterSpeed],
        test: by_pitch,
    },
    Relation {
        name: "depth against heave",
        needs: &[Column::Depth, Column::Pitch, Column::DvlU, Column::DvlW],
        uses: &[Column::Roll, Column::DvlV],
        test: by_heave,
    },
];

fn by_pitch(grid: &Grid) -> Outcome {
    let has_heave = grid.has(Column::DvlW);
    let speed = grid.speed().map(|(column, _)| column);
    // Without the heave a vehicle may sink flat or fly at an angle of attack; without a speed the gain is the speed.
    let gain = match speed {
        Some(_) if has_heave => [0.6, 1.6],
        Some(Column::SpeedLog | Column::WaterSpeed) => [0.4, 2.5],
        Some(_) => [0.3, 3.0],
        None => [0.05, 20.0],
    };
    let demand = Demand { gain, correlation: 0.35, stretch_s: STRETCH_S };
    let x = speed.map_or_else(|| "-sin(pitch_rad)".to_owned(), |speed| format!("-{} sin(pitch_rad)", speed.name()));
    compare(grid, 0, &x, &demand)
}

fn by_heave(grid: &Grid) -> Outcome {
    let demand = Demand { gain: [0.4, 2.5], correlation: 0.3, stretch_s: STRETCH_S };
    compare(grid, 1, "dvl_w_mps", &demand)
}

/// The slope of depth on one of the two parts of the velocity down, the other fitted beside it.
fn compare(grid: &Grid, part: usize, x: &str, demand: &Demand) -> Outcome {
    let Some((depth, parts)) = parts(grid) else { return Outcome::untested("no such columns") };
    let known: Vec<f64> = depth.iter().copied().filter(|depth| !depth.is_nan()).collect();
    let span = [0.02, 0.98].map(|q| percentile(&known, q).unwrap_or(0.0));
    if span[1] - span[0] < DIVE_M {
        return Outcome::untested(format!("depth_m changes by {:.1} m: no dive", span[1] - span[0]));
    }
    let slopes = OVER_S.map(|over_s| {
        let over = grid.cells(over_s, 2);
        let stretch = grid.cells(STRETCH_S, 2 * over);
        let equations = (0..grid.len.saturating_sub(over)).step_by(over).map(|at| {
            let sum = |of: &[f64]| {
                of[at..at + over].iter().zip(&of[at + 1..=at + over]).map(|(a, b)| 0.5 * (a + b)).sum::<f64>()
                    * grid.cell_s
            };
            let other = if parts[1 - part].is_empty() { 0.0 } else { sum(&parts[1 - part]) };
            Equation {
                stretch: at / stretch,
                y: depth[at + over] - depth[at],
                x: sum(&parts[part]),
                // a pitch sensor with a bias
                others: [1.0, other, 0.0, 0.0],
            }
        });
        Slope::of(equations.collect())
    });
    let mut outcome = Outcome::of(slopes, x, "the change of depth_m", demand);
    if part == 0 && outcome.state == State::Absent && !grid.has(Column::DvlW) {
        // a vehicle with vertical thrusters, or moved by its ballast
        outcome.state = State::Untested;
    }
    outcome
}

/// Depth, and the velocity down by surge, and by sway and heave together (empty without).
fn parts(grid: &Grid) -> Option<(&[f64], [Vec<f64>; 2])> {
    let [depth, pitch] = grid.all([Column::Depth, Column::Pitch])?;
    let ones = vec![1.0; grid.len];
    let zeros = vec![0.0; grid.len];
    let u = grid.speed().map_or(&ones[..], |(_, speed)| speed);
    let by_surge = (0..grid.len).map(|k| -u[k] * pitch[k].sin()).collect();
    let by_heave = match grid.get(Column::DvlW) {
        Some(w) => {
            let v = grid.get(Column::DvlV).unwrap_or(&zeros);
            let roll = grid.get(Column::Roll).unwrap_or(&zeros);
            (0..grid.len).map(|k| (v[k] * roll[k].sin() + w[k] * roll[k].cos()) * pitch[k].cos()).collect()
        }
        None => Vec::new(),
    };
    Some((depth, [by_surge, by_heave]))
}
