//! Files of settings, all of them TOML: which of them a file is shows in the names at its top; its own reader then
//! says what is in it, or what is wrong with it.

use crate::duration::span;
use crate::mission_file as mission;
use crate::topside_config as topside;
use backseat_core::parameters::SECTIONS;
use backseat_logs::importers::ColumnMap;
use backseat_logs::{BoardFile, DataError};
use hil_sim::scenario::Scenario;
use std::path::Path;

/// What a file may be.
#[derive(Clone, Copy)]
enum Kind {
    Mapping,
    Topside,
    Scenario,
    Mission,
    Vehicle,
}

/// Names at the top of a file that none of the kinds below it has.
const NAMES: [(Kind, &[&str]); 5] = [
    (Kind::Mapping, &["time", "columns", "quaternion", "constants", "separator", "missing"]),
    (Kind::Topside, &["ports", "cycle", "modem"]),
    (Kind::Scenario, &["duration_s", "seed", "start", "ship", "environment", "acoustics", "plant"]),
    (Kind::Mission, &["mission", "fence", "separate"]),
    (Kind::Vehicle, &["app", "effects"]),
];

/// What a file is, facts, and what to do with it.
pub type Described = (&'static str, Vec<String>, &'static str);

/// What a file of settings is, facts about it, and which command takes it.
///
/// # Errors
/// A file that says what it is and is broken, or says nothing.
pub fn describe(path: &Path) -> anyhow::Result<Described> {
    let text = backseat_logs::settings::read(path)?;
    // of what is no TOML the reader of a vehicle file says where
    let kind = table(&text).map_or(Some(Kind::Vehicle), |table| kind(&table));
    let Some(kind) = kind else {
        let message = "TOML, but none of the files that a command takes: vehicle file, scenario, mission, column mapping, \
                       topside's configuration";
        return Err(DataError::file(path, message).into());
    };
    Ok(match kind {
        Kind::Mapping => mapping(path)?,
        Kind::Topside => topside(path)?,
        Kind::Scenario => scenario(path)?,
        Kind::Mission => mission(path)?,
        Kind::Vehicle => vehicle(path)?,
    })
}

fn table(text: &str) -> Option<toml::Table> {
    text.trim_start_matches('\u{feff}').parse().ok()
}

fn kind(table: &toml::Table) -> Option<Kind> {
    let has = |name: &&str| table.contains_key(*name);
    let is_vehicle = || SECTIONS.iter().any(|section| has(&section.name));
    let named = NAMES.iter().find(|(_, names)| names.iter().any(has)).map(|(kind, _)| *kind);
    named.or_else(|| is_vehicle().then_some(Kind::Vehicle))
}

/// What a file given as a log is, where it is one of settings.
pub fn instead_of_log(path: &Path) -> Option<&'static str> {
    let table = table(&backseat_logs::settings::read(path).ok()?)?;
    Some(match kind(&table)? {
        Kind::Mapping => "a column mapping, not a log: give it beside a log",
        Kind::Topside => "a configuration of topside, not a log",
        Kind::Scenario => "a scenario, not a log",
        Kind::Mission => "a mission, not a log",
        Kind::Vehicle => "a vehicle file, not a log: give it beside a log",
    })
}

fn mapping(path: &Path) -> Result<Described, DataError> {
    let map = ColumnMap::read(path)?;
    let facts = map.columns().map(|(column, target)| format!("{column} becomes {target}")).collect();
    Ok(("column mapping", facts, "`backseat info LOG --columns FILE` shows what becomes of a log"))
}

fn topside(path: &Path) -> anyhow::Result<Described> {
    let read = topside::read(path)?;
    let mut facts = vec![format!("GNSS on {}, modem on {}", read.ports.gnss, read.ports.modem)];
    facts.extend(
        read.vehicles.iter().map(|vehicle| format!("vehicle {}: modem address {}", vehicle.name, vehicle.address)),
    );
    let next = "`backseat topside FILE --check` prints its cycle; `backseat topside FILE` runs the ship's program";
    Ok(("configuration of topside", facts, next))
}

fn scenario(path: &Path) -> Result<Described, DataError> {
    let Scenario { settings, vehicle } = Scenario::load(path)?;
    let waypoints = settings.mission.waypoints().len();
    let facts = vec![
        format!("{}: {waypoints} waypoints, at most {}", settings.name, span(settings.duration_s)),
        format!("vehicle {} of {}", vehicle.name, settings.vehicle),
    ];
    let next = "`backseat sim run FILE` flies it; `backseat mission put PORT FILE` takes its [mission] and [fence]";
    Ok(("scenario", facts, next))
}

fn mission(path: &Path) -> Result<Described, DataError> {
    let mission = mission::read(path)?;
    let deepest_m = mission.waypoints.iter().map(|waypoint| waypoint.depth_m).fold(0.0, f64::max);
    let mut facts = vec![format!("{} waypoints, {deepest_m} m deep at most", mission.waypoints.len())];
    if !mission.fence_m.is_empty() {
        facts.push(format!("a fence of {} corners", mission.fence_m.len()));
    }
    Ok(("mission", facts, "`backseat mission put PORT FILE` stores it on the board"))
}

fn vehicle(path: &Path) -> Result<Described, DataError> {
    let board = BoardFile::read(path)?;
    let mut facts = Vec::new();
    if let Some(vehicle) = &board.vehicle {
        facts.push(format!("vehicle {}, {} kg", vehicle.name, vehicle.parameters.mass_kg));
        let effects: Vec<&str> = vehicle.effects.set.active().map(|(_, effect, _)| effect.name).collect();
        if !effects.is_empty() {
            facts.push(format!("with the effects {}", effects.join(", ")));
        }
    }
    if !board.app.is_empty() {
        facts.push(format!("{} parameters of [app]", board.app.len()));
    }
    Ok(("vehicle file", facts, "`backseat vehicle check FILE` flies it and names the numbers that do not fit"))
}
