//! The board itself: its load and stacks, its log, supply, memory and pulse, and what ended its runs before.

use super::{faint, panel};
use crate::monitor::model::{Model, words};
use backseat_wire::hostlink::{BoardLog, Hardware, Health, LogState};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let inner = panel(frame, area, "board", "since its start");
    let mut lines = match &model.health {
        Some(health) => counters(health),
        None => vec![Line::styled("not received yet", faint())],
    };
    lines.extend(crashes(model));
    frame.render_widget(Paragraph::new(lines).wrap(Wrap { trim: true }), inner);
}

/// Yellow where it is not as it should be.
fn judged(text: String, is_good: bool) -> Span<'static> {
    Span::styled(text, if is_good { Style::new() } else { Style::new().fg(Color::Yellow) })
}

fn counters(health: &Health) -> Vec<Line<'static>> {
    let BoardLog { state, lost_records } = health.log;
    let late = health.late_steps;
    let mut lines = Vec::new();
    if let Some(hardware) = &health.hardware {
        let [interrupts, thread] = hardware.stacks;
        lines.push(Line::from(vec![
            judged(format!("load {:.0} %", 0.1 * f64::from(hardware.load_permille)), !hardware.is_loaded()),
            Span::raw(format!("  longest step {:.1} ms", 1e-3 * f64::from(hardware.longest_step_us))),
            judged(format!("  {late} late"), late == 0),
        ]));
        lines.push(Line::from(vec![
            judged(format!("stacks {} of {}", interrupts.used, interrupts.room), !interrupts.is_narrow()),
            judged(format!(", {} of {}", thread.used, thread.room), !thread.is_narrow()),
        ]));
    } else {
        lines.push(Line::from(judged(format!("no hardware of a board; {late} steps late"), late == 0)));
    }
    lines.push(Line::from(vec![
        judged(format!("log {}", words::log_state(state)), !matches!(state, LogState::Failed | LogState::Full)),
        judged(format!(", {lost_records} records lost"), lost_records == 0),
    ]));
    if let Some(hardware) = &health.hardware {
        lines.extend(memory_and_supply(hardware));
    }
    let lost_edges = health.hardware.map_or(0, |hardware| hardware.lost_edges);
    lines.push(Line::from(vec![
        Span::raw(format!("pulse edges {}", health.pps_edges)),
        judged(format!(", {lost_edges} lost"), lost_edges == 0),
        Span::raw(format!("; {} clock", words::oscillator(health.oscillator))),
    ]));
    lines
}

fn memory_and_supply(hardware: &Hardware) -> [Line<'static>; 2] {
    let [corrected, lost] = hardware.wrong_bits;
    [
        Line::from(vec![
            judged(format!("brown-out level {}", hardware.brown_out_level), !hardware.has_low_brown_out()),
            judged(format!(", supply fell {} times", hardware.supply_dips), hardware.supply_dips == 0),
        ]),
        Line::from(vec![
            Span::raw("wrong bits "),
            judged(format!("{corrected} corrected"), corrected == 0),
            judged(format!(", {lost} not"), lost == 0),
        ]),
    ]
}

/// The newest first: it is what a small screen has room for.
fn crashes(model: &Model) -> Vec<Line<'static>> {
    let texts = model.crash_texts();
    if texts.is_empty() {
        return vec![Line::styled("no crash is kept", faint())];
    }
    let count = texts.len();
    let numbered = texts.into_iter().enumerate().map(|(k, text)| format!("crash {} of {count}: {text}", count - k));
    numbered.map(|text| Line::styled(text, Style::new().fg(Color::Yellow))).collect()
}
