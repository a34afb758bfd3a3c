//! The map: mission, track, vehicle and the ellipse of its uncertainty. North is up.

use super::{Focus, faint, panel};
use crate::monitor::model::Model;
use crate::screen::{Ellipse, Window};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::Span;
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Context, Line, Points};

/// A map is no smaller than this, m.
const LEAST_M: f64 = 20.0;
/// `None` where there is nothing to be shown.
fn window(model: &Model, focus: Focus, area: Rect) -> Option<Window> {
    let place = model.position().map(|record| [record.state[0], record.state[1]]);
    if let (Focus::Vehicle { width_m }, Some(place)) = (focus, place) {
        return Some(Window::about(place, width_m, area));
    }
    let waypoints = model.mission.iter().map(|waypoint| [waypoint.x_m, waypoint.y_m]);
    let ship = model.ship.map(|ship| ship.position_m);
    Window::around(waypoints.chain(model.track().iter().copied()).chain(place).chain(ship), LEAST_M, area)
}

pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, focus: Focus) {
    let Some(window) = window(model, focus, area) else {
        let inner = panel(frame, area, "map", "north up");
        frame.render_widget(Paragraph::new("no position, no mission").style(faint()), inner);
        return;
    };
    let ellipse = model.position().map(|record| {
        let [north, east] = [0, 1].map(|i| record.sigma[i].powi(2));
        Ellipse::of([record.state[0], record.state[1]], [north, east, record.cov_xy_m2])
    });
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
    fn arrows_point_along_the_heading() {
        assert_eq!([0.0, 0.8, 1.6, -1.6, 3.1, 6.2].map(arrow), ["↑", "↗", "→", "←", "↓", "↑"]);
    }
}
