//! What is wrong now, and what happened.

use super::{colour, faint, panel};
use crate::monitor::model::Model;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;

pub fn draw(frame: &mut Frame<'_>, area: Rect, model: &Model, scrolled: usize, now_us: u64) {
    let alarms = model.alarms(now_us);
    let remark = if scrolled > 0 { format!("{scrolled} newer below (end)") } else { String::new() };
    let title = match alarms.len() {
        0 => "log".to_owned(),
        1 => "1 alarm".to_owned(),
        count => format!("{count} alarms"),
    };
    let inner = panel(frame, area, &title, &remark);
    let rows = usize::from(inner.height);
    // Alarms leave a row to the log; the title counts those that are cut.
    let room = alarms.len().min(rows.saturating_sub(1).max(1));
    let mut lines: Vec<Line<'_>> = alarms
        .iter()
        .take(room)
        .map(|alarm| {
            let style = Style::new().fg(Color::Black).bg(colour(alarm.severity)).add_modifier(Modifier::BOLD);
            Line::from(Span::styled(format!(" {} ", alarm.text), style))
        })
        .collect();
    let mut events: Vec<Line<'_>> = model
        .journal
        .newest()
        .skip(scrolled)
        .take(rows.saturating_sub(lines.len()))
        .map(|event| {
            let text = Span::styled(event.text.as_str(), Style::new().fg(colour(event.severity)));
            Line::from(vec![Span::styled(format!("{} ", event.when), faint()), text])
        })
        .collect();
    events.reverse();
    lines.extend(events);
    frame.render_widget(Paragraph::new(lines), inner);
}
