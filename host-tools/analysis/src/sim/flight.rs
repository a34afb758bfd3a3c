//! A mission flown in the simulator.

use super::flown::{Flown, REPORT, SESSION, VEHICLE};
use super::report;
use super::ship::{self, TopsideKind};
use super::trial;
use crate::flight_score;
use crate::reach;
use crate::vehicle::unflyable;
use anyhow::{Context, bail};
use backseat_link::{Client, Ports};
use backseat_logs::VehicleFile;
use backseat_logs::interrupt;
use backseat_logs::output::Existing;
use backseat_logs::session::{Attachment, Clock, Meta, Writer};
use backseat_report::Report;
use backseat_report::console::Progress;
use hil_sim::backseat::InProcess;
use hil_sim::dataset;
use hil_sim::ending::Ending;
use hil_sim::faults;
use hil_sim::flight;
use hil_sim::scenario::{Request, Scenario, Settings};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// What the head of the vehicle's file says.
const DECLARED: &str = "the vehicle that the backseat was given";

/// What to fly.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// A scenario file, or the name of a built-in one; `survey` without one.
    pub scenario: Option<PathBuf>,
    /// The vehicle to simulate and to declare, instead of the scenario's.
    pub vehicle: Option<VehicleFile>,
    /// Fly a vehicle that cannot.
    pub force: bool,
    /// What the backseat is, for the session log.
    pub backseat: String,
    /// At the speed of the clock.
    pub realtime: bool,
    /// In real time: wait for a request to start the mission.
    pub wait: bool,
    /// Who sits on the ship.
    pub topside: Option<TopsideKind>,
    /// Who does unless it is said, and the scenario has it.
    pub usual_topside: TopsideKind,
    /// Instead of the scenario's.
    pub seed: Option<u64>,
    /// Injected beside the scenario's; the seed draws missing numbers.
    pub effects: Vec<Request>,
    /// End after this simulated time, minutes.
    pub minutes: Option<f64>,
    /// Folder of the results; the first free one in `out/` without one.
    pub out: Option<PathBuf>,
}

/// Flies with the app in this process.
///
/// # Errors
/// Those of [`fly`].
pub fn simulate(options: &Options) -> anyhow::Result<(Flown, Report)> {
    let inside = |_: &Scenario| -> anyhow::Result<(Box<dyn Ports>, String)> {
        Ok((Box::new(InProcess::new()), "the app in this process".to_owned()))
    };
    fly(options, &AtomicBool::new(false), &|_| (), inside)
}

/// Flies a scenario and judges it; `start` starts the backseat and says where its ports are, `say` is told what somebody
/// who waits should know.
///
/// # Errors
/// A scenario that is wrong, a vehicle that does not fly, a backseat that dies, a file that cannot be written.
pub fn fly(
    options: &Options,
    stop: &AtomicBool,
    say: &dyn Fn(&str),
    start: impl FnOnce(&Scenario) -> anyhow::Result<(Box<dyn Ports>, String)>,
) -> anyhow::Result<(Flown, Report)> {
    let scenario = load(options)?;
    if !options.force
        && let Some(reason) = unflyable(&scenario.vehicle)?
    {
        bail!("vehicle {} does not fly: {reason}", scenario.vehicle.name);
    }
    let values = flight::board_parameters(&scenario);
    for sentence in
        reach::unreachable(&reach::FlightSetup::by(values.iter().map(|(name, value)| (name.as_str(), *value))))
    {
        say(&format!("warning: {sentence}"));
    }
    let folder = folder(options, &scenario)?;
    let program = ship::start(options.topside, options.usual_topside, options.realtime, &scenario, &folder, say)?;
    let (backseat, ports) = start(&scenario)?;
    let mut ship = program.map(|program| ship::end(&scenario, program, &folder)).transpose()?;
    let mut client = Client::new(backseat);
    client.hello()?;
    client.record(session(options, &scenario, &folder)?)?;
    scenario.declared_vehicle().write(&folder.join(VEHICLE), DECLARED, Existing::Replace)?;
    let Settings { effects, faults, .. } = &scenario.settings;
    let effects = effects.as_slice();
    if !faults.is_empty() {
        faults::write(faults, scenario.settings.seed, &folder)?;
    }
    if !effects.is_empty() {
        dataset::write_effects(effects, scenario.settings.seed, &folder)?;
    }

    say(&format!("{}: {ports}", scenario.settings.name));
    let bar = Progress::new("simulated seconds", scenario.settings.duration_s as usize);
    let progress = |t_s| {
        interrupt::check();
        bar.set(t_s as usize);
    };
    let end = ship.as_mut();
    let mut companions = Vec::new();
    let others = scenario.companions();
    let flight = if !others.is_empty() {
        let end = end.filter(|_| !options.realtime);
        let end = end.context(
            "a companion flies in lock-step with topside on the ship alone: neither in real time nor without it",
        )?;
        let mut beside = Vec::new();
        for number in 1..=others.len() {
            let name = if others.len() > 1 { format!("companion{number}") } else { "companion".to_owned() };
            let folder = folder.join(name);
            std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
            beside.push((Client::new(Box::new(InProcess::new()) as Box<dyn Ports>), folder));
        }
        let further = others.iter().zip(&mut beside);
        let further = further.map(|(scenario, (board, folder))| (scenario, board, Some(folder.as_path())));
        let first = (&scenario, &mut client, Some(folder.as_path()));
        let mut fleet: Vec<_> = std::iter::once(first).chain(further).collect();
        flight::fly_fleet(&mut fleet, end, stop, progress).map(|mut flights| {
            companions = flights.split_off(1);
            flights.pop().unwrap_or_default()
        })
    } else if options.realtime {
        let start = if options.wait { flight::Start::OnRequest } else { flight::Start::AtOnce };
        flight::fly_realtime(&scenario, &mut client, start, end, Some(&folder), stop, progress)
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
    let flown = Flown { scenario, folder, trial, flight, companions, analysis, ending };
    let report = report::report(&flown);
    let page = flown.folder.join(REPORT);
    report.write(&page).with_context(|| page.display().to_string())?;
    Ok((flown, report))
}

fn load(options: &Options) -> anyhow::Result<Scenario> {
    let (mut scenario, is_built_in) = match &options.scenario {
        None => (Scenario::built_in("survey")?, true),
        Some(path) => match path.to_str() {
            // A file of that name goes first.
            Some(name) if !path.exists() && path.extension().is_none() => (Scenario::built_in(name)?, true),
            _ => (Scenario::load(path)?, false),
        },
    };
    if let Some(vehicle) = &options.vehicle {
        scenario.vehicle = vehicle.clone();
        // a scenario of the user's own says its speeds
        if let Some(speed_mps) = vehicle.cruise_speed_mps().filter(|_| is_built_in) {
            scenario.settings.mission.set_speed(speed_mps);
            scenario.settings.plant.round_hull = true; // other figures were made with the plain section
        }
    }
    if let Some(seed) = options.seed {
        scenario.settings.seed = seed;
    }
    if let Some(minutes) = options.minutes {
        if !(minutes > 0.0 && minutes.is_finite()) {
            bail!("minutes {minutes}: expected a positive number");
        }
        scenario.settings.duration_s = scenario.settings.duration_s.min(minutes * 60.0);
    }
    let Settings { seed, duration_s, .. } = scenario.settings;
    for effect in Request::resolve(&options.effects, seed, duration_s) {
        scenario.settings.effects.push(effect);
    }
    Ok(scenario)
}

/// The folder asked for, which must not hold a flight yet, or the first free one in `out/`.
fn folder(options: &Options, scenario: &Scenario) -> anyhow::Result<PathBuf> {
    let folder = match &options.out {
        Some(folder) => folder.clone(),
        None => {
            let name = format!("{}-seed{}", scenario.settings.name, scenario.settings.seed);
            (1..).map(|n| Path::new("out").join(format!("{name}-{n}"))).find(|path| !path.exists()).unwrap_or_default()
        }
    };
    if folder.join("log.csv").exists() {
        bail!("{}: this folder holds a flight already; choose another", folder.display());
    }
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    Ok(folder)
}

/// The session log, with the scenario and the vehicle that the board is given.
fn session(options: &Options, scenario: &Scenario, folder: &Path) -> anyhow::Result<Writer> {
    let Settings { name, seed, .. } = &scenario.settings;
    let clock = if options.realtime { Clock::Host } else { Clock::Board };
    let program = concat!("backseat ", env!("CARGO_PKG_VERSION"));
    let meta = Meta::new(program, clock)
        .with("backseat", &options.backseat)
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
    attach(VEHICLE, scenario.declared_vehicle().to_toml(DECLARED))?;
    if let Some(path) = options.scenario.as_ref().filter(|path| path.is_file()) {
        attach("scenario.toml", std::fs::read_to_string(path).with_context(|| path.display().to_string())?)?;
    }
    Ok(session)
}
