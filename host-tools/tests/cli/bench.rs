//! `backseat bench` on a log of known noise.

use crate::harness::backseat;
use backseat_logs::{Column, Log, LogRow, LogWriter};
use serde_json::Value;
use std::path::Path;
use std::process::Output;

/// One sigma of the log's sensors.
const KNOWN: [(&str, f64); 5] = [
    ("sensors.depth_m", 0.02),
    ("sensors.attitude_rad", 9.0e-4),
    ("sensors.heading_rad", 2.6e-3),
    ("sensors.rates_radps", 1.6e-4),
    ("sensors.gnss_m", 0.8),
];

/// Twenty minutes at rest at 10 Hz, heading about south where angles wrap; depth drifts with a tide, the DVL reads
/// zero.
fn write_static_log(path: &Path) {
    let mut random = hil_sim::rng::Stream::new(7, hil_sim::rng::Source::Ahrs);
    let [depth, tilt, compass, rate, fix] = KNOWN.map(|(_, sigma)| sigma);
    let mut log = Log::default();
    for k in 0..12_000_u32 {
        let mut row = LogRow::new(u64::from(k) * 100_000);
        let tide = 0.3 * f64::from(k) / 12_000.0;
        let heading = libm::remainder(std::f64::consts::PI + compass * random.normal(), std::f64::consts::TAU);
        row.set(Column::Depth, 1.0 + tide + depth * random.normal())
            .set(Column::Roll, 0.01 + tilt * random.normal())
            .set(Column::Pitch, -0.02 + tilt * random.normal())
            .set(Column::Heading, heading)
            .set_all(Column::P, &random.normals::<3>(rate))
            .set_all(Column::DvlU, &[0.0; 3]);
        if k % 10 == 0 {
            row.set_all(Column::GpsX, &random.normals::<2>(fix));
        }
        log.rows.push(row);
    }
    let mut writer = LogWriter::create(path).unwrap();
    log.rows.iter().for_each(|row| writer.write(row).unwrap());
    writer.finish().unwrap();
}

fn bench(folder: &Path, arguments: &[&str]) -> Output {
    backseat(folder, &[&["bench"], arguments].concat())
}

#[test]
fn val_known_noise_is_found_and_written() {
    let folder = tempfile::tempdir().unwrap();
    write_static_log(&folder.path().join("static.csv"));
    let output = bench(folder.path(), &["static.csv", "--out", "mine.toml", "--report", "out", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let vehicle = backseat_logs::VehicleFile::read(&folder.path().join("mine.toml")).unwrap();
    let written: std::collections::BTreeMap<String, f64> = vehicle.flatten().into_iter().collect();
    for (key, sigma) in KNOWN {
        let found = json["sensors"][key].as_f64().unwrap();
        // The Allan deviation of N differences is known to sqrt(3 / (4 N)): 2.5 % of 1200 fixes; three of it.
        assert!((found / sigma - 1.0).abs() < 0.075, "{key}: {found} instead of {sigma}");
        assert!((written[key] - found).abs() < 1e-12 * sigma.max(1.0), "{key}");
    }
    // The tide is no noise, and said so; a DVL that reads zero keeps what the vehicle file had.
    let depth = &json["channels"][0];
    assert!(depth["sigma"].as_f64().unwrap() > 0.08 && depth["white"].as_f64().unwrap() < 0.022, "{depth}");
    let notes = json["notes"].to_string();
    assert!(notes.contains("depth: sigma is") && notes.contains("dvl u: no scatter"), "{notes}");
    assert_eq!(written["sensors.dvl_mps"], backseat_logs::VehicleFile::reference().sensors.dvl_mps);
    let page = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("Allan deviation"));

    let kept = bench(folder.path(), &["static.csv", "--out", "mine.toml"]);
    assert_eq!(kept.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&kept.stderr).contains("--force"));
}

#[test]
fn a_log_without_readings_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("short.csv"), "t_s,depth_m\n0,1\n1,1\n").unwrap();
    let output = bench(folder.path(), &["short.csv"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("readings"), "{output:?}");
}

#[test]
fn a_vehicle_that_moves_is_not_measured() {
    let folder = tempfile::tempdir().unwrap();
    let dive = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/guide/samples/dive.csv.gz");
    let output = bench(folder.path(), &[dive, "--out", "mine.toml"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("the vehicle moves at ") && said.contains("where the vehicle lies still"), "{said}");
    assert!(!output.status.success() && !folder.path().join("mine.toml").exists());
}
