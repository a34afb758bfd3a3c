//! When an event began and ended: intervals from the profile of Σ e².

use crate::candidates::{Instance, Span};
use crate::prepared_log::PreparedLog;
use crate::search;

/// By how much Σ e² may be above its least inside the 95 % interval of an onset or an end. A change point has no smooth
/// likelihood: about the true time Σ e² is a random walk with drift to either side, whose least lies below the true
/// time's by x with probability 1 − (1 − exp(−x/2))² (Siegmund 1988, Biometrika 75, 31); a chi-square's 3.84 would hold
/// 73 %.
const CHANGE_RISE_95: f64 = 7.35;

/// Times tried before and after the one found.
const STEPS: usize = 12;

/// 95 % intervals of onset and end, s, where there are any.
pub type Intervals = [Option<[f64; 2]>; 2];

/// A side of a span.
#[derive(Clone, Copy, PartialEq)]
enum Edge {
    Onset,
    End,
}

/// The intervals of onset and end of an event, where it has them.
#[must_use]
pub fn intervals(log_data: &PreparedLog, others: &[Instance], instance: &Instance) -> Intervals {
    [Edge::Onset, Edge::End].map(|edge| interval(log_data, others, instance, edge))
}

/// Times about an edge of an event that the data do not exclude, the other edge fixed: the interval, s.
fn interval(log_data: &PreparedLog, others: &[Instance], instance: &Instance, edge: Edge) -> Option<[f64; 2]> {
    let span = instance.candidate.span?;
    let centre = if edge == Edge::Onset { span.onset_s } else { span.end_s? };
    let moved = |time_s: f64| match edge {
        Edge::Onset => Span { onset_s: time_s, ..span },
        Edge::End => Span { end_s: Some(time_s), ..span },
    };
    let mut step_s = 0.25;
    for _ in 0..5 {
        let times: Vec<f64> = (0..=2 * STEPS).map(|k| centre + step_s * (k as f64 - STEPS as f64)).collect();
        let spans: Vec<Span> = times.iter().map(|time_s| moved(*time_s)).collect();
        let mut gains = search::span_gains(log_data, others, &instance.candidate, &spans)?;
        for (gain, span) in gains.iter_mut().zip(&spans) {
            if span.end_s.is_some_and(|end_s| end_s <= span.onset_s) {
                *gain = f64::NEG_INFINITY;
            }
        }
        let top = gains.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let inside: Vec<usize> = (0..gains.len()).filter(|i| gains[*i] > top - CHANGE_RISE_95).collect();
        // Beside the others as they were fitted in the end the best time may be another: the one stated is in its interval.
        let (first, last) = ((*inside.first()?).min(STEPS), (*inside.last()?).max(STEPS));
        if first > 0 && last + 1 < gains.len() {
            return Some([times[first] - step_s, times[last] + step_s]);
        }
        step_s *= 4.0;
    }
    None
}
