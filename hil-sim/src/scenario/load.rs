//! Reading scenarios from files and from the built-in ones.

use super::{Scenario, Settings, SurveyLine};
use crate::faults::{Fault, FaultKind};
use crate::fittings::FittedParts;
use backseat_logs::settings::{self, place};
use backseat_logs::{DataError, VehicleFile};
use backseat_wire::hostlink::Waypoint;
use serde::de::DeserializeOwned;
use std::path::Path;

/// The built-in scenarios by name; they fly the built-in reference vehicle.
const BUILT_IN: [(&str, &str); 8] = [
    ("survey", include_str!("../../scenarios/survey.toml")),
    ("survey_current", include_str!("../../scenarios/survey_current.toml")),
    ("survey_pd", include_str!("../../scenarios/survey_pd.toml")),
    ("survey_oms", include_str!("../../scenarios/survey_oms.toml")),
    ("identification", include_str!("../../scenarios/identification.toml")),
    ("sea_trial", include_str!("../../scenarios/sea_trial.toml")),
    ("two_vehicles", include_str!("../../scenarios/two_vehicles.toml")),
    ("team", include_str!("../../scenarios/team.toml")),
];

impl Scenario {
    /// Reads a scenario file and the vehicle file it names.
    ///
    /// # Errors
    /// Whatever is wrong with either, in one line with file, line, column and key.
    pub fn load(path: &Path) -> Result<Self, DataError> {
        let text = settings::read(path)?;
        let settings = Settings::parse(&text, path)?;
        let vehicle_path = path.parent().unwrap_or(Path::new("")).join(&settings.vehicle);
        if !vehicle_path.is_file() {
            let (line, column) = place(&text, text.find("\nvehicle").map_or(0, |newline| newline + 1));
            let message = format!("vehicle: no such file: {}", vehicle_path.display());
            return Err(DataError::at(path, line, column, message));
        }
        Ok(Self { settings, vehicle: VehicleFile::read(&vehicle_path)? })
    }

    /// A built-in scenario: `survey` (the default mission), `survey_current`, `survey_pd`, `survey_oms`,
    /// `identification`, `sea_trial`, `two_vehicles` or `team`.
    ///
    /// # Errors
    /// If there is no built-in scenario of that name.
    pub fn built_in(name: &str) -> Result<Self, DataError> {
        let Some((_, text)) = BUILT_IN.iter().find(|(known, _)| *known == name) else {
            let names: Vec<_> = BUILT_IN.iter().map(|(known, _)| *known).collect();
            let message = format!("no such built-in scenario; there are {}", names.join(", "));
            return Err(DataError::file(Path::new(name), message));
        };
        Self::with_built_in_vehicle(text, &format!("{name}.toml"))
    }

    /// A scenario of this text, which flies the built-in vehicle; `path` is for the messages.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn with_built_in_vehicle(text: &str, path: &str) -> Result<Self, DataError> {
        Ok(Self { settings: Settings::parse(text, Path::new(path))?, vehicle: VehicleFile::reference() })
    }
}

impl Settings {
    /// Parses the text of a scenario file; `path` is for the messages.
    ///
    /// # Errors
    /// The first key that is unknown, missing, of the wrong type or out of its range.
    pub fn parse(text: &str, path: &Path) -> Result<Self, DataError> {
        let settings: Self = from_toml(text, path)?;
        let is_of_fittings = |fault: &Fault| matches!(fault.kind, FaultKind::Fitting(_));
        if settings.fittings == FittedParts::default() && settings.faults.iter().any(is_of_fittings) {
            return Err(DataError::file(path, "fault: last-resort hardware that is read wrong, and no [fittings]"));
        }
        Ok(settings)
    }

    /// The waypoints for the backseat, in order.
    pub fn waypoints(&self) -> Vec<Waypoint> {
        self.mission.waypoints()
    }

    /// The lines on which the true track is judged.
    pub fn lines(&self) -> Vec<SurveyLine> {
        self.mission.lines([self.start.x_m, self.start.y_m])
    }
}

/// What a text of settings declares; `path` is for the messages.
///
/// # Errors
/// What is wrong with it, in one line with file, line, column and key.
pub fn from_toml<T: DeserializeOwned>(text: &str, path: &Path) -> Result<T, DataError> {
    toml::from_str(text).map_err(|mut error: toml::de::Error| {
        let (line, column) = error.span().map_or((0, 0), |span| place(text, span.start));
        // Without the text at hand, the error names the key instead of drawing the line.
        error.set_input(None);
        let rendered = error.to_string();
        let (what, key) = rendered.trim_end().split_once("\nin `").unwrap_or((rendered.trim_end(), ""));
        let message = if key.is_empty() { what.to_owned() } else { format!("{}: {what}", key.trim_end_matches('`')) };
        DataError::at(path, line, column, message.replace('\n', " "))
    })
}
