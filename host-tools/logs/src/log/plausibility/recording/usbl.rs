//! Fixes by USBL of an array on the ship against the depth cell and against fixes by GNSS.
//!
//! An array that is turned by some degrees is for `diagnose`: here only what a wrong sign, unit or axis does.

use super::grid::Grid;
use super::relation::{Outcome, Relation, State};
use crate::log::Column;
use crate::stats::median;

/// Fewest fixes that are compared.
const FEWEST: usize = 5;
/// Nearer than this a direction says little, m.
const NEAREST_M: f64 = 30.0;
/// A median is known to so many of its standard errors.
const SIGMAS: f64 = 4.0;
/// Fixes by USBL and by GNSS that are apart by this share of the range are not of one place; by the other, they are.
const APART: [f64; 2] = [0.3, 0.6];

const FIX: [Column; 3] = [Column::UsblRange, Column::UsblBearing, Column::UsblElevation];

pub const RELATIONS: [Relation; 2] = [
    Relation {
        name: "USBL's elevation against depth",
        needs: &[Column::UsblRange, Column::UsblElevation, Column::Depth],
        uses: &[],
        test: depth,
    },
    Relation {
        name: "USBL's bearing against fixes",
        needs: &[
            Column::UsblRange,
            Column::UsblBearing,
            Column::UsblElevation,
            Column::ShipX,
            Column::ShipY,
            Column::GpsX,
            Column::GpsY,
        ],
        uses: &[],
        test: place,
    },
];

fn depth(grid: &Grid) -> Outcome {
    let Some([range, elevation, depth]) = of_ship(grid, [FIX[0], FIX[2], Column::Depth]) else {
        return Outcome::untested("the array is on the vehicle");
    };
    let down = |k: usize| -range[k] * elevation[k].sin();
    let cells: Vec<usize> = (0..grid.len).filter(|&k| !(down(k) - depth[k]).is_nan()).collect();
    // with the sign that it has, and with the other
    let of = |sign: f64| {
        let all: Vec<f64> = cells.iter().map(|&k| sign * down(k) - depth[k]).collect();
        let off = median(&all)?;
        let scatter = 1.5 * median(&all.iter().map(|value| (value - off).abs()).collect::<Vec<_>>())?;
        Some((off.abs(), SIGMAS * 1.25 * scatter / (all.len() as f64).sqrt()))
    };
    let (Some((off_m, bound_m)), Some((turned_m, _))) = (of(1.0), of(-1.0)) else {
        return Outcome::untested("no depth beside a fix by USBL");
    };
    let state = match cells.len() {
        ..FEWEST => State::Untested,
        // an array some metres down, and rays that bend
        _ if turned_m < 0.5 * off_m && off_m > bound_m => State::Contradicted,
        _ if off_m < 0.5 * turned_m && turned_m > bound_m => State::Holds,
        _ => State::Untested,
    };
    let evidence = format!(
        "the depth by range and elevation is off by {off_m:.1} m, with the other sign by {turned_m:.1} m, median of {} fixes",
        cells.len()
    );
    Outcome::new(state, evidence)
}

fn place(grid: &Grid) -> Outcome {
    let columns = [FIX[0], FIX[1], FIX[2], Column::ShipX, Column::ShipY, Column::GpsX, Column::GpsY];
    let Some([range, bearing, elevation, ship_x, ship_y, x, y]) = of_ship(grid, columns) else {
        return Outcome::untested("the array is on the vehicle");
    };
    let apart = |k: usize| {
        let level_m = range[k] * elevation[k].cos();
        let (north_m, east_m) = (ship_x[k] + level_m * bearing[k].cos(), ship_y[k] + level_m * bearing[k].sin());
        (north_m - x[k]).hypot(east_m - y[k]) / range[k]
    };
    let all: Vec<f64> =
        (0..grid.len).filter(|&k| range[k] > NEAREST_M).map(apart).filter(|apart| !apart.is_nan()).collect();
    let Some(typical) = median(&all).filter(|_| all.len() >= FEWEST) else {
        return Outcome::untested(format!("{} fixes by USBL at a time of a fix by GNSS", all.len()));
    };
    let state = match typical {
        apart if apart < APART[0] => State::Holds,
        apart if apart > APART[1] => State::Contradicted,
        _ => State::Untested,
    };
    let evidence = format!(
        "fixes by USBL are {:.0} % of their range from those by GNSS of that time, median of {} fixes",
        100.0 * typical,
        all.len()
    );
    Outcome::new(state, evidence)
}

/// Columns of fixes by an array on the ship.
fn of_ship<const N: usize>(grid: &Grid, columns: [Column; N]) -> Option<[&[f64]; N]> {
    grid.all(columns).filter(|_| !grid.has(Column::UsblOnVehicle))
}
