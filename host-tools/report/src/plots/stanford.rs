//! The Stanford diagram: errors against the level that was stated for each. Below the diagonal the bound was broken.

use super::axis::Axis;
use super::frame::{Frame, Key, Mark, left_margin};
use super::{Point, Series, is_drawable};
use crate::palette::{SERIES, TRUTH};

const HEIGHT: i32 = 420;
const DIAGONAL: Mark = Mark::Line { width: 1.9, opacity: 1.0 };
/// Smaller errors stand at the edge, m.
const LEAST: f64 = 0.01;

/// Draws groups of (error, level) on logarithmic axes of the same length.
pub fn stanford(x_label: &str, y_label: &str, groups: &[Series<'_>]) -> String {
    let place = |&(error, level): &Point| (error.max(LEAST).log10(), level.max(LEAST).log10());
    let drawn = |point: &&Point| is_drawable(point.0) && is_drawable(point.1) && point.1 > 0.0;
    let points = || groups.iter().flat_map(|(_, points)| points.iter()).filter(drawn).map(place);
    let (low, high) =
        points().fold((f64::INFINITY, 0.0_f64), |(low, high), (x, y)| (low.min(x.min(y)), high.max(x.max(y))));
    let (low, high) = (10_f64.powf(low.min(0.0)), 10_f64.powf(high.max(1.0) + 0.05));
    let (x, y) = (Axis::log(x_label, low, high), Axis::log(y_label, low, high));
    let ink = |i: usize| SERIES[i % SERIES.len()];
    let mut legend: Vec<Key> =
        groups.iter().enumerate().map(|(i, (name, _))| Key::new(*name, ink(i), Mark::Dot)).collect();
    legend.push(Key::new("error = level", TRUTH, DIAGONAL));
    let frame = Frame {
        left: left_margin(&y),
        description: format!("{y_label} against {x_label}; the bound is broken below the diagonal"),
        empty: points().next().is_none(),
        legend,
        height: HEIGHT,
        x,
        y,
    };
    frame.draw(|canvas| {
        canvas.line(vec![(frame.x.low, frame.x.low), (frame.x.high, frame.x.high)], TRUTH, 1.9, 1.0);
        for (i, (_, points)) in groups.iter().enumerate() {
            points.iter().filter(drawn).map(place).for_each(|point| canvas.dot(point, ink(i), 2.0, 0.7));
        }
    })
}
