//! Logs of MOOS (`.alog`): one variable a line, as time, name, source, value.
//!
//! The variables are those that MOOS-IvP's helms and simulators share: x east and y north in metres, heading in degrees
//! from true north, speed in m/s, depth in metres; yaw, pitch and roll in radians. A mapping names any other, such as
//! the helm's commands: `DESIRED_RUDDER` is in degrees or per cent by vehicle.

use super::Imported;
use super::mapping::ColumnMap;
use super::message_tables::TABLES;
use super::signals::Signals;
use crate::DataError;
use crate::log::table;
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "MOOS alog";

/// Whether the beginning of a file is that of an alog.
pub(super) fn is_alog(beginning: &str) -> bool {
    beginning.starts_with("%%")
}

/// Reads an alog.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let mut signals = Signals::new(path, map, "moos")?;
    signals.is_one_by_one = true;
    let mut lines = BufReader::new(table::open_lines(path)?);
    let mut bytes = Vec::new();
    for number in 1.. {
        bytes.clear();
        let count = lines.read_until(b'\n', &mut bytes).map_err(|e| DataError::io(path, &e))?;
        // a last line without its end was cut off
        if count == 0 || (bytes.last() != Some(&b'\n') && number > 1) {
            break;
        }
        let line = String::from_utf8_lossy(&bytes);
        let mut cells = line.split_whitespace();
        let Some(time) = cells.next().filter(|first| !first.starts_with('%')) else {
            // %% LOGSTART with seconds since 1970
            let start = line.split_once("LOGSTART").and_then(|(_, start)| start.trim().parse::<f64>().ok());
            if let Some(start_s) = start.filter(|start_s| (0.0..1e10).contains(start_s)) {
                signals.shift_us = (start_s * 1e6).round() as i64;
            }
            continue;
        };
        let (Some(variable), Some(_source)) = (cells.next(), cells.next()) else {
            return Err(DataError::at(path, number, 0, "expected time, variable, source and value"));
        };
        let Some(time_s) = time.parse::<f64>().ok().filter(|time_s| time_s.is_finite() && time_s.abs() < 1e10) else {
            return Err(DataError::at(path, number, 1, format!("{time:?} is not a time in seconds")));
        };
        let time_us = (time_s * 1e6).round() as i64;
        let value = cells.next().unwrap_or_default();
        match value.parse::<f64>() {
            Ok(value) => signals.message(time_us, variable, "", &[("", value)]),
            Err(_) if TABLES["moos"].messages.iter().any(|row| row.name == variable) => {
                return Err(DataError::at(path, number, 4, format!("{variable}: {value:?} is not a number")));
            }
            Err(_) => signals.message(time_us, variable, "", &[]),
        }
    }
    let is_reckoned = signals.has("NAV_X") && !(signals.has("GPS_X") && signals.has("GPS_Y"));
    let note = "NAV_X and NAV_Y are taken for fixes: where the vehicle reckons them itself they are none";
    signals.finish(NAME, if is_reckoned { vec![note.to_owned()] } else { Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::super::tests::import;
    use super::*;
    use crate::log::Column;

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

    /// The helm's commands come one by one, each where it changes; a row has all that hold.
    #[test]
    fn commands_are_those_that_the_mapping_names() {
        let alog = format!(
            "{}0.70 DESIRED_THRUST pHelm 50\n0.90 DESIRED_ELEVATOR pHelm -10\n1.20 DESIRED_RUDDER pHelm -4\n",
            ALOG.rsplit_once('\n').unwrap().0.to_owned() + "\n"
        );
        let entry =
            |column: &str, variable: &str, rest: &str| format!("[columns.{column}]\ncolumn = \"{variable}\"\n{rest}\n");
        let map = entry("prop_rpm", "DESIRED_THRUST", "scale = 20")
            + &entry("fin_top_rad", "DESIRED_RUDDER", "unit = \"deg\"")
            + &entry("fin_bottom_rad", "DESIRED_RUDDER", "unit = \"deg\"\nsign = -1")
            + &entry("fin_port_rad", "DESIRED_ELEVATOR", "unit = \"deg\"")
            + &entry("fin_starboard_rad", "DESIRED_ELEVATOR", "unit = \"deg\"\nsign = -1");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.alog");
        std::fs::write(&path, alog).unwrap();
        let map = ColumnMap::parse(&map, Path::new("m.toml")).unwrap();
        let log = super::super::read_mapped(&path, &map).unwrap().log;
        let inputs: Vec<_> = log.rows.iter().filter_map(|row| Some((row.time_us, row.actuators()?))).collect();
        let [(0.., first), (700_000, last)] = inputs[..] else { panic!("{inputs:?}") };
        assert!((first.propeller_radps - 1000.0 * std::f64::consts::PI / 30.0).abs() < 1e-9, "{first:?}");
        assert_eq!(first.fins_rad.map(|rad| rad.to_degrees().round()), [12.0, -12.0, -10.0, 10.0]);
        assert_eq!(last.fins_rad.map(|rad| rad.to_degrees().round()), [-4.0, 4.0, -10.0, 10.0]);
    }

    /// More than a record of a CSV may have, behind a quotation mark that nothing closes.
    #[test]
    fn quotation_marks_mean_nothing() {
        let whole = ALOG.rsplit_once('\n').unwrap().0;
        let long = format!("{whole}\n{}", "2.000 APPCAST pHelmIvP \"\n".repeat(50_000));
        assert_eq!(import(&long).unwrap().log.rows.len(), 2);
    }

    #[test]
    fn broken_lines_are_named() {
        let complaint = |from: &str, to: &str| import(&ALOG.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(complaint("270", "west").contains(":7:4: NAV_HEADING: \"west\" is not a number"));
        assert!(complaint("0.500 ", "soon ").contains(":5:1: \"soon\" is not a time"));
    }
}
