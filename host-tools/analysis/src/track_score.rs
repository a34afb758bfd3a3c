//! How well a mission was steered: the true track against the lines.

use backseat_logs::stats::ErrorSummary;
use hil_sim::scenario::SurveyLine;

/// A line is judged from this far behind its start to this far before its end, m: what lies
/// outside belongs to the turns.
pub const TURN_MARGIN_M: f64 = 50.0;

/// How well the true track kept to the lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackScore {
    /// Of the horizontal distance from the line.
    pub cross_track: ErrorSummary,
    /// Of the difference to the line's depth.
    pub depth: ErrorSummary,
    /// Samples that were judged.
    pub samples: usize,
}

impl TrackScore {
    /// Judges a true track (north, east, down, m) against the lines.
    ///
    /// A sample belongs to the nearest of those lines between whose ends (less
    /// [`TURN_MARGIN_M`]) it lies; beyond the ends of all lines it belongs to a turn and is not
    /// judged. However far off the track strays beside a line, it counts. `None` if nothing does.
    #[must_use]
    pub fn of(track_m: impl IntoIterator<Item = [f64; 3]>, lines: &[SurveyLine]) -> Option<Self> {
        let (cross_m, depth_m): (Vec<f64>, Vec<f64>) = track_m
            .into_iter()
            .filter_map(|place| {
                lines
                    .iter()
                    .filter_map(|line| cross_track_m(line, place).map(|cross| (cross, place[2] - line.depth_m)))
                    .min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
            })
            .unzip();
        Some(Self { cross_track: magnitudes(&cross_m)?, depth: magnitudes(&depth_m)?, samples: cross_m.len() })
    }
}

fn magnitudes(errors_m: &[f64]) -> Option<ErrorSummary> {
    let magnitudes: Vec<f64> = errors_m.iter().map(|error| error.abs()).collect();
    ErrorSummary::of(&magnitudes)
}

/// Distance to starboard of a line, m; `None` outside the part of it that is judged.
fn cross_track_m(line: &SurveyLine, place: [f64; 3]) -> Option<f64> {
    let [dx, dy] = [line.to_m[0] - line.from_m[0], line.to_m[1] - line.from_m[1]];
    let length = dx.hypot(dy);
    let [px, py] = [place[0] - line.from_m[0], place[1] - line.from_m[1]];
    let along = (px * dx + py * dy) / length;
    (TURN_MARGIN_M..=length - TURN_MARGIN_M).contains(&along).then(|| (py * dx - px * dy) / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_statistics_of_an_even_ramp() {
        // |−100|, …, |100|: order statistics are known; RMS² = n(n+1)/3 / (2n+1) · … = 100·101/3.
        let ramp: Vec<f64> = (-100..=100).map(f64::from).collect();
        let s = magnitudes(&ramp).unwrap();
        assert_eq!((s.median_m, s.p95_m, s.max_m), (50.0, 95.0, 100.0));
        // Sum of squares is exact; one division and one root.
        assert!((s.rms_m - (100.0_f64 * 101.0 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(magnitudes(&[]), None);
    }

    #[test]
    fn val_track_beside_a_diagonal_line() {
        let line = SurveyLine { from_m: [0.0, 0.0], to_m: [300.0, 400.0], depth_m: 3.0 };
        // 2 m to starboard of the line (starboard of (0.6, 0.8) is (−0.8, 0.6)), 0.25 m too deep.
        let track = (0..=500).map(|s| {
            let s = f64::from(s);
            [0.6 * s - 1.6, 0.8 * s + 1.2, 3.25]
        });
        let score = TrackScore::of(track, &[line]).unwrap();
        // Rounding of coordinates of 400 m.
        assert!((score.cross_track.median_m - 2.0).abs() < 1e-12 && (score.cross_track.max_m - 2.0).abs() < 1e-12);
        assert_eq!(score.depth.rms_m, 0.25);
        assert_eq!(score.samples, 401);
    }

    #[test]
    fn turns_are_not_judged_and_strays_are() {
        let line = |y| SurveyLine { from_m: [0.0, y], to_m: [1000.0, y], depth_m: 3.0 };
        let lines = [line(0.0), line(100.0)];
        assert_eq!(TrackScore::of([[1020.0, 50.0, 3.0], [40.0, 1.0, 3.0]], &lines), None);
        let stray = TrackScore::of([[500.0, 60.0, 3.0]], &lines).unwrap();
        assert_eq!(stray.cross_track.max_m, 40.0);
    }
}
