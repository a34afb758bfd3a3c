//! Plots as SVG text. Plain slices in; NaN and infinite points are left out (a line breaks there), and no data draws an
//! empty frame.
//!
//! Time is in hours everywhere; the axis chooses seconds, minutes or hours by the span.

mod axis;
mod decimate;
mod frame;
mod sheet;
mod stanford;
mod statistics;
mod svg;
mod time;
mod track;
mod xy;

pub use sheet::sheet;
pub use stanford::stanford;
pub use statistics::{bars, before_after, histogram};
pub use time::{error_vs_time, innovations, time_series};
pub use track::track;
pub use xy::xy;

/// An abscissa and an ordinate; on a map north and east, in metres.
pub type Point = (f64, f64);

/// A named line.
pub type Series<'a> = (&'a str, &'a [Point]);

/// A named band of `(t_h, low, high)`.
pub type Band<'a> = (&'a str, &'a [(f64, f64, f64)]);

/// Spacing of the value axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal steps.
    #[default]
    Linear,
    /// Equal factors; values that are not positive are left out.
    Log,
}

/// Position covariance in the north-east plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// North of the centre, m.
    pub x_m: f64,
    /// East of the centre, m.
    pub y_m: f64,
    /// Variance of north, m².
    pub xx_m2: f64,
    /// Covariance of north and east, m².
    pub xy_m2: f64,
    /// Variance of east, m².
    pub yy_m2: f64,
}

/// A map: north up, east to the right, one scale for both. All points are `(north_m, east_m)`.
#[derive(Clone, Copy, Debug, Default)]
pub struct TrackPlot<'a> {
    /// True track of the vehicle.
    pub truth: Option<&'a [Point]>,
    /// Estimated tracks.
    pub estimates: &'a [Series<'a>],
    /// Covariances along the first estimate. Drawn as 95 % ellipses, thinned out, and enlarged where they would be too
    /// small to see; the legend states the enlargement.
    pub ellipses: &'a [Ellipse],
    /// Acoustic paths, vehicle then ship.
    pub acoustic_paths: &'a [(Point, Point)],
    /// Track of the ship.
    pub ship: Option<&'a [Point]>,
    /// Waypoints of the mission, in order.
    pub waypoints: &'a [Point],
}

/// Errors against time, with the bound that a filter states itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct ErrorPlot<'a> {
    /// What is plotted and its unit: `horizontal error [m]`.
    pub y_label: &'a str,
    /// Lines of `(t_h, error)`.
    pub series: &'a [Series<'a>],
    /// Name and `(t_h, bound)` of the band from zero up to the bound.
    pub bound: Option<Series<'a>>,
    /// Spacing of the error axis.
    pub scale: Scale,
}

/// Several lines against time, and a band.
#[derive(Clone, Copy, Debug, Default)]
pub struct TimePlot<'a> {
    /// What is plotted and its unit: `depth [m]`.
    pub y_label: &'a str,
    /// Lines of `(t_h, value)`.
    pub series: &'a [Series<'a>],
    /// Name and `(t_h, low, high)` of a band behind the lines.
    pub band: Option<Band<'a>>,
}

/// Lines of one quantity against another.
#[derive(Clone, Copy, Debug, Default)]
pub struct XyPlot<'a> {
    /// What is along the page and its unit.
    pub x_label: &'a str,
    /// What is up the page and its unit.
    pub y_label: &'a str,
    /// Lines of `(x, y)`.
    pub series: &'a [Series<'a>],
    /// Name and height of a line to compare with.
    pub reference: Option<(&'a str, f64)>,
    /// Spacing of the x axis.
    pub x_scale: Scale,
    /// Spacing of the y axis.
    pub y_scale: Scale,
}

/// Distribution of a sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct Histogram<'a> {
    /// What is counted and its unit.
    pub x_label: &'a str,
    /// The sample.
    pub values: &'a [f64],
    /// Mean and standard deviation of a normal density to draw over it.
    pub normal: Option<(f64, f64)>,
}

/// One innovation of a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Time, h.
    pub t_h: f64,
    /// Measured minus predicted.
    pub value: f64,
    /// Standard deviation that the filter expects of it.
    pub sigma: f64,
    /// Whether the gate let it through.
    pub fused: bool,
}

/// Innovations of one sensor against time, with the band of ±2 sigma.
#[derive(Clone, Copy, Debug, Default)]
pub struct InnovationPlot<'a> {
    /// What is plotted and its unit: `range innovation [m]`.
    pub y_label: &'a str,
    /// The innovations, in order of time.
    pub innovations: &'a [Innovation],
}

/// The same quantities before and after a change, one line each.
#[derive(Clone, Copy, Debug, Default)]
pub struct BeforeAfter<'a> {
    /// What is compared and its unit.
    pub x_label: &'a str,
    /// Name, before, after.
    pub rows: &'a [(&'a str, f64, f64)],
    /// Spacing of the value axis.
    pub scale: Scale,
}

/// One bar with its confidence interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar<'a> {
    /// Name at its left.
    pub name: &'a str,
    /// Length.
    pub value: f64,
    /// Ends of the confidence interval.
    pub interval: Option<(f64, f64)>,
}

/// Horizontal bars with confidence intervals.
#[derive(Clone, Copy, Debug, Default)]
pub struct BarPlot<'a> {
    /// What is measured, its unit and the confidence level.
    pub x_label: &'a str,
    /// The bars, from the top.
    pub bars: &'a [Bar<'a>],
    /// Name and value of a line to compare the bars with.
    pub reference: Option<(&'a str, f64)>,
}

/// Values that neither are NaN nor overflow when their range is taken.
fn is_drawable(value: f64) -> bool {
    value.abs() < 1e100
}
