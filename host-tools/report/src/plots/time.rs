//! Plots against time.

use super::axis::{Axis, extent, padded};
use super::decimate::{every, min_max, runs, stride};
use super::frame::{BAND, Canvas, Frame, Key, Mark, left_margin};
use super::{ErrorPlot, Innovation, InnovationPlot, Point, Scale, TimePlot, is_drawable};
use crate::palette::{AXIS, BLUE, FAINT, Ink, SERIES, VERMILION};

const HEIGHT: i32 = 270;
const LINE: Mark = Mark::Line { width: 2.0, opacity: 1.0 };
const MOST_DOTS: usize = 3000;
/// Width in pixels of what [`min_max`] reduces to its extremes.
const COLUMN: f64 = 1.5;

/// Time, low, high.
type Slice = (f64, f64, f64);

/// Draws errors against time.
pub fn error_vs_time(plot: &ErrorPlot<'_>) -> String {
    let bound = plot.bound.map_or(&[][..], |(_, line)| line);
    let values = || plot.series.iter().flat_map(|(_, line)| line.iter()).chain(bound).map(|p| p.1);
    let y = match plot.scale {
        Scale::Linear => {
            let (low, high) = extent(values()).unwrap_or((0.0, 1.0));
            let (below, above) = padded((low.min(0.0), high.max(0.0)), 0.05);
            Axis::linear(plot.y_label, if low < 0.0 { below } else { 0.0 }, above, 8)
        }
        Scale::Log => log_axis(plot.y_label, values()),
    };
    let place = |value: f64| match plot.scale {
        Scale::Linear => value,
        Scale::Log if value > 0.0 => value.log10().max(y.low),
        Scale::Log => f64::NAN,
    };
    let foot = if plot.scale == Scale::Log { y.low } else { 0.0 };
    let band: Vec<Slice> = bound.iter().map(|(t, b)| (*t, foot, place(*b))).collect();
    let lines: Vec<(&str, Vec<Point>)> =
        plot.series.iter().map(|(name, line)| (*name, line.iter().map(|(t, v)| (*t, place(*v))).collect())).collect();
    lines_over_band(&y, &lines, plot.bound.map(|(name, _)| name), &band)
}

/// Draws lines against time.
pub fn time_series(plot: &TimePlot<'_>) -> String {
    let band = plot.band.map_or(&[][..], |(_, band)| band);
    let lines: Vec<(&str, Vec<Point>)> = plot.series.iter().map(|(name, line)| (*name, line.to_vec())).collect();
    let values =
        lines.iter().flat_map(|(_, line)| line.iter().map(|p| p.1)).chain(band.iter().flat_map(|b| [b.1, b.2]));
    let (low, high) = padded(extent(values).unwrap_or((0.0, 1.0)), 0.06);
    lines_over_band(&Axis::linear(plot.y_label, low, high, 8), &lines, plot.band.map(|(name, _)| name), band)
}

/// Draws innovations against time.
pub fn innovations(plot: &InnovationPlot<'_>) -> String {
    let all: Vec<_> =
        plot.innovations.iter().filter(|i| [i.t_h, i.value, i.sigma].iter().all(|v| is_drawable(*v))).collect();
    // A few outliers must not flatten the rest: they are drawn on the edge.
    let typical = |values: Vec<f64>| quantile(values, 0.995);
    let limit = typical(all.iter().filter(|i| i.fused).map(|i| i.value.abs()).collect()) * 1.3;
    let limit = limit.max(1.3 * quantile(all.iter().map(|i| 2.0 * i.sigma).collect(), 0.95));
    let limit = if limit > 0.0 { limit } else { 1.0 };
    let (x, per_hour) = time_axis(all.iter().map(|i| i.t_h));
    let y = Axis::linear(plot.y_label, -limit, limit, 8);
    let place = |value: f64| value.clamp(-limit, limit);

    let (fused, rejected): (Vec<&Innovation>, Vec<&Innovation>) = all.iter().partition(|i| i.fused);
    let nth = stride(fused.len(), MOST_DOTS);
    let nth_rejected = stride(rejected.len(), MOST_DOTS / 4);
    let mut legend = vec![
        Key::new("±2σ of the filter", BLUE, Mark::Band),
        Key::new(format!("fused: {}{}", fused.len(), every(nth)), BLUE, Mark::Dot),
    ];
    if !rejected.is_empty() {
        legend.push(Key::new(format!("rejected: {}{}", rejected.len(), every(nth_rejected)), VERMILION, Mark::Cross));
    }
    if all.iter().any(|i| i.value.abs() > limit) {
        legend.push(Key::new("beyond the axis: on its edge", FAINT, Mark::Line { width: 0.0, opacity: 0.0 }));
    }
    let frame = Frame {
        x,
        left: left_margin(&y),
        y,
        legend,
        height: HEIGHT,
        description: format!("{} against time", plot.y_label),
        empty: all.is_empty(),
    };
    frame.draw(|canvas| {
        let band: Vec<Slice> =
            all.iter().map(|i| (i.t_h * per_hour, place(-2.0 * i.sigma), place(2.0 * i.sigma))).collect();
        draw_band(canvas, &band, BLUE);
        canvas.line(vec![(frame.x.low, 0.0), (frame.x.high, 0.0)], AXIS, 1.0, 1.0);
        let radius = if fused.len() > 600 { 1.5 } else { 2.5 };
        for i in fused.iter().step_by(nth) {
            canvas.dot((i.t_h * per_hour, place(i.value)), BLUE, radius, 0.85);
        }
        for i in rejected.iter().step_by(nth_rejected) {
            canvas.cross((i.t_h * per_hour, place(i.value)), VERMILION);
        }
    })
}

fn lines_over_band(y: &Axis, lines: &[(&str, Vec<Point>)], band_name: Option<&str>, band: &[Slice]) -> String {
    let times = lines.iter().flat_map(|(_, line)| line.iter().map(|p| p.0)).chain(band.iter().map(|b| b.0));
    let (x, per_hour) = time_axis(times);
    let drawn = |line: &Vec<Point>| runs(line).next().is_some();
    let empty = !lines.iter().any(|(_, line)| drawn(line))
        && !band.iter().any(|b| [b.0, b.1, b.2].iter().all(|v| is_drawable(*v)));
    let mut legend: Vec<Key> =
        lines.iter().enumerate().map(|(i, (name, _))| Key::new(*name, SERIES[i % SERIES.len()], LINE)).collect();
    legend.extend(band_name.map(|name| Key::new(name, SERIES[0], Mark::Band)));
    let description = format!("{} against time", y.title);
    let frame = Frame { x, y: y.clone(), left: left_margin(y), legend, height: HEIGHT, description, empty };
    frame.draw(|canvas| {
        let scaled: Vec<Slice> = band.iter().map(|(t, low, high)| (t * per_hour, *low, *high)).collect();
        draw_band(canvas, &scaled, SERIES[0]);
        // The first line belongs on top, over the band of its own colour.
        for (i, (_, line)) in lines.iter().enumerate().rev() {
            let gap = longest_step(line.iter().map(|p| p.0));
            for run in runs(line).flat_map(|run| run.chunk_by(|a, b| b.0 - a.0 <= gap)) {
                let run: Vec<Point> = run.iter().map(|(t, v)| (t * per_hour, *v)).collect();
                canvas.line(min_max(&run, canvas.pixel.0 * COLUMN), SERIES[i % SERIES.len()], 1.7, 1.0);
            }
        }
    })
}

/// Fills between low and high, and draws the upper edge.
fn draw_band(canvas: &Canvas<'_, '_>, band: &[Slice], ink: Ink) {
    let runs = band.split(|(t, low, high)| ![t, low, high].iter().all(|v| is_drawable(**v)));
    let gap = longest_step(band.iter().map(|slice| slice.0));
    for run in runs.flat_map(|run| run.chunk_by(|a, b| b.0 - a.0 <= gap)) {
        let column = |slice: &Slice| (slice.0 / (canvas.pixel.0 * COLUMN)).floor();
        // Mean of a column: of a bound that rises and falls between two fixes, an envelope would flatter the filter.
        let means: Vec<Slice> = run
            .chunk_by(|a, b| column(a) == column(b))
            .map(|chunk| {
                let sum = chunk.iter().fold((0.0, 0.0, 0.0), |sum, s| (sum.0 + s.0, sum.1 + s.1, sum.2 + s.2));
                let count = chunk.len() as f64;
                (sum.0 / count, sum.1 / count, sum.2 / count)
            })
            .collect();
        let low = means.iter().map(|s| (s.0, s.1));
        let high = means.iter().map(|s| (s.0, s.2));
        canvas.area(low.chain(high.clone().rev()).collect(), ink, BAND);
        canvas.line(high.collect(), ink, 1.0, 0.5);
    }
}

/// The longest step between two points that is drawn: across hours without data there is neither line nor band.
fn longest_step(times: impl Iterator<Item = f64>) -> f64 {
    /// Steps of usual length, and share of the whole.
    const MOST: (f64, f64) = (20.0, 0.02);
    let times: Vec<f64> = times.filter(|t| is_drawable(*t)).collect();
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return f64::INFINITY };
    let usual = quantile(times.windows(2).map(|pair| pair[1] - pair[0]).collect(), 0.5);
    (MOST.0 * usual).max(MOST.1 * (last - first))
}

fn time_axis(times: impl Iterator<Item = f64>) -> (Axis, f64) {
    let (low, high) = extent(times).unwrap_or((0.0, 1.0));
    Axis::time(low, high)
}

/// From the first percentile up: a chance zero crossing of an error must not add decades.
fn log_axis(title: &str, values: impl Iterator<Item = f64>) -> Axis {
    let positive: Vec<f64> = values.filter(|v| is_drawable(*v) && *v > 0.0).collect();
    let (_, high) = extent(positive.iter().copied()).unwrap_or((0.1, 10.0));
    let low = if positive.is_empty() { 0.1 } else { quantile(positive, 0.01) };
    Axis::log(title, (low * 0.8).max(high * 1e-9), high * 1.25)
}

fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values.get((last as f64 * share).ceil() as usize).copied().unwrap_or(0.0)
}
