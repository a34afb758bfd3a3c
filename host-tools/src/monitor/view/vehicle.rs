//! Position, attitude, velocity and actuator commands.

use super::{faint, panel};
use crate::monitor::model::Model;
use backseat_wire::hostlink::Telemetry;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

/// Rows of this panel, its title included.
pub const ROWS: u16 = 8;

pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let inner = panel(frame, area, "vehicle", "±1 sigma");
    let lines = match (&model.telemetry, model.position()) {
        (_, Some(record)) => lines(record, model),
        (Some(_), None) => vec![Line::styled("the filter has no position yet", faint())],
        (None, None) => Vec::new(),
    };
    frame.render_widget(Paragraph::new(lines), inner);
}

/// A name, then what it is.
fn named(name: &str, value: String) -> [Span<'static>; 2] {
    [Span::styled(name.to_owned(), faint()), Span::styled(value, Style::new().add_modifier(Modifier::BOLD))]
}

fn lines(record: &Telemetry, model: &Model) -> Vec<Line<'static>> {
    let Telemetry { state, sigma, .. } = record;
    let place = |name: &str, i: usize, (velocity, j): (&str, usize)| {
        let mut spans = named(name, format!("{:>9.2}", state[i])).to_vec();
        spans.push(Span::raw(format!(" ±{:<7}", uncertainty(sigma[i]))));
        spans.extend(named(velocity, format!("{:>6.2}", state[j])));
        Line::from(spans)
    };
    let degrees = |i: usize| state[i].to_degrees();
    let heading_deg = degrees(5).rem_euclid(360.0);
    // 359.96 would be printed as 360.0
    let heading_deg = if heading_deg >= 359.95 { 0.0 } else { heading_deg };
    let mut attitude = named("roll ", format!("{:+.1}°", degrees(3))).to_vec();
    attitude.extend(named("  pitch ", format!("{:+.1}°", degrees(4))));
    attitude.extend(named("  head ", format!("{heading_deg:05.1}°")));
    let mut rates = vec![Span::styled("rates", faint())];
    for (name, i) in [(" p", 9), ("  q", 10), ("  r", 11)] {
        rates.extend(named(name, format!(" {:+.1}", degrees(i))));
    }
    rates.push(Span::raw(" °/s"));
    let mut actuators = named("prop ", format!("{:.0}", record.propeller_radps)).to_vec();
    actuators.push(Span::raw(" rad/s"));
    actuators.push(Span::styled("  fins", faint()));
    let fins: String = record.fins_rad.iter().map(|fin| format!(" {:+.0}", fin.to_degrees())).collect();
    actuators.push(Span::styled(fins, Style::new().add_modifier(Modifier::BOLD)));
    actuators.push(Span::raw("°"));
    vec![
        place("north m", 0, ("u m/s ", 6)),
        place("east  m", 1, ("v m/s ", 7)),
        place("depth m", 2, ("w m/s ", 8)),
        level(record, model.settings().map(|settings| [settings.app.alert_horizontal_m, settings.app.alert_depth_m])),
        Line::from(attitude),
        Line::from(rates),
        Line::from(actuators),
    ]
}

/// The protection levels, red beyond an alert limit.
fn level(record: &Telemetry, alerts_m: Option<[f64; 2]>) -> Line<'static> {
    let alerts_m = alerts_m.unwrap_or_default();
    let one = |which: usize| {
        let (level_m, alert_m) = (f64::from(record.level_m[which]), alerts_m[which]);
        let beyond = alert_m > 0.0 && level_m > alert_m;
        let style = Style::new().add_modifier(Modifier::BOLD);
        let limit = if alert_m > 0.0 { format!("/{alert_m:.0}") } else { String::new() };
        let shown = if level_m.is_finite() { uncertainty(level_m) } else { "none".to_owned() };
        Span::styled(format!("{shown}{limit}"), if beyond { style.fg(Color::Red) } else { style })
    };
    Line::from(vec![Span::styled("level m  ", faint()), one(0), Span::styled("  in depth ", faint()), one(1)])
}

/// Three figures are plenty.
fn uncertainty(sigma: f64) -> String {
    match sigma {
        ..10.0 => format!("{sigma:.2}"),
        10.0..1000.0 => format!("{sigma:.0}"),
        _ => format!("{sigma:.0e}"),
    }
}
