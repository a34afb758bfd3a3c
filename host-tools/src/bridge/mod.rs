//! `backseat bridge`: a board live, for the programs that a laboratory runs.

mod foxglove;
mod imc;
mod moos;

use crate::decode::{Decoding, Found, What};
use crate::foxglove::Topics;
use crate::monitor::{Link, Model, News};
use anyhow::{Context, ensure};
use backseat_app::LocalFrame;
use backseat_link::board::PortName;
use backseat_logs::session::{Entry, Event};
use backseat_report::console;
use backseat_wire::hostlink::{Mode, Port, Telemetry};
use serde_json::{Map, Value, json};
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime};

const EXAMPLES: &str = "\
Examples:
  backseat bridge /dev/ttyACM0 --foxglove 127.0.0.1:8765
  backseat bridge /dev/ttyACM0 --imc 224.0.75.69:30100 --name backseat
  backseat bridge /dev/ttyACM0 --moos 127.0.0.1:9000 --for 600

PORT is the board's host port, or the one that `backseat sim run --realtime` names. The bridge asks the board for its
parameters and changes nothing; it may come, go and die at any time. Other commands reach the board through the port that
it prints first.

Foxglove: Open connection, Foxglove WebSocket, ws://127.0.0.1:8765; the layout is that of `backseat export --foxglove`.
IMC: Announce, Heartbeat and EstimatedState over UDP, which Neptus draws. MOOS: NAV_X (east), NAV_Y (north), NAV_LAT,
NAV_LONG, NAV_DEPTH, NAV_SPEED, NAV_HEADING, NAV_PITCH, NAV_ROLL in a MOOSDB, in MOOS' units (m, degrees of heading, rad of
pitch and roll). Times are the board's UTC; this computer's before the board knows it.";

/// How often the port is looked at.
const POLL: Duration = Duration::from_millis(5);

/// Publish a board's state live: Foxglove, IMC (Neptus), MOOS
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Serial device of the board's host port, PATH or PATH:BAUD
    port: PortName,
    /// Serve Foxglove's WebSocket here
    #[arg(long, value_name = "IP:PORT")]
    foxglove: Option<SocketAddr>,
    /// Send IMC over UDP there; 224.0.75.69:30100 reaches every Neptus of the network
    #[arg(long, value_name = "IP:PORT")]
    imc: Option<SocketAddr>,
    /// Connect to this MOOSDB
    #[arg(long, value_name = "IP:PORT")]
    moos: Option<SocketAddr>,
    /// The vehicle's name, for IMC and MOOS
    #[arg(long, default_value = "backseat")]
    name: String,
    /// The vehicle's number in IMC
    #[arg(long, default_value_t = 0x2001, value_name = "ID")]
    imc_id: u16,
    /// End after this time
    #[arg(long = "for", value_name = "SECONDS", value_parser = crate::monitor::seconds)]
    time: Option<Duration>,
    /// Print the counts at the end as JSON
    #[arg(long)]
    json: bool,
}

/// What one side has got, and what it has not because it did not keep up.
#[derive(Default)]
pub struct Counts {
    sent: AtomicU64,
    dropped: AtomicU64,
}

impl Counts {
    /// One message was sent, or was not.
    pub fn note(&self, sent: bool) {
        let count = if sent { &self.sent } else { &self.dropped };
        count.fetch_add(1, Ordering::Relaxed);
    }

    fn read(&self) -> [u64; 2] {
        [&self.sent, &self.dropped].map(|count| count.load(Ordering::Relaxed))
    }
}

/// A telemetry record with what it means elsewhere.
pub struct Place<'a> {
    /// The record.
    pub telemetry: &'a Telemetry,
    /// UTC, s since 1970.
    pub utc_s: f64,
    /// Latitude and longitude, degrees.
    pub position_deg: [f64; 2],
    /// The origin of x and y, degrees.
    pub origin_deg: [f64; 2],
}

/// The sides that were asked for.
struct Sides {
    foxglove: Option<Topics<foxglove::Server>>,
    imc: Option<imc::Sender>,
    moos: Option<moos::Client>,
}

impl Sides {
    fn open(args: &Args) -> anyhow::Result<Self> {
        let Args { foxglove, imc, moos, name, imc_id, .. } = args;
        ensure!(foxglove.or(*imc).or(*moos).is_some(), "where to? Give --foxglove, --imc or --moos");
        let foxglove = foxglove.map(foxglove::Server::open).transpose()?;
        if let Some(server) = &foxglove {
            eprintln!("bridge: Foxglove at ws://{}", server.at);
        }
        Ok(Self {
            foxglove: foxglove.map(|server| Topics::new(server, 0)),
            imc: imc.map(|to| imc::Sender::open(to, name, *imc_id)).transpose()?,
            moos: moos.map(|to| moos::Client::open(to, name)),
        })
    }

    fn take(&mut self, found: &Found<'_>, frame: LocalFrame, utc_us: u64) -> anyhow::Result<()> {
        if let Some(topics) = &mut self.foxglove {
            let offset_us = i64::try_from(utc_us).unwrap_or(0) - i64::try_from(found.time_us).unwrap_or(0);
            topics.zero_ns = offset_us.saturating_mul(1000);
            topics.take(found, frame)?;
        }
        let What::Telemetry(telemetry) = found.what else { return Ok(()) };
        if telemetry.mode == Mode::Initialising {
            return Ok(());
        }
        let degrees = |(latitude, longitude): (f64, f64)| [latitude, longitude];
        let place = Place {
            telemetry,
            utc_s: utc_us as f64 * 1e-6,
            position_deg: degrees(frame.to_geodetic([telemetry.state[0], telemetry.state[1]])),
            origin_deg: degrees(frame.to_geodetic([0.0, 0.0])),
        };
        if let Some(imc) = &mut self.imc {
            imc.send(&place);
        }
        if let Some(moos) = &mut self.moos {
            moos.send(&place);
        }
        Ok(())
    }

    /// Name, and counts.
    fn counts(&self) -> Vec<(&'static str, [u64; 2])> {
        let foxglove = self.foxglove.as_ref().map(|topics| ("foxglove", topics.sink.counts.read()));
        let imc = self.imc.as_ref().map(|imc| ("imc", imc.counts.read()));
        let moos = self.moos.as_ref().map(|moos| ("moos", moos.counts.read()));
        [foxglove, imc, moos].into_iter().flatten().collect()
    }
}

/// UTC of a record, µs: the board's where it knows it, else this computer's.
fn utc_us(found: &Found<'_>) -> u64 {
    match found.what {
        What::Telemetry(telemetry) if telemetry.utc_us > 0 => telemetry.utc_us,
        _ => {
            let now = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default();
            u64::try_from(now.as_micros()).unwrap_or(0)
        }
    }
}

/// Bridges until Ctrl-C or the time is over.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut link = Link::open(&args.port)?;
    let mut sides = Sides::open(args)?;
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("signal handler")?;
    eprintln!("bridge: other commands: {}", link.shared());
    let begun = Instant::now();
    let mut model = Model::new();
    let mut decoding = Decoding::new(None);
    let mut records = 0_u64;
    while !stop.load(Ordering::Relaxed) && args.time.is_none_or(|time| begun.elapsed() < time) {
        let now_us = u64::try_from(begun.elapsed().as_micros()).unwrap_or(u64::MAX);
        let mut bytes = Vec::new();
        let heard = link.poll(now_us, &mut bytes);
        model.receive(now_us, &bytes);
        let asked = model.question(now_us).and_then(|question| link.send(now_us, &question));
        for news in [heard, asked].into_iter().flatten() {
            match news {
                News::Lost(why) => eprintln!("bridge: port lost: {why}"),
                News::Found => {
                    eprintln!("bridge: port back");
                    decoding = Decoding::new(None);
                    model.found(now_us);
                }
            }
        }
        let frame = model.settings().map_or_else(|| decoding.frame(), |settings| crate::decode::frame(&settings.app));
        let mut outcome = Ok(());
        let entry = Entry { time_us: model.board_us(now_us), event: Event::Sent { port: Port::Host, bytes } };
        decoding.take(&entry, &mut |found| {
            records += u64::from(matches!(found.what, What::Telemetry(_)));
            if outcome.is_ok() {
                outcome = sides.take(&found, frame, utc_us(&found));
            }
        });
        outcome?;
        std::thread::sleep(POLL);
    }
    say(args, records, &sides)
}

fn say(args: &Args, records: u64, sides: &Sides) -> anyhow::Result<()> {
    let counts = sides.counts();
    if args.json {
        let side =
            |(name, [sent, dropped]): (&str, [u64; 2])| (name.to_owned(), json!({"sent": sent, "dropped": dropped}));
        let sides: Map<String, Value> = counts.into_iter().map(side).collect();
        return console::print(format!("{}\n", json!({"telemetry_records": records, "sides": sides})).as_bytes());
    }
    let mut text = format!("{records} telemetry records\n");
    for (name, [sent, dropped]) in counts {
        text += &format!("{name}: {sent} messages sent, {dropped} dropped\n");
    }
    console::print(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_wire::hostlink::ModeReason;

    /// At 10 m north and 20 m east, 5 m deep, heading east at 1.2 m/s in a current to the north.
    pub fn telemetry() -> Telemetry {
        Telemetry {
            time_us: 1_000_000,
            utc_us: 0,
            mode: Mode::Navigating,
            reason: ModeReason::Nominal,
            state: [10.0, 20.0, 5.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2, 1.2, 0.0, 0.0, 0.0, 0.0, 0.0],
            sigma: [1.0; 12],
            cov_xy_m2: 0.0,
            current_mps: [0.1, 0.0],
            propeller_radps: 100.0,
            fins_rad: [0.0; 4],
            leg: None,
            rejected_frames: [0; 4],
            level_m: [0.0; 2],
        }
    }

    #[test]
    fn a_bridge_to_nowhere_says_what_is_missing() {
        let args = <Parsed as clap::Parser>::try_parse_from(["bridge", "/dev/null"]).unwrap().args;
        let Err(error) = Sides::open(&args) else { panic!("nobody was named") };
        assert!(error.to_string().contains("--foxglove"), "{error}");
    }

    #[derive(clap::Parser)]
    struct Parsed {
        #[command(flatten)]
        args: Args,
    }
}
