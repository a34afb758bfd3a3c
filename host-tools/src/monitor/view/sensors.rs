//! Each sensor's rate and age, and its innovations beside the gate.

use super::{dash, faint, panel};
use crate::monitor::model::{Model, SourceHistory};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

/// Width of the columns left of the bar.
const LEFT: u16 = 24;
/// And right of it, without and with what a wider screen adds.
const RIGHT: u16 = 6;
const WIDE_RIGHT: u16 = RIGHT + 14;
/// Share of the bar that lies within the gate.
const WITHIN: f64 = 0.75;

pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, now_us: u64) {
    let gate = model.gate_sigmas();
    let inner = panel(frame, area, "sensors", &format!("gate at {gate:.0} sigmas"));
    let wide = inner.width >= LEFT + WIDE_RIGHT + 10;
    let bar = inner.width.saturating_sub(LEFT + if wide { WIDE_RIGHT } else { RIGHT });
    let more = if wide { "  rms rejected" } else { "" };
    let width = usize::from(bar);
    // nothing is wider than its bar
    let head = format!("{:<11}{:>6} {:>5} {:<width$.width$}", "", "Hz", "age", "innovation in sigmas");
    let mut lines = vec![Line::styled(format!("{head}worst {more}"), faint())];
    let board_us = model.board_us(now_us);
    lines.extend(model.sources.iter().map(|source| row(source, gate, bar, wide, board_us)));
    if model.sources.len() == 0 {
        lines.push(Line::styled("nothing fused yet", faint()));
    }
    frame.render_widget(Paragraph::new(lines), inner);
}

fn row(source: &SourceHistory, gate: f64, bar: u16, wide: bool, board_us: u64) -> Line<'static> {
    let age_s = source.age_s(board_us);
    let overdue = age_s.zip(source.interval_s()).is_some_and(|(age_s, interval_s)| age_s > (3.5 * interval_s).max(2.0));
    let rate = dash(source.rate_hz(board_us), 2);
    let rate = rate.get(..5).map_or(rate.as_str(), |short| short.trim_end_matches('.'));
    let mut spans = vec![
        Span::styled(format!("{:<11}", source.sensor.name()), Style::new().add_modifier(Modifier::BOLD)),
        Span::raw(format!("{rate:>6} ")),
        Span::styled(
            format!("{:>5} ", age(age_s)),
            if overdue { Style::new().fg(Color::Yellow) } else { Style::new() },
        ),
    ];
    if let Some((sigmas, fused)) = source.worst(board_us) {
        let colour = match sigmas / gate {
            _ if !fused => Color::Red,
            0.0..0.6 => Color::Green,
            _ => Color::Yellow,
        };
        spans.extend(bars(sigmas / gate, usize::from(bar), colour));
        let number = if sigmas < 100.0 { format!("{sigmas:>5.1} ") } else { format!("{sigmas:>5.0} ") };
        spans.push(Span::styled(number, Style::new().fg(colour)));
    }
    if wide {
        spans.push(Span::raw(format!("{:>5} ", dash(source.rms_sigmas(), 2))));
        let style = if source.in_a_row > 0 { Style::new().fg(Color::Red) } else { Style::new() };
        spans.push(Span::styled(format!("{:>8}", source.rejected), style));
    }
    Line::from(spans)
}

/// A bar with the gate marked; `ratio` 1 is at the gate.
fn bars(ratio: f64, width: usize, colour: Color) -> [Span<'static>; 3] {
    let gate_at = ((width as f64 - 1.0) * WITHIN) as usize;
    let filled = ((ratio * gate_at as f64).round() as usize).min(width.saturating_sub(1));
    let cell = |i: usize| if i < filled { '■' } else { '·' };
    let part = |cells: std::ops::Range<usize>| cells.map(cell).collect::<String>();
    let style = Style::new().fg(colour);
    [Span::styled(part(0..gate_at), style), Span::raw("│"), Span::styled(part(gate_at..width.saturating_sub(1)), style)]
}

fn age(age_s: Option<f64>) -> String {
    match age_s {
        None => "-".to_owned(),
        Some(s) if s < 99.95 => format!("{s:.1}s"),
        Some(s) if s < 5999.5 => format!("{:.0}m", s / 60.0),
        Some(s) => format!("{:.0}h", s / 3600.0),
    }
}
