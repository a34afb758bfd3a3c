//! `backseat sim run`: fly a scenario against a backseat and judge its navigation.

use super::ship::TopsideKind;
use super::trial;
use crate::outcome::Outcome;
use crate::vehicle::unflyable;
use anyhow::{Context, bail};
use backseat_analysis::flight_score::{self, Analysis, Configuration};
use backseat_analysis::track_score::TrackScore;
use backseat_link::{Client, Ports, Process, Serial, Tap};
use backseat_logs::VehicleFile;
use backseat_logs::output::Existing;
use backseat_logs::session::{Attachment, Clock, Meta, Writer};
use backseat_logs::stats::ErrorSummary;
use backseat_report::console::Progress;
use clap::Parser;
use hil_sim::backseat::{InProcess, Qemu, build_image};
use hil_sim::dataset;
use hil_sim::ending::Ending;
use hil_sim::faults::{self, Board};
use hil_sim::flight::{self, FlightLog};
use hil_sim::scenario::{Request, Scenario, Settings};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The session log: all that passed over the ports.
const SESSION: &str = "session.mcap";
/// The report.
const REPORT: &str = "report.html";

/// Command line.
#[derive(clap::Args, Clone, Debug, Default)]
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

/// A flight that ended, and what it is worth.
struct Flown {
    folder: PathBuf,
    /// What a real trial would have left.
    trial: Option<PathBuf>,
    flight: FlightLog,
    companion: Option<FlightLog>,
    analysis: Analysis,
    ending: Ending,
}

/// Flies and judges.
///
/// # Errors
/// A scenario that is wrong, a backseat that dies, a file that cannot be written.
pub fn run(arguments: &Args) -> anyhow::Result<Outcome> {
    let stop = stop_on_interrupt()?;
    let flown = fly(arguments, &stop, TopsideKind::Process, |scenario| start(arguments, scenario))?;
    let Flown { folder, trial, flight, companion, analysis, ending } = &flown;
    if arguments.json {
        println!("{}", summary_json(flight, companion.as_ref(), analysis, *ending));
    } else {
        print!("{}", summary_text(flight, companion.as_ref(), analysis, *ending));
        println!("\nlog     {}", folder.join("log.csv").display());
        println!("session {}", folder.join(SESSION).display());
        println!("report  {}", folder.join(REPORT).display());
        if let Some(trial) = trial {
            println!("trial   {}, to be joined by backseat navigate --ship --modem", trial.display());
        }
    }
    if stop.load(Ordering::Relaxed) {
        bail!("interrupted after {:.0} s; the files are complete up to there", flight.simulated_s);
    }
    Ok(Outcome::doubtful_if(!ending.is_trustworthy()))
}

/// Flies with the options of `sim run`, the app in this process: its JSON object and its folder.
///
/// # Errors
/// Options that `sim run` does not have, and its own errors.
pub fn simulate(options: &[String]) -> anyhow::Result<(String, PathBuf)> {
    #[derive(clap::Parser)]
    #[command(no_binary_name = true)]
    struct Options {
        #[command(flatten)]
        run: Args,
    }
    let arguments = Options::try_parse_from(options)?.run;
    let inside = |_: &Scenario| -> anyhow::Result<(Box<dyn Ports>, String)> {
        Ok((Box::new(InProcess::new()), "the app in this process".to_owned()))
    };
    // this program may be another's library: it cannot be started again
    if arguments.topside == Some(TopsideKind::Process) {
        bail!("--topside process: here topside flies in this process: `library`");
    }
    let flown = fly(&arguments, &AtomicBool::new(false), TopsideKind::Library, inside)?;
    let Flown { folder, flight, companion, analysis, ending, .. } = flown;
    Ok((summary_json(&flight, companion.as_ref(), &analysis, ending).to_string(), folder))
}

fn fly(
    arguments: &Args,
    stop: &AtomicBool,
    usual: TopsideKind,
    start: impl FnOnce(&Scenario) -> anyhow::Result<(Box<dyn Ports>, String)>,
) -> anyhow::Result<Flown> {
    let scenario = load(arguments)?;
    if !arguments.force
        && let Some(reason) = unflyable(&scenario.vehicle)?
    {
        bail!(
            "vehicle {} does not fly: {reason} (`backseat vehicle check` says more, --force flies it)",
            scenario.vehicle.name
        );
    }
    let folder = folder(arguments, &scenario)?;
    let program = super::ship::start(arguments.topside, usual, arguments.realtime, &scenario, &folder)?;
    let (backseat, ports) = start(&scenario)?;
    let mut ship = program.map(|program| super::ship::end(&scenario, program, &folder)).transpose()?;
    let backseat = if arguments.monitor || arguments.wait { watched(backseat)? } else { backseat };
    let mut client = Client::new(backseat);
    client.hello()?;
    client.record(session(arguments, &scenario, &folder)?)?;
    let Settings { effects, faults, .. } = &scenario.settings;
    let effects = effects.as_slice();
    if !faults.is_empty() {
        faults::write(faults, scenario.settings.seed, &folder)?;
    }
    if !effects.is_empty() {
        dataset::write_effects(effects, scenario.settings.seed, &folder)?;
    }

    eprintln!("{}: {ports}", scenario.settings.name);
    let bar = Progress::new("simulated seconds", scenario.settings.duration_s as usize);
    let progress = |t_s| bar.set(t_s as usize);
    let end = ship.as_mut();
    let mut companion = None;
    let flight = if let Some(second) = scenario.companion() {
        let end = end.filter(|_| !arguments.realtime);
        let end = end.context(
            "a companion flies in lock-step with topside on the ship alone: leave --realtime and --topside out",
        )?;
        let mut board = Client::new(Box::new(InProcess::new()) as Box<dyn Ports>);
        let beside = folder.join("companion");
        std::fs::create_dir_all(&beside).with_context(|| beside.display().to_string())?;
        let mut fleet =
            [(&scenario, &mut client, Some(folder.as_path())), (&second, &mut board, Some(beside.as_path()))];
        flight::fly_fleet(&mut fleet, end, stop, progress).map(|mut flights| {
            companion = flights.pop();
            flights.pop().unwrap_or_default()
        })
    } else if arguments.realtime {
        let start = if arguments.wait { flight::Start::OnRequest } else { flight::Start::AtOnce };
        flight::fly_realtime_with_ship(&scenario, &mut client, start, end, Some(&folder), stop, progress)
    } else {
        flight::fly_with_ship(&scenario, &mut client, end, Some(&folder), stop, progress)
    };
    drop(ship);
    drop(bar);
    let flight = flight.with_context(|| format!("flight (the part that was flown is in {})", folder.display()))?;
    client.end_record()?;
    drop(client);
    let start_unix_s = scenario.settings.environment.start_unix_s;
    let trial = folder.join(trial::FOLDER).exists();
    let trial = trial.then(|| trial::add_vehicle(&flight, start_unix_s, &folder.join(SESSION), &folder)).transpose()?;

    if flight.samples.is_empty() {
        bail!("interrupted before the first second");
    }
    let ending = Ending::of(&scenario, &flight);
    let analysis = flight_score::analyse(&scenario, &flight)?;
    super::report::write(&folder.join(REPORT), &scenario, &flight, &analysis, ending)?;
    if let Some(picture) = &arguments.picture {
        super::report::picture(picture, &scenario, &flight, &analysis)?;
    }
    Ok(Flown { folder, trial, flight, companion, analysis, ending })
}

/// Starts the backseat asked for; where its ports are.
fn start(arguments: &Args, scenario: &Scenario) -> anyhow::Result<(Box<dyn Ports>, String)> {
    let faults = &scenario.settings.faults;
    if arguments.realtime && Board::is_touched(faults) {
        bail!("--realtime: this scenario resets the board or moves its clock, which works in lock-step only");
    }
    match arguments.backseat.as_str() {
        "host" | "" if Board::is_reset(faults) => {
            Ok((Box::new(InProcess::new()), "the app in this process, which the scenario can reset".to_owned()))
        }
        _ if Board::is_reset(faults) => {
            bail!("--backseat {}: this scenario resets the board, which works with `host` only", arguments.backseat)
        }
        "host" | "" => {
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

fn load(arguments: &Args) -> anyhow::Result<Scenario> {
    let backseat = &arguments.backseat;
    if !matches!(backseat.as_str(), "" | "host" | "qemu") && !backseat.starts_with('/') {
        bail!("--backseat {backseat}: expected `host`, `qemu` or five serial ports (frontseat,dvl,ahrs,modem,host)");
    }
    let mut scenario = match &arguments.scenario {
        None => Scenario::built_in("survey")?,
        Some(path) => match path.to_str() {
            // A file of that name goes first.
            Some(name) if !path.exists() && path.extension().is_none() => Scenario::built_in(name)?,
            _ => Scenario::load(path)?,
        },
    };
    if let Some(path) = &arguments.vehicle {
        scenario.vehicle = VehicleFile::read(path)?;
    }
    if let Some(seed) = arguments.seed {
        scenario.settings.seed = seed;
    }
    if let Some(minutes) = arguments.minutes {
        if !(minutes > 0.0 && minutes.is_finite()) {
            bail!("--minutes {minutes}: expected a positive number");
        }
        scenario.settings.duration_s = scenario.settings.duration_s.min(minutes * 60.0);
    }
    let chance = arguments.random_effect.then_some(Request::Random);
    let requests: Vec<Request> = arguments.effects.iter().cloned().chain(chance).collect();
    let Settings { seed, duration_s, .. } = scenario.settings;
    for effect in Request::resolve(&requests, seed, duration_s) {
        scenario.settings.effects.push(effect);
    }
    Ok(scenario)
}

/// The folder asked for, which must not hold a flight yet, or the first free one in `out/`.
fn folder(arguments: &Args, scenario: &Scenario) -> anyhow::Result<PathBuf> {
    let folder = match &arguments.out {
        Some(folder) => folder.clone(),
        None => {
            let name = format!("{}-seed{}", scenario.settings.name, scenario.settings.seed);
            (1..).map(|n| Path::new("out").join(format!("{name}-{n}"))).find(|path| !path.exists()).unwrap_or_default()
        }
    };
    if folder.join("log.csv").exists() {
        bail!("{}: this folder holds a flight already; choose another with --out", folder.display());
    }
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(folder)
}

/// The session log, with the scenario and the vehicle that the board is given.
fn session(arguments: &Args, scenario: &Scenario, folder: &Path) -> anyhow::Result<Writer> {
    let Settings { name, seed, .. } = &scenario.settings;
    let clock = if arguments.realtime { Clock::Host } else { Clock::Board };
    let program = concat!("backseat ", env!("CARGO_PKG_VERSION"));
    let meta = Meta::new(program, clock)
        .with("backseat", &arguments.backseat)
        .with("scenario", name)
        .with("seed", seed)
        .with("vehicle", &scenario.vehicle.name);
    let mut session = Writer::create(&folder.join(SESSION), &meta, Existing::Keep)?;
    let mut attach = |name: &str, text: String| {
        session.attach(&Attachment {
            name: name.to_owned(),
            media_type: "application/toml".to_owned(),
            bytes: text.into_bytes(),
        })
    };
    attach("vehicle.toml", scenario.declared_vehicle().to_toml("the vehicle that the backseat was given"))?;
    if let Some(path) = arguments.scenario.as_ref().filter(|path| path.is_file()) {
        attach("scenario.toml", std::fs::read_to_string(path).with_context(|| path.display().to_string())?)?;
    }
    Ok(session)
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
    let names = ["frontseat", "dvl", "ahrs", "modem", "host"];
    let ports: Vec<String> = names.iter().zip(backseat.paths()).map(|(name, path)| format!("{name} {path}")).collect();
    ports.join(", ")
}

fn summary_text(flight: &FlightLog, companion: Option<&FlightLog>, analysis: &Analysis, ending: Ending) -> String {
    let warning = if ending.is_trustworthy() { String::new() } else { format!("{}\n\n", ending.headline()) };
    if ending == Ending::NotFlown {
        return format!("{warning}{:.0} s simulated\n", flight.simulated_s);
    }
    let mut text = warning
        + &format!("{:<36} {:>8} {:>8} {:>8} {:>8}\n", "horizontal error [m]", "median", "95 %", "max", "RMS/DRMS");
    for configuration in &analysis.configurations {
        let error = &configuration.error;
        let ratio = configuration.rms_over_drms().map_or("-".into(), |ratio| format!("{ratio:.2}"));
        text += &format!(
            "{:<36} {:>8.2} {:>8.2} {:>8.2} {ratio:>8}\n",
            configuration.name, error.median_m, error.p95_m, error.max_m
        );
    }
    if let Some(track) = &analysis.track {
        for (name, error) in [
            ("true cross-track error on the lines", &track.cross_track),
            ("true depth error on the lines", &track.depth),
        ] {
            text += &format!("{name:<36} {:>8.2} {:>8.2} {:>8.2}\n", error.median_m, error.p95_m, error.max_m);
        }
    }
    text += &super::ship::text(flight);
    text += &companion.map(super::ship::companion_text).unwrap_or_default();
    let sensors = flight_score::sensor_names(&analysis.configurations);
    text += &format!("\n{:<36}", "mean NIS (rejected)");
    for sensor in &sensors {
        text += &format!(" {sensor:>12}");
    }
    text.push('\n');
    for configuration in analysis.configurations.iter().filter(|c| !c.nis.is_empty()) {
        text += &format!("{:<36}", configuration.name);
        for sensor in &sensors {
            let cell =
                configuration.nis.get(sensor).map_or("-".into(), |nis| format!("{:.2} ({})", nis.mean(), nis.rejected));
            text += &format!(" {cell:>12}");
        }
        text.push('\n');
    }
    text += &format!(
        "\n{}: {:.0} s in {:.1} s, {:.0} times real time, digest {:016x}\n",
        if ending.is_trustworthy() { ending.headline() } else { ending.name().to_owned() },
        flight.simulated_s,
        flight.wall_s,
        flight.simulated_s / flight.wall_s,
        flight.digest
    );
    text
}

fn summary_json(flight: &FlightLog, companion: Option<&FlightLog>, analysis: &Analysis, ending: Ending) -> Value {
    let configurations: Vec<Value> = analysis
        .configurations
        .iter()
        .map(|configuration| {
            let error = &configuration.error;
            json!({
                "name": configuration.name,
                "median_m": error.median_m,
                "p95_m": error.p95_m,
                "max_m": error.max_m,
                "rms_m": error.rms_m,
                "drms_m": configuration.drms_m,
                "nis": nis_json(configuration),
            })
        })
        .collect();
    let track = |pick: fn(&TrackScore) -> &ErrorSummary| {
        analysis.track.as_ref().map(|track| json!({"median": pick(track).median_m, "p95": pick(track).p95_m}))
    };
    json!({
        "configurations": configurations,
        "cross_track_m": track(|track| &track.cross_track),
        "depth_m": track(|track| &track.depth),
        "nis": analysis.configurations.first().map(nis_json),
        "topside": super::ship::json(flight),
        "companion": companion.map(super::ship::companion_json),
        "finished": matches!(ending, Ending::Flown),
        "ending": ending.name(),
        "trust": if ending.is_trustworthy() { "ok" } else { "suspicious" },
        "simulated_s": flight.simulated_s,
        "wall_s": flight.wall_s,
        "digest": format!("{:016x}", flight.digest),
    })
}

fn nis_json(configuration: &Configuration) -> Value {
    let means = configuration.nis.iter().map(|(sensor, nis)| ((*sensor).to_owned(), json!(nis.mean())));
    Value::Object(means.collect::<Map<String, Value>>())
}
