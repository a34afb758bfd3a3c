//! Logs of MOOS (`.alog`): one variable a line, as time, name, source, value.
//!
//! The variables are those that MOOS-IvP's helms and simulators share: x east and y north in metres, heading in degrees
//! from true north, speed in m/s, depth in metres; yaw, pitch and roll in radians.

use super::Imported;
use super::RAD_PER_DEG;
use super::messages::Gathering;
use crate::DataError;
use crate::log::{Column, table};
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "MOOS alog";

/// Variables and what they are: column and factor.
const VARIABLES: &[(&str, Column, f64)] = &[
    ("NAV_HEADING", Column::Heading, RAD_PER_DEG),
    ("NAV_PITCH", Column::Pitch, 1.0),
    ("NAV_ROLL", Column::Roll, 1.0),
    ("NAV_DEPTH", Column::Depth, 1.0),
    ("NAV_SPEED", Column::SpeedLog, 1.0),
    ("SOUND_SPEED", Column::SoundSpeed, 1.0),
    ("GPS_X", Column::GpsY, 1.0),
    ("GPS_Y", Column::GpsX, 1.0),
    ("NAV_X", Column::GpsY, 1.0),
    ("NAV_Y", Column::GpsX, 1.0),
];

/// Whether the beginning of a file is that of an alog.
pub(super) fn is_alog(beginning: &str) -> bool {
    beginning.starts_with("%%")
}

/// Reads an alog.
pub(super) fn read(path: &Path) -> Result<Imported, DataError> {
    let lines = lines(path)?;
    let present: BTreeSet<&str> = lines.iter().filter_map(|(_, line)| line.split_whitespace().nth(1)).collect();
    let has_gps = present.contains("GPS_X") && present.contains("GPS_Y");
    let mut gathering = Gathering::default();
    let mut recognised: BTreeSet<&str> = BTreeSet::new();
    for (number, line) in &lines {
        let mut cells = line.split_whitespace();
        let (Some(time), Some(variable), Some(_source)) = (cells.next(), cells.next(), cells.next()) else {
            return Err(DataError::at(path, *number, 0, "expected time, variable, source and value"));
        };
        let Some(time_s) = time.parse::<f64>().ok().filter(|time_s| time_s.is_finite() && time_s.abs() < 1e10) else {
            return Err(DataError::at(path, *number, 1, format!("{time:?} is not a time in seconds")));
        };
        let value = cells.next().unwrap_or_default();
        let Some((_, column, factor)) = VARIABLES.iter().find(|(name, ..)| *name == variable) else {
            let reason = match variable {
                "DESIRED_RUDDER" | "DESIRED_ELEVATOR" | "DESIRED_THRUST" => {
                    "per cent or degrees, by vehicle: no fin angle"
                }
                _ => "not part of a vehicle log",
            };
            gathering.leave_out(variable, reason);
            continue;
        };
        if has_gps && ["NAV_X", "NAV_Y"].contains(&variable) {
            gathering.leave_out(variable, "the vehicle's own estimate; GPS_X and GPS_Y are used");
            continue;
        }
        let Ok(number_read) = value.parse::<f64>() else {
            return Err(DataError::at(path, *number, 4, format!("{variable}: {value:?} is not a number")));
        };
        recognised.insert(variable);
        gathering.add((time_s * 1e6).round() as i64, &[(*column, number_read * factor)]);
    }
    let recognised: Vec<&str> = recognised.into_iter().collect();
    let mut notes = vec![format!("{NAME}; recognised: {}", recognised.join(", "))];
    if !has_gps && recognised.contains(&"NAV_X") {
        notes.push(
            "NAV_X and NAV_Y are taken for fixes: where the vehicle reckons them itself they are none".to_owned(),
        );
    }
    Ok(Imported { format: NAME, log: gathering.finish(path, notes)? })
}

/// Lines that are no comment, with their numbers; a last line without its end was cut off.
fn lines(path: &Path) -> Result<Vec<(u64, String)>, DataError> {
    let mut reader = BufReader::new(table::open(path)?);
    let (mut lines, mut bytes) = (Vec::new(), Vec::new());
    for number in 1.. {
        bytes.clear();
        let count = reader.read_until(b'\n', &mut bytes).map_err(|e| DataError::io(path, &e))?;
        if count == 0 || (bytes.last() != Some(&b'\n') && number > 1) {
            break;
        }
        let line = String::from_utf8_lossy(&bytes);
        let line = line.trim();
        if !line.is_empty() && !line.starts_with('%') {
            lines.push((number, line.to_owned()));
        }
    }
    Ok(lines)
}

#[cfg(test)]
mod tests {
    use super::super::tests::import;
    use super::*;

    const ALOG: &str = "%%%%%%%%\n%% LOG FILE: x.alog\n%% LOGSTART 1475765467.06\n%%%%%%%%\n\
        0.500    NAV_X         uSimMarine   3.0\n\
        0.501    NAV_Y         uSimMarine   4.0\n\
        0.502    NAV_HEADING   uSimMarine   270\n\
        0.503    NAV_SPEED     uSimMarine   1.5\n\
        0.600    DESIRED_RUDDER  pHelmIvP   12\n\
        0.700    APPCAST       pHelmIvP     proc=pHelmIvP!@#iter=1\n\
        1.500    NAV_X         uSimMarine   1.5\n\
        1.501    NAV_Y         uSimMarine   4.0\n\
        1.502    NAV_HEADING   uSimMar";

    #[test]
    fn variables_of_one_time_share_a_row() {
        let imported = import(ALOG).unwrap();
        assert_eq!((imported.format, imported.log.rows.len()), (NAME, 2));
        let row = &imported.log.rows[0];
        // x is east
        assert_eq!((row.gnss_m(), row.get(Column::SpeedLog)), (Some([4.0, 3.0]), Some(1.5)));
        assert!((row.get(Column::Heading).unwrap() + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert_eq!(imported.log.rows[1].time_us, 1_000_000);
        let notes = imported.log.notes.join("\n");
        assert!(notes.contains("DESIRED_RUDDER (1)") && notes.contains("APPCAST (1)"), "{notes}");
    }

    #[test]
    fn broken_lines_are_named() {
        let complaint = |from: &str, to: &str| import(&ALOG.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(complaint("270", "west").contains(":7:4: NAV_HEADING: \"west\" is not a number"));
        assert!(complaint("0.500 ", "soon ").contains(":5:1: \"soon\" is not a time"));
    }
}
