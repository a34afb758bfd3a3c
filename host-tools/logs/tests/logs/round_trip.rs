//! A log that is written reads back as it was, to the decimals written.

use backseat_core::dynamics::ActuatorInput;
use backseat_logs::{Column, Log, LogRow, LogWriter};

fn rows() -> Vec<LogRow> {
    (0..500_u64)
        .map(|k| {
            let mut row = LogRow::new(k * 142_857);
            // A quotient is the double nearest to its decimals, as a number that is read.
            row.set(Column::Depth, (30_000 + k) as f64 / 10_000.0);
            if k % 3 == 0 {
                row.set_all(Column::Roll, &[0.01, -0.02, 1.5]).set_all(Column::P, &[0.001, -0.002, 0.003]);
            }
            if k % 5 == 0 {
                row.set(Column::PropRpm, 1000.5).set_all(Column::FinTop, &[0.1, -0.1, 0.2, -0.2]);
            }
            row
        })
        .collect()
}

#[test]
fn plain_and_compressed() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["log.csv", "log.csv.gz"] {
        let path = folder.path().join(name);
        let mut writer = LogWriter::create(&path).unwrap();
        for row in &rows() {
            writer.write(row).unwrap();
        }
        writer.finish().unwrap();
        let log = Log::read(&path).unwrap();
        assert_eq!(log.rows.len(), rows().len());
        for (read, written) in log.rows.iter().zip(&rows()) {
            assert_eq!(read, written);
        }
        assert!(log.notes.is_empty());
        assert!(LogWriter::create(&path).is_err(), "a log is never overwritten");
    }
}

#[test]
fn actuators_go_both_ways() {
    let input = ActuatorInput { propeller_radps: 104.719_755, fins_rad: [0.1, -0.1, 0.2, -0.2] };
    let mut row = LogRow::new(0);
    assert_eq!(row.actuators(), None);
    let read = row.set_actuators(&input).actuators().unwrap();
    assert!((read.propeller_radps - input.propeller_radps).abs() < 1e-12); // rounding of rpm and back
    assert_eq!(read.fins_rad, input.fins_rad);
}

#[test]
fn an_interrupted_run_leaves_a_readable_log() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let mut writer = LogWriter::create(&path).unwrap();
    // Enough for a block to reach the file, whose last line must be whole.
    let many: Vec<LogRow> = rows().into_iter().cycle().take(500).collect();
    for (k, row) in many.iter().cycle().take(20_000).enumerate() {
        let mut row = row.clone();
        row.time_us = k as u64 * 10_000;
        writer.write(&row).unwrap();
    }
    // Killed: neither finished nor dropped.
    std::mem::forget(writer);
    let text = std::fs::read_to_string(&path).unwrap();
    assert!(text.ends_with('\n'));
    let log = Log::read(&path).unwrap();
    assert!(log.rows.len() > 10_000 && log.notes.is_empty(), "{} {:?}", log.rows.len(), log.notes);
}

#[test]
fn only_the_columns_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let mut writer = LogWriter::with_columns(&path, &[Column::SoundSpeed, Column::Depth]).unwrap();
    let mut row = LogRow::new(1_500_000);
    writer.write(row.set(Column::Depth, 2.0).set(Column::Heading, 1.0)).unwrap();
    writer.finish().unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "t_s,sound_speed_mps,depth_m\n1.5,,2\n");
}

/// What a program writes above a table about itself.
#[test]
fn lines_that_begin_with_a_hash_are_comments() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    std::fs::write(&path, "# a lake, 2024\nt_s,depth_m\n0,1\n# moored\n1,2\n2,x\n").unwrap();
    // lines are counted with them
    let complaint = backseat_logs::importers::read(&path).unwrap_err().to_string();
    assert!(complaint.contains("log.csv:6:2: depth_m"), "{complaint}");
    std::fs::write(&path, "# a lake, 2024\nt_s,depth_m\n0,1\n# moored\n1,2\n").unwrap();
    assert_eq!(backseat_logs::importers::read(&path).unwrap().log.rows.len(), 2);
}
