//! Logs of other vehicles and programs (`tests/vectors`, whose README says where they are from): what is read is what
//! their makers' own programs show; whatever bytes are wrong, no reader panics.

use crate::random::Random;
use backseat_logs::importers::{self, ColumnMap, Imported};
use backseat_logs::{Column, Log};
use std::path::{Path, PathBuf};

fn vector(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vectors").join(name)
}

fn read(name: &str) -> Imported {
    importers::read(&vector(name)).unwrap()
}

fn mapped(name: &str, map: &str) -> Result<Imported, String> {
    let map = ColumnMap::parse(map, Path::new("map.toml")).unwrap();
    importers::read_mapped(&vector(name), &map).map_err(|error| error.to_string())
}

fn samples(log: &Log, column: Column) -> Vec<f64> {
    log.column(column).map(|(_, value)| value).collect()
}

/// The first sample of a column, to the digits that the other program shows.
fn check_first(log: &Log, expected: &[(Column, usize, f64)]) {
    for &(column, count, value) in expected {
        let found = samples(log, column);
        assert_eq!(found.len(), count, "{}", column.name());
        assert!((found[0] - value).abs() <= 2e-7 * value.abs(), "{}: {} {value}", column.name(), found[0]);
    }
}

fn has_note(log: &Log, part: &str) {
    assert!(log.notes.iter().any(|note| note.contains(part)), "{part}: {:#?}", log.notes);
}

/// A BlueROV2's dive, against pymavlink 2.4.50.
#[test]
fn val_dataflash_as_pymavlink_shows_it() {
    let Imported { format, log } = read("ardusub.BIN");
    assert_eq!(format, "ArduPilot DataFlash log");
    check_first(
        &log,
        &[
            (Column::Roll, 4, -0.08_f64.to_radians()),
            (Column::Pitch, 4, -0.63_f64.to_radians()),
            (Column::Heading, 4, (213.93_f64 - 360.0).to_radians()),
            (Column::P, 8, -0.007_749_793_119_728_565),
            (Column::R, 8, 0.002_518_214_052_543_044),
            (Column::Depth, 4, 0.002_040_816_238_150_000_6),
        ],
    );
    // from the first IMU at 265678654 us to the first ATT at 265738465 us
    let attitude_us = log.column(Column::Roll).next().unwrap().0;
    assert_eq!(attitude_us, 265_738_465 - 265_678_654);
    has_note(&log, "ArduSub V4.1.0");
    has_note(&log, "RCOU (4): pulse widths");
    // a motor that stands still at 1500 us, 4 rpm for each microsecond beyond
    let map =
        "[columns.prop_rpm]\ncolumn = \"RCOU.C1\"\noffset = -1400\nscale = 4\n[constants]\nsound_speed_mps = 1480.0\n";
    let log = mapped("ardusub.BIN", map).unwrap().log;
    assert_eq!(samples(&log, Column::PropRpm), [400.0; 4]);
    assert_eq!(samples(&log, Column::SoundSpeed).len(), log.rows.len());
    let complaint = mapped("ardusub.BIN", &map.replace("RCOU.C1", "RCOU.C15")).unwrap_err();
    assert!(complaint.contains("mapped RCOU.C15: no such number; RCOU has TimeUS, C1, C2"), "{complaint}");
    let complaint = mapped("ardusub.BIN", &map.replace("RCOU.C1", "SERVO.1")).unwrap_err();
    assert!(complaint.contains("no such message; expected MESSAGE.number; the log has ATT, BARO, CTUN"), "{complaint}");
}

/// The ground station's side of another dive, against pymavlink 2.4.50.
#[test]
fn val_telemetry_as_pymavlink_shows_it() {
    let Imported { format, log } = read("ardusub.tlog");
    assert_eq!(format, "MAVLink telemetry log");
    assert_eq!(log.origin_deg, Some([48.386_141_8, -124.630_573_2]));
    check_first(
        &log,
        &[
            (Column::Roll, 6, -0.024_300_388_991_832_733),
            (Column::Pitch, 6, 0.024_687_847_122_550_01),
            (Column::Heading, 6, -2.347_999_572_753_906_2),
            (Column::R, 6, -0.000_698_194_315_191_358_3),
            (Column::GpsX, 2, 0.0),
        ],
    );
    // 1015.7999877929688 hPa above the 1013.25 hPa of the air
    let depth_m = samples(&log, Column::Depth)[0];
    assert!((depth_m - (1_015.799_987_792_968_8 - 1013.25) * 100.0 / (1025.0 * 9.81)).abs() < 1e-9, "{depth_m}");
    // a bit that is wrong costs one packet, and is told
    let mut bytes = std::fs::read(vector("ardusub.tlog")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.tlog");
    let roll = bytes.windows(4).position(|four| four == (-0.024_300_389_f32).to_le_bytes()).unwrap();
    bytes[roll] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let log = importers::read(&path).unwrap().log;
    assert_eq!(samples(&log, Column::Roll).len(), 5);
    has_note(&log, "1 check sums are wrong");
}

/// The log of PX4's own reader's tests, against pyulog 1.3.
#[test]
fn val_ulog_as_pyulog_shows_it() {
    let Imported { format, log } = read("px4.ulg");
    assert_eq!(format, "PX4 ULog");
    let [w, x, y, z] = [0.954_590_6_f64, 0.041_478_634, 0.048_174_9, -0.291_059_52];
    let heading_rad = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
    let [heading, p, q] = [Column::Heading, Column::P, Column::Q].map(|column| samples(&log, column));
    assert!((heading[0] - heading_rad).abs() < 1e-6 && heading.len() == 4, "{heading:?}");
    assert!((p[0] + 0.001_924_943_6).abs() < 1e-9 && p.len() == 6, "{p:?}");
    assert!((q[0] + 0.003_310_213_6).abs() < 1e-9, "{q:?}");
    let map = "[columns.depth_m]\ncolumn = \"vehicle_local_position.z\"\n";
    assert_eq!(samples(&mapped("px4.ulg", map).unwrap().log, Column::Depth).len(), 2);
}

/// Messages packed by pyimclsts, of the makers of IMC, in both orders of bytes, one file compressed.
#[test]
fn val_imc_as_its_makers_pack_it() {
    for name in ["imc_little.lsf", "imc_big.lsf.gz"] {
        let Imported { format, log } = read(name);
        assert_eq!(format, "LSTS log (IMC)");
        let milliradians: Vec<i64> = samples(&log, Column::Heading).iter().map(|r| (r * 1e3).round() as i64).collect();
        assert_eq!(milliradians, [1500, 1600, 1700, 1800]);
        assert_eq!(samples(&log, Column::Q), [0.2; 4]);
        // the CTD sends more than the other, which came first
        assert_eq!(samples(&log, Column::Depth), [2.5, 3.5, 4.5, 5.5]);
        // of the second only two axes are valid
        assert_eq!(samples(&log, Column::DvlU), [1.25; 3]);
        assert_eq!(samples(&log, Column::PropRpm), [1000.0, 1001.0, 1002.0, 1003.0, -7.0]);
        assert_eq!(log.origin_deg.map(|degrees| degrees.map(|d| (d * 1e9).round() / 1e9)), Some([41.0, -8.0]));
        assert_eq!(samples(&log, Column::GpsX), [0.0]);
        assert_eq!(log.duration_s(), 3.0);
        has_note(&log, "Depth[9] (1): another sensor");
        let map = "[columns.fin_top_rad]\ncolumn = \"SetServoPosition[3].value\"\nsign = -1\n";
        assert_eq!(samples(&mapped(name, map).unwrap().log, Column::FinTop), [-0.75]);
    }
}

/// Arrays and a structure that SciPy 1.17 wrote, plain and compressed.
#[test]
fn val_mat_files_as_scipy_writes_them() {
    let log = read("v5.mat").log;
    assert_eq!(samples(&log, Column::Depth), [0.25, 1.25, 2.25, 3.25, 4.25]);
    assert_eq!(
        log.rows.iter().map(|row| row.time_us).collect::<Vec<_>>(),
        [0, 500_000, 1_000_000, 1_500_000, 2_000_000]
    );
    has_note(&log, "left out note, z: what is no array of real numbers");
    let map = "[time]\ncolumn = \"t_s\"\n[columns.roll_rad]\ncolumn = \"attitude_rad_1\"\n[columns.pitch_rad]\n\
        column = \"attitude_rad_2\"\n[columns.heading_rad]\ncolumn = \"attitude_rad_3\"\nunit = \"deg\"\n";
    let log = mapped("v5.mat", map).unwrap().log;
    assert_eq!(samples(&log, Column::Roll)[3], 0.300_000_000_000_000_04);
    assert!((samples(&log, Column::Heading)[4] - 5_f64.to_radians()).abs() < 1e-12);
    let log = read("v7_struct.mat").log;
    assert_eq!(samples(&log, Column::Depth), [1.0, 2.0, 3.0, 4.0, 5.0]);
    let map = "[time]\ncolumn = \"t_s\"\n[columns.dvl_u_mps]\ncolumn = \"speed.dvl_u_mps\"\n";
    // one is not a number
    assert_eq!(samples(&mapped("v7_struct.mat", map).unwrap().log, Column::DvlU), [1.5; 4]);
}

/// A folder of two files that the library rosbags wrote, in pages so small that rows go over several.
#[test]
fn val_a_bag_in_sqlite_as_rosbags_writes_it() {
    let Imported { format, log } = read("bag_sqlite");
    assert_eq!((format, log.rows.len()), ("ROS 2 bag", 30));
    assert_eq!(log.start_unix_us, Some(1_700_000_000_000_000));
    let depth: Vec<f64> = samples(&log, Column::Depth).iter().map(|depth_m| depth_m.round()).collect();
    assert_eq!(depth, [1.0, 4.0, 7.0, 10.0, 13.0, 16.0, 19.0, 22.0, 25.0, 28.0]);
    // forward-left-up to forward-right-down
    assert_eq!(log.rows[0].dvl_mps(), Some([1.5, -0.25, 0.5]));
    assert_eq!(log.rows[29].rates_radps(), Some([0.1, -0.2, -0.3]));
    has_note(&log, "/chatter (1): std_msgs/msg/String is not read");
    let map = "[columns.prop_rpm]\ncolumn = \"/rpm\"\n";
    assert_eq!(samples(&mapped("bag_sqlite", map).unwrap().log, Column::PropRpm).last(), Some(&1027.0));
    let folder = tempfile::tempdir().unwrap();
    let complaint = importers::read(folder.path()).unwrap_err().to_string();
    assert!(complaint.contains("a folder, not a log: give a log"), "{complaint}");
}

/// A structure that h5py wrote as MATLAB does, compressed in parts, and arrays that MATLAB wrote itself.
#[cfg(feature = "hdf5")]
#[test]
fn val_mat_files_of_version_7_3() {
    let map = "[time]\ncolumn = \"time_s\"\n[columns.dvl_u_mps]\ncolumn = \"dvl_1\"\n[columns.dvl_w_mps]\n\
        column = \"dvl_3\"\n[columns.prop_rpm]\ncolumn = \"prop_rpm\"\n[columns.depth_m]\ncolumn = \"depth_m\"\n";
    let log = mapped("v7_3.mat", map).unwrap().log;
    assert_eq!((log.rows.len(), log.rows[39].time_us), (40, 3_900_000));
    assert_eq!(samples(&log, Column::DvlU)[39], 1.0);
    assert!((samples(&log, Column::DvlW)[39] + 0.2 * 3.9).abs() < 1e-12);
    assert_eq!(samples(&log, Column::PropRpm)[39], 1039.0);
    assert!((samples(&log, Column::Depth)[10] - (3.0 + 0.5 * 1.0_f64.sin())).abs() < 1e-6);
    has_note(&log, "left out name: what is no array of real numbers");
    let map = "[time]\ncolumn = \"i\"\n[columns.depth_m]\ncolumn = \"v\"\n";
    // i is 6, 8, 3, 7, 5
    let complaint = mapped("v7_3_matlab.mat", map).map(|_| ()).unwrap_err();
    assert!(complaint.ends_with("v7_3_matlab.mat:4:1: i: the time is before that of the row above"), "{complaint}");
}

#[cfg(not(feature = "hdf5"))]
#[test]
fn a_mat_file_of_version_7_3_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.mat");
    std::fs::write(&path, b"MATLAB 7.3 MAT-file, Platform: GLNXA64").unwrap();
    let complaint = importers::read(&path).unwrap_err().to_string();
    assert!(complaint.contains("version 7.3 (HDF5): save it in MATLAB by save(..., '-v7')"), "{complaint}");
}

/// Every vector with bytes changed, taken out, doubled and cut off: a log, or an error in one line.
#[test]
fn no_bytes_make_a_reader_panic() {
    let names = [
        "ardusub.BIN",
        "ardusub.tlog",
        "px4.ulg",
        "imc_little.lsf",
        "v5.mat",
        "v7_struct.mat",
        #[cfg(feature = "hdf5")]
        "v7_3.mat",
        "bag_sqlite/dive_1.db3",
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log");
    let mut random = Random(1);
    let mut below = |limit: usize| random.below(limit);
    for name in names {
        let whole = std::fs::read(vector(name)).unwrap();
        for _ in 0..RUNS {
            let mut bytes = whole.clone();
            for _ in 0..1 + below(4) {
                let at = below(bytes.len().max(1));
                match below(4) {
                    0 if at < bytes.len() => bytes[at] = below(256) as u8,
                    1 => drop(bytes.drain(at..(at + 1 + below(16)).min(bytes.len()))),
                    2 => {
                        let part: Vec<u8> = bytes[at..].iter().take(1 + below(64)).copied().collect();
                        drop(bytes.splice(at..at, part));
                    }
                    _ if below(8) == 0 => bytes.truncate(at),
                    // a length that is far too large
                    _ => bytes.iter_mut().skip(at).take(2).for_each(|byte| *byte = 0xff),
                }
            }
            std::fs::write(&path, &bytes).unwrap();
            match importers::read(&path) {
                Ok(imported) => assert!(imported.log.rows.windows(2).all(|two| two[0].time_us <= two[1].time_us)),
                Err(error) => assert_eq!(error.to_string().lines().count(), 1, "{name}: {error}"),
            }
        }
    }
}

/// Inputs of each kind: a second in all.
const RUNS: usize = 100;
