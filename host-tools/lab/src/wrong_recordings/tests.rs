//! The bench in short: the samples of the guide, and one simulated log.

use super::judge::{Judged, Verdict, judge};
use super::page::Counts;
use super::{Clean, accusations, latest, logs};
use backseat_logs::log::plausibility::Examination;
use backseat_logs::{Column, Log, importers};
use std::collections::BTreeMap;
use std::path::Path;

fn sample(name: &str) -> Log {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/guide/samples").join(name);
    importers::read(&path).unwrap().log
}

/// The logs show more or fewer of the mistakes: one in which the vehicle never dives shows no sign of a pitch.
#[test]
fn no_wrong_recording_that_a_log_shows_passes_in_silence() {
    for (name, least) in [("dive.csv.gz", 80), ("iver_survey.csv.gz", 29)] {
        let log = sample(name);
        let table: BTreeMap<String, Judged> =
            latest::all().iter().filter_map(|wrong| Some((wrong.name.clone(), judge(wrong, &log)?))).collect();
        let counts = Counts::of(table.values());
        let missed: Vec<(&String, Verdict)> = (table.iter().map(|(name, judged)| (name, judged.verdict)))
            .filter(|(_, verdict)| *verdict >= Verdict::Refused && *verdict != Verdict::Told)
            .collect();
        assert_eq!(counts.silent(), 0, "{name}: {missed:?}");
        assert!(counts.shown() >= least, "{name}: {} shown, {missed:?}", counts.shown());
        assert!(counts.named() * 10 >= counts.shown() * 9, "{name}: {} named, {missed:?}", counts.named());
    }
}

#[test]
fn what_is_recorded_rightly_is_not_accused() {
    for name in ["dive.csv.gz", "trial_vehicle.csv.gz", "iver_survey.csv.gz"] {
        assert_eq!(accusations(&sample(name)), [""; 0], "{name}");
    }
    for (kind, seed) in [(Clean::AsDeclared, 1), (Clean::Vessel, 2)] {
        let (what, log) = logs::clean(kind, seed).unwrap();
        assert_eq!(accusations(&log), [""; 0], "{what}");
    }
}

/// A mend is text for a mapping: read by it, the wrong log is the right one.
#[test]
fn a_mapping_with_the_mend_reads_the_right_log() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.csv");
    let log = sample("dive.csv.gz");
    for name in
        ["heading negated", "heading from east, counter-clockwise", "gps_x_m and gps_y_m exchanged", "depth_m in ft"]
    {
        let wrong = latest::all().into_iter().find(|wrong| wrong.name == name).unwrap();
        let wrong_log = wrong.apply(&log).unwrap();
        let found = Examination::of(&wrong_log);
        let mend = found.suspicions().next().unwrap().mend.clone().unwrap();
        let columns = [Column::Heading, Column::GpsX, Column::GpsY, Column::Depth];
        let mut text = format!("t_s,{}\n", columns.map(Column::name).join(","));
        let cell = |value: Option<f64>| value.map_or_else(String::new, |value| value.to_string());
        for row in &wrong_log.rows {
            text +=
                &format!("{},{}\n", row.time_us as f64 * 1e-6, columns.map(|column| cell(row.get(column))).join(","));
        }
        std::fs::write(&path, text).unwrap();
        let mut map = format!("time = {{ column = \"t_s\" }}\n{mend}\n");
        for column in columns.iter().filter(|column| !mend.contains(&format!("columns.{} =", column.name()))) {
            map += &format!("columns.{0} = {{ column = \"{0}\" }}\n", column.name());
        }
        let map = importers::ColumnMap::parse(&map, Path::new("mend.toml")).unwrap();
        let mended = importers::read_mapped(&path, &map).unwrap().log;
        for column in columns {
            for ((_, a), (_, b)) in mended.column(column).zip(log.column(column)) {
                let apart = if column == Column::Heading {
                    (a - b).sin().abs().max(1.0 - (a - b).cos())
                } else {
                    (a - b).abs()
                };
                // digits of the offset in the mend, and of a depth in feet
                assert!(apart < 1e-6, "{name}: {} {a} {b}", column.name());
            }
        }
    }
}
