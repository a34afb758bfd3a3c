//! `backseat sim run`: fly a scenario against a backseat and judge its navigation.

use crate::outcome::Outcome;
use crate::output::print;
use anyhow::{Context, bail};
use backseat_analysis::sim::{self, Options, TopsideKind};
use backseat_link::{Ports, Process, Serial, Tap};
use backseat_logs::VehicleFile;
use backseat_logs::output::{self, Existing};
use backseat_report::console;
use backseat_wire::hostlink::Port;
use hil_sim::backseat::{InProcess, Qemu, build_image};
use hil_sim::faults::Board;
use hil_sim::scenario::{Request, Scenario};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Command line.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:
  backseat sim run
  backseat sim run survey_current --seed 3
  backseat sim run --effect water_current:north_mps=0.15 --effect heading_bias:cos_rad=0.035
  backseat sim run --vehicle my_vehicle.toml --minutes 30
  backseat sim run my_scenario.toml --minutes 30 --out flight --json
  backseat sim run --realtime --monitor
  backseat sim run sea_trial                 uplinks, downlinks and pings, which topside ranges and tracks
  backseat sim run --topside off             the vehicle's modem plays the ship's part
  backseat sim run two_vehicles              a companion in slots of its own
  backseat sim run --realtime --wait         practise: mission put, start and stop by hand")]
pub struct Args {
    /// Scenario file, or a built-in one: survey (the default), survey_current, survey_pd, survey_oms, identification,
    /// sea_trial, two_vehicles.
    scenario: Option<PathBuf>,
    /// Vehicle file to simulate and to declare, instead of the scenario's; one that does not fly is refused.
    #[arg(long, value_name = "V.toml")]
    vehicle: Option<PathBuf>,
    /// Fly a vehicle that `backseat vehicle check` says does not fly.
    #[arg(long)]
    force: bool,
    /// Backseat to fly: `host`, a Linux process; `qemu`, the ARM image; or a board, by its five serial ports in
    /// the order frontseat,dvl,ahrs,modem,host.
    #[arg(long, value_name = "host|qemu|PORTS", default_value = "host")]
    backseat: String,
    /// ARM image for `--backseat qemu` [default: built from the sources].
    #[arg(long, value_name = "ELF")]
    image: Option<PathBuf>,
    /// Fly in real time instead of as fast as possible.
    #[arg(long)]
    realtime: bool,
    /// With --realtime: open two more serial ports, for `backseat monitor` and for other commands.
    #[arg(long, requires = "realtime")]
    monitor: bool,
    /// With --realtime: wait for `backseat mission start`, as the board on a vehicle does, and let a mission that is
    /// stopped be started again; opens the ports of --monitor.
    #[arg(long, requires = "realtime")]
    wait: bool,
    /// Who sits on the ship, behind a receiver and a modem of its own: `process`, `backseat topside` on serial ports;
    /// `library`, the same in this process; `off`, nobody: the vehicle's modem plays the ship's part. With topside,
    /// trial/ gets what a real trial leaves: logs of vehicle, ship's receiver and both modems [default: process, unless
    /// the scenario says topside = false or breaks what only the vehicle's modem can].
    #[arg(long, value_name = "off|library|process")]
    topside: Option<TopsideKind>,
    /// Seed of all randomness instead of the scenario's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Inject an effect: NAME, or NAME:parameter=value,…; the seed draws missing numbers. May be repeated.
    #[arg(long = "effect", value_name = "NAME", value_parser = Request::parse)]
    effects: Vec<Request>,
    /// Inject an effect that the seed picks from the catalogue; truth/effects.json names it.
    #[arg(long)]
    random_effect: bool,
    /// End after this simulated time, minutes.
    #[arg(long, value_name = "MINUTES", allow_negative_numbers = true)]
    minutes: Option<f64>,
    /// Folder for log.csv, truth.csv, session.mcap and report.html [default: a new one in out/].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Draw map and errors as one picture as well; replaces an earlier one.
    #[arg(long, value_name = "FILE.svg")]
    picture: Option<PathBuf>,
    /// Print one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

/// Flies and judges.
///
/// # Errors
/// A scenario that is wrong, a backseat that dies, a file that cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<Outcome> {
    let backseat = arguments.backseat.as_str();
    if !matches!(backseat, "host" | "qemu") && !backseat.starts_with('/') {
        bail!("--backseat {backseat}: expected `host`, `qemu` or five serial ports (frontseat,dvl,ahrs,modem,host)");
    }
    if let Some(path) = &arguments.picture {
        output::check(path, Existing::Replace)?;
    }
    let stop = stop_on_interrupt()?;
    let options = Options {
        scenario: arguments.scenario.clone(),
        vehicle: arguments.vehicle.as_ref().map(|path| VehicleFile::read(path)).transpose()?,
        force: arguments.force,
        backseat: backseat.to_owned(),
        realtime: arguments.realtime,
        wait: arguments.wait,
        topside: arguments.topside,
        usual_topside: TopsideKind::Process,
        seed: arguments.seed,
        effects: arguments.effects.iter().cloned().chain(arguments.random_effect.then_some(Request::Random)).collect(),
        minutes: arguments.minutes,
        out: arguments.out.clone(),
    };
    let say = console::say;
    let (flown, report) = sim::fly(&options, &stop, &say, |scenario| {
        let (backseat, ports) = start(arguments, scenario)?;
        let is_watched = arguments.monitor || arguments.wait;
        Ok((if is_watched { watched(backseat)? } else { backseat }, ports))
    })?;
    if let Some(path) = &arguments.picture {
        let picture = sim::picture(&flown);
        output::write(path, Existing::Replace, |file| file.write_all(picture.as_bytes()))?;
    }
    print(&report, arguments.json)?;
    if stop.load(Ordering::Relaxed) {
        bail!("interrupted after {:.0} s; the files are complete up to there", flown.flight.simulated_s);
    }
    Ok(Outcome::doubtful_if(!flown.is_trustworthy()))
}

/// Starts the backseat asked for; where its ports are.
fn start(arguments: &Args, scenario: &Scenario) -> anyhow::Result<(Box<dyn Ports>, String)> {
    let faults = &scenario.settings.faults;
    if arguments.realtime && Board::is_touched(faults) {
        bail!("--realtime: this scenario resets the board or moves its clock, which works in lock-step only");
    }
    match arguments.backseat.as_str() {
        "host" if Board::is_reset(faults) => {
            Ok((Box::new(InProcess::new()), "the app in this process, which the scenario can reset".to_owned()))
        }
        _ if Board::is_reset(faults) => {
            bail!("--backseat {}: this scenario resets the board, which works with `host` only", arguments.backseat)
        }
        "host" => {
            let program = std::env::current_exe().context("this program's own path")?;
            let backseat = Process::spawn(&program).context("starting the backseat")?;
            let line = ports_line(&backseat);
            Ok((Box::new(backseat), line))
        }
        "qemu" => {
            let image = arguments.image.clone().map_or_else(build_image, Ok)?;
            let backseat = Qemu::start(&image)?;
            Ok((Box::new(backseat), format!("{} in QEMU", image.display())))
        }
        ports => Ok((Box::new(Serial::open(ports)?), ports.to_owned())),
    }
}

/// The same ports with two more, whose paths are printed.
fn watched(backseat: Box<dyn Ports>) -> anyhow::Result<Box<dyn Ports>> {
    let commands = Tap::new(backseat).context("a port to command from")?;
    eprintln!("to command it: backseat mission start {0}, backseat params get {0}", commands.path());
    let watching = Tap::new(commands).context("a port to watch from")?;
    eprintln!("to watch it: backseat monitor {}", watching.path());
    Ok(Box::new(watching))
}

fn stop_on_interrupt() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130); // asked twice
        }
    })
    .context("Ctrl-C handler")?;
    Ok(stop)
}

fn ports_line(backseat: &Process) -> String {
    let ports: Vec<String> =
        Port::NAMES.iter().zip(backseat.paths()).map(|(name, path)| format!("{name} {path}")).collect();
    ports.join(", ")
}
