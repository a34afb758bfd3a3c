//! Mode, time, and the link that all this comes over.

use super::{colour, dash, faint};
use crate::monitor::model::{Model, words};
use backseat_wire::hostlink::{LogState, Mode, Oscillator, Port};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

const KEYS: &str = "q quit  f follow  b board  ↑↓ log";

pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, port: &str, now_us: u64) {
    let mut lines = vec![mode(model, now_us)];
    if area.height >= 3 {
        lines.push(link(model, port));
        lines.push(ports(model));
    }
    let used = lines[0].width() as u16;
    frame.render_widget(Paragraph::new(lines), area);
    let width = KEYS.chars().count() as u16;
    if used + width < area.width {
        let corner = Rect { x: area.right() - width, width, height: 1, ..area };
        frame.render_widget(Paragraph::new(Span::styled(KEYS, faint())), corner);
    }
}

const fn background(mode: Mode) -> Color {
    match mode {
        Mode::Navigating => Color::Green,
        Mode::Initialising | Mode::Degraded => Color::Yellow,
        Mode::Lost | Mode::Safe => Color::Red,
    }
}

fn mode(model: &Model, now_us: u64) -> Line<'static> {
    let badge = |text: &str, back| {
        let style = Style::new().fg(Color::Black).bg(back).add_modifier(Modifier::BOLD);
        Span::styled(format!(" {} ", text.to_uppercase()), style)
    };
    let Some(record) = &model.telemetry else {
        return Line::from(vec![badge("no telemetry", Color::Yellow), Span::raw(" waiting for the board")]);
    };
    let stale = model.away_since_us.is_some() || model.silence_s(now_us).is_some_and(|seconds| seconds > 1.0);
    let back = if stale { Color::DarkGray } else { background(record.mode) };
    let mut spans = vec![badge(words::mode_name(record.mode), back)];
    if stale {
        let seconds = model.silence_s(now_us).unwrap_or(0.0);
        let style = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);
        spans.push(Span::styled(format!(" {seconds:.0} s ago "), style));
    }
    let reason = words::reason(record.reason);
    if !reason.is_empty() {
        spans.push(Span::styled(format!(" {reason}"), Style::new().fg(colour(words::severity(record.mode)))));
    }
    let leg = match (record.leg, model.mission.len()) {
        (Some(leg), 0) => format!("  leg {}", leg + 1),
        (Some(leg), count) => format!("  leg {} of {count}", leg + 1),
        (None, 0) => String::new(),
        (None, count) => format!("  {count} waypoints"),
    };
    spans.push(Span::raw(leg));
    if let Some(held) = model.helm() {
        spans.push(Span::raw(format!("  host steers {}", words::helm(&held))));
    }
    spans.push(Span::raw(format!("  {}", words::time_of_day(record.utc_us, record.time_us))));
    Line::from(spans)
}

fn link(model: &Model, port: &str) -> Line<'static> {
    let link = &model.link;
    let rate = dash(link.record_rate.per_s(), 1);
    let kilobytes = dash(link.byte_rate.per_s().map(|per_s| per_s * 1e-3), 1);
    let mut spans = vec![
        Span::styled(format!("{port}  "), Style::new().add_modifier(Modifier::BOLD)),
        Span::raw(format!("{rate} rec/s {kilobytes} kB/s  {} frames", link.frames)),
    ];
    let mut count = |count: u64, text: String| {
        let style = if count > 0 { Style::new().fg(Color::Yellow) } else { faint() };
        spans.push(Span::styled(text, style));
    };
    count(link.broken, format!("  {} broken", link.broken));
    count(link.gaps, format!("  {} gaps", link.gaps));
    if link.unknown > 0 {
        count(link.unknown, format!("  {} unknown", link.unknown));
    }
    Line::from(spans)
}

fn ports(model: &Model) -> Line<'static> {
    let Some(health) = &model.health else { return Line::styled("good frames a second: not received yet", faint()) };
    let mut spans = vec![Span::styled("frames/s ", faint())];
    for (port, rate) in Port::DEVICES.into_iter().zip(&model.port_rates) {
        spans.push(Span::raw(format!(" {} {}", port.name(), dash(rate.per_s(), 0))));
        let refused = health.rejected_frames.get(port as usize).copied().unwrap_or(0);
        if refused > 0 {
            spans.push(Span::styled(format!(" ({refused} refused)"), Style::new().fg(Color::Yellow)));
        }
        spans.push(Span::raw(" "));
    }
    let pps = if health.synchronised { " PPS" } else { " no PPS" };
    if health.oscillator == Oscillator::Internal {
        spans.push(Span::styled(" internal oscillator", Style::new().fg(Color::Yellow)));
    }
    if matches!(health.log.state, LogState::Failed | LogState::Full) {
        spans.push(Span::styled(" no board log", Style::new().fg(Color::Yellow)));
    }
    spans.push(Span::styled(pps, if health.synchronised { Style::new() } else { Style::new().fg(Color::Yellow) }));
    Line::from(spans)
}
