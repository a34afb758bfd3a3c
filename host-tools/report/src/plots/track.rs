//! The map.

use super::axis::{Axis, extent, nice_step, plain};
use super::decimate::{every, runs, simplify, stride};
use super::frame::{Frame, Key, Mark, left_margin};
use super::{Ellipse, Point, TrackPlot, is_drawable};
use crate::palette::{FAINT, ORANGE, SERIES, SKY, TEXT, TRUTH};

/// Square root of the 95 % quantile of chi-square with two degrees of freedom: standard deviations to the edge of the
/// ellipse.
const ELLIPSE_95: f64 = 2.447_746_8;
const MOST_PATHS: usize = 130;
const MOST_WAYPOINTS: usize = 500;
const MOST_POINTS: usize = 4000;
const MOST_ELLIPSES: usize = 60;
/// Half axis in pixels below which a typical ellipse is enlarged.
const SMALLEST_ELLIPSE: f64 = 9.0;
/// Pixels of track from one ellipse to the next: closer, they cover the track and one another.
const ELLIPSE_SPACING: f64 = 40.0;
const TRUTH_LOOK: Mark = Mark::Line { width: 5.0, opacity: 0.35 };
const ESTIMATE_LOOK: Mark = Mark::Line { width: 2.0, opacity: 1.0 };
const SHIP_LOOK: Mark = Mark::Line { width: 2.0, opacity: 0.9 };
const PATH_LOOK: Mark = Mark::Line { width: 1.0, opacity: 0.4 };

/// East, north: from the order of the frame to that of the page.
fn on_page((north, east): Point) -> Point {
    (east, north)
}

fn drawable(points: &[Point]) -> impl Iterator<Item = Point> {
    points.iter().copied().filter(|p| is_drawable(p.0) && is_drawable(p.1)).map(on_page)
}

/// Draws a map.
pub fn track(plot: &TrackPlot<'_>) -> String {
    let paths: Vec<(Point, Point)> = plot
        .acoustic_paths
        .iter()
        .copied()
        .filter(|(v, s)| [v.0, v.1, s.0, s.1].iter().all(|c| is_drawable(*c)))
        .collect();
    let ellipses: Vec<&Ellipse> = plot.ellipses.iter().filter(|e| half_axes(e).is_some()).collect();
    let all: Vec<Point> = [plot.truth, plot.ship, Some(plot.waypoints)]
        .into_iter()
        .flatten()
        .chain(plot.estimates.iter().map(|(_, line)| *line))
        .flat_map(drawable)
        .chain(paths.iter().flat_map(|(v, s)| [on_page(*v), on_page(*s)]))
        .chain(ellipses.iter().map(|e| (e.y_m, e.x_m)))
        .collect();
    let mut frame = plane(&all);
    let metres_per_pixel = frame.pixel().0;

    let nth_path = stride(paths.len(), MOST_PATHS);
    let most_ellipses = (length(&ellipses) / metres_per_pixel / ELLIPSE_SPACING) as usize;
    let nth_ellipse = stride(ellipses.len(), most_ellipses.clamp(2, MOST_ELLIPSES));
    let enlarged = enlargement(&ellipses, metres_per_pixel);
    frame.legend = legend(plot, &ellipses, enlarged, nth_ellipse, (paths.len(), nth_path));

    frame.draw(|canvas| {
        let line = |points: &[Point], ink, look| {
            let Mark::Line { width, opacity } = look else { return };
            for run in runs(points) {
                let simple = simplify(run, metres_per_pixel * 0.3, MOST_POINTS);
                canvas.line(simple.into_iter().map(on_page).collect(), ink, width, opacity);
            }
        };
        for (vehicle, ship) in paths.iter().step_by(nth_path) {
            line(&[*vehicle, *ship], FAINT, PATH_LOOK);
        }
        line(plot.ship.unwrap_or_default(), SKY, SHIP_LOOK);
        line(plot.truth.unwrap_or_default(), TRUTH, TRUTH_LOOK);
        // The first estimate is what the report is about: on top.
        for (i, (_, points)) in plot.estimates.iter().enumerate().rev() {
            line(points, SERIES[i % SERIES.len()], ESTIMATE_LOOK);
        }
        for ellipse in ellipses.iter().step_by(nth_ellipse) {
            let outline = outline(ellipse, enlarged * ELLIPSE_95);
            canvas.area(outline.clone(), SERIES[0], 0.15);
            canvas.line(outline, SERIES[0], 1.3, 0.9);
        }
        let waypoints: Vec<Point> = drawable(plot.waypoints).collect();
        for waypoint in waypoints.iter().copied().step_by(stride(waypoints.len(), MOST_WAYPOINTS)) {
            canvas.square(waypoint, ORANGE);
        }
        let started = plot.truth.or(plot.estimates.first().map(|(_, line)| *line)).unwrap_or_default();
        if let Some(start) = drawable(started).next() {
            // In no line's colour.
            canvas.dot(start, TEXT, 6.0, 1.0);
        }
    })
}

fn legend(
    plot: &TrackPlot<'_>,
    ellipses: &[&Ellipse],
    enlarged: f64,
    nth_ellipse: usize,
    (paths, nth_path): (usize, usize),
) -> Vec<Key> {
    let mut legend = Vec::new();
    if plot.truth.is_some_and(|t| !t.is_empty()) {
        legend.push(Key::new("true track", TRUTH, TRUTH_LOOK));
    }
    for (i, (name, _)) in plot.estimates.iter().enumerate() {
        legend.push(Key::new(*name, SERIES[i % SERIES.len()], ESTIMATE_LOOK));
    }
    if plot.truth.is_some_and(|t| !t.is_empty()) || plot.estimates.iter().any(|(_, line)| !line.is_empty()) {
        legend.push(Key::new("start", TEXT, Mark::Dot));
    }
    if plot.ship.is_some_and(|s| !s.is_empty()) {
        legend.push(Key::new("ship", SKY, SHIP_LOOK));
    }
    if paths > 0 {
        legend.push(Key::new(format!("acoustic path{}", every(nth_path)), FAINT, PATH_LOOK));
    }
    if !ellipses.is_empty() {
        let size = if enlarged > 1.0 { format!(", drawn {}× larger", plain(enlarged)) } else { String::new() };
        legend.push(Key::new(format!("95 % ellipse{size}{}", every(nth_ellipse)), SERIES[0], Mark::Ellipse));
    }
    if !plot.waypoints.is_empty() {
        legend.push(Key::new("waypoint", ORANGE, Mark::Square));
    }
    legend
}

/// A frame around all points with one scale on both axes.
fn plane(all: &[Point]) -> Frame {
    let east = extent(all.iter().map(|p| p.0)).unwrap_or((0.0, 1.0));
    let north = extent(all.iter().map(|p| p.1)).unwrap_or((0.0, 1.0));
    // A track shorter than a metre is drawn in a frame of a metre.
    let room = |(low, high): (f64, f64)| ((high - low) * 1.08).max(1.0);
    let middle = |(low, high): (f64, f64)| low / 2.0 + high / 2.0;
    // The left margin depends on the tick labels and these on the range: take the margin of a first guess.
    let guess = 530.0;
    let height = (room(north) / room(east) * guess).clamp(240.0, 720.0).round();
    let axes = |width: f64| {
        let metres_per_pixel = (room(east) / width).max(room(north) / height);
        let half = (metres_per_pixel * width / 2.0, metres_per_pixel * height / 2.0);
        let step = nice_step(2.0 * half.0.max(half.1) / 7.0);
        let x = Axis::with_step("east [m]", middle(east) - half.0, middle(east) + half.0, step);
        (x, Axis::with_step("north [m]", middle(north) - half.1, middle(north) + half.1, step))
    };
    let (x, y) = axes(guess);
    let description = String::from("Map of the tracks");
    let left = left_margin(&y);
    let mut frame = Frame { x, y, left, legend: Vec::new(), height: height as i32, description, empty: all.is_empty() };
    (frame.x, frame.y) = axes(frame.canvas_size().0);
    frame
}

/// Lengths of the half axes at one standard deviation; none of what is no covariance.
fn half_axes(e: &Ellipse) -> Option<(f64, f64)> {
    if ![e.x_m, e.y_m, e.xx_m2, e.xy_m2, e.yy_m2].iter().all(|v| is_drawable(*v)) {
        return None;
    }
    let mean = (e.xx_m2 + e.yy_m2) / 2.0;
    let spread = ((e.xx_m2 - e.yy_m2) / 2.0).hypot(e.xy_m2);
    (mean > 0.0 && mean - spread >= -1e-9 * mean).then(|| ((mean + spread).sqrt(), (mean - spread).max(0.0).sqrt()))
}

/// Of the way along the ellipses' centres.
fn length(ellipses: &[&Ellipse]) -> f64 {
    ellipses.windows(2).map(|pair| (pair[1].x_m - pair[0].x_m).hypot(pair[1].y_m - pair[0].y_m)).sum()
}

fn outline(e: &Ellipse, scale: f64) -> Vec<Point> {
    let Some((major, minor)) = half_axes(e) else { return Vec::new() };
    let angle = 0.5 * (2.0 * e.xy_m2).atan2(e.xx_m2 - e.yy_m2);
    let (sin, cos) = angle.sin_cos();
    (0..=36)
        .map(|i| (f64::from(i) * 10.0).to_radians().sin_cos())
        .map(|(s, c)| (scale * major * c, scale * minor * s))
        .map(|(a, b)| on_page((e.x_m + a * cos - b * sin, e.y_m + a * sin + b * cos)))
        .collect()
}

/// By what a typical ellipse must grow to be seen: 1, or 2 or 5 times a power of ten.
fn enlargement(ellipses: &[&Ellipse], metres_per_pixel: f64) -> f64 {
    let mut sizes: Vec<f64> =
        ellipses.iter().filter_map(|e| half_axes(e)).map(|(major, _)| ELLIPSE_95 * major / metres_per_pixel).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    match sizes.get(sizes.len() / 2) {
        Some(size) if *size > 0.0 && *size < SMALLEST_ELLIPSE => nice_step(SMALLEST_ELLIPSE / size),
        _ => 1.0,
    }
}
