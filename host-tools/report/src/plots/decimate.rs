//! Fewer points for the same picture.

use super::{Point, is_drawable};

/// Splits a line where a point cannot be drawn.
pub(super) fn runs(points: &[Point]) -> impl Iterator<Item = &[Point]> {
    points.split(|(x, y)| !(is_drawable(*x) && is_drawable(*y))).filter(|run| !run.is_empty())
}

/// Keeps of each column of width `column` the first, lowest, highest and last point, in their order: spikes survive.
pub(super) fn min_max(points: &[Point], column: f64) -> Vec<Point> {
    let mut out = Vec::new();
    let index = |p: &Point| (p.0 / column).floor();
    for chunk in points.chunk_by(|a, b| index(a) == index(b)) {
        let lowest = (0..chunk.len()).min_by(|a, b| chunk[*a].1.total_cmp(&chunk[*b].1)).unwrap_or(0);
        let highest = (0..chunk.len()).max_by(|a, b| chunk[*a].1.total_cmp(&chunk[*b].1)).unwrap_or(0);
        let mut keep = [0, lowest, highest, chunk.len() - 1];
        keep.sort_unstable();
        out.extend(keep.iter().enumerate().filter(|(i, k)| *i == 0 || keep[i - 1] != **k).map(|(_, k)| chunk[*k]));
    }
    out
}

/// Ramer, Douglas and Peucker's simplification: no dropped point is further than about `tolerance` from the line that
/// remains. The tolerance grows until at most `limit` points remain.
pub(super) fn simplify(points: &[Point], tolerance: f64, limit: usize) -> Vec<Point> {
    let mut tolerance = tolerance;
    // Dropping near neighbours first is cheap, and bounds the work on a noisy track that never leaves its spot.
    let mut out = spaced(points, tolerance / 2.0);
    while out.len() > 8 * limit {
        tolerance *= 1.5;
        out = spaced(&out, tolerance / 2.0);
    }
    out = douglas_peucker(&out, tolerance);
    while out.len() > limit {
        tolerance *= 2.0;
        out = douglas_peucker(&out, tolerance);
    }
    out
}

fn spaced(points: &[Point], distance: f64) -> Vec<Point> {
    let mut out: Vec<Point> = Vec::new();
    for (i, p) in points.iter().enumerate() {
        let near = out.last().is_some_and(|q| (p.0 - q.0).hypot(p.1 - q.1) < distance);
        if !near || i + 1 == points.len() {
            out.push(*p);
        }
    }
    out
}

fn douglas_peucker(points: &[Point], tolerance: f64) -> Vec<Point> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut keep = vec![false; points.len()];
    keep[0] = true;
    keep[points.len() - 1] = true;
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        let furthest = (first + 1..last)
            .map(|i| (i, distance_to_segment(points[i], points[first], points[last])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, distance)) = furthest
            && distance > tolerance
        {
            keep[i] = true;
            open.push((first, i));
            open.push((i, last));
        }
    }
    points.iter().zip(keep).filter(|(_, k)| *k).map(|(p, _)| *p).collect()
}

fn distance_to_segment(p: Point, a: Point, b: Point) -> f64 {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length2 = dx * dx + dy * dy;
    let along = if length2 > 0.0 { (((p.0 - a.0) * dx + (p.1 - a.1) * dy) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (p.0 - a.0 - along * dx).hypot(p.1 - a.1 - along * dy)
}

/// Every how manieth of `count` items to take so that at most `limit` remain.
pub(super) fn stride(count: usize, limit: usize) -> usize {
    count.div_ceil(limit).max(1)
}

/// "", ", every 2nd", ", every 5th": how a thinned series is named.
pub(super) fn every(stride: usize) -> String {
    match (stride, stride % 10, stride % 100) {
        (1, ..) => String::new(),
        (_, 1, teen) if teen != 11 => format!(", every {stride}st"),
        (_, 2, teen) if teen != 12 => format!(", every {stride}nd"),
        (_, 3, teen) if teen != 13 => format!(", every {stride}rd"),
        _ => format!(", every {stride}th"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_survive_and_straight_lines_shrink() {
        let corner: Vec<Point> = (0..=1000).map(f64::from).map(|s| (s.min(500.0), (s - 500.0).max(0.0))).collect();
        assert_eq!(simplify(&corner, 0.1, 100), [(0.0, 0.0), (500.0, 0.0), (500.0, 500.0)]);
    }

    #[test]
    fn no_point_is_lost_by_more_than_the_tolerance() {
        let circle: Vec<Point> =
            (0..5000).map(|i| f64::from(i) * 1e-3).map(|a| (100.0 * a.cos(), 100.0 * a.sin())).collect();
        let simple = simplify(&circle, 0.5, 1000);
        assert!(simple.len() < 60);
        for p in circle {
            let distance = simple.windows(2).map(|s| distance_to_segment(p, s[0], s[1])).fold(f64::INFINITY, f64::min);
            // Half a tolerance more for the neighbours that are dropped first.
            assert!(distance <= 0.75, "{distance}");
        }
    }

    #[test]
    fn thinned_series_are_named_in_english() {
        assert_eq!(
            [1, 2, 3, 4, 11, 12, 21, 112].map(every).map(|s| s.trim_start_matches(", every ").to_string()),
            ["", "2nd", "3rd", "4th", "11th", "12th", "21st", "112th"]
        );
    }
}
