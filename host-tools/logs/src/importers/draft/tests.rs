//! Drafts of tables as they come.

use super::super::tests::{import_mapped, written};
use super::*;
use crate::importers::Imported;
use crate::log::Column;

/// The draft for a file of this content.
fn drafted(text: &str) -> Result<Draft, DataError> {
    draft(&written(text).1)
}

/// The same, and what is read by it.
fn drafted_and_read(text: &str) -> (Draft, Result<Imported, DataError>) {
    let draft = drafted(text).unwrap();
    let imported = import_mapped(text, &draft.text);
    (draft, imported)
}

#[test]
fn a_draft_runs_as_it_is() {
    let text = "Stamp [ns];Depth (ft);Yaw;Pitch;Roll;Rudder;Elevator;Shaft rpm;SOG (kn);Lat;Lon;Battery\n\
        1600000000000000000;1;270;2;1;5;-5;1000;2;41.0;-70.0;ok\n\
        1600000000200000000;2;271;2;1;5;-5;1000;2;41.0;-70.0;ok\n";
    let (draft, imported) = drafted_and_read(text);
    let log = imported.unwrap().log;
    assert_eq!(log.rows[1].time_us, 200_000);
    let value = |column| log.rows[0].get(column).unwrap();
    assert!((value(Column::Depth) - 0.3048).abs() < 1e-12);
    assert!((value(Column::Heading) + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert!((value(Column::SpeedLog) - 2.0 * 1852.0 / 3600.0).abs() < 1e-12);
    assert!((value(Column::FinTop) - 5.0_f64.to_radians()).abs() < 1e-12);
    assert!((value(Column::FinStarboard) - 5.0_f64.to_radians()).abs() < 1e-12);
    assert_eq!((value(Column::PropRpm), log.rows[0].gnss_m()), (1000.0, Some([0.0, 0.0])));
    assert_eq!(draft.unused, ["Battery"]);
}

/// A table as `ros2 topic echo --csv` and a spreadsheet leave it: it runs as drafted.
#[test]
fn names_of_ros_and_marks_of_no_sample() {
    // facing east, level; nose down 0.1 rad/s, to port 0.2 rad/s; sliding to port
    let text = "header.stamp,orientation.x,orientation.y,orientation.z,orientation.w,angular_velocity.x,angular_velocity.y,\
        angular_velocity.z,dvl.linear.x,dvl.linear.y,dvl.linear.z,odom.position.x,odom.position.y,prop_radps\n\
        1700000000000000000,0,0,0,1,0,0.1,0.2,1.5,0.3,0.4,7,8,NaN\n\
        1700000000500000000,0,0,0,1,0,0.1,0.2,1.5,0.3,0.4,7,8,100\n";
    let (draft, imported) = drafted_and_read(text);
    assert!(draft.unused.is_empty(), "{:?}", draft.unused);
    let rows = imported.unwrap().log.rows;
    let value = |column| rows[0].get(column).unwrap();
    assert!((rows[0].attitude_rad().unwrap()[2] - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    assert_eq!([Column::Q, Column::R, Column::DvlV, Column::DvlW].map(value), [-0.1, -0.2, -0.3, -0.4]);
    assert_eq!((value(Column::DvlU), rows[0].gnss_m()), (1.5, Some([8.0, 7.0])));
    assert_eq!([0, 1].map(|row| rows[row].get(Column::PropRpm).map(f64::round)), [None, Some(955.0)]);
    let text = "t,yaw enu [deg],DVL Velocity X [m/s],DVL Velocity Z [m/s]\n0,90,1,2\n1,180,1,2\n";
    let rows = drafted_and_read(text).1.unwrap().log.rows;
    assert!(rows[0].get(Column::Heading).unwrap().abs() < 1e-12); // to the north
    assert_eq!([Column::DvlU, Column::DvlW].map(|column| rows[0].get(column)), [Some(1.0), Some(2.0)]);
}

/// 2 m of sea water above 1 atm, by its definition; a depth of its own is preferred.
#[test]
fn a_pressure_is_a_depth() {
    let at_2_m = (101_325.0 + 2.0 * 1025.0 * 9.81) / 100.0;
    let log = drafted_and_read(&format!("t,abs_pressure_mbar\n0,1013.25\n1,{at_2_m}\n")).1.unwrap().log;
    let depths: Vec<f64> = log.rows.iter().filter_map(|row| row.get(Column::Depth)).collect();
    assert!(depths.len() == 2 && depths[0].abs() < 1e-9 && (depths[1] - 2.0).abs() < 1e-9, "{depths:?}");
    assert_eq!(drafted("t,pressure_dbar,depth_m\n0,1,1\n1,2,2\n").unwrap().unused, ["pressure_dbar"]);
}

/// ψ is a heading before it is a pressure; a course from east may be in gon.
#[test]
fn a_heading_by_its_symbol_and_in_gon() {
    for (name, heading) in
        [("nav_psi", 0.5), ("yaw_enu [gon]", std::f64::consts::FRAC_PI_2 - 0.5 * std::f64::consts::PI / 200.0)]
    {
        let (draft, imported) = drafted_and_read(&format!("t,{name},depth_m\n0,0.5,1\n1,0.5,2\n"));
        let found = imported.unwrap().log.rows[0].get(Column::Heading);
        assert!(found.is_some_and(|found| (found - heading).abs() < 1e-9), "{name}: {found:?} {}", draft.text);
    }
}

#[test]
fn a_log_that_is_no_table_needs_no_draft() {
    let all = [("NAV_DEPTH", 3), ("NAV_ROLL", 0), ("NAV_PITCH", 0), ("NAV_HEADING", 90), ("NAV_X", 1), ("NAV_Y", 2)];
    let lines: String = all.iter().map(|(name, value)| format!("0.5 {name} iIver {value}\n")).collect();
    let complaint = drafted(&format!("%% LOG FILE: dive.alog\n{lines}")).unwrap_err().to_string();
    assert!(complaint.contains("MOOS alog: needs no mapping"), "{complaint}");
}

/// A roll in degrees, no pitch, and a number that nothing was read from.
#[test]
fn a_log_of_messages_is_mended_by_its_own_names() {
    let mut text = "%% LOG FILE: boat.alog\n".to_owned();
    for t in 1..300 {
        let (roll_deg, heading_deg) = (9.0 * (0.9 * f64::from(t)).sin(), 40.0 + 20.0 * (0.02 * f64::from(t)).sin());
        text += &format!(
            "{t}.0 NAV_ROLL iBoat {roll_deg:.3}\n{t}.0 NAV_HEADING iBoat {heading_deg:.2}\n{t}.0 VOLTS iBoat 12\n"
        );
    }
    let draft = drafted(&text).unwrap();
    let line = "columns.roll_rad = { column = \"NAV_ROLL\", unit = \"deg\" }";
    assert!(draft.text.contains(line) && draft.text.contains("# pitch_rad = 0"), "{}", draft.text);
    assert_eq!((draft.unused, draft.doubts), (vec!["VOLTS".to_owned()], Vec::new()), "{}", draft.text);
}

#[test]
fn a_quaternion_and_constants() {
    // facing north-east (yaw 45 degrees from east), nose up by 10 degrees (pitch -10 in forward-left-up)
    let (yaw, pitch) = (45.0_f64.to_radians(), -10.0_f64.to_radians());
    let ((sy, cy), (sp, cp)) = ((0.5 * yaw).sin_cos(), (0.5 * pitch).sin_cos());
    let q = [cy * cp, -sy * sp, cy * sp, sy * cp];
    let text = format!("t,w,x,y,z\n0,{},{},{},{}\n", q[0], q[1], q[2], q[3]);
    let map = "[time]\ncolumn = \"t\"\n[columns]\n[quaternion]\ncolumns = [\"w\", \"x\", \"y\", \"z\"]\nframes = \"enu-flu\"\n\
        [constants]\nprop_rpm = 900.0\n";
    let row = import_mapped(text, map).unwrap().log.rows[0].clone();
    let euler = row.attitude_rad().unwrap();
    for (found, expected) in euler.iter().zip([0.0, 10.0_f64.to_radians(), 45.0_f64.to_radians()]) {
        assert!((found - expected).abs() < 1e-12, "{euler:?}");
    }
    assert_eq!(row.get(Column::PropRpm), Some(900.0));
}

/// Words of the axes, radians of a position, counts, comments in front, NaN of MATLAB.
#[test]
fn words_of_axes_units_and_comments() {
    let text = "# made by a script\n# t [s],Latitude [rad],Longitude [rad],dvl_fwd,dvl_left,dvl_up,yaw_enu_deg,prop_rps,rudder_cmd,water_depth\n\
        0,0.7,-1.2,1.5,0.1,-0.2,90,10,128,30\n1,0.7,-1.2,NaN,NaN,NaN,180,10,255,30\n";
    let (draft, imported) = drafted_and_read(text);
    let rows = imported.unwrap_or_else(|e| panic!("{e}\n{}", draft.text)).log.rows;
    let value = |column| rows[0].get(column).unwrap();
    assert_eq!([Column::DvlU, Column::DvlV, Column::DvlW].map(value), [1.5, -0.1, 0.2]);
    assert_eq!((value(Column::PropRpm), rows[0].gnss_m(), rows[1].dvl_mps()), (600.0, Some([0.0, 0.0]), None));
    assert!(value(Column::Heading).abs() < 1e-12, "to the north");
    assert_eq!(draft.unused, ["rudder_cmd", "water_depth"], "counts, and the water's depth");
    assert!(draft.text.contains("# check: its name states no unit; m/s by its values"), "{}", draft.text);
    let complaint = drafted("0,1,2\n1,2,3\n").unwrap_err().to_string();
    assert!(complaint.contains("numbers, where the names of the columns are expected"), "{complaint}");
}

/// A yaw that is counted from east, as no name says: the fixes show it.
#[test]
fn the_tests_of_columns_correct_the_draft() {
    let mut text = "t,yaw [deg],speed [m/s],northing,easting\n".to_owned();
    let (mut north, mut east) = (0.0, 0.0);
    for t in 0..900 {
        let heading: f64 = if (t / 100) % 2 == 0 { 0.5 } else { 2.4 };
        (north, east) = (north + 1.5 * heading.cos(), east + 1.5 * heading.sin());
        text += &format!("{t},{},1.5,{north:.2},{east:.2}\n", (90.0 - heading.to_degrees()).rem_euclid(360.0));
    }
    let (draft, imported) = drafted_and_read(&text);
    assert_eq!((draft.changes.len(), &draft.doubts[..]), (1, &[][..]), "{}", draft.text);
    let heading = imported.unwrap().log.rows[0].get(Column::Heading).unwrap();
    assert!((heading - 0.5).abs() < 1e-6, "{heading} {}", draft.text);
    assert!(draft.text.contains("sure: course against heading: holds; changed: heading_rad is counted from east"));
}

/// What the reader does not take is left out or marked: the draft reads the table, or says what it lacks.
#[test]
fn a_draft_reads_its_own_table() {
    let rows = |header: &str, row: &dyn Fn(usize) -> String| {
        let lines: Vec<String> = (0..60).map(row).collect();
        let text = format!("{header}\n{}\n", lines.join("\n"));
        let draft = drafted(&text).unwrap();
        let map = ColumnMap::parse(&draft.text, Path::new("m.toml"));
        let read = map.and_then(|_| import_mapped(&text, &draft.text));
        (draft, read)
    };
    // degrees and minutes as NMEA has them are no latitude
    let (draft, read) = rows("time,lat,lon,depth", &|t| format!("{t},4130.1,-7040.2,{}.5", t % 7));
    assert_eq!(read.unwrap().log.rows[1].get(Column::Depth), Some(1.5), "{}", draft.text);
    assert!(draft.doubts[0].starts_with("\"lat\" is left out, it does not read: "), "{:?}", draft.doubts);
    assert_eq!(draft.unused, ["lat", "lon"]);
    let (draft, read) = rows("time,depth,depth,pitch_deg", &|t| format!("{t},{t},{t},{}", t % 7));
    assert!(read.unwrap().log.has(Column::Pitch) && draft.doubts[0].contains("column depth appears twice"));
    let (draft, read) = rows("time,depth", &|t| format!("{t},{}", if t == 9 { "ERR".into() } else { t.to_string() }));
    assert_eq!(read.unwrap().log.column(Column::Depth).count(), 59);
    assert!(draft.text.contains("missing = [\"ERR\"]  # check: what stands"), "{}", draft.text);
    let (draft, _) = rows("depth,pitch", &|t| format!("{t},{}", t % 7));
    assert!(draft.doubts[0].ends_with("no column looks like a time; name it in [time]"), "{:?}", draft.doubts);
    let (draft, _) = rows("time,depth [furlong]", &|t| format!("{t},{t}"));
    assert!(draft.text.contains("its name states \"furlong\", which is no unit of a mapping"), "{}", draft.text);
    let (draft, read) = rows("time,press (psi)", &|t| format!("{t},{}", 20 + t));
    assert!(read.is_ok() && draft.text.contains("unit = \"psi\""), "{}", draft.text);
}

/// A name that says radians over values of degrees; a heading that is counted on over several turns is one in radians.
#[test]
fn values_stand_above_the_unit_of_a_name() {
    let heading = |values: &dyn Fn(f64) -> f64| {
        let lines: Vec<String> = (0..600).map(|t| format!("{t},{:.2}", values(f64::from(t)))).collect();
        let (draft, imported) = drafted_and_read(&format!("t_s,heading_rad\n{}\n", lines.join("\n")));
        let read = imported.unwrap().log.rows[100].get(Column::Heading).unwrap();
        (read, draft.checks.iter().map(|(entry, why)| format!("{entry}: {why}")).collect::<String>())
    };
    let (read, checks) = heading(&|t| (1.3 * t) % 360.0);
    assert!((read - 130.0_f64.to_radians()).abs() < 1e-9, "{read}");
    assert_eq!(checks, "heading_rad: its name says rad, its values are 0 to 358.9: taken for deg");
    let (read, checks) = heading(&|t| 0.03 * t);
    assert!((read - 3.0).abs() < 1e-9, "{read}");
    assert_eq!(
        checks,
        "heading_rad: its name says rad, its values are 0 to 17.97: radians over several turns, or deg?"
    );
    assert_eq!(heading(&|t| (0.03 * t) % 6.2).1, "");
}

/// The day first where a field beyond twelve shows it; where none does, to be checked.
#[test]
fn dates_with_the_year_last() {
    for (date, unit, is_open) in
        [("25/11/2026", "dmy", false), ("11/25/2026", "mdy", false), ("05/11/2026", "dmy", true)]
    {
        let text = format!("time,depth\n{date} 14:03:22.5,1\n{date} 14:03:23.5,2\n");
        let (draft, imported) = drafted_and_read(&text);
        assert!(draft.text.contains(&format!("unit = \"{unit}\"")), "{}", draft.text);
        assert_eq!(draft.checks.iter().any(|(entry, _)| entry == "time"), is_open, "{:?}", draft.checks);
        assert_eq!(imported.unwrap().log.rows[1].time_us, 1_000_000);
    }
}
