//! The screen: ship, vehicles with their ellipses, clock, slots. It fits 80 columns and 24 rows.

use super::abort::{self, Prompt};
use super::json::level;
use super::model::Model;
use crate::screen::{Ellipse, Window, faint, panel, time_of_day};
use backseat_analysis::topside_config::Vehicle;
use backseat_link::named::told_briefly;
use backseat_topside::Topside;
use backseat_topside::slots::Slot;
use backseat_topside::track::VehicleEstimate;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::Paragraph;
use ratatui::widgets::canvas::{Canvas, Points};

/// A map is no smaller than this, m.
const LEAST_M: f64 = 50.0;
const VEHICLE_COLOURS: [Color; 4] = [Color::Cyan, Color::Yellow, Color::Green, Color::Blue];

/// Draws a screen for `time_us` of the program's clock.
pub fn draw(
    frame: &mut Frame<'_>,
    topside: &Topside,
    model: &Model,
    vehicles: &[Vehicle],
    prompt: Prompt,
    time_us: u64,
) {
    let screen = frame.area();
    let log_rows = (screen.height / 4).clamp(3, 10);
    let [header, body, log] =
        Layout::vertical([Constraint::Length(4), Constraint::Fill(1), Constraint::Length(log_rows)]).areas(screen);
    let right_width = 38.min(screen.width / 2);
    let [left, _, right] =
        Layout::horizontal([Constraint::Fill(1), Constraint::Length(1), Constraint::Length(right_width)]).areas(body);
    let named = topside.tracks().iter().map(|track| track.names().iter().count()).sum::<usize>();
    let vehicle_rows = u16::try_from(4 * vehicles.len() + named).unwrap_or(16) + 1;
    let [table, slots] = Layout::vertical([Constraint::Length(vehicle_rows), Constraint::Fill(1)]).areas(right);
    let utc_us = topside.utc_us(time_us);
    frame
        .render_widget(Paragraph::new(head(topside, model, order(topside, vehicles, prompt), time_us, utc_us)), header);
    map(frame, left, topside, model, utc_us);
    draw_vehicles(frame, table, topside, vehicles, utc_us);
    draw_slots(frame, slots, topside, utc_us);
    events(frame, log, model);
}

/// The question that is open, or the abort that is being sent.
fn order(topside: &Topside, vehicles: &[Vehicle], prompt: Prompt) -> Option<String> {
    prompt.text(vehicles).or_else(|| {
        let (destination, left) = topside.aborting()?;
        Some(format!("ABORT to {}: {left} packets still to leave", abort::name(destination, vehicles)))
    })
}

fn head(
    topside: &Topside,
    model: &Model,
    order: Option<String>,
    time_us: u64,
    utc_us: Option<u64>,
) -> Vec<Line<'static>> {
    let hold = topside.hold();
    let (text, back) = if hold.is_none() { ("SENDING", Color::Green) } else { ("HOLD", Color::Red) };
    let badge = Style::new().fg(Color::Black).bg(back).add_modifier(Modifier::BOLD);
    let clock = utc_us.map_or("no UTC".to_owned(), |us| format!("{} UTC", time_of_day(us)));
    let first = Line::from(vec![
        Span::styled(format!(" {text} "), badge),
        Span::raw(format!(" {clock}  {} packets sent  ", topside.sent())),
        Span::styled("a abort  q quit", faint()),
    ]);
    let second = match hold {
        _ if order.is_some() => {
            let loud = Style::new().fg(Color::Red).add_modifier(Modifier::BOLD);
            Line::from(Span::styled(order.unwrap_or_default(), loud))
        }
        Some(hold) => Line::from(Span::styled(hold.to_string(), Style::new().fg(Color::Red))),
        None => Line::from(model.last_sent(topside, utc_us)),
    };
    let ship = utc_us.and_then(|us| topside.ship_at(us)).map_or("ship     no fix".to_owned(), |ship| {
        let place = topside.frame().map_or(String::new(), |frame| {
            let (latitude, longitude) = frame.to_geodetic(ship.position_m);
            format!("{latitude:.6} {longitude:.6}")
        });
        let [north, east] = ship.velocity_mps;
        let course = east.atan2(north).to_degrees().rem_euclid(360.0);
        let (satellites, _) = topside.satellites();
        format!(
            "ship     {place} ±{:.1} m  {:.1} m/s {course:03.0}°  {satellites} satellites",
            ship.sigma_m(),
            north.hypot(east)
        )
    });
    let modem = topside.modem_clock().map_or("modem    no clock report".to_owned(), |clock| {
        let age_s = time_us.saturating_sub(clock.time_us) / 1_000_000;
        format!("modem    clock {}, pulse {}, {age_s} s ago{}", clock.clock, clock.pulse, model.lines_lost())
    });
    vec![first, second, Line::from(ship), Line::from(modem)]
}

fn map(frame: &mut Frame<'_>, area: Rect, topside: &Topside, model: &Model, utc_us: Option<u64>) {
    let ship = utc_us.and_then(|us| topside.ship_at(us));
    let estimates: Vec<Option<VehicleEstimate>> =
        topside.tracks().iter().map(|track| utc_us.and_then(|us| track.at(us))).collect();
    let places = estimates.iter().flatten().map(|estimate| estimate.position_m);
    let all = model.paths.iter().flatten().copied().chain(places).chain(ship.map(|ship| ship.position_m));
    let Some(window) = Window::around(all, LEAST_M, area) else {
        let inner = panel(frame, area, "map", "north up");
        frame.render_widget(Paragraph::new("no position yet").style(faint()), inner);
        return;
    };
    let inner = panel(frame, area, "map", &format!("north up, {:.0} m wide, 95 %", window.width_m()));
    let [x_bounds, y_bounds] = window.bounds();
    let canvas = Canvas::default().marker(Marker::Braille).x_bounds(x_bounds).y_bounds(y_bounds).paint(|map| {
        for (path, index) in model.paths.iter().zip(0_usize..) {
            let colour = index.checked_sub(1).map_or(Color::Magenta, |i| VEHICLE_COLOURS[i % VEHICLE_COLOURS.len()]);
            let points: Vec<(f64, f64)> = path.iter().map(|[north, east]| (*east, *north)).collect();
            map.draw(&Points { coords: &points, color: colour });
        }
        map.layer();
        for (estimate, index) in estimates.iter().zip(0_usize..) {
            let Some(estimate) = estimate else { continue };
            let colour = VEHICLE_COLOURS[index % VEHICLE_COLOURS.len()];
            let ellipse = Ellipse::of(estimate.position_m, estimate.covariance_m2);
            map.draw(&Points { coords: &ellipse.points(1.0), color: colour });
            let [north, east] = estimate.position_m;
            let style = Style::new().fg(colour).add_modifier(Modifier::BOLD);
            map.print(east, north, Span::styled(format!("{}", index + 1), style));
        }
        if let Some(ship) = &ship {
            let [north, east] = ship.position_m;
            map.print(east, north, Span::styled("S", Style::new().fg(Color::Magenta).add_modifier(Modifier::BOLD)));
        }
    });
    frame.render_widget(canvas, inner);
}

fn draw_vehicles(frame: &mut Frame<'_>, area: Rect, topside: &Topside, vehicles: &[Vehicle], utc_us: Option<u64>) {
    let inner = panel(frame, area, "vehicles", "");
    let mut lines = Vec::new();
    for ((track, vehicle), index) in topside.tracks().iter().zip(vehicles).zip(0_usize..) {
        let style = Style::new().fg(VEHICLE_COLOURS[index % VEHICLE_COLOURS.len()]).add_modifier(Modifier::BOLD);
        let heard = track.heard_us().zip(utc_us).map(|(heard, utc)| utc.saturating_sub(heard) / 1_000_000);
        let heard = heard.map_or("never heard".to_owned(), |age_s| format!("heard {age_s} s ago"));
        let name = format!("{} {} (address {}) ", index + 1, vehicle.name, track.vehicle);
        lines.push(Line::from(vec![Span::styled(name, style), Span::raw(heard)]));
        let [used, refused] = track.ranges();
        lines.push(Line::from(match utc_us.and_then(|us| track.at(us)) {
            Some(e) => format!("  {:.0} N {:.0} E ±{:.1} m", e.position_m[0], e.position_m[1], e.sigma_m()),
            None => "  no position".to_owned(),
        }));
        let report = track.report();
        let horizontal = level(utc_us.and_then(|us| track.level_at(us)));
        lines.push(Line::from(format!("  level {horizontal}, in depth {}", level(report.and_then(|r| r.level_m[1])))));
        let depth = report.map_or("-".to_owned(), |report| format!("{:.1} m", report.depth_m));
        lines.push(Line::from(format!("  depth {depth}, {used} ranges, {refused} refused")));
        let changed = |named| format!("  changed: {}", told_briefly(&named));
        lines.extend(
            track.names().iter().map(|(named, _)| Line::styled(changed(named), Style::new().fg(Color::Yellow))),
        );
    }
    frame.render_widget(Paragraph::new(lines), inner);
}

fn draw_slots(frame: &mut Frame<'_>, area: Rect, topside: &Topside, utc_us: Option<u64>) {
    let table = &topside.config().slots;
    let inner = panel(frame, area, "cycle", &format!("{} s", table.period_s()));
    let next = utc_us.and_then(|us| table.next(us / 1_000_000 + 1));
    let line = |slot: &Slot| {
        let whom = slot.exchange.vehicle().map_or("all".to_owned(), |vehicle| vehicle.to_string());
        let text = format!("{:>4} s  {:<12} {whom:<4}", slot.offset_s, slot.exchange.name());
        match next.filter(|(_, next)| next == slot) {
            Some((launch_s, _)) => {
                let in_s = utc_us.map_or(0, |us| launch_s.saturating_sub(us / 1_000_000));
                Line::from(Span::styled(format!("{text} in {in_s} s"), Style::new().fg(Color::Green)))
            }
            None => Line::from(text),
        }
    };
    frame.render_widget(Paragraph::new(table.slots().iter().map(line).collect::<Vec<_>>()), inner);
}

fn events(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let inner = panel(frame, area, "log", "");
    let rows = usize::from(inner.height);
    let lines: Vec<Line<'static>> = model
        .recent(rows)
        .map(|(when, trouble, text)| {
            let style = if trouble { Style::new().fg(Color::Yellow) } else { Style::new() };
            Line::from(vec![Span::styled(format!("{when} "), faint()), Span::styled(text, style)])
        })
        .collect();
    frame.render_widget(Paragraph::new(lines), inner);
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_topside::Config;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    #[test]
    fn a_fresh_start_fits_80_by_24_and_names_what_is_missing() {
        let mut topside = Topside::new(Config::reference()).unwrap();
        for step in 0..100 {
            topside.step(step * 100_000);
        }
        let mut model = Model::new(&topside);
        let _ = model.take(&mut topside, 9_900_000);
        let vehicles = [Vehicle { address: 2, name: "iver3".to_owned() }];
        let mut terminal = Terminal::new(TestBackend::new(80, 24)).unwrap();
        terminal.draw(|frame| draw(frame, &topside, &model, &vehicles, Prompt::Which, 9_900_000)).unwrap();
        let cells = terminal.backend().buffer().content();
        let screen: String = cells.iter().map(|cell| cell.symbol()).collect();
        for text in [
            "HOLD",
            "end the mission of: 1 iver3, 0 all",
            "GNSS port: nothing arrives",
            "never heard",
            "downlink",
            "no position yet",
        ] {
            assert!(screen.contains(text), "{text} is missing in {screen}");
        }
    }
}
