//! A scenario: everything a simulated mission depends on, in one TOML file.
//!
//! Unknown keys, missing files and values out of range are errors that name file, line, column
//! and key.

mod backseat;
mod companion;
pub mod effects;
mod installation;
mod limits;
mod load;
mod mission;
mod sections;
mod sensors;
mod vehicle;

pub use backseat::{Backseat, ControlLaw, ControlMode, perturbed};
pub use effects::{Effect, Effects, Physics, Request};
pub use installation::Installation;
pub use limits::{End, Limits};
pub use load::from_toml;
pub use mission::{Alert, Fence, Lawnmower, Mission, MissionWaypoint, Separate, SurveyLine};
pub use sections::{Acoustics, Companion, Current, Environment, Exchange, Plant, Ship, ShipTrack, Slot, Start};
pub use sensors::{Ahrs, Depth, Dvl, Gnss, Sensors, ShipGnss};

use crate::faults::Fault;
use crate::fittings::FittedParts;
use crate::noise::NoiseKind;
use crate::quantity;
use backseat_logs::VehicleFile;
use serde::Deserialize;

/// A scenario, read and checked.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// The file's own tables.
    pub settings: Settings,
    /// The declared vehicle.
    pub vehicle: VehicleFile,
}

/// What stands in the scenario file itself.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Name, for reports and folders.
    #[serde(deserialize_with = "quantity::name")]
    pub name: String,
    /// The simulation ends here at the latest, s.
    #[serde(deserialize_with = "quantity::duration")]
    pub duration_s: f64,
    /// Flown on after the mission's end, s: the last fixes are to be seen.
    #[serde(default = "sections::epilogue_s", deserialize_with = "quantity::delay")]
    pub epilogue_s: f64,
    /// Seed of all randomness.
    pub seed: u64,
    /// Vehicle file, relative to the scenario file.
    pub vehicle: String,
    /// The vehicle at time zero.
    pub start: Start,
    /// What to fly.
    pub mission: Mission,
    /// Whether a manoeuvre may tell two causes apart.
    #[serde(default)]
    pub separate: Separate,
    /// The mission is not to begin without the board's own log.
    #[serde(default = "sections::log_required")]
    pub log_required: bool,
    /// The polygon that it must not leave.
    #[serde(default)]
    pub fence: Fence,
    /// Limits of the protection level.
    #[serde(default)]
    pub alert: Alert,
    /// The backseat under test.
    #[serde(default)]
    pub backseat: Backseat,
    /// Last-resort hardware.
    #[serde(default)]
    pub fittings: FittedParts,
    /// Water, place and date.
    #[serde(default)]
    pub environment: Environment,
    /// The ship.
    #[serde(default)]
    pub ship: Ship,
    /// TDMA cycle and acoustic channel.
    #[serde(default)]
    pub acoustics: Acoustics,
    /// Further vehicles; they fly with topside on the ship only.
    #[serde(default, rename = "companion")]
    pub companions: Vec<Companion>,
    /// Sensors.
    #[serde(default)]
    pub sensors: Sensors,
    /// Where the sensors really sit.
    #[serde(default)]
    pub installation: Installation,
    /// Spectra of the noise.
    #[serde(default)]
    pub noise: NoiseKind,
    /// Physics that the declared vehicle leaves out.
    #[serde(default)]
    pub plant: Plant,
    /// Undeclared effects.
    #[serde(default)]
    pub effects: Effects,
    /// What breaks.
    #[serde(default, rename = "fault")]
    pub faults: Vec<Fault>,
    /// What a row of the fault table must keep.
    #[serde(default)]
    pub limits: Option<Limits>,
}
