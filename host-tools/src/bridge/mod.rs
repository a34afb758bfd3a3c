//! `backseat bridge`: a board live, or a session of one, for the programs that a laboratory runs.

mod commands;
mod counts;
mod foxglove;
mod helm;
mod imc;
mod moos;
mod pace;
#[cfg(not(feature = "ros2"))]
#[path = "no_ros2.rs"]
mod ros2;
#[cfg(feature = "ros2")]
mod ros2;

use crate::board::KeySource;
use crate::decode::{self, Decoding, EventKind, Found, What};
use crate::export::decode_log;
use crate::foxglove::Topics;
use crate::live::Course;
use crate::monitor::{Link, Model, News};
use anyhow::{anyhow, ensure};
use backseat_app::LocalFrame;
use backseat_app::parameters::Settings;
use backseat_link::board::PortName;
use backseat_logs::session::{Entry, Event};
use backseat_report::console;
use backseat_wire::hostlink::{Mode, Port, Telemetry};
use commands::Commands;
use counts::Counts;
use pace::{Pace, Rate};
use serde_json::{Map, Value, json};
use std::fmt;
use std::net::{IpAddr, SocketAddr};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant, SystemTime};

const EXAMPLES: &str = "\
Examples:
  backseat bridge /dev/ttyACM0 --foxglove 127.0.0.1:8765
  backseat bridge /dev/ttyACM0 --imc 224.0.75.69:30100 --name backseat
  backseat bridge /dev/ttyACM0 --ros2 0 --name auv
  backseat bridge /dev/ttyACM0 --moos 127.0.0.1:9000 --rate 1 --for 600
  backseat bridge /dev/ttyACM0 --moos 127.0.0.1:9000 --accept --key board.key
  backseat bridge out/survey-1/session.mcap --ros2 0

PORT is the board's host port, or the one that `backseat sim run --realtime` names. The bridge asks the board for its
parameters and, without --accept, changes nothing; it may come, go and die at any time. Other commands reach the board
through the port that it prints first, `backseat monitor` through the second. A session, or the log of a board's memory
card, in its place is published as fast as it was recorded, with the UTC of then.

Foxglove: Open connection, Foxglove WebSocket, ws://127.0.0.1:8765; the layout is that of `backseat export --foxglove`.
IMC: Announce, Heartbeat and EstimatedState over UDP, which Neptus draws. MOOS: NAV_X (east), NAV_Y (north), NAV_LAT,
NAV_LONG, NAV_DEPTH, NAV_SPEED, NAV_HEADING, NAV_PITCH, NAV_ROLL in a MOOSDB, in MOOS' units (m, degrees of heading, rad of
pitch and roll). ROS 2: /NAME/odom, /NAME/water_velocity, /NAME/pressure, /diagnostics, /tf; needs a release's archive
or a build with `--features ros2`. Times are the board's UTC; this computer's before the board knows it.

With --accept whoever reaches the MOOSDB or the ROS 2 domain commands the board: the string BACKSEAT_MISSION, or
/NAME/mission (std_msgs/String), is `start`, `stop` or the text of a mission file. BACKSEAT_ANSWER and /NAME/answer say
what became of it. DESIRED_HEADING (degrees), DESIRED_DEPTH (m) and DESIRED_SPEED (m/s) steer a vehicle under way instead
of its leg, if app.helm of the board permits it; a speed of 0 of a helm that steers ends the mission.";

/// How often the port is looked at.
const POLL: Duration = Duration::from_millis(5);

/// Publish a board's state live: Foxglove, ROS 2, MOOS, IMC (Neptus)
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    /// Serial device of the board's host port, PATH or PATH:BAUD; or a session (.mcap), or a board's log (.BSL)
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
    /// Join this domain of ROS 2, on every network or on the one of this address
    #[arg(long, value_name = "DOMAIN[@IP]")]
    ros2: Option<Domain>,
    /// Take missions, starts and stops from MOOS and ROS 2, and from MOOS what its helm wants
    #[arg(long)]
    accept: bool,
    /// With --accept: file with the board's key, if it has one; `-`: asked for
    #[arg(long, value_name = "FILE", requires = "accept")]
    key: Option<PathBuf>,
    /// The vehicle's name, for ROS 2, IMC and MOOS
    #[arg(long, default_value = "backseat")]
    name: String,
    /// The vehicle's number in IMC
    #[arg(long, default_value_t = 0x2001, value_name = "ID")]
    imc_id: u16,
    /// Publish at most so many of the board's 10 telemetry records a second, and each change of mode
    #[arg(long, value_name = "HZ")]
    rate: Option<Rate>,
    /// End after this time
    #[arg(long = "for", value_name = "SECONDS", value_parser = crate::live::seconds)]
    time: Option<Duration>,
    /// Print the counts at the end as JSON
    #[arg(long)]
    json: bool,
}

/// A domain of ROS 2, and the address of the one network where it is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Domain {
    id: u16,
    address: Option<IpAddr>,
}

impl FromStr for Domain {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (id, address) = text.split_once('@').map_or((text, None), |(id, address)| (id, Some(address)));
        // above 232 the ports of RTPS end
        let id = id.parse().ok().filter(|id| *id <= 232).ok_or("expected the number of a domain, 0 to 232")?;
        let address = address.map(str::parse).transpose().map_err(|_| "expected an address behind the @")?;
        Ok(Self { id, address })
    }
}

impl fmt::Display for Domain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.id)?;
        self.address.map_or(Ok(()), |address| write!(f, "@{address}"))
    }
}

/// A telemetry record with what it means elsewhere.
pub struct Place<'a> {
    /// The record.
    pub telemetry: &'a Telemetry,
    /// UTC since 1970, µs.
    pub utc_us: u64,
    /// When its bytes were read.
    pub arrived: Instant,
    /// Density of the water, as the board takes it.
    #[cfg_attr(not(feature = "ros2"), expect(dead_code, reason = "for a pressure of ROS 2"))]
    pub density_kg_per_m3: f64,
    /// Latitude and longitude, degrees.
    pub position_deg: [f64; 2],
    /// The origin of x and y, degrees.
    pub origin_deg: [f64; 2],
}

impl Place<'_> {
    /// UTC since 1970, s.
    fn utc_s(&self) -> f64 {
        self.utc_us as f64 * 1e-6
    }
}

/// What of the board's settings the sides need.
#[derive(Clone, Copy)]
struct Setting {
    frame: LocalFrame,
    density_kg_per_m3: f64,
}

impl From<&Settings> for Setting {
    fn from(settings: &Settings) -> Self {
        Self { frame: decode::frame(&settings.app), density_kg_per_m3: settings.vehicle.rho_kg_per_m3 }
    }
}

/// The sides that were asked for.
struct Sides {
    foxglove: Option<Topics<foxglove::Server>>,
    imc: Option<imc::Sender>,
    moos: Option<moos::Client>,
    ros2: Option<ros2::Node>,
    commands: Option<(Commands, Receiver<String>)>,
    pace: Pace,
}

impl Sides {
    /// The shared port is where commands reach the board.
    fn open(args: &Args, shared: &str) -> anyhow::Result<Self> {
        let Args { foxglove, imc, moos, ros2, name, imc_id, accept, .. } = args;
        ensure!(
            foxglove.or(*imc).or(*moos).is_some() || ros2.is_some(),
            "where to? Give --foxglove, --ros2, --moos or --imc"
        );
        ensure!(!accept || moos.is_some() || ros2.is_some(), "--accept: missions come by --moos or --ros2");
        let commands = if *accept {
            let key = KeySource::of(args.key.as_deref()).read("the board's key")?;
            Some(Commands::open(shared.parse::<PortName>().map_err(|why| anyhow!(why))?, key))
        } else {
            None
        };
        let foxglove = foxglove.map(foxglove::Server::open).transpose()?;
        if let Some(server) = &foxglove {
            eprintln!("bridge: Foxglove at ws://{}", server.at);
        }
        Ok(Self {
            foxglove: foxglove.map(|server| Topics::new(server, 0)),
            imc: imc.map(|to| imc::Sender::open(to, name, *imc_id)).transpose()?,
            moos: moos.map(|to| moos::Client::open(to, name, commands.as_ref().map(|(commands, _)| commands.clone()))),
            ros2: ros2.map(|domain| ros2::Node::open(domain, name, *accept)).transpose()?,
            commands,
            pace: Pace::new(args.rate),
        })
    }

    fn take(&mut self, found: &Found<'_>, setting: Setting, utc_us: u64, arrived: Instant) -> anyhow::Result<()> {
        let Setting { frame, density_kg_per_m3 } = setting;
        if let What::Telemetry(telemetry) = found.what
            && !self.pace.lets(telemetry)
        {
            return Ok(());
        }
        if let Some(topics) = &mut self.foxglove {
            let offset_us = i64::try_from(utc_us).unwrap_or(0) - i64::try_from(found.time_us).unwrap_or(0);
            topics.zero_ns = offset_us.saturating_mul(1000);
            topics.sink.arrived = arrived;
            topics.take(found, frame)?;
        }
        if let (Some(node), What::Event(EventKind::Naming, statement)) = (&mut self.ros2, &found.what) {
            node.name_causes(statement);
        }
        if let (Some(_), What::Event(EventKind::Helm, steered)) = (&self.commands, &found.what) {
            self.answer(steered, utc_us as f64 * 1e-6);
        }
        let What::Telemetry(telemetry) = found.what else { return Ok(()) };
        if let Some(node) = &mut self.ros2 {
            node.diagnose(telemetry, utc_us, arrived);
        }
        if telemetry.mode == Mode::Initialising {
            return Ok(());
        }
        let degrees = |(latitude, longitude): (f64, f64)| [latitude, longitude];
        let place = Place {
            telemetry,
            utc_us,
            arrived,
            density_kg_per_m3,
            position_deg: degrees(frame.to_geodetic([telemetry.state[0], telemetry.state[1]])),
            origin_deg: degrees(frame.to_geodetic([0.0, 0.0])),
        };
        if let Some(imc) = &mut self.imc {
            imc.send(&place);
        }
        if let Some(moos) = &mut self.moos {
            moos.send(&place);
        }
        if let Some(node) = &self.ros2 {
            node.send(&place);
        }
        Ok(())
    }

    /// Hears what is asked of the board, and says what became of it.
    fn attend(&mut self, utc_s: f64) {
        let Some((commands, answers)) = &self.commands else { return };
        if let Some(node) = &mut self.ros2 {
            node.attend(commands);
        }
        answers.try_iter().for_each(|answer| self.answer(&answer, utc_s));
    }

    /// Says it to those who may ask.
    fn answer(&self, text: &str, utc_s: f64) {
        if let Some(moos) = &self.moos {
            moos.answer(text, utc_s);
        }
        if let Some(node) = &self.ros2 {
            node.answer(text.to_owned());
        }
    }

    /// Names, and counts.
    fn counts(&self) -> Vec<(&'static str, &Counts)> {
        let foxglove = self.foxglove.as_ref().map(|topics| ("foxglove", &*topics.sink.counts));
        let imc = self.imc.as_ref().map(|imc| ("imc", &imc.counts));
        let moos = self.moos.as_ref().map(|moos| ("moos", &*moos.counts));
        let ros2 = self.ros2.as_ref().map(|node| ("ros2", node.counts()));
        [foxglove, imc, moos, ros2].into_iter().flatten().collect()
    }
}

/// UTC of a record, µs: the board's where it knows it, else this computer's.
fn utc_us(found: &Found<'_>) -> u64 {
    match found.what {
        What::Telemetry(telemetry) if telemetry.utc_us > 0 => telemetry.utc_us,
        _ => u64::try_from(now().as_micros()).unwrap_or(0),
    }
}

/// This computer's time since 1970.
fn now() -> Duration {
    SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default()
}

/// How far the bridge has come.
struct Bridging {
    course: Course,
    records: u64,
}

impl Bridging {
    /// Hands what an entry says to all sides.
    fn pass(
        &mut self,
        decoding: &mut Decoding,
        entry: &Entry,
        setting: Setting,
        arrived: Instant,
        sides: &mut Sides,
    ) -> anyhow::Result<()> {
        let mut outcome = Ok(());
        decoding.take(entry, &mut |found| {
            self.records += u64::from(matches!(found.what, What::Telemetry(_)));
            if outcome.is_ok() {
                outcome = sides.take(&found, setting, utc_us(&found), arrived);
            }
        });
        outcome
    }
}

/// Bridges until Ctrl-C, the time or the session is over.
pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut bridging = Bridging { course: Course::stoppable(args.time)?, records: 0 };
    if args.ros2.is_some() {
        ros2::limit_memory()?;
    }
    let session = Path::new(args.port.path());
    let sides = if session.is_file() { play(args, session, &mut bridging)? } else { live(args, &mut bridging)? };
    say(args, bridging.records, &sides)
}

/// What a board says.
fn live(args: &Args, bridging: &mut Bridging) -> anyhow::Result<Sides> {
    let mut link = Link::open(&args.port)?;
    let mut sides = Sides::open(args, link.shared())?;
    eprintln!("bridge: other commands: {}", link.shared());
    eprintln!("bridge: to watch it: backseat monitor {}", link.watch()?);
    let mut model = Model::new();
    let mut decoding = Decoding::new(None);
    while !bridging.course.is_over() {
        let now_us = bridging.course.now_us();
        let mut bytes = Vec::new();
        let heard = link.poll(now_us, &mut bytes);
        let arrived = Instant::now();
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
        let setting = model.settings().unwrap_or_else(|| decoding.settings()).into();
        let entry = Entry { time_us: model.board_us(now_us), event: Event::Sent { port: Port::Host, bytes } };
        bridging.pass(&mut decoding, &entry, setting, arrived, &mut sides)?;
        sides.attend(now().as_secs_f64());
        std::thread::sleep(POLL);
    }
    Ok(sides)
}

/// What a session holds, as fast as it was recorded.
fn play(args: &Args, session: &Path, bridging: &mut Bridging) -> anyhow::Result<Sides> {
    ensure!(!args.accept, "--accept: {}: a session takes no missions", session.display());
    let mut sides = Sides::open(args, "")?;
    bridging.course.restart();
    let mut first_us = None;
    decode_log(session, "bridge", |entry, decoding| {
        let due = Duration::from_micros(entry.time_us.saturating_sub(*first_us.get_or_insert(entry.time_us)));
        let course = &bridging.course;
        while !course.is_over() && course.elapsed() < due {
            std::thread::sleep(POLL.min(due.saturating_sub(course.elapsed())));
        }
        if course.is_over() {
            return Ok(()); // what is left is read and not published
        }
        let setting = decoding.settings().into();
        bridging.pass(decoding, entry, setting, Instant::now(), &mut sides)
    })?;
    Ok(sides)
}

fn say(args: &Args, records: u64, sides: &Sides) -> anyhow::Result<()> {
    let counts = sides.counts();
    if args.json {
        let sides: Map<String, Value> =
            counts.into_iter().map(|(name, counts)| (name.to_owned(), counts.json())).collect();
        return console::print(format!("{}\n", json!({"telemetry_records": records, "sides": sides})).as_bytes());
    }
    let sides: String = counts.into_iter().map(|(name, counts)| format!("{name}: {counts}\n")).collect();
    console::print(format!("{records} telemetry records\n{sides}").as_bytes())
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

    pub fn place(telemetry: &Telemetry) -> Place<'_> {
        Place {
            telemetry,
            utc_us: 1_500_000,
            arrived: Instant::now(),
            density_kg_per_m3: 1025.0,
            position_deg: [41.0, 2.0],
            origin_deg: [45.0, 90.0],
        }
    }

    #[test]
    fn a_domain_is_a_number_and_perhaps_an_address() {
        assert_eq!("7".parse(), Ok(Domain { id: 7, address: None }));
        assert_eq!("0@127.0.0.1".parse(), Ok(Domain { id: 0, address: Some(IpAddr::from([127, 0, 0, 1])) }));
        for wrong in ["", "233", "-1", "0@", "0@lo"] {
            assert!(wrong.parse::<Domain>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_bridge_to_nowhere_says_what_is_missing() {
        let args = <Parsed as clap::Parser>::try_parse_from(["bridge", "/dev/null"]).unwrap().args;
        let Err(error) = Sides::open(&args, "/dev/null") else { panic!("nobody was named") };
        assert!(error.to_string().contains("--foxglove"), "{error}");
    }

    #[derive(clap::Parser)]
    struct Parsed {
        #[command(flatten)]
        args: Args,
    }
}
