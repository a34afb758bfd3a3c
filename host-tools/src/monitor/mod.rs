//! `backseat monitor`: a board live, over its host port.

mod json;
mod link;
mod model;
mod view;

pub use link::{Link, News};
#[cfg(feature = "ros2")]
pub use model::Severity;
pub use model::{Model, words};

use crate::live::{Course, needs_terminal, print_line, seconds};
use backseat_link::board::PortName;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};
use view::{Action, View};

const EXAMPLES: &str = "\
Examples:
  backseat monitor /dev/ttyACM0
  backseat monitor /dev/ttyUSB0:921600
  backseat monitor /dev/ttyACM0 --json --for 60 > minute.jsonl

PORT is the board's host port, with :BAUD behind it where that is not 115200. The view asks the board for its counters,
mission and parameters and changes nothing. It waits for a board that is not there yet and for a port that was
unplugged. While it holds the port, other commands reach the board through the one that its log names first, such as
`backseat params get /dev/pts/5` or `backseat mission stop /dev/pts/5`. With --json there is one JSON object a second instead, of one line each.

Keys: q quits; f has the map follow the vehicle or show everything; b shows the board itself, its load, stacks, log,
supply, memory and crashes; + and - zoom; up, down, page up, page down and end move in the log.";

/// The view is drawn as often, and the port looked at.
const DRAW: Duration = Duration::from_millis(200);
const POLL: Duration = Duration::from_millis(10);
const SECOND_US: u64 = 1_000_000;

/// Watch a board live: position, sensors, mode, effects, alarms
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Serial device of the board's host port, PATH or PATH:BAUD
    port: PortName,
    /// Print one JSON object a second, of one line each, instead of the view
    #[arg(long)]
    json: bool,
    /// End after this time
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    time: Option<Duration>,
}

/// Board, clock and when to end.
struct Watch {
    link: Link,
    model: Model,
    course: Course,
    received: Vec<u8>,
}

impl Watch {
    /// Hears and asks.
    fn poll(&mut self) {
        let now_us = self.course.now_us();
        let Self { link, model, received, .. } = self;
        received.clear();
        let heard = link.poll(now_us, received);
        model.receive(now_us, received);
        let asked = model.question(now_us).and_then(|question| link.send(now_us, &question));
        for news in [heard, asked].into_iter().flatten() {
            match news {
                News::Lost(why) => model.lost(now_us, &why),
                News::Found => model.found(now_us),
            }
        }
        model.tick(now_us);
    }
}

/// Watches until q, Ctrl-C or the time is over.
pub fn run(args: &Args) -> anyhow::Result<()> {
    needs_terminal(args.json)?;
    let link = Link::open(&args.port)?;
    let mut model = Model::new();
    model.shared(link.shared());
    let mut watch = Watch { link, model, course: Course::stoppable(args.time)?, received: Vec::new() };
    if args.json {
        return print(&mut watch);
    }
    // Restores the terminal however the closure ends, panics included.
    ratatui::run(|terminal| show(terminal, &mut watch, View::new(args.port.to_string())))
}

fn print(watch: &mut Watch) -> anyhow::Result<()> {
    let (mut due_us, mut seen) = (SECOND_US, 0);
    while !watch.course.is_over() {
        std::thread::sleep(POLL);
        watch.poll();
        let now_us = watch.course.now_us();
        if now_us >= due_us {
            due_us += SECOND_US;
            let (object, count) = json::object(&watch.model, now_us, seen);
            seen = count;
            if !print_line(&object)? {
                return Ok(());
            }
        }
    }
    Ok(())
}

fn show(terminal: &mut DefaultTerminal, watch: &mut Watch, mut view: View) -> anyhow::Result<()> {
    let events = events();
    let mut drawn: Option<Instant> = None;
    while !watch.course.is_over() {
        watch.poll();
        let mut redraw = drawn.is_none_or(|drawn| drawn.elapsed() >= DRAW);
        while let Ok(event) = events.recv_timeout(if redraw { Duration::ZERO } else { POLL }) {
            match event {
                Event::Key(key) => match view.press(key) {
                    Some(Action::Quit) => return Ok(()),
                    None => redraw = true,
                },
                Event::Resize(..) => redraw = true,
                _ => {}
            }
        }
        if redraw {
            let now_us = watch.course.now_us();
            terminal.draw(|frame| view.draw(frame, &watch.model, now_us))?;
            drawn = Some(Instant::now());
        }
    }
    Ok(())
}

/// Keys and changes of size, from a thread of their own: on a terminal that has gone, reading them never returns, and
/// the view has to end all the same.
fn events() -> Receiver<Event> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        while let Ok(event) = event::read() {
            if sender.send(event).is_err() {
                break;
            }
        }
    });
    receiver
}
