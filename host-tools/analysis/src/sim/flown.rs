//! A flight, judged, and where its files are.

use crate::flight_score::Analysis;
use hil_sim::ending::Ending;
use hil_sim::flight::FlightLog;
use hil_sim::scenario::Scenario;
use std::path::PathBuf;

/// The session log: all that passed over the ports.
pub const SESSION: &str = "session.mcap";
/// The vehicle that the backseat was given.
pub const VEHICLE: &str = "vehicle.toml";
/// The report.
pub const REPORT: &str = "report.html";

/// A flight that ended, and what it is worth.
pub struct Flown {
    /// As it was flown.
    pub scenario: Scenario,
    /// Where its files are.
    pub folder: PathBuf,
    /// What a real trial would have left.
    pub trial: Option<PathBuf>,
    /// What happened.
    pub flight: FlightLog,
    /// What happened to the further vehicles.
    pub companions: Vec<FlightLog>,
    /// How well it was navigated and steered.
    pub analysis: Analysis,
    /// How it ended.
    pub ending: Ending,
}

impl Flown {
    /// Whether its figures are of a vehicle that flew its mission, and of a backseat that kept time.
    pub fn is_trustworthy(&self) -> bool {
        self.ending.is_trustworthy() && self.flight.late_steps == 0
    }
}
