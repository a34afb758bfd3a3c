//! The map: mission, track, vehicle and the ellipse of its uncertainty. North is up.

use super::{Focus, faint, panel};
use crate::monitor::model::Model;
use backseat_wire::hostlink::Telemetry;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::Span;
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Context, Line, Points};

/// √ of the 95 % point of chi-square with two degrees of freedom.
const ELLIPSE: f64 = 2.4477;
/// Points of an ellipse.
const POINTS: usize = 72;
/// The smallest ellipse that can be seen, dots.
const VISIBLE: f64 = 2.5;
/// A map is no smaller than this, m.
const LEAST_M: f64 = 20.0;
/// Dots of a character cell.
const DOTS: [f64; 2] = [2.0, 4.0];

/// North and east, m, of the window.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Window {
    centre: [f64; 2],
    /// Metres a dot, the same in both directions.
    scale_m: f64,
    /// Half its size, m.
    half: [f64; 2],
}

impl Window {
    /// `None` where there is nothing to be shown.
    fn of(model: &Model, focus: Focus, area: Rect) -> Option<Self> {
        let dots = [f64::from(area.height) * DOTS[1], f64::from(area.width) * DOTS[0]];
        let place = model.position().map(|record| [record.state[0], record.state[1]]);
        let (centre, scale_m) = match (focus, place) {
            (Focus::Vehicle { width_m }, Some(place)) => (place, width_m / dots[1]),
            _ => {
                let waypoints = model.mission.iter().map(|waypoint| [waypoint.x_m, waypoint.y_m]);
                let ship = model.ship.map(|ship| ship.position_m);
                let all = waypoints.chain(model.track().iter().copied()).chain(place).chain(ship);
                let (least, largest) = all.fold(([f64::MAX; 2], [f64::MIN; 2]), |(least, largest), point| {
                    ([0, 1].map(|i| least[i].min(point[i])), [0, 1].map(|i| largest[i].max(point[i])))
                });
                if least[0] > largest[0] {
                    return None;
                }
                let scale = |i: usize| (1.1 * (largest[i] - least[i])).max(LEAST_M) / dots[i];
                ([0, 1].map(|i| 0.5 * (least[i] + largest[i])), scale(0).max(scale(1)))
            }
        };
        Some(Self { centre, scale_m, half: dots.map(|count| 0.5 * count * scale_m) })
    }

    fn width_m(&self) -> f64 {
        2.0 * self.half[1]
    }

    /// Canvas bounds along east and north.
    fn bounds(&self) -> [[f64; 2]; 2] {
        [1, 0].map(|i| [self.centre[i] - self.half[i], self.centre[i] + self.half[i]])
    }
}

pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, focus: Focus) {
    let room = Rect { height: area.height.saturating_sub(1), ..area };
    let Some(window) = Window::of(model, focus, room) else {
        let inner = panel(frame, area, "map", "north up");
        frame.render_widget(Paragraph::new("no position, no mission").style(faint()), inner);
        return;
    };
    let ellipse = model.position().map(Ellipse::of);
    let factor = ellipse.as_ref().map_or(1.0, |ellipse| ellipse.factor(window.scale_m));
    let times = if factor > 1.0 { format!(" ×{factor:.0}") } else { String::new() };
    let width = metres(window.width_m());
    let remark = match area.width {
        ..50 => format!("{width} wide, 95 % ellipse{times}"),
        _ => format!("north up, {width} wide, 95 % ellipse{times}"),
    };
    let inner = panel(frame, area, "map", &remark);
    let [x_bounds, y_bounds] = window.bounds();
    let canvas = Canvas::default().marker(Marker::Braille).x_bounds(x_bounds).y_bounds(y_bounds).paint(|map| {
        mission(map, model);
        let track: Vec<(f64, f64)> = model.track().iter().map(|[north, east]| (*east, *north)).collect();
        map.draw(&Points { coords: &track, color: Color::Cyan });
        map.layer();
        if let Some(ship) = &model.ship {
            let [north, east] = ship.position_m;
            map.print(east, north, Span::styled("S", Style::new().fg(Color::Magenta).add_modifier(Modifier::BOLD)));
        }
        if let (Some(ellipse), Some(record)) = (&ellipse, model.position()) {
            map.draw(&Points { coords: &ellipse.points(factor), color: Color::Yellow });
            map.layer();
            let style = Style::new().fg(Color::White).add_modifier(Modifier::BOLD);
            map.print(record.state[1], record.state[0], Span::styled(arrow(record.state[5]), style));
        }
    });
    frame.render_widget(canvas, inner);
}

fn mission(map: &mut Context<'_>, model: &Model) {
    let leg = model.telemetry.as_ref().and_then(|record| record.leg).map(usize::from);
    let line = |from: [f64; 2], to: [f64; 2], color| Line::new(from[1], from[0], to[1], to[0], color);
    let corners: Vec<[f64; 2]> = model.mission.iter().map(|waypoint| [waypoint.x_m, waypoint.y_m]).collect();
    for (i, pair) in corners.windows(2).enumerate() {
        if leg != Some(i + 1) {
            map.draw(&line(pair[0], pair[1], Color::DarkGray));
        }
    }
    // the present leg over the others
    map.layer();
    if let Some(leg) = leg
        && let Some(to) = corners.get(leg)
        && let Some(from) = leg.checked_sub(1).and_then(|before| corners.get(before))
    {
        map.draw(&line(*from, *to, Color::Magenta));
    }
    map.layer();
}

/// The half axes of the position's covariance.
struct Ellipse {
    centre: [f64; 2],
    /// North and east of each.
    axes: [[f64; 2]; 2],
}

impl Ellipse {
    fn of(record: &Telemetry) -> Self {
        let (xx, yy, xy) = (record.sigma[0].powi(2), record.sigma[1].powi(2), record.cov_xy_m2);
        let mean = 0.5 * (xx + yy);
        let radius = (0.5 * (xx - yy)).hypot(xy);
        let angle = 0.5 * xy.atan2(0.5 * (xx - yy));
        let axis = |variance: f64, angle: f64| {
            let length = ELLIPSE * variance.max(0.0).sqrt();
            [length * angle.cos(), length * angle.sin()]
        };
        let across = angle + std::f64::consts::FRAC_PI_2;
        Self {
            centre: [record.state[0], record.state[1]],
            axes: [axis(mean + radius, angle), axis(mean - radius, across)],
        }
    }

    /// By how much it has to be drawn larger to be seen: 1, 10, 100, …
    fn factor(&self, scale_m: f64) -> f64 {
        let [[n, e], _] = self.axes;
        let dots = n.hypot(e) / scale_m;
        if dots > 0.0 && dots.is_finite() { 10_f64.powf((VISIBLE / dots).log10().ceil().clamp(0.0, 6.0)) } else { 1.0 }
    }

    /// East and north of its outline.
    fn points(&self, factor: f64) -> Vec<(f64, f64)> {
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

/// Where it points.
fn arrow(heading_rad: f64) -> &'static str {
    const ARROWS: [&str; 8] = ["↑", "↗", "→", "↘", "↓", "↙", "←", "↖"];
    let eighth = (heading_rad / std::f64::consts::FRAC_PI_4).round().rem_euclid(8.0);
    ARROWS.get(eighth as usize).copied().unwrap_or("•")
}

fn metres(metres: f64) -> String {
    match metres {
        ..10.0 => format!("{metres:.1} m"),
        10.0..10_000.0 => format!("{metres:.0} m"),
        _ => format!("{:.0} km", metres * 1e-3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_the_ellipse_has_the_axes_of_its_covariance() {
        // eigenvalues 9 and 1 m², the larger at 30° from north
        let (sin, cos) = 30_f64.to_radians().sin_cos();
        let (xx, yy, xy) = (9.0 * cos * cos + sin * sin, 9.0 * sin * sin + cos * cos, 8.0 * sin * cos);
        let mut record = crate::monitor::view::tests::record(0);
        (record.sigma[0], record.sigma[1], record.cov_xy_m2) = (f64::sqrt(xx), f64::sqrt(yy), xy);
        let ellipse = Ellipse::of(&record);
        let [large, small] = ellipse.axes;
        assert!((large[0] - 3.0 * ELLIPSE * cos).abs() < 1e-9 && (large[1] - 3.0 * ELLIPSE * sin).abs() < 1e-9);
        assert!((small[0].hypot(small[1]) - ELLIPSE).abs() < 1e-9);
        // 7.3 m at 10 m a dot is no dot at all; ten times that is seven
        assert_eq!((ellipse.factor(0.1), ellipse.factor(10.0), ellipse.factor(100.0)), (1.0, 10.0, 100.0));
    }

    #[test]
    fn arrows_point_along_the_heading() {
        assert_eq!([0.0, 0.8, 1.6, -1.6, 3.1, 6.2].map(arrow), ["↑", "↗", "→", "←", "↓", "↑"]);
    }
}
