//! Distributions and comparisons.

use plotters::style::text_anchor::HPos;

use super::axis::{Axis, extent, padded, plain, row_position};
use super::frame::{Frame, Key, Mark, left_margin};
use super::{BarPlot, BeforeAfter, Histogram, Scale, is_drawable};
use crate::palette::{BLUE, FAINT, TEXT, VERMILION};

const HEIGHT: i32 = 250;
const ROW: i32 = 36;
const CURVE: Mark = Mark::Line { width: 2.2, opacity: 1.0 };

/// Draws a distribution.
pub fn histogram(plot: &Histogram<'_>) -> String {
    let mut values: Vec<f64> = plot.values.iter().copied().filter(|v| is_drawable(*v)).collect();
    values.sort_unstable_by(f64::total_cmp);
    let (low, high) = bins_range(&values);
    let count = bin_count(&values, high - low);
    let width = (high - low) / count as f64;
    let mut heights = vec![0usize; count];
    for v in &values {
        // Outliers are counted in the outermost bins.
        heights[(((v - low) / width).max(0.0) as usize).min(count - 1)] += 1;
    }
    let expected = |x: f64| {
        plot.normal.filter(|(mean, sigma)| is_drawable(*mean) && *sigma > 0.0).map(|(mean, sigma)| {
            let z = (x - mean) / sigma;
            values.len() as f64 * width * (-0.5 * z * z).exp() / (sigma * (2.0 * std::f64::consts::PI).sqrt())
        })
    };
    let curve: Vec<_> = (0..=120)
        .map(|i| low + (high - low) * f64::from(i) / 120.0)
        .filter_map(|x| expected(x).filter(|y| is_drawable(*y)).map(|y| (x, y)))
        .collect();
    let tallest = heights.iter().map(|h| *h as f64).chain(curve.iter().map(|p| p.1)).fold(1.0, f64::max);

    let mut legend = vec![Key::new(format!("{} values", values.len()), BLUE, Mark::Band)];
    if let (Some((mean, sigma)), false) = (plot.normal, curve.is_empty()) {
        legend.push(Key::new(format!("normal, mean {}, sigma {}", plain(mean), plain(sigma)), VERMILION, CURVE));
    }
    let y = Axis::linear("count", 0.0, tallest * 1.06, 8);
    let frame = Frame {
        x: Axis::linear(plot.x_label, low, high, 7),
        left: left_margin(&y),
        y,
        legend,
        height: HEIGHT,
        description: format!("Histogram of {}", plot.x_label),
        empty: values.is_empty(),
    };
    frame.draw(|canvas| {
        let gap = frame.pixel().0 * 0.75;
        for (i, height) in heights.iter().enumerate().filter(|(_, h)| **h > 0) {
            let left = low + width * i as f64;
            canvas.bar((left + gap, 0.0), (left + width - gap, *height as f64), BLUE, 0.55);
        }
        canvas.line(curve, VERMILION, 2.2, 1.0);
    })
}

/// Draws pairs of values.
pub fn before_after(plot: &BeforeAfter<'_>) -> String {
    let log = plot.scale == Scale::Log;
    let drawn = |v: f64| is_drawable(v) && (!log || v > 0.0);
    let values = || plot.rows.iter().flat_map(|(_, before, after)| [*before, *after]).filter(|v| drawn(*v));
    let x = if log {
        let (low, high) = extent(values()).unwrap_or((0.1, 10.0));
        Axis::log(plot.x_label, low / 1.6, high * 1.6)
    } else {
        let (low, high) = extent(values()).unwrap_or((0.0, 1.0));
        let (below, above) = padded((low.min(0.0), high.max(0.0)), 0.08);
        Axis::linear(plot.x_label, if low < 0.0 { below } else { 0.0 }, above, 6)
    };
    let place = |v: f64| if log { v.log10() } else { v };
    let y = Axis::names(plot.rows.iter().map(|row| row.0));
    let frame = Frame {
        x,
        left: left_margin(&y),
        y,
        legend: vec![Key::new("before", BLUE, Mark::Ring), Key::new("after", VERMILION, Mark::Dot)],
        height: rows_height(plot.rows.len()),
        description: format!("{} before and after", plot.x_label),
        empty: values().next().is_none(),
    };
    frame.draw(|canvas| {
        for (i, (_, before, after)) in plot.rows.iter().enumerate() {
            let y = row_position(i, plot.rows.len());
            if drawn(*before) && drawn(*after) {
                // The line ends at the edge of the ring.
                let edge = (6.0 * canvas.pixel.0).copysign(before - after);
                canvas.line(vec![(place(*before) - edge, y), (place(*after), y)], FAINT, 2.5, 0.8);
            }
            if drawn(*after) {
                canvas.dot((place(*after), y), VERMILION, 6.0, 1.0);
            }
            if drawn(*before) {
                canvas.ring((place(*before), y), BLUE, 6.0);
            }
        }
    })
}

/// Draws bars with confidence intervals.
pub fn bars(plot: &BarPlot<'_>) -> String {
    let drawn: Vec<_> = plot.bars.iter().enumerate().filter(|(_, bar)| is_drawable(bar.value)).collect();
    let interval = |bar: &super::Bar<'_>| bar.interval.filter(|(low, high)| is_drawable(*low) && is_drawable(*high));
    let reference = plot.reference.filter(|(_, value)| is_drawable(*value));
    let ends = drawn.iter().flat_map(|(_, bar)| {
        let (low, high) = interval(bar).unwrap_or((bar.value, bar.value));
        [bar.value, low, high]
    });
    let (low, high) = extent(ends.chain(reference.map(|r| r.1))).unwrap_or((0.0, 1.0));
    let (low, high) = (low.min(0.0), high.max(0.0));
    // The values are written at the right of the bars.
    let room = (high - low).max(f64::MIN_POSITIVE) * 0.2;
    let left = if low < 0.0 { low - room * 0.25 } else { 0.0 };

    let mut legend = Vec::new();
    if drawn.iter().any(|(_, bar)| interval(bar).is_some()) {
        legend.push(Key::new("confidence interval", TEXT, Mark::Line { width: 2.0, opacity: 1.0 }));
    }
    if let Some((name, _)) = reference {
        legend.push(Key::new(name, VERMILION, CURVE));
    }
    let y = Axis::names(plot.bars.iter().map(|bar| bar.name));
    let frame = Frame {
        x: Axis::linear(plot.x_label, left, high + room, 6),
        left: left_margin(&y),
        y,
        legend,
        height: rows_height(plot.bars.len()),
        description: plot.x_label.into(),
        empty: drawn.is_empty(),
    };
    frame.draw(|canvas| {
        canvas.line(vec![(0.0, frame.y.low), (0.0, frame.y.high)], FAINT, 1.2, 1.0);
        for (row, bar) in &drawn {
            let y = row_position(*row, plot.bars.len());
            canvas.bar((0.0, y - 0.3), (bar.value, y + 0.3), BLUE, 0.55);
            if let Some((low, high)) = interval(bar) {
                canvas.line(vec![(low, y), (high, y)], TEXT, 2.0, 1.0);
                for end in [low, high] {
                    canvas.line(vec![(end, y - 0.14), (end, y + 0.14)], TEXT, 2.0, 1.0);
                }
            }
            let right = interval(bar).map_or(bar.value, |(_, high)| high.max(bar.value)).max(0.0);
            let label = right..right + LABEL_PX * frame.pixel().0;
            let right = reference.map(|(_, value)| value).filter(|value| label.contains(value)).unwrap_or(right);
            canvas.text(&plain(bar.value), (right + 8.0 * frame.pixel().0, y), HPos::Left);
        }
        if let Some((_, value)) = reference {
            canvas.line(vec![(value, frame.y.low), (value, frame.y.high)], VERMILION, 2.2, 1.0);
        }
    })
}

/// Room for a value beside its bar: the line of reference does not cross it.
const LABEL_PX: f64 = 55.0;

fn rows_height(rows: usize) -> i32 {
    (rows.clamp(2, 60) as i32) * ROW + 10
}

/// From the 0.1 % to the 99.9 % quantile, so that one outlier does not make a single bin of the rest.
fn bins_range(sorted: &[f64]) -> (f64, f64) {
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else { return (0.0, 1.0) };
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize];
    let (low, high) = (at(0.001), at(0.999));
    let room = (high - low) * 0.25;
    padded((first.max(low - room), last.min(high + room)), 0.0)
}

/// Freedman and Diaconis' rule, kept between 8 and 60 bins.
fn bin_count(sorted: &[f64], range: f64) -> usize {
    let at = |share: f64| sorted.get((sorted.len() as f64 * share) as usize).copied().unwrap_or(0.0);
    let width = 2.0 * (at(0.75) - at(0.25)) / (sorted.len().max(1) as f64).cbrt();
    if width > 0.0 { (range / width).clamp(8.0, 60.0).round() as usize } else { 8 }
}
