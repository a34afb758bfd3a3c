//! Logs of MOOS (`.alog`): one variable a line, as time, name, source, value.
//!
//! The variables are those that MOOS-IvP's helms and simulators share: x east and y north in metres, heading in degrees
//! from true north, speed in m/s, depth in metres; yaw, pitch and roll in radians. A mapping names any other, such as
//! the helm's commands: `DESIRED_RUDDER` is in degrees or per cent by vehicle. The value of a variable that is a text may
//! have several lines (`DB_VARSUMMARY`). Of several sources of one variable the one that sends most is used.

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
/// Of so many lines one at least has a message: in sound logs lists of all variables are up to five of six lines.
const LINES_OF_A_MESSAGE: usize = 10;
/// What `aloggrep` writes above the log that it cut out.
const CUT_OUT: &str = "Processing on file";

/// Whether the first lines of a file are those of an alog.
pub(super) fn is_alog(beginning: &str) -> bool {
    let mut lines = beginning.lines().skip_while(|line| line.trim().is_empty() || line.starts_with(CUT_OUT));
    lines.next().is_some_and(|line| line.starts_with("%%"))
}

/// Reads an alog.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let mut signals = Signals::new(path, map, "moos")?;
    signals.is_one_by_one = true;
    let mut lines = BufReader::new(table::open_lines(path)?);
    let mut bytes = Vec::new();
    let (mut messages, mut continued, mut first_continued) = (0_usize, 0_usize, None);
    for number in 1.. {
        bytes.clear();
        let count = lines.read_until(b'\n', &mut bytes).map_err(|e| DataError::io(path, &e))?;
        // a last line without its end was cut off
        if count == 0 || (bytes.last() != Some(&b'\n') && number > 1) {
            break;
        }
        let line = String::from_utf8_lossy(&bytes);
        if let Some(comment) = line.strip_prefix("%%") {
            // the first of the columns that such a log names
            if messages == 0 && comment.trim_start().starts_with("(1) ") {
                let message = "a synchronous log of MOOS (.slog), which repeats the last value of each variable: give the \
                               .alog beside it";
                return Err(DataError::at(path, number, 0, message));
            }
            // %% LOGSTART with seconds since 1970
            let start = comment.split_once("LOGSTART").and_then(|(_, start)| start.trim().parse::<f64>().ok());
            if let Some(start_s) = start.filter(|start_s| (0.0..1e10).contains(start_s)) {
                signals.shift_us = (start_s * 1e6).round() as i64;
            }
            continue;
        }
        if line.trim().is_empty() || (messages == 0 && line.starts_with(CUT_OUT)) {
            continue;
        }
        let Some(Message { time_s, variable, source, value }) = Message::of(&line) else {
            continued += 1;
            first_continued = first_continued.or(Some(number));
            continue;
        };
        messages += 1;
        let time_us = (time_s * 1e6).round() as i64;
        let which = if signals.takes(variable) { format!("[{source}]") } else { String::new() };
        match value.parse::<f64>() {
            Ok(value) => signals.message(time_us, variable, &which, &[("", value)]),
            Err(_) if TABLES["moos"].messages.iter().any(|row| row.name == variable) => {
                return Err(DataError::at(path, number, 4, format!("{variable}: {value:?} is not a number")));
            }
            Err(_) => signals.message(time_us, variable, &which, &[]),
        }
    }
    let mut notes = Vec::new();
    if let Some(number) = first_continued {
        if messages * LINES_OF_A_MESSAGE < messages + continued {
            let message = format!(
                "expected time, variable, source and value; {continued} of {} lines have none",
                messages + continued
            );
            return Err(DataError::at(path, number, 0, message));
        }
        notes.push(format!("{continued} lines go on with the text of the line before them and are left out"));
    }
    if signals.has("NAV_X") && !(signals.has("GPS_X") && signals.has("GPS_Y")) {
        notes.push(
            "NAV_X and NAV_Y are taken for fixes: where the vehicle reckons them itself they are none".to_owned(),
        );
    }
    signals.finish(NAME, notes)
}

/// What a line says.
struct Message<'a> {
    time_s: f64,
    variable: &'a str,
    source: &'a str,
    value: &'a str,
}

impl<'a> Message<'a> {
    /// `None` of a line that goes on with the text of the one before it.
    fn of(line: &'a str) -> Option<Self> {
        let mut cells = line.split_whitespace();
        let time_s = cells.next()?.parse::<f64>().ok().filter(|time_s| time_s.is_finite() && time_s.abs() < 1e10)?;
        let variable = cells.next().filter(|name| name.parse::<f64>().is_err())?;
        Some(Self { time_s, variable, source: cells.next()?, value: cells.next().unwrap_or_default() })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{import, import_mapped};
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
        assert_eq!(imported.log.estimated_fixes.as_deref(), Some("NAV_X, NAV_Y"));
        let measured = import(ALOG.replace("NAV_X", "GPS_X").replace("NAV_Y", "GPS_Y")).unwrap().log;
        assert_eq!((measured.estimated_fixes, measured.rows[0].gnss_m()), (None, Some([4.0, 3.0])));
        assert!((row.get(Column::Heading).unwrap() + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert_eq!(imported.log.rows[1].time_us, 1_000_000);
        let notes = imported.log.notes.join("\n");
        assert!(notes.contains("DESIRED_RUDDER (1)") && notes.contains("APPCAST (1)"), "{notes}");
    }

    /// The helm's commands come one by one, each where it changes; a row has all that hold.
    #[test]
    fn commands_are_those_that_the_mapping_names() {
        let alog = format!(
            "{}0.70 DESIRED_THRUST pHelm 50\n0.90 DESIRED_ELEVATOR pHelm -10\n1.20 DESIRED_RUDDER pHelmIvP -4\n",
            ALOG.rsplit_once('\n').unwrap().0.to_owned() + "\n"
        );
        let entry =
            |column: &str, variable: &str, rest: &str| format!("[columns.{column}]\ncolumn = \"{variable}\"\n{rest}\n");
        let map = entry("prop_rpm", "DESIRED_THRUST", "scale = 20")
            + &entry("fin_top_rad", "DESIRED_RUDDER", "unit = \"deg\"")
            + &entry("fin_bottom_rad", "DESIRED_RUDDER", "unit = \"deg\"\nsign = -1")
            + &entry("fin_port_rad", "DESIRED_ELEVATOR", "unit = \"deg\"")
            + &entry("fin_starboard_rad", "DESIRED_ELEVATOR", "unit = \"deg\"\nsign = -1");
        let log = import_mapped(alog, &map).unwrap().log;
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

    /// A text of several lines, and what `aloggrep` writes above.
    #[test]
    fn a_text_may_have_several_lines() {
        let summary =
            "0.650 DB_VARSUMMARY MOOSDB Variable \"time\nNAV_X 18:59:59.000 (write pending) 0.0 Hz ~\n\n  \"etc\n";
        let alog = format!("Processing on file : x.alog\n{}", ALOG.replacen("0.700 ", &format!("{summary}0.700 "), 1));
        let log = import(&alog).unwrap().log;
        assert_eq!(log.rows.len(), 2);
        let notes = log.notes.join("\n");
        assert!(notes.contains("2 lines go on with the text of the line before them"), "{notes}");
    }

    /// The vehicle's own position every second and another process's, less often.
    #[test]
    fn of_several_sources_the_one_that_sends_most_is_used() {
        let other = "0.600 NAV_SPEED pOther 9.0\n0.700 NAV_HEADING pOther 10\n0.800 NAV_HEADING pOther 11\n";
        let alog = ALOG.replacen("1.500 ", &format!("{other}1.200 NAV_SPEED uSimMarine 1.4\n1.500 "), 1);
        let log = import(&alog).unwrap().log;
        let speeds: Vec<f64> = log.column(Column::SpeedLog).map(|(_, speed)| speed).collect();
        let headings: Vec<f64> = log.column(Column::Heading).map(|(_, rad)| rad.to_degrees().round()).collect();
        assert_eq!((speeds, headings), (vec![1.5, 1.4], vec![10.0, 11.0]));
        let notes = log.notes.join("\n");
        let said = "left out NAV_HEADING[uSimMarine] (1), NAV_SPEED[pOther] (1): another sensor with the same message";
        assert!(notes.contains("NAV_HEADING[pOther] (heading_rad)") && notes.contains(said), "{notes}");
        // by a mapping as well, unless it names the source
        for (name, expected) in [("NAV_SPEED", vec![1.5, 1.4]), ("NAV_SPEED[pOther]", vec![9.0])] {
            let map = format!("[columns.speed_log_mps]\ncolumn = \"{name}\"\n");
            let log = import_mapped(&alog, &map).unwrap().log;
            assert_eq!(log.column(Column::SpeedLog).map(|(_, speed)| speed).collect::<Vec<_>>(), expected, "{name}");
        }
    }

    /// As the guide says of a vehicle that logs no roll and pitch; a table needs its columns.
    #[test]
    fn constants_stand_beside_what_a_log_has() {
        let map = "[constants]\nroll_rad = 0\npitch_rad = 0\n";
        let log = import_mapped(ALOG, map).unwrap().log;
        let attitude_rad = log.rows[0].attitude_rad().unwrap();
        assert_eq!(attitude_rad.map(|rad| rad.to_degrees().round()), [0.0, 0.0, -90.0]);
        let complaint = import_mapped("Zeit,Tiefe\n0,1\n", map).unwrap_err().to_string();
        assert!(complaint.contains("[columns] is empty"), "{complaint}");
    }

    /// Yaw is counted from north as well, counter-clockwise and in radians.
    #[test]
    fn a_yaw_is_a_heading_where_there_is_no_other() {
        let with_yaw = ALOG.replacen("0.600 ", "0.550 NAV_YAW uSimMarine 0.5\n0.600 ", 1);
        let headings =
            |text: &str| import(text).unwrap().log.column(Column::Heading).map(|(_, rad)| rad).collect::<Vec<_>>();
        assert_eq!(headings(&with_yaw.replace("NAV_HEADING", "OTHER")), [-0.5]);
        assert_eq!(headings(&with_yaw), headings(ALOG));
    }

    #[test]
    fn a_synchronous_log_is_told() {
        let slog =
            "%%%%\n%% LOG FILE: x.slog\n%%%%\n%%   (1) TIME\n%%   (2) NAV_YAW\n%%%%\n%% TIME  NAV_YAW\n0.9  NaN\n";
        let complaint = import(slog).unwrap_err().to_string();
        assert!(complaint.contains(":4: a synchronous log of MOOS (.slog)"), "{complaint}");
    }

    #[test]
    fn broken_lines_are_named() {
        let complaint = |from: &str, to: &str| import(ALOG.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(complaint("270", "west").contains(":7:4: NAV_HEADING: \"west\" is not a number"));
        let damaged = "soon NAV_X uSimMarine 3.0\n".repeat(99);
        let complaint = complaint("0.500 ", &damaged);
        assert!(complaint.contains(":5: expected time, variable, source and value; 100 of 107 lines"), "{complaint}");
    }
}
