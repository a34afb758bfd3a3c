//! Short runs on disk: a log and a configuration each, the columns' names, and the solution in `truth/`.

use super::{Effect, Hidden, Law, Row, SimulatedRun};
use backseat_logs::DataError;
use backseat_logs::output::{self, Existing};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::Path;

/// Names of the columns, as the list beside the logs has them: one more than a row holds.
const NAMES: [&str; 36] = [
    "elapsedTime",
    "lat",
    "lon",
    "depth",
    "roll",
    "pitch",
    "heading",
    "targetHeading",
    "targetSpeed",
    "targetDepth",
    "vX",
    "vY",
    "vZ",
    "upperRudder",
    "lowerRudder",
    "portElevator",
    "stbdElevator",
    "propPower",
    "propCurrent",
    "propSpeed",
    "rudderMode",
    "elevMode",
    "propMode",
    "leakDetect",
    "battTemp",
    "battVolt",
    "battCurr",
    "battSOC",
    "totalCurrent",
    "temp1",
    "temp2",
    "temp3",
    "abortingVariable",
    "accelerationX",
    "accelerationY",
    "accelerationZ",
];

/// Writes the runs into a folder, which is made; nothing that is there is replaced.
///
/// # Errors
/// If a file exists or cannot be written.
pub fn write(runs: &[SimulatedRun], hidden: &Hidden, seed: u64, folder: &Path) -> Result<(), DataError> {
    let truth = folder.join("truth");
    std::fs::create_dir_all(&truth).map_err(|error| DataError::io(&truth, &error))?;
    let names: String = NAMES.iter().enumerate().fold(String::new(), |mut text, (column, name)| {
        let _ = writeln!(text, "{name} = data[:,{column}]");
        text
    });
    text(&folder.join("Iver Data Headings.txt"), &names)?;
    for run in runs {
        text(&folder.join(format!("IverControlData-{}.log", run.label)), &rows(&run.rows))?;
        text(&folder.join(format!("Config-{}.log", run.label)), &configuration(&run.law))?;
    }
    let effects: Vec<Value> = hidden.effects.iter().map(Effect::json).collect();
    let effects = json!({ "seed": seed, "effects": effects });
    text(&truth.join("effects.json"), &format!("{effects:#}\n"))
}

fn text(path: &Path, text: &str) -> Result<(), DataError> {
    output::write(path, Existing::Keep, |file| {
        file.write_all(text.as_bytes())?;
        Ok(())
    })
}

fn rows(rows: &[Row]) -> String {
    let mut text = String::new();
    for row in rows {
        let [roll, pitch, heading] = row.attitude_rad.map(f64::to_degrees);
        let heading = heading.rem_euclid(360.0);
        let (to, deep) = row.target.map_or((999.0, 999.0), |[to, deep]| (to.to_degrees().rem_euclid(360.0), deep));
        let doppler = row.doppler_mps.map_or("nan nan nan".to_owned(), |[x, y, z]| format!("{x:.3} {y:.3} {z:.1}"));
        let angles = [row.command.rudders_rad, row.command.elevators_rad].concat();
        let fins: Vec<String> = angles.iter().map(|angle| format!("{:.1}", angle.to_degrees())).collect();
        let mode = u8::from(row.target.is_some());
        let power = if row.command.is_powered { 12 } else { 0 };
        let [x, y, z] = row.gravity_mps2.map(|value| value / 9.81 * 1000.0);
        let _ = writeln!(
            text,
            "{:.3} 0.00000 0.00000 {:.1} {roll:.1} {pitch:.1} {heading:.1} {to:.1} 999.000 {deep:.1} {doppler} {} \
             {power} 0.0 {:.0} {mode} {mode} 0 0.0 22.4 15.2 0.065 67.0 0.004 0.0 0.0 0.0 {x:.1} {y:.1} {z:.1}",
            row.time_s,
            row.depth_m.max(0.0),
            fins.join(" "),
            row.motor_rpm.max(0.0),
        );
    }
    text
}

/// Settings in the order of their names.
fn configuration(law: &Law) -> String {
    let mut settings = vec![
        format!("control.depthdeadband = {}", law.depth_band_m),
        format!("control.depthpidp = {}", law.depth_p),
        format!("control.headingdeadband = {}", law.heading_band_deg),
        "control.headingpidp = -1.0".to_owned(),
    ];
    if let Some(gain) = law.roll_p {
        settings.extend(["control.rolldeadband = 3".to_owned(), format!("control.rollpidp = {gain}")]);
    }
    settings.extend(["fins.fincount0 = 3968".to_owned(), "fins.fincount1 = 8000".to_owned()]);
    format!(" ===== Config Input =====\n{}\n", settings.join("\n"))
}
