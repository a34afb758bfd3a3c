//! One quantity against another: spectra, and residuals against what explains them.

use super::axis::{Axis, extent, padded};
use super::frame::{Frame, Key, Mark, left_margin};
use super::{Scale, XyPlot, is_drawable};
use crate::palette::{AXIS, FAINT, SERIES};

const HEIGHT: i32 = 250;
const LINE: Mark = Mark::Line { width: 1.9, opacity: 1.0 };

/// Draws lines, with dots on them where there are few points, against any quantity.
pub fn xy(plot: &XyPlot<'_>) -> String {
    let place = |scale: Scale, value: f64| match scale {
        Scale::Linear => value,
        Scale::Log if value > 0.0 => value.log10(),
        Scale::Log => f64::NAN,
    };
    let lines: Vec<(&str, Vec<(f64, f64)>)> = plot
        .series
        .iter()
        .map(|(name, line)| {
            let placed = line.iter().map(|(x, y)| (place(plot.x_scale, *x), place(plot.y_scale, *y)));
            (*name, placed.filter(|(x, y)| is_drawable(*x) && is_drawable(*y)).collect())
        })
        .collect();
    let axis = |title: &str, scale: Scale, values: Vec<f64>, count: usize| {
        let (low, high) = extent(values.into_iter()).unwrap_or((0.0, 1.0));
        match scale {
            Scale::Linear => {
                let (low, high) = padded((low, high), 0.06);
                Axis::linear(title, low, high, count)
            }
            Scale::Log => Axis::log(title, 10_f64.powf(low - 0.05), 10_f64.powf(high + 0.05)),
        }
    };
    let every = || lines.iter().flat_map(|(_, line)| line);
    let x = axis(plot.x_label, plot.x_scale, every().map(|p| p.0).collect(), 7);
    let level = plot.reference.map(|(_, level)| place(plot.y_scale, level)).filter(|level| is_drawable(*level));
    let y = axis(plot.y_label, plot.y_scale, every().map(|p| p.1).chain(level).collect(), 8);
    let mut legend: Vec<Key> =
        lines.iter().enumerate().map(|(i, (name, _))| Key::new(*name, SERIES[i % SERIES.len()], LINE)).collect();
    legend.extend(plot.reference.map(|(name, _)| Key::new(name, FAINT, LINE)));
    let frame = Frame {
        left: left_margin(&y),
        description: format!("{} against {}", plot.y_label, plot.x_label),
        empty: lines.iter().all(|(_, line)| line.is_empty()),
        x,
        y,
        legend,
        height: HEIGHT,
    };
    frame.draw(|canvas| {
        if let Some(level) = level {
            canvas.line(vec![(frame.x.low, level), (frame.x.high, level)], AXIS, 1.2, 1.0);
        }
        for (i, (_, line)) in lines.iter().enumerate().rev() {
            let ink = SERIES[i % SERIES.len()];
            canvas.line(line.clone(), ink, 1.7, 1.0);
            if line.len() <= 40 {
                line.iter().for_each(|point| canvas.dot(*point, ink, 3.0, 1.0));
            }
        }
    })
}
