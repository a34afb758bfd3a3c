//! The mission file: `[mission]`, `[fence]`, `[alert]`, `separate` and `log_required` of a simulator's scenario, or of a
//! file of its own.

use backseat_logs::DataError;
use backseat_wire::hostlink::Waypoint;
use hil_sim::scenario::{Alert, Fence, Mission, Separate, from_toml};
use serde::Deserialize;
use std::fmt::Write as _;
use std::path::Path;

/// Whatever else stands in a scenario is for the simulator.
#[derive(Deserialize)]
struct MissionFile {
    mission: Mission,
    #[serde(default)]
    fence: Fence,
    alert: Option<Alert>,
    separate: Option<Separate>,
    log_required: Option<bool>,
}

/// A mission as a board stores it.
#[derive(Debug, Default, PartialEq)]
pub struct StoredMission {
    /// Its legs.
    pub waypoints: Vec<Waypoint>,
    /// Corners of its fence, north and east, m.
    pub fence_m: Vec<[f64; 2]>,
    /// Alert limits of the protection level, horizontally and in depth, m; `None`: those of the board stay.
    pub alerts_m: Option<[f64; 2]>,
    /// Whether a manoeuvre may tell two causes apart; `None`: what the board has stays.
    pub separate: Option<Separate>,
    /// Whether it is not to begin without the board's own log; `None`: what the board has stays.
    pub log_required: Option<bool>,
}

/// The waypoints of a mission file, and its fence.
///
/// # Errors
/// What is wrong with it, in one line with file, line, column and key.
pub fn read(path: &Path) -> Result<StoredMission, DataError> {
    let text = backseat_logs::settings::read(path)?;
    parse(&text, path)
}

/// The same of a text; errors name it by this path.
///
/// # Errors
/// As of [`read`].
pub fn parse(text: &str, path: &Path) -> Result<StoredMission, DataError> {
    let file: MissionFile = from_toml(text, path)?;
    let waypoints = file.mission.waypoints();
    if waypoints.is_empty() {
        return Err(DataError::file(path, "mission.waypoints: a mission needs at least one"));
    }
    let alerts_m = file.alert.map(|Alert { horizontal_m, depth_m }| [horizontal_m, depth_m]);
    let MissionFile { fence: Fence { corners_m: fence_m }, separate, log_required, .. } = file;
    Ok(StoredMission { waypoints, fence_m, alerts_m, separate, log_required })
}

/// The text of a mission file; without corners it has no fence.
pub fn text_of(stored: &StoredMission) -> String {
    let StoredMission { waypoints, fence_m, alerts_m, separate, log_required } = stored;
    let mut text = String::from(
        "# Mission: waypoints in the local frame (x north, y east); depth and speed are those of the leg that ends there.\n",
    );
    if let Some((_, word)) = Separate::ALL.iter().find(|(own, _)| Some(*own) == *separate) {
        let _ = write!(text, "\nseparate = \"{word}\"\n");
    }
    if let Some(log_required) = log_required {
        let _ = write!(text, "\nlog_required = {log_required}\n");
    }
    for Waypoint { x_m, y_m, depth_m, speed_mps } in waypoints {
        let _ = write!(
            text,
            "\n[[mission.waypoints]]\nx_m = {x_m:?}\ny_m = {y_m:?}\ndepth_m = {depth_m:?}\nspeed_mps = {speed_mps:?}\n"
        );
    }
    if !fence_m.is_empty() {
        let _ = write!(text, "\n[fence]\ncorners_m = {fence_m:?}\n");
    }
    if let Some([horizontal_m, depth_m]) = alerts_m {
        let _ = write!(text, "\n[alert]\nhorizontal_m = {horizontal_m:?}\ndepth_m = {depth_m:?}\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back_the_same() {
        let waypoints = [(-1.0 / 3.0, 1e5, 0.0, 1.5), (7.0, -0.0, 3.25, 0.1)]
            .map(|(x_m, y_m, depth_m, speed_mps)| Waypoint { x_m, y_m, depth_m, speed_mps });
        for fence_m in [vec![], vec![[0.0, -1e5], [1.0 / 3.0, 0.0], [5.0, 5.0]]] {
            for alerts_m in [None, Some([25.0, 2.5])] {
                for separate in [None, Some(Separate::Never), Some(Separate::OnLegs), Some(Separate::Free)] {
                    for log_required in [None, Some(false), Some(true)] {
                        let (waypoints, fence_m) = (waypoints.to_vec(), fence_m.clone());
                        let stored = StoredMission { waypoints, fence_m, alerts_m, separate, log_required };
                        assert_eq!(parse(&text_of(&stored), Path::new("m.toml")).unwrap(), stored);
                    }
                }
            }
        }
    }

    #[test]
    fn a_scenario_is_a_mission_file() {
        let text = include_str!("../../../hil-sim/scenarios/survey.toml");
        // ten lines, and the runs before and behind them
        assert_eq!(parse(text, Path::new("survey.toml")).unwrap().waypoints.len(), 22);
    }

    #[test]
    fn errors_say_where() {
        let waypoints = vec![Waypoint { x_m: 1.0, y_m: 2.0, depth_m: 3.0, speed_mps: 1.0 }];
        let good = text_of(&StoredMission { waypoints, ..StoredMission::default() });
        let cases = [
            (String::new(), "m.toml", "missing field `mission`"),
            ("[mission]\n".to_owned(), "m.toml:1:1:", "mission"),
            ("[mission]\nwaypoints = []\n".to_owned(), "m.toml:", "at least one"),
            (good.replace("depth_m", "depth_ft"), "m.toml:6:1:", "depth_ft"),
            (good.replace("depth_m = 3.0\n", ""), "m.toml:3:1:", "depth_m"),
            (good.replace("3.0", "-3.0"), "m.toml:6:11:", "-3 is outside 0 to 1000"),
            (good.replace("3.0", "nan"), "m.toml:6:11:", "outside"),
            (good.replace("3.0", "\"deep\""), "m.toml:6:11:", "depth_m"),
            (good.replace("3.0", "3.0.0"), "m.toml:6:", ""),
            (good.replace("[[mission.waypoints]]", "[mission.lawnmower]"), "m.toml:", "x_m"),
            (good.replace("[[mission.waypoints]]", "[[mission.waypoint]]"), "m.toml:", "waypoint"),
            (good.clone() + "[fence]\ncorners = []\n", "m.toml:9:1:", "corners"),
            (good.clone() + "[fence]\ncorners_m = [[1.0, nan]]\n", "m.toml:9:", "outside"),
            (good.clone() + "[alert]\nhorizontal_m = -1.0\n", "m.toml:9:", "horizontal_m"),
            ("separate = \"always\"\n".to_owned() + &good, "m.toml:1:12:", "always"),
            ("log_required = \"no\"\n".to_owned() + &good, "m.toml:1:16:", "boolean"),
            (good.clone() + "[alert]\nacross_m = 1.0\n", "m.toml:9:", "across_m"),
        ];
        for (text, place, message) in cases {
            let error = parse(&text, Path::new("m.toml")).unwrap_err().to_string();
            assert!(error.starts_with(place) && error.contains(message), "{text}\n{error}");
            assert_eq!(error.lines().count(), 1, "{error}");
        }
    }
}
