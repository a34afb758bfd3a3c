//! Screens of a known board, at the sizes of a plain terminal and of a large one.

use super::*;
use crate::monitor::model::tests::{feed, flying, of_a_board};
use backseat_wire::hostlink::{FromBoard, Mode, ModeReason, Telemetry};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::KeyEvent;

pub use crate::monitor::model::tests::record;

/// What a terminal of that size shows, without trailing spaces.
fn screen(view: &mut View, model: &Model, now_us: u64, width: u16, height: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
    terminal.draw(|frame| view.draw(frame, model, now_us)).unwrap();
    let buffer = terminal.backend().buffer();
    let row = |y| (0..width).map(|x| buffer[(x, y)].symbol()).collect::<String>().trim_end().to_owned() + "\n";
    (0..height).map(row).collect()
}

fn view() -> View {
    View::new("/dev/ttyACM0".to_owned())
}

fn press(view: &mut View, code: KeyCode) -> Option<Action> {
    view.press(KeyEvent::new(code, KeyModifiers::NONE))
}

#[test]
fn regress_a_plain_terminal_shows_everything() {
    let (model, now_us) = flying();
    assert_snapshot("flying-80x24", &screen(&mut view(), &model, now_us, 80, 24));
}

#[test]
fn regress_a_large_terminal_shows_more_of_it() {
    let (model, now_us) = flying();
    assert_snapshot("flying-120x40", &screen(&mut view(), &model, now_us, 120, 40));
}

#[test]
fn regress_without_a_board_it_says_so() {
    assert_snapshot("nothing-80x24", &screen(&mut view(), &Model::new(), 3_000_000, 80, 24));
}

#[test]
fn regress_the_board_itself_is_shown() {
    let (mut model, now_us) = flying();
    of_a_board(&mut model, now_us);
    let mut view = view();
    press(&mut view, KeyCode::Char('b'));
    assert_snapshot("board-80x24", &screen(&mut view, &model, now_us, 80, 24));
    assert!(screen(&mut view, &model, now_us, 60, 40).contains("brown-out level 3"), "a narrow screen shows it too");
    press(&mut view, KeyCode::Char('b'));
    assert!(!screen(&mut view, &model, now_us, 80, 24).contains("brown-out"));
}

/// Compares with the file beside; `BACKSEAT_WRITE_SCREENS=1` writes it.
fn assert_snapshot(name: &str, text: &str) {
    let path = format!("{}/src/monitor/view/snapshots/{name}.txt", env!("CARGO_MANIFEST_DIR"));
    if std::env::var_os("BACKSEAT_WRITE_SCREENS").is_some() {
        std::fs::write(&path, text).unwrap();
    }
    let expected = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(text == expected, "{name} is now:\n{text}\nand was:\n{expected}");
}

#[test]
fn small_terminals_drop_panels_and_never_fail() {
    let (model, now_us) = flying();
    for width in (1..130).step_by(3) {
        for height in (1..45).step_by(2) {
            screen(&mut view(), &model, now_us, width, height);
            let panels = Panels::of(Rect::new(0, 0, width, height), model.sources.len());
            let shown = [panels.map, panels.vehicle, panels.sensors, panels.learned, panels.log];
            let all: Vec<Rect> = shown.into_iter().flatten().chain([panels.header]).collect();
            for (i, one) in all.iter().enumerate() {
                assert!(one.right() <= width && one.bottom() <= height, "{width}x{height}: {panels:?}");
                assert!(all.iter().skip(i + 1).all(|other| !one.intersects(*other)), "{width}x{height}: {panels:?}");
            }
        }
    }
    let text = screen(&mut view(), &model, now_us, 50, 18);
    for part in ["NAVIGATING", "north m", "attitude"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(screen(&mut view(), &model, now_us, 30, 4).contains("NAVIGATING"));
}

#[test]
fn what_is_missing_is_seen_at_once() {
    let (mut model, now_us) = flying();
    assert!(!screen(&mut view(), &model, now_us, 80, 24).contains("alarm"));
    let later_us = now_us + 12_000_000;
    let text = screen(&mut view(), &model, later_us, 80, 24);
    for part in ["12 s ago", "1 alarm ", "no telemetry for 12 s"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    model.lost(later_us, "hung up");
    let text = screen(&mut view(), &model, later_us + 5_000_000, 80, 24);
    assert!(text.contains("port gone for 5 s") && !text.contains("no telemetry for"), "{text}");
    model.found(later_us + 6_000_000);
    let lost = Telemetry { mode: Mode::Lost, reason: ModeReason::PositionUncertain, ..record(200) };
    feed(&mut model, later_us + 6_500_000, &FromBoard::Telemetry(lost));
    let text = screen(&mut view(), &model, later_us + 6_600_000, 80, 24);
    for part in ["LOST  position uncertain", "lost: position uncertain", "port back after 6.0 s"] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn keys() {
    let (model, now_us) = flying();
    let mut view = view();
    assert_eq!(press(&mut view, KeyCode::Char('q')), Some(Action::Quit));
    assert_eq!(view.press(KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL)), Some(Action::Quit));
    assert_eq!(press(&mut view, KeyCode::Char('c')), None);
    let everything = screen(&mut view, &model, now_us, 120, 40);
    press(&mut view, KeyCode::Char('f'));
    assert!(screen(&mut view, &model, now_us, 120, 40).contains("200 m wide"));
    press(&mut view, KeyCode::Char('-'));
    assert!(screen(&mut view, &model, now_us, 120, 40).contains("300 m wide"));
    press(&mut view, KeyCode::Char('f'));
    assert_eq!(screen(&mut view, &model, now_us, 120, 40), everything);
    for _ in 0..3 {
        press(&mut view, KeyCode::PageUp);
    }
    let scrolled = screen(&mut view, &model, now_us, 120, 40);
    assert!(scrolled.contains("newer below") && scrolled.contains("backseat 0.1.0"), "{scrolled}");
    press(&mut view, KeyCode::End);
    assert_eq!(screen(&mut view, &model, now_us, 120, 40), everything);
}

#[test]
fn sparklines() {
    assert_eq!(sparkline(&[], 8), "");
    assert_eq!(sparkline(&[1.0, 2.0, 3.0], 8), "▁▅█");
    assert_eq!(sparkline(&[2.0, 2.0], 8), "▄▄");
    assert_eq!(sparkline(&(0..100).map(f64::from).collect::<Vec<_>>(), 8), "▁▂▃▄▅▆▇█");
    assert_eq!(sparkline(&[f64::NAN, 1.0, 2.0], 3).chars().count(), 3);
}
