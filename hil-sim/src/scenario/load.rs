//! Reading scenarios from files and from the built-in ones.

use super::{Line, Mission, Scenario, Settings};
use backseat_data::{DataError, VehicleFile};
use backseat_wire::hostlink::Waypoint;
use std::path::Path;

/// The built-in scenarios and vehicle files, by file name.
const BUILT_IN: [(&str, &str); 4] = [
    ("survey.toml", include_str!("../../scenarios/survey.toml")),
    ("survey_current.toml", include_str!("../../scenarios/survey_current.toml")),
    ("survey_pd.toml", include_str!("../../scenarios/survey_pd.toml")),
    ("iver3.toml", include_str!("../../scenarios/iver3.toml")),
];

impl Scenario {
    /// Reads a scenario file and the vehicle file it names.
    ///
    /// # Errors
    /// Whatever is wrong with either, with file, line, column and key.
    pub fn load(_path: &Path) -> Result<Self, DataError> {
        todo!()
    }

    /// A built-in scenario: `survey`, `survey_current` or `survey_pd`.
    ///
    /// # Errors
    /// No built-in scenario of that name.
    pub fn built_in(_name: &str) -> Result<Self, DataError> {
        todo!()
    }
}

impl Settings {
    /// The waypoints for the backseat, in order.
    #[must_use]
    pub fn waypoints(&self) -> Vec<Waypoint> {
        self.mission.waypoints()
    }

    /// The lines on which the true track is judged.
    #[must_use]
    pub fn lines(&self) -> Vec<Line> {
        self.mission.lines(self.start)
    }
}
