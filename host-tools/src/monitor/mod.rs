//! `backseat monitor`: a board live, over its host port.

mod json;
mod link;
mod model;
mod view;

pub use link::{Link, News};
#[cfg(feature = "ros2")]
pub use model::Severity;
pub use model::{Model, words};

use anyhow::{Context, bail};
use backseat_link::board::PortName;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event};
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};
use view::{Action, View};

const EXAMPLES: &str = "\
Examples:
  backseat monitor /dev/ttyACM0
  backseat monitor /dev/ttyUSB0 --baud 921600
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
    /// Baud rate of the port
    #[arg(long, value_name = "RATE", value_parser = clap::value_parser!(u32).range(1..))]
    baud: Option<u32>,
    /// Print one JSON object a second, of one line each, instead of the view
    #[arg(long)]
    json: bool,
    /// End after this time
    #[arg(long = "for", value_name = "SECONDS", value_parser = seconds)]
    time: Option<Duration>,
}

/// A time span of an option.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("{text}: expected a number of seconds"))?;
    Duration::try_from_secs_f64(seconds).map_err(|_| format!("{text}: expected a positive number of seconds"))
}

/// Board, clock and when to end.
struct Watch {
    link: Link,
    model: Model,
    begun: Instant,
    time: Option<Duration>,
    /// Ctrl-C outside the view, SIGTERM, SIGHUP.
    stop: Arc<AtomicBool>,
    received: Vec<u8>,
}

impl Watch {
    fn now_us(&self) -> u64 {
        u64::try_from(self.begun.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.time.is_some_and(|time| self.begun.elapsed() >= time)
    }

    /// Hears and asks.
    fn poll(&mut self) {
        let now_us = self.now_us();
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
    let on_terminal = std::io::stdout().is_terminal() && std::io::stdin().is_terminal();
    if !args.json && !on_terminal {
        bail!("the view needs a terminal; use --json to write to a file or a pipe");
    }
    let name = args.baud.map_or_else(|| args.port.clone(), |baud| args.port.with_baud(baud));
    let link = Link::open(&name)?;
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("signal handler")?;
    let begun = Instant::now();
    let mut model = Model::new();
    model.shared(link.shared());
    let mut watch = Watch { link, model, begun, time: args.time, stop, received: Vec::new() };
    if args.json {
        return print(&mut watch);
    }
    // Restores the terminal however the closure ends, panics included.
    ratatui::run(|terminal| show(terminal, &mut watch, View::new(name.to_string())))
}

fn print(watch: &mut Watch) -> anyhow::Result<()> {
    let (mut due_us, mut seen) = (SECOND_US, 0);
    while !watch.is_over() {
        std::thread::sleep(POLL);
        watch.poll();
        let now_us = watch.now_us();
        if now_us >= due_us {
            due_us += SECOND_US;
            let (object, count) = json::object(&watch.model, now_us, seen);
            seen = count;
            // a reader that has gone (`| head`) has seen enough
            match writeln!(std::io::stdout(), "{object}") {
                Err(error) if error.kind() == ErrorKind::BrokenPipe => return Ok(()),
                written => written?,
            }
        }
    }
    Ok(())
}

fn show(terminal: &mut DefaultTerminal, watch: &mut Watch, mut view: View) -> anyhow::Result<()> {
    let events = events();
    let mut drawn: Option<Instant> = None;
    while !watch.is_over() {
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
            let now_us = watch.now_us();
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
