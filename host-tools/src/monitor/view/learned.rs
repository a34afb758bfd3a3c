//! The water current, the active effects, and the identified parameters with their trend.

use super::{faint, panel, sparkline};
use crate::monitor::model::{Identified, Model, Severity, words};
use backseat_core::effects::FIN_NAMES;
use backseat_core::effects::{ParameterKind, fin_index};
use backseat_core::navigation::{ESTIMATE_NAMES, ESTIMATE_UNITS};
use backseat_wire::hostlink::{Estimate, Estimates, Visibility};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

/// Width of an identified parameter: name and change, and the least and most that is left for its trend.
const CHANGE: usize = 13;
const TREND: std::ops::RangeInclusive<usize> = 6..=16;
/// A change that large is worth a look.
const LARGE: f64 = 0.1;
const MEANINGLESS: f64 = 5.0;
/// Width of an estimate of the robust filter with its remark.
const ESTIMATE: usize = 58;

pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let inner = panel(frame, area, "effects and identified parameters", "");
    let mut lines = Vec::new();
    if let Some((speed, towards_rad, trend)) = model.current() {
        let degrees = towards_rad.to_degrees().round().rem_euclid(360.0);
        lines.push(Line::from(vec![
            Span::styled("water_current ", Style::new().add_modifier(Modifier::BOLD)),
            Span::raw(format!("{speed:.3} m/s to {degrees:03.0}° ")),
            Span::styled(sparkline(trend, *TREND.end()), Style::new().fg(Color::Cyan)),
        ]));
    }
    match model.settings() {
        None => lines.push(Line::styled("effects: not received yet", faint())),
        Some(settings) => {
            for (_, effect, values) in settings.navigation.effects.active() {
                let values = effect.parameters.iter().zip(values).map(|(parameter, value)| match parameter.kind {
                    ParameterKind::Fin => fin_index(*value).map_or("no", |i| FIN_NAMES[i]).to_owned(),
                    _ => format!("{} {value:.4}", parameter.name),
                });
                lines.push(Line::from(vec![
                    Span::styled(format!("{} ", effect.name), Style::new().add_modifier(Modifier::BOLD)),
                    Span::raw(values.collect::<Vec<_>>().join(", ")),
                ]));
            }
            if lines.is_empty() {
                lines.push(Line::styled("no effects beyond the declared model", faint()));
            }
        }
    }
    lines.push(identifier(model));
    lines.extend(model.naming.as_ref().map(|naming| styled(words::naming(naming))));
    lines.extend(model.fault.as_ref().map(|report| styled(words::fault(report))));
    lines.extend(model.estimates.as_ref().map(robust));
    let room = usize::from(inner.height).saturating_sub(lines.len());
    let identified = grid(model, room, usize::from(inner.width));
    let room = room.saturating_sub(identified.len());
    lines.extend(identified);
    lines.extend(model.estimates.iter().flat_map(|record| estimates(record, room, usize::from(inner.width))));
    frame.render_widget(Paragraph::new(lines), inner);
}

fn styled((severity, text): (Severity, String)) -> Line<'static> {
    let style = match severity {
        Severity::Critical => Style::new().fg(Color::Red).add_modifier(Modifier::BOLD),
        Severity::Warning => Style::new().fg(Color::Yellow),
        Severity::Info => faint(),
    };
    Line::styled(text, style)
}

fn identifier(model: &Model) -> Line<'static> {
    let Some(record) = model.identification() else {
        let off = model.settings().is_some_and(|settings| !settings.app.adapt);
        return Line::styled(if off { "identification off" } else { "identification: no record yet" }, faint());
    };
    let seen = record.visibility.iter().filter(|v| matches!(v, Visibility::Separate | Visibility::Collinear)).count();
    Line::from(vec![
        Span::styled("identification ", Style::new().add_modifier(Modifier::BOLD)),
        Span::raw(format!("{} {:.0} s, {seen}/21", words::activity(record.activity), record.adapted_s)),
    ])
}

/// The robust filter in one line.
fn robust(record: &Estimates) -> Line<'static> {
    let separable = record.estimates.iter().filter(|estimate| estimate.separable).count();
    let dives = match record.dives {
        0 => String::new(),
        1 => ", from a dive before".to_owned(),
        dives => format!(", from {dives} dives before"),
    };
    Line::from(vec![
        Span::styled("robust filter ", Style::new().add_modifier(Modifier::BOLD)),
        Span::raw(format!("{separable}/{} separable{dives}", record.estimates.len())),
    ])
}

/// Its estimates, as many as fit, those that may be read as findings first.
fn estimates(record: &Estimates, rows: usize, width: usize) -> Vec<Line<'static>> {
    let columns = (width / ESTIMATE).max(1);
    let mut all: Vec<&Estimate> = record.estimates.iter().collect();
    all.sort_by_key(|estimate| !estimate.separable);
    let lines = all.chunks(columns).take(rows);
    lines.map(|line| Line::from(line.iter().flat_map(|estimate| estimate_cell(estimate)).collect::<Vec<_>>())).collect()
}

fn estimate_cell(estimate: &Estimate) -> [Span<'static>; 3] {
    let place = usize::from(estimate.place);
    let name = ESTIMATE_NAMES.get(place).copied().unwrap_or("unknown");
    let unit = ESTIMATE_UNITS.get(place).copied().unwrap_or_default();
    let Estimate { value, sigma, separable, .. } = *estimate;
    let number = match unit {
        // the logarithm of a factor
        "1" => format!("{:+.1} ±{:.1} %", 100.0 * value.exp_m1(), 100.0 * sigma),
        "rad" => format!("{:+.2} ±{:.2}°", value.to_degrees(), sigma.to_degrees()),
        unit => format!("{value:+.3} ±{sigma:.3} {unit}"),
    };
    let (style, remark) = if separable { (Style::new(), "") } else { (faint(), "not separable yet") };
    [
        Span::styled(format!("{name:<18} "), style.add_modifier(Modifier::BOLD)),
        Span::styled(format!("{number:<20} "), style),
        Span::styled(format!("{remark:<18}"), style),
    ]
}

/// All in their order where they fit; else those that moved most.
fn grid(model: &Model, rows: usize, width: usize) -> Vec<Line<'static>> {
    let mut all = model.identified();
    // a space behind each cell
    let columns = ((width + 1) / (CHANGE + 2 + TREND.start())).max(1);
    let trend = ((width + 1) / columns).saturating_sub(CHANGE + 2).min(*TREND.end());
    if rows == 0 || all.is_empty() {
        return Vec::new();
    }
    if all.len() > rows * columns {
        let weight = |p: &Identified<'_>| {
            let visible = !matches!(p.visibility, Visibility::Frozen | Visibility::Known);
            (p.drifted, visible, p.change.unwrap_or(0.0).abs())
        };
        all.sort_by(|a, b| weight(b).partial_cmp(&weight(a)).unwrap_or(std::cmp::Ordering::Equal));
        all.truncate(rows * columns);
    }
    let rows = all.len().div_ceil(columns);
    let line = |row: usize| {
        let cells = (0..columns).filter_map(|column| all.get(column * rows + row));
        Line::from(cells.flat_map(|parameter| cell(parameter, trend)).collect::<Vec<_>>())
    };
    (0..rows).map(line).collect()
}

fn cell(parameter: &Identified<'_>, width: usize) -> [Span<'static>; 3] {
    // a change relative to almost zero is meaningless
    let change = match parameter.change {
        Some(change) if change.abs() < MEANINGLESS => format!("{:+.1}%", change * 100.0),
        _ => format!("{:.3}", parameter.value),
    };
    let style = match parameter.visibility {
        Visibility::Frozen | Visibility::Known => faint(),
        _ if parameter.drifted => Style::new().fg(Color::Red).add_modifier(Modifier::BOLD),
        _ if parameter.change.is_some_and(|change| change.abs() > LARGE) => Style::new().fg(Color::Yellow),
        _ => Style::new(),
    };
    let known = if parameter.visibility == Visibility::Known { "scale" } else { change.as_str() };
    let trend =
        if parameter.visibility == Visibility::Known { String::new() } else { sparkline(parameter.trend, width) };
    [
        Span::styled(format!("{:<5}", parameter.name), style.add_modifier(Modifier::BOLD)),
        Span::styled(format!("{known:>8} "), style),
        Span::styled(format!("{trend:<width$} "), Style::new().fg(Color::Cyan)),
    ]
}
