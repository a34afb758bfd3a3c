//! `backseat topside`: the ship's half of the system, on the ship's GNSS receiver and modem.

mod abort;
pub mod json;
mod line;
mod model;
mod simulated;
mod view;

pub use simulated::{Simulated, run_simulated};

use crate::live::{Course, needs_terminal, print_line};
use abort::Prompt;
use anyhow::Context;
use backseat_analysis::topside_config::{self as config, Vehicle};
use backseat_logs::output::Existing;
use backseat_logs::session::{Attachment, Clock, Meta, Writer};
use backseat_report::console;
use backseat_topside::{Port, Topside};
use line::SerialLine;
use model::Model;
use ratatui::DefaultTerminal;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyModifiers};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const EXAMPLES: &str = "\
Examples:
  backseat topside ship.toml
  backseat topside ship.toml --log dive.mcap
  backseat topside ship.toml --check
  backseat topside ship.toml --json --for 60 > minute.jsonl
  backseat topside ship.toml --abort iver3       ends its mission, when its name is typed again

CONFIG.toml names the two serial ports, the modem addresses, the cycle and its slots; there is an example in
host-tools/logs/examples/topside.toml, explained in docs/guide/topside.md. --check reads it, says what it means, and opens
no port. The ship sends nothing until GNSS, modem, clock and pulse are good, and says what is missing. Keys: a ends a mission, q quits.";

/// Names of the ports in the session log.
const GNSS: &str = "gnss";
const MODEM: &str = "modem";
const POLL: Duration = Duration::from_millis(10);
const STEP_US: u64 = 100_000;
const SECOND_US: u64 = 1_000_000;
const DRAW: Duration = Duration::from_millis(200);

/// The ship's half: send the ship's state by acoustic packets, hear and track the vehicles
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Ports, addresses, cycle and slots
    #[arg(value_name = "CONFIG.toml")]
    config: PathBuf,
    /// Write a session log
    #[arg(long, value_name = "LOG.mcap")]
    log: Option<PathBuf>,
    /// Replace a log that exists
    #[arg(long)]
    force: bool,
    /// Read the configuration, print the cycle, and end
    #[arg(long)]
    check: bool,
    /// Print one JSON object a second, of one line each, instead of the view
    #[arg(long)]
    json: bool,
    /// End the mission of this vehicle, or of `all`: the next downlink slots carry the authenticated abort
    #[arg(long, value_name = "VEHICLE", conflicts_with = "check")]
    abort: Option<String>,
    /// Do not ask before the abort
    #[arg(long, requires = "abort")]
    yes: bool,
    /// End after this time
    #[arg(long = "for", value_name = "SECONDS")]
    seconds: Option<f64>,
}

/// A session under way.
struct Session {
    topside: Topside,
    model: Model,
    vehicles: Vec<Vehicle>,
    gnss: SerialLine,
    modem: SerialLine,
    log: Option<Writer>,
    course: Course,
    next_step_us: u64,
    next_second_us: u64,
    events: Vec<serde_json::Value>,
}

/// Sends and hears until q, Ctrl-C or the time is over.
///
/// # Errors
/// A configuration that cannot be used, a port that is not there, a log that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let read = config::read(&args.config)?;
    let limit =
        args.seconds.map(|s| Duration::try_from_secs_f64(s).with_context(|| format!("--for {s}"))).transpose()?;
    let mut topside = Topside::new(read.config.clone()).with_context(|| args.config.display().to_string())?;
    if args.check {
        return check(&topside, &read.vehicles, args.json);
    }
    needs_terminal(args.json)?;
    if let Some(vehicle) = &args.abort {
        abort::order(&mut topside, &read.vehicles, vehicle, args.yes)?;
    }
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    let log = args.log.as_deref().map(|path| (path, existing));
    let mut session = Session::new(topside, read, log, Course::stoppable(limit)?)?;
    let outcome = if args.json { print(&mut session) } else { ratatui::run(|terminal| show(terminal, &mut session)) };
    let closed = session.log.map_or(Ok(()), Writer::finish);
    outcome.and(closed.map_err(Into::into))
}

/// What the configuration means.
fn check(topside: &Topside, vehicles: &[Vehicle], as_json: bool) -> anyhow::Result<()> {
    let config = topside.config();
    let table = &config.slots;
    if as_json {
        return console::print(format!("{}\n", json::object(topside, 0, &[])).as_bytes());
    }
    let mut lines = vec![format!(
        "ship: modem address {}, downlinks to {}, rate {}",
        config.address, config.destination, config.rate
    )];
    lines.extend(vehicles.iter().map(|vehicle| format!("vehicle {}: modem address {}", vehicle.name, vehicle.address)));
    lines.push(format!("cycle of {} s, its starts at whole multiples of UTC seconds since 1970", table.period_s()));
    lines.extend(table.slots().iter().map(|slot| {
        let whom = slot.exchange.vehicle().map_or("all".to_owned(), |vehicle| vehicle.to_string());
        format!("  {:>4} s  {:<12} {whom}", slot.offset_s, slot.exchange.name())
    }));
    let key = if config.key.is_set() { "authenticated" } else { "not authenticated: no key" };
    lines.push(format!("packets are {key}"));
    console::print(lines.iter().map(|line| format!("{line}\n")).collect::<String>().as_bytes())
}

/// What came of bytes and a step.
struct Acted {
    /// Bytes sent to the modem.
    sent: usize,
    /// The JSON object of a second that is complete.
    second: Option<serde_json::Value>,
}

impl Session {
    /// Opens the ports, and the log if there is to be one.
    fn new(
        topside: Topside,
        read: config::Read,
        log: Option<(&Path, Existing)>,
        course: Course,
    ) -> anyhow::Result<Self> {
        let gnss = SerialLine::open(GNSS, &read.ports.gnss, 4800)?;
        let modem = SerialLine::open(MODEM, &read.ports.modem, 19_200)?;
        let log = log.map(|(path, existing)| {
            let meta = Meta::new(concat!("backseat topside ", env!("CARGO_PKG_VERSION")), Clock::Host)
                .with("device gnss", gnss.name.path())
                .with("device modem", modem.name.path());
            let mut log = Writer::create(path, &meta, existing)?;
            log.attach(&Attachment {
                name: "topside.toml".to_owned(),
                media_type: "application/toml".to_owned(),
                bytes: read.text.into_bytes(),
            })?;
            anyhow::Ok(log)
        });
        Ok(Self {
            model: Model::new(&topside),
            topside,
            vehicles: read.vehicles,
            gnss,
            modem,
            log: log.transpose()?,
            course,
            next_step_us: 0,
            next_second_us: 0,
            events: Vec::new(),
        })
    }

    /// Time in the log: UTC where it is known, else since the start.
    fn log_us(&self, time_us: u64) -> u64 {
        self.topside.utc_us(time_us).unwrap_or(time_us)
    }

    /// Hears, steps, sends by its own clock; the JSON object of a second that is complete.
    fn poll(&mut self) -> anyhow::Result<Option<serde_json::Value>> {
        for port in Port::ALL {
            let line = if port == Port::Gnss { &mut self.gnss } else { &mut self.modem };
            let polled = line.poll();
            let now_us = self.course.now_us();
            match polled {
                Ok(bytes) if bytes.is_empty() => {}
                Ok(bytes) => self.hear(port, now_us, &bytes)?,
                Err(why) => self.model.note(&self.topside, now_us, true, why),
            }
        }
        let lost = [(&self.gnss, GNSS), (&self.modem, MODEM)];
        self.model
            .set_lost(lost.iter().filter(|(line, _)| !line.is_open()).map(|(_, name)| (*name).to_owned()).collect());
        Ok(self.act(self.course.now_us())?.second)
    }

    /// Bytes have come, the last of them at `time_us`.
    fn hear(&mut self, port: Port, time_us: u64, bytes: &[u8]) -> anyhow::Result<()> {
        self.topside.receive(port, time_us, bytes);
        let log_us = self.log_us(time_us);
        if let Some(log) = &mut self.log {
            log.write_line(if port == Port::Gnss { GNSS } else { MODEM }, false, log_us, bytes)?;
        }
        Ok(())
    }

    /// Steps if that is due, and sends.
    fn act(&mut self, now_us: u64) -> anyhow::Result<Acted> {
        if now_us >= self.next_step_us {
            self.next_step_us = now_us - now_us % STEP_US + STEP_US;
            self.topside.step(now_us);
        }
        let sent = self.send(now_us)?;
        let events = self.model.take(&mut self.topside, now_us);
        self.events.extend(events);
        if now_us < self.next_second_us {
            return Ok(Acted { sent, second: None });
        }
        self.next_second_us = now_us + SECOND_US;
        let object = json::object(&self.topside, now_us, &self.events);
        self.events.clear();
        let log_us = self.log_us(now_us);
        if let Some(log) = &mut self.log {
            log.write_json("topside", log_us, &object)?;
            log.flush()?;
        }
        Ok(Acted { sent, second: Some(object) })
    }

    fn press(&mut self, prompt: &mut Prompt, key: char) {
        if let Some(text) = prompt.key(key, &mut self.topside, &self.vehicles) {
            let now_us = self.course.now_us();
            self.model.note(&self.topside, now_us, true, text);
        }
    }

    /// Hands the modem what waits for it; how many bytes.
    fn send(&mut self, now_us: u64) -> anyhow::Result<usize> {
        let mut bytes = Vec::new();
        while !self.topside.transmit(Port::Modem).is_empty() {
            bytes.extend_from_slice(self.topside.transmit(Port::Modem));
            let count = self.topside.transmit(Port::Modem).len();
            self.topside.transmitted(Port::Modem, count);
        }
        if bytes.is_empty() {
            return Ok(0);
        }
        if let Err(why) = self.modem.send(&bytes) {
            self.model.note(&self.topside, now_us, true, why);
        }
        let log_us = self.log_us(now_us);
        if let Some(log) = &mut self.log {
            log.write_line(MODEM, true, log_us, &bytes)?;
        }
        Ok(bytes.len())
    }
}

fn print(session: &mut Session) -> anyhow::Result<()> {
    while !session.course.is_over() {
        std::thread::sleep(POLL);
        let Some(object) = session.poll()? else { continue };
        if !print_line(&object)? {
            return Ok(());
        }
    }
    Ok(())
}

fn show(terminal: &mut DefaultTerminal, session: &mut Session) -> anyhow::Result<()> {
    let mut drawn: Option<Instant> = None;
    let mut prompt = Prompt::default();
    while !session.course.is_over() {
        session.poll()?;
        if event::poll(POLL)?
            && let Event::Key(key) = event::read()?
        {
            let control = key.modifiers.contains(KeyModifiers::CONTROL);
            match key.code {
                KeyCode::Char('c') if control => return Ok(()),
                KeyCode::Char('q') | KeyCode::Esc if prompt == Prompt::Closed => return Ok(()),
                KeyCode::Char(key) => session.press(&mut prompt, key),
                _ => prompt = Prompt::Closed,
            }
        }
        if drawn.is_none_or(|drawn| drawn.elapsed() >= DRAW) {
            let now_us = session.course.now_us();
            let Session { topside, model, vehicles, .. } = session;
            terminal.draw(|frame| view::draw(frame, topside, model, vehicles, prompt, now_us))?;
            drawn = Some(Instant::now());
        }
    }
    Ok(())
}
