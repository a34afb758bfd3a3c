//! The way between fixes, and the way by heading and speed over the same time.

use super::grid::Grid;
use crate::log::Column;
use nalgebra::{Complex, Normed};
use std::f64::consts::FRAC_PI_2;

/// A leg is at least so long, s, and that or so long, m; and at most so long, s: nearer fixes are noise, of further ones
/// errors rule.
const SHORTEST: (f64, f64, f64) = (10.0, 60.0, 8.0);
const LONGEST_S: f64 = 1200.0;
/// Share of a leg without heading or speed.
const MISSING: f64 = 0.1;

/// North and east as a complex number: a heading is then a factor.
pub type Way = Complex<f64>;

/// A way of this length in this direction.
pub fn polar(length: f64, angle: f64) -> Way {
    Way::new(length * angle.cos(), length * angle.sin())
}

/// From one fix to another.
pub struct Leg {
    pub seconds: f64,
    /// For how many legs it counts: one a minute.
    pub counts: usize,
    /// By the fixes, m.
    pub fixed: Way,
    /// By heading and what moves ahead, m (s, where no speed is known).
    pub ahead: Way,
    /// By heading and the sway, m.
    pub aside: Way,
}

/// The legs of a log and what they were made of.
pub struct Legs {
    pub legs: Vec<Leg>,
    /// Where the speed comes from.
    pub speed: Option<Column>,
    /// What the fixed way is made of.
    pub fixes: &'static str,
}

impl Legs {
    /// `None` without heading, or without fixes or a reference velocity.
    pub fn of(grid: &Grid) -> Option<Self> {
        let heading = grid.get(Column::Heading)?;
        let speed = grid.speed().map(|(column, _)| column);
        let ones = vec![1.0; grid.len];
        let u = grid.speed().map_or(&ones[..], |(_, speed)| speed);
        let v = if speed == Some(Column::DvlU) { grid.get(Column::DvlV) } else { None };
        let pitch = grid.get(Column::Pitch);
        let (place, fixes) = places(grid)?;
        let [shortest, long, longest] = [SHORTEST.0, SHORTEST.1, LONGEST_S].map(|seconds| grid.cells(seconds, 1));
        let (mut legs, mut start): (Vec<Leg>, Option<(usize, Way)>) = (Vec::new(), None);
        let (mut ahead, mut aside, mut missing) = (Way::default(), Way::default(), 0_usize);
        for cell in 0..grid.len {
            if let Some(here) = place[cell] {
                let (from, before) = *start.get_or_insert((cell, here));
                let (cells, way) = (cell - from, here - before);
                let seconds = cells as f64 * grid.cell_s;
                if cells >= shortest && (way.norm() >= SHORTEST.2 || cells >= long) {
                    let is_whole = (missing as f64) < MISSING * cells as f64 && cells <= longest;
                    if is_whole {
                        let filled = cells as f64 / ((cells - missing) as f64).max(1.0);
                        let counts = cells.div_ceil(long);
                        legs.push(Leg { seconds, counts, fixed: way, ahead: ahead * filled, aside: aside * filled });
                    }
                    (start, ahead, aside, missing) = (Some((cell, here)), Way::default(), Way::default(), 0);
                }
            }
            let level = pitch.map_or(1.0, |pitch| if pitch[cell].abs() < FRAC_PI_2 { pitch[cell].cos() } else { 1.0 });
            let forward = polar(grid.cell_s, heading[cell]);
            let sway = v.map_or(0.0, |v| if v[cell].is_nan() { 0.0 } else { v[cell] });
            let step = forward * (u[cell] * level);
            if step.re.is_nan() {
                missing += 1;
            } else {
                ahead += step;
                aside += forward * Way::i() * sway;
            }
        }
        Some(Self { legs, speed, fixes })
    }
}

/// Places by the fixes, or by a reference velocity.
fn places(grid: &Grid) -> Option<(Vec<Option<Way>>, &'static str)> {
    let whole = |way: Way| Some(way).filter(|way| way.re.is_finite() && way.im.is_finite());
    if let Some([x, y]) = grid.all([Column::GpsX, Column::GpsY]) {
        return Some(((0..grid.len).map(|k| whole(Way::new(x[k], y[k]))).collect(), "gps_x_m, gps_y_m"));
    }
    let [north, east] = grid.all([Column::RefNorth, Column::RefEast])?;
    let mut at = Way::default();
    let mut places = Vec::with_capacity(grid.len);
    for k in 0..grid.len {
        let step = whole(Way::new(north[k], east[k]));
        places.push(step.map(|_| at));
        at += step.unwrap_or_default() * grid.cell_s;
    }
    Some((places, "ref_north_mps, ref_east_mps"))
}
