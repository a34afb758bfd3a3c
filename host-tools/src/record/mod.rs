//! `backseat record`: several serial lines at once, into a session log.

mod inquiry;
mod line;

use crate::live::Course;
use anyhow::{Context, bail};
use backseat_logs::DataError;
use backseat_logs::output::Existing;
use backseat_logs::session::{Clock, Entry, Event, Meta, Writer};
use backseat_report::console;
use backseat_wire::hostlink::Port;
use indicatif::{ProgressBar, ProgressStyle};
use inquiry::Inquiry;
pub use line::NamedDevice;
use line::{LineEvent, LineReport};
use serde_json::{Map, Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

/// The file is flushed and the figures on the screen are renewed this often.
const INTERVAL: Duration = Duration::from_secs(1);
/// Longest wait for the next bytes.
const TICK: Duration = Duration::from_millis(50);

const EXAMPLES: &str = "\
Examples:
  backseat record host=/dev/ttyACM0 -o dive.mcap
  backseat record frontseat=/dev/ttyUSB0 dvl=/dev/ttyUSB1:9600 ahrs=/dev/ttyUSB2 modem=/dev/ttyUSB3 -o dive.mcap --for 3600

The names are those of the board's ports: frontseat, dvl, ahrs, modem and host. On the host port this program talks to the
board: it asks for the parameters and decodes telemetry into the log. On the other ports it listens beside the board to
what the device sends. If a device is unplugged, it waits for it. Ctrl-C ends the recording. At any moment the file is
complete up to the last second: read it with backseat replay, backseat export, or any MCAP tool.";

/// Record serial ports into a session log (MCAP)
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// What to record: NAME=PATH or NAME=PATH:BAUD
    #[arg(value_name = "NAME=PATH", required = true)]
    ports: Vec<NamedDevice>,
    /// File to write
    #[arg(short, long, value_name = "LOG.mcap")]
    output: PathBuf,
    /// End after this time
    #[arg(long = "for", value_name = "SECONDS")]
    seconds: Option<f64>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    /// Print one JSON object at the end
    #[arg(long)]
    json: bool,
}

/// A recorded device and its counts.
struct RecordedLine {
    source: NamedDevice,
    open: bool,
    bytes: u64,
    /// Bytes when the rate was last shown, and the rate.
    shown: u64,
    rate: f64,
    interruptions: u32,
}

/// A recording under way.
struct Recording {
    writer: Writer,
    lines: Vec<RecordedLine>,
    inquiry: Option<Inquiry>,
    parameters: Option<usize>,
    began: Instant,
    /// Microseconds since 1970 when it began; from there on the monotonic clock counts.
    began_us: u64,
    bar: ProgressBar,
}

/// Why a recording ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Interrupted,
    Time,
}

/// Records until Ctrl-C or the time is over.
///
/// # Errors
/// A port that cannot be opened, a file that cannot be written.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let limit =
        args.seconds.map(|s| Duration::try_from_secs_f64(s).with_context(|| format!("--for {s}"))).transpose()?;
    for (index, source) in args.ports.iter().enumerate() {
        if args.ports[..index].iter().any(|other| other.port == source.port) {
            bail!("{}: this port is named twice", source.port.name());
        }
    }
    let course = Course::stoppable(limit)?;
    let devices: Vec<_> = args.ports.iter().map(NamedDevice::open).collect::<anyhow::Result<_>>()?;
    let mut meta = Meta::new(concat!("backseat ", env!("CARGO_PKG_VERSION")), Clock::Host);
    for source in &args.ports {
        meta = meta.with(&format!("device {}", source.port.name()), source.device.path());
    }
    let existing = if args.force { Existing::Replace } else { Existing::Keep };
    let writer = Writer::create(&args.output, &meta, existing)?;

    let (to, reports) = channel();
    let threads: Vec<JoinHandle<()>> = devices
        .into_iter()
        .enumerate()
        .map(|(line, device)| args.ports[line].clone().listen(line, device, to.clone(), Arc::clone(&course.stop)))
        .collect();
    let mut recording = Recording::new(writer, &args.ports);
    let outcome = recording.record(&reports, &course);
    course.stop.store(true, Ordering::Relaxed);
    threads.into_iter().for_each(|thread| {
        let _ = thread.join(); // a panic has been printed
    });
    // what came while the lines were being closed
    let outcome = outcome.and_then(|end| recording.take_all(&reports).map(|()| end));
    recording.finish(outcome, args)
}

impl Recording {
    fn new(writer: Writer, sources: &[NamedDevice]) -> Self {
        let line = |source: &NamedDevice| RecordedLine {
            source: source.clone(),
            open: false,
            bytes: 0,
            shown: 0,
            rate: 0.0,
            interruptions: 0,
        };
        let style = ProgressStyle::with_template("{spinner} {elapsed_precise} {msg}");
        Self {
            writer,
            lines: sources.iter().map(line).collect(),
            inquiry: None,
            parameters: None,
            began: Instant::now(),
            began_us: SystemTime::UNIX_EPOCH.elapsed().map_or(0, |since| since.as_micros() as u64),
            bar: ProgressBar::new_spinner().with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner())),
        }
    }

    fn time_us(&self, at: Instant) -> u64 {
        self.began_us + at.saturating_duration_since(self.began).as_micros() as u64
    }

    fn write(&mut self, at: Instant, event: Event) -> Result<(), DataError> {
        let time_us = self.time_us(at);
        self.writer.write(&Entry { time_us, event })
    }

    fn record(&mut self, reports: &Receiver<LineReport>, course: &Course) -> Result<End, DataError> {
        let mut shown = Instant::now();
        loop {
            if course.is_over() {
                return Ok(if course.is_stopped() { End::Interrupted } else { End::Time });
            }
            match reports.recv_timeout(TICK) {
                Ok(report) => self.take(report)?,
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
            }
            if let Some(frame) = self.inquiry.as_mut().and_then(Inquiry::ask) {
                self.write(Instant::now(), Event::Received { port: Port::Host, bytes: frame })?;
            }
            if shown.elapsed() >= INTERVAL {
                self.show(shown.elapsed().as_secs_f64());
                shown = Instant::now();
                self.writer.sync()?;
            }
        }
    }

    /// Takes everything that waits.
    fn take_all(&mut self, reports: &Receiver<LineReport>) -> Result<(), DataError> {
        reports.try_iter().try_for_each(|report| self.take(report))
    }

    fn take(&mut self, LineReport { line: index, at, event }: LineReport) -> Result<(), DataError> {
        let line = &mut self.lines[index];
        let (port, path) = (line.source.port, line.source.device.to_string());
        match event {
            LineEvent::Opened(device) => {
                let again = line.interruptions > 0;
                line.open = true;
                if port == Port::Host {
                    self.inquiry = Some(Inquiry::new(device));
                }
                if again { self.say(at, format!("{}: {path} is back", port.name())) } else { Ok(()) }
            }
            LineEvent::Lost(reason) => {
                (line.open, line.interruptions) = (false, line.interruptions + 1);
                if port == Port::Host {
                    self.inquiry = None;
                }
                self.say(at, format!("{}: {path} disconnected ({reason}); waiting for it", port.name()))
            }
            LineEvent::Bytes(bytes) => {
                line.bytes += bytes.len() as u64;
                if port != Port::Host {
                    return self.write(at, Event::Received { port, bytes });
                }
                let parameters = self.inquiry.as_mut().and_then(|inquiry| inquiry.hear(&bytes));
                self.write(at, Event::Sent { port, bytes })?;
                let Some(parameters) = parameters else { return Ok(()) };
                (self.inquiry, self.parameters) = (None, Some(parameters.len()));
                self.write(at, Event::Parameters(parameters))
            }
        }
    }

    /// On the screen and into the log.
    fn say(&mut self, at: Instant, note: String) -> Result<(), DataError> {
        self.bar.suspend(|| console::say(&note));
        self.write(at, Event::Note(note))
    }

    fn show(&mut self, seconds: f64) {
        let mut message = String::new();
        for line in &mut self.lines {
            line.rate = (line.bytes - line.shown) as f64 / seconds;
            line.shown = line.bytes;
            let rate = if line.open { format!("{:.1} kB/s", line.rate * 1e-3) } else { "gone".to_owned() };
            message += &format!("  {} {rate}", line.source.port.name());
        }
        self.bar.set_message(message);
        self.bar.tick();
    }

    /// Ends the file and prints a summary.
    fn finish(self, outcome: Result<End, DataError>, args: &Args) -> anyhow::Result<()> {
        let Self { writer, lines, parameters, began, bar, .. } = self;
        bar.finish_and_clear();
        let seconds = began.elapsed().as_secs_f64();
        let outcome = outcome.and_then(|end| writer.finish().map(|()| end));
        let end = outcome.with_context(|| {
            format!("recording ended early, after {seconds:.0} s; {} can be read up to there", args.output.display())
        })?;
        let bytes: u64 = lines.iter().map(|line| line.bytes).sum();
        if args.json {
            let port = |line: &RecordedLine| {
                let RecordedLine { source, open, bytes, interruptions, .. } = line;
                let json = json!({
                    "device": source.device.path(),
                    "bytes": bytes,
                    "mean_bytes_per_s": *bytes as f64 / seconds,
                    "interruptions": interruptions,
                    "open_at_end": open,
                });
                (source.port.name().to_owned(), json)
            };
            let summary = json!({
                "file": args.output,
                "seconds": seconds,
                "ended_by": if end == End::Time { "time" } else { "interrupt" },
                "bytes": bytes,
                "parameters": parameters,
                "ports": Value::Object(lines.iter().map(port).collect::<Map<_, _>>()),
            });
            return console::print(format!("{summary}\n").as_bytes());
        }
        let mut text = format!("{}  {seconds:.1} s, {bytes} bytes", args.output.display());
        for RecordedLine { source, bytes, interruptions, .. } in &lines {
            text += &format!("\n  {:<9} {bytes:>10} bytes", source.port.name());
            if *interruptions > 0 {
                text += &format!(", interrupted {interruptions} times");
            }
        }
        if lines.iter().any(|line| line.source.port == Port::Host) && parameters.is_none() {
            text += "\n  the board did not send its parameters: replay and export will assume the defaults";
        }
        console::print(format!("{text}\n").as_bytes())
    }
}
