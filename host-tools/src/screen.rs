//! What the live screens of `monitor` and `topside` share: panels, and a map with ellipses. North is up.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Borders};

/// √ of the 95 % point of chi-square with two degrees of freedom.
const ELLIPSE: f64 = 2.4477;
/// Points of an ellipse.
const POINTS: usize = 72;
/// The smallest ellipse that can be seen, dots.
const VISIBLE: f64 = 2.5;
/// Dots of a character cell: down, across.
const DOTS: [f64; 2] = [4.0, 2.0];

/// Hours, minutes, seconds of UTC.
pub fn time_of_day(utc_us: u64) -> String {
    let s = utc_us / 1_000_000 % 86_400;
    format!("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

/// What is beside the point.
pub const fn faint() -> Style {
    Style::new().fg(Color::DarkGray)
}

/// A panel's frame: a line with its title. Gives what is inside.
pub fn panel(frame: &mut Frame<'_>, area: Rect, title: &str, remark: &str) -> Rect {
    let mut block = Block::new()
        .borders(Borders::TOP)
        .border_style(faint())
        .title(Line::from(Span::styled(format!("{title} "), Style::new().add_modifier(Modifier::BOLD))));
    if !remark.is_empty() {
        block = block.title(Line::from(Span::styled(format!(" {remark}"), faint())).right_aligned());
    }
    let inner = block.inner(area);
    frame.render_widget(block, area);
    inner
}

/// What part of the world a map shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    centre: [f64; 2],
    /// Metres a dot, the same in both directions.
    pub scale_m: f64,
    /// Half its size north and east, m.
    half: [f64; 2],
}

impl Window {
    /// Of this width about a place, in the rows and columns of an area below its title.
    pub fn about(centre: [f64; 2], width_m: f64, area: Rect) -> Self {
        Self::new(centre, width_m / dots(area)[1], area)
    }

    /// All these places (north, east, m), no smaller than `least_m`; `None` where there are none.
    pub fn around(places: impl Iterator<Item = [f64; 2]>, least_m: f64, area: Rect) -> Option<Self> {
        let (least, largest) = places.fold(([f64::MAX; 2], [f64::MIN; 2]), |(least, largest), place| {
            ([0, 1].map(|i| least[i].min(place[i])), [0, 1].map(|i| largest[i].max(place[i])))
        });
        if least[0] > largest[0] {
            return None;
        }
        let scale = |i: usize| (1.1 * (largest[i] - least[i])).max(least_m) / dots(area)[i];
        Some(Self::new([0, 1].map(|i| 0.5 * (least[i] + largest[i])), scale(0).max(scale(1)), area))
    }

    fn new(centre: [f64; 2], scale_m: f64, area: Rect) -> Self {
        Self { centre, scale_m, half: dots(area).map(|count| 0.5 * count * scale_m) }
    }

    /// Its width, m.
    pub fn width_m(&self) -> f64 {
        2.0 * self.half[1]
    }

    /// Canvas bounds along east and north.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        [1, 0].map(|i| [self.centre[i] - self.half[i], self.centre[i] + self.half[i]])
    }
}

/// Dots of a map in this area, whose first row is its title: down, across.
fn dots(area: Rect) -> [f64; 2] {
    [f64::from(area.height.saturating_sub(1)) * DOTS[0], f64::from(area.width) * DOTS[1]]
}

/// The half axes of a position's covariance.
pub struct Ellipse {
    centre: [f64; 2],
    /// North and east of each.
    axes: [[f64; 2]; 2],
}

impl Ellipse {
    /// What holds 95 % about a place, of its variances north and east and their covariance, m².
    pub fn of(centre: [f64; 2], [nn, ee, ne]: [f64; 3]) -> Self {
        let mean = 0.5 * (nn + ee);
        let radius = (0.5 * (nn - ee)).hypot(ne);
        let angle = 0.5 * ne.atan2(0.5 * (nn - ee));
        let axis = |variance: f64, angle: f64| {
            let length = ELLIPSE * variance.max(0.0).sqrt();
            [length * angle.cos(), length * angle.sin()]
        };
        let across = angle + std::f64::consts::FRAC_PI_2;
        Self { centre, axes: [axis(mean + radius, angle), axis(mean - radius, across)] }
    }

    /// By how much it has to be drawn larger to be seen: 1, 10, 100, …
    pub fn factor(&self, scale_m: f64) -> f64 {
        let [[n, e], _] = self.axes;
        let dots = n.hypot(e) / scale_m;
        if dots > 0.0 && dots.is_finite() { 10_f64.powf((VISIBLE / dots).log10().ceil().clamp(0.0, 6.0)) } else { 1.0 }
    }

    /// East and north of its outline.
    pub fn points(&self, factor: f64) -> Vec<(f64, f64)> {
        let [a, b] = self.axes;
        let of = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / POINTS as f64;
            let (sin, cos) = angle.sin_cos();
            let at = |k: usize| self.centre[k] + factor * (a[k] * cos + b[k] * sin);
            (at(1), at(0))
        };
        (0..POINTS).map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_ellipse_has_the_axes_of_its_covariance() {
        // eigenvalues 9 and 1 m², the larger at 30° from north
        let (sin, cos) = 30_f64.to_radians().sin_cos();
        let covariance = [9.0 * cos * cos + sin * sin, 9.0 * sin * sin + cos * cos, 8.0 * sin * cos];
        let ellipse = Ellipse::of([100.0, -20.0], covariance);
        let [large, small] = ellipse.axes;
        assert!((large[0] - 3.0 * ELLIPSE * cos).abs() < 1e-9 && (large[1] - 3.0 * ELLIPSE * sin).abs() < 1e-9);
        assert!((small[0].hypot(small[1]) - ELLIPSE).abs() < 1e-9);
        // 7.3 m at 10 m a dot is no dot at all; ten times that is seven
        assert_eq!((ellipse.factor(0.1), ellipse.factor(10.0), ellipse.factor(100.0)), (1.0, 10.0, 100.0));
        // every point is at the same Mahalanobis distance
        let [nn, ee, ne] = covariance;
        for (east, north) in ellipse.points(1.0) {
            let (n, e) = (north - 100.0, east + 20.0);
            let square = (ee * n * n - 2.0 * ne * n * e + nn * e * e) / (nn * ee - ne * ne);
            assert!((square.sqrt() - ELLIPSE).abs() < 1e-9, "{square}");
        }
    }
}
