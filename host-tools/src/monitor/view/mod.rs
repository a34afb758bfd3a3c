//! The view: what is known, as a screen. A screen depends on nothing but its arguments.

mod board;
mod header;
mod learned;
mod log;
mod map;
mod sensors;
mod vehicle;

use super::model::{Model, Severity};
use crate::screen::{faint, panel};
use ratatui::Frame;
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Color;

/// From this width on there are two columns.
const TWO_COLUMNS: u16 = 76;
/// Rows of a page of the log.
const PAGE: usize = 5;
/// Steps of zooming.
const ZOOM: f64 = 1.5;

/// What a key asks for beyond another view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    Quit,
}

/// What the map shows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Focus {
    /// All there is.
    Everything,
    /// The vehicle in the middle of so many metres.
    Vehicle { width_m: f64 },
}

/// What the user has chosen to see.
pub struct View {
    port: String,
    focus: Focus,
    /// The board itself is shown in place of what is learned.
    board: bool,
    /// Events that are further down than the last row of the log.
    scrolled: usize,
}

impl View {
    pub const fn new(port: String) -> Self {
        Self { port, focus: Focus::Everything, board: false, scrolled: 0 }
    }

    /// Takes a key.
    pub fn press(&mut self, key: KeyEvent) -> Option<Action> {
        if key.kind == KeyEventKind::Release {
            return None;
        }
        let control = key.modifiers.contains(KeyModifiers::CONTROL);
        match key.code {
            KeyCode::Char('q') | KeyCode::Esc => return Some(Action::Quit),
            KeyCode::Char('c') if control => return Some(Action::Quit),
            KeyCode::Char('f') => {
                self.focus = match self.focus {
                    Focus::Everything => Focus::Vehicle { width_m: 200.0 },
                    Focus::Vehicle { .. } => Focus::Everything,
                };
            }
            KeyCode::Char('b') => self.board = !self.board,
            KeyCode::Char('+' | '=') => self.zoom(1.0 / ZOOM),
            KeyCode::Char('-') => self.zoom(ZOOM),
            KeyCode::Up => self.scrolled = self.scrolled.saturating_add(1),
            KeyCode::Down => self.scrolled = self.scrolled.saturating_sub(1),
            KeyCode::PageUp => self.scrolled = self.scrolled.saturating_add(PAGE),
            KeyCode::PageDown => self.scrolled = self.scrolled.saturating_sub(PAGE),
            KeyCode::End => self.scrolled = 0,
            _ => {}
        }
        None
    }

    /// Zooming follows the vehicle.
    fn zoom(&mut self, factor: f64) {
        let width_m = match self.focus {
            Focus::Everything => 200.0,
            Focus::Vehicle { width_m } => width_m,
        };
        self.focus = Focus::Vehicle { width_m: (width_m * factor).clamp(2.0, 20_000.0) };
    }

    /// Draws a screen.
    pub fn draw(&mut self, frame: &mut Frame<'_>, model: &Model, now_us: u64) {
        let screen = frame.area();
        let mut panels = Panels::of(screen, model.sources.len());
        self.scrolled = self.scrolled.min(model.journal.len().saturating_sub(1));
        header::draw(frame, panels.header, model, &self.port, now_us);
        if self.board
            && let Some(area) = panels.learned.take().or_else(|| panels.map.take())
        {
            board::draw(frame, area, model);
        }
        if let Some(area) = panels.map {
            map::draw(frame, area, model, self.focus);
        }
        if let Some(area) = panels.vehicle {
            vehicle::draw(frame, area, model);
        }
        if let Some(area) = panels.sensors {
            sensors::draw(frame, area, model, now_us);
        }
        if let Some(area) = panels.learned {
            learned::draw(frame, area, model);
        }
        if let Some(area) = panels.log {
            log::draw(frame, area, model, self.scrolled, now_us);
        }
    }
}

/// Where everything goes; `None` for what a screen has no room for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Panels {
    header: Rect,
    map: Option<Rect>,
    vehicle: Option<Rect>,
    sensors: Option<Rect>,
    learned: Option<Rect>,
    log: Option<Rect>,
}

impl Panels {
    /// The title of a panel takes a row; a panel of fewer rows than this is useless.
    const LEAST: u16 = 3;

    fn of(screen: Rect, sources: usize) -> Self {
        let header_rows = if screen.height < 20 { 1 } else { 3 };
        let log_rows = match screen.height {
            ..12 => 0,
            12..20 => 3,
            height => (height / 4).clamp(5, 12),
        };
        let [header, body, log] =
            Layout::vertical([Constraint::Length(header_rows), Constraint::Fill(1), Constraint::Length(log_rows)])
                .areas(screen);
        let some = |area: Rect| (area.height >= Self::LEAST && area.width >= 20).then_some(area);
        let sensor_rows = u16::try_from(sources.clamp(5, 9)).unwrap_or(9) + 2;
        let panels = Self { header, log: some(log), ..Self::default() };
        if screen.width < TWO_COLUMNS {
            let mut rows = [vehicle::ROWS, sensor_rows, 0, 0];
            rows[2] = body.height.saturating_sub(rows[0] + rows[1]);
            let [vehicle, sensors, map, _] = stack(body, rows);
            return Self { vehicle: some(vehicle), sensors: some(sensors), map: some(map), ..panels };
        }
        let left_width = (screen.width * 9 / 20).max(38);
        let [left, _, right] =
            Layout::horizontal([Constraint::Length(left_width), Constraint::Length(1), Constraint::Fill(1)])
                .areas(body);
        let [vehicle, map, ..] = stack(left, [vehicle::ROWS, left.height.saturating_sub(vehicle::ROWS), 0, 0]);
        let [sensors, learned, ..] = stack(right, [sensor_rows, right.height.saturating_sub(sensor_rows), 0, 0]);
        Self { map: some(map), vehicle: some(vehicle), sensors: some(sensors), learned: some(learned), ..panels }
    }
}

/// One below the other, as far as they go.
fn stack(area: Rect, rows: [u16; 4]) -> [Rect; 4] {
    let mut y = area.y;
    rows.map(|height| {
        let height = height.min(area.bottom().saturating_sub(y));
        let panel = Rect { y, height, ..area };
        y += height;
        panel
    })
}

const fn colour(severity: Severity) -> Color {
    match severity {
        Severity::Info => Color::Reset,
        Severity::Warning => Color::Yellow,
        Severity::Critical => Color::Red,
    }
}

/// A number in so many places, or a dash.
fn dash(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}

/// Values as bars of eighths of a row, from the least to the largest of them, stretched or thinned to `width`.
fn sparkline(values: &[f64], width: usize) -> String {
    const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    if values.len() < 2 {
        return String::new();
    }
    let (least, largest) = values.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    let width = width.min(values.len());
    let of = |i: usize| {
        let value = values[if width > 1 { i * (values.len() - 1) / (width - 1) } else { 0 }];
        let share = (value - least) / (largest - least);
        // all the same: in the middle
        let bar = if share.is_finite() { (share * 7.0).round() as usize } else { 3 };
        BARS[bar.min(7)]
    };
    (0..width).map(of).collect()
}

#[cfg(test)]
mod tests;
