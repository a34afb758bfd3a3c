//! ROS 2 bags, as MCAP, SQLite (`.db3`) or a folder of such files: the standard messages of attitude, velocity,
//! pressure and position, CDR encoded.
//!
//! Messages are in the conventions of REP 103 and REP 105: body forward-left-up, world east-north-up; here they are
//! turned to forward-right-down and north-east-down. Times are those of the headers.
//!
//! Commands of propeller and fins come in types that say nothing of their meaning: a mapping names them. `column` of its
//! entry is a topic, with `.field` where the message has several arrays, and `[element]`, by number or by the name that
//! the message gives it: `/thruster/rpm`, `/fins[2]`, `/joint_states.position[fin_top]`.

mod cdr;
mod files;
mod sqlite;
mod types;
mod zstd;

use super::Imported;
use super::mapping::ColumnMap;
use super::message_tables::TABLES;
use super::signals::Signals;
use crate::DataError;
use crate::log::Column;
use crate::log::units::SEA_WATER_N_PER_M3;
use files::{Recorded, Take};
use std::collections::BTreeSet;
use std::path::Path;
use types::{Numbers, ODOMETRY, PRESSURE};

/// Name of the format.
pub(super) const NAME: &str = "ROS 2 bag";
/// Pressure at the surface, Pa.
pub(super) const SURFACE_PA: f64 = 101_325.0;
/// A gauge shows less than this in shallow water, an absolute sensor never, Pa.
pub(super) const GAUGE_PA: f64 = 50_000.0;

/// Clocks that differ by less are one, µs.
const SAME_CLOCK_US: i64 = 1_000_000;

/// Whether the beginning of a file (from 32 bytes on) is that of an MCAP file, and whether it is one of ROS 2, by the
/// profile of its first record.
#[must_use]
pub fn is_bag(beginning: &[u8]) -> Option<bool> {
    let rest = beginning.strip_prefix(mcap::MAGIC)?;
    // opcode 1, length of the record, length of the profile, profile
    let profile = rest.get(13..17);
    Some(rest.first() == Some(&1) && profile == Some(b"ros2"))
}

/// Whether a path is a bag, of any kind of file.
pub(super) fn is_any_bag(path: &Path, beginning: &[u8]) -> bool {
    is_bag(beginning) == Some(true) || sqlite::is_sqlite(beginning) || !files::of_folder(path).is_empty()
}

/// What a bag's messages of no use could be.
const COULD_BE: [(&str, &str); 9] = [
    ("geometry_msgs/msg/Pose", "a position or attitude in a frame of any meaning: record it as nav_msgs/msg/Odometry"),
    ("geometry_msgs/msg/Twist", "a velocity or a command: record it as geometry_msgs/msg/TwistWithCovarianceStamped"),
    ("geometry_msgs/msg/Vector3", "a velocity or a command: record it as geometry_msgs/msg/TwistWithCovarianceStamped"),
    ("geometry_msgs/msg/Wrench", "commanded forces, not speeds of a propeller"),
    ("dvl", "a velocity over ground: let the DVL's driver write geometry_msgs/msg/TwistWithCovarianceStamped as well"),
    (
        "sensor_msgs/msg/MagneticField",
        "part of a heading: let the driver write sensor_msgs/msg/Imu with its orientation",
    ),
    ("mavros_msgs", "what the autopilot logs itself: its .BIN is read"),
    ("px4_msgs", "what the autopilot logs itself: its .ulg is read"),
    ("sensor_msgs/msg/Range", "a height above the bottom"),
];

/// A bag as it is read.
struct Bag<'a> {
    path: &'a Path,
    signals: Signals<'a>,
    /// Types of the table that it has.
    types: BTreeSet<&'static str>,
    lowest_pa: f64,
    /// Topics and messages that a mapping names, by the time of the recorder.
    commands: Vec<(i64, String, Numbers)>,
    /// What the clock of the headers is ahead of the recorder's, µs.
    ahead_us: Vec<i64>,
}

/// The type, if the table has it.
fn of_table(type_name: &str) -> Option<&'static str> {
    TABLES["ros2"].messages.iter().map(|row| row.name.as_str()).find(|name| *name == type_name)
}

impl Bag<'_> {
    fn fail(&self, message: String) -> DataError {
        DataError::file(self.path, message)
    }

    /// Hands on the numbers of a message.
    fn signal(&mut self, time_us: i64, type_name: &str, topic: &str, numbers: &Numbers) {
        let fields: Vec<(&str, f64)> = numbers.fields.iter().map(|(name, value)| (&**name, *value)).collect();
        self.signals.named(time_us, type_name, topic, &fields);
    }
}

impl Take for Bag<'_> {
    fn wants(&mut self, topic: &str, type_name: &str) -> Result<bool, DataError> {
        let is_nameable = types::is_known(type_name) && of_table(type_name).is_none();
        let is_mapped = self.signals.takes(topic);
        if is_mapped && !is_nameable {
            return Err(self.fail(format!("mapped {topic}: no mapping reads {type_name}")));
        }
        if is_mapped || of_table(type_name).is_some() {
            return Ok(true);
        }
        if self.signals.wants(topic) {
            let lower = type_name.to_lowercase();
            let could_be = COULD_BE.iter().find(|(part, _)| lower.contains(&part.to_lowercase()));
            let reason = match could_be {
                _ if is_nameable => "numbers of any meaning: name them by --columns".to_owned(),
                Some((_, could_be)) => format!("{type_name} is not read, {could_be}"),
                None => format!("{type_name} is not read"),
            };
            self.signals.reasons.insert(topic.to_owned(), reason);
            self.signals.named(0, type_name, topic, &[]);
        }
        Ok(false)
    }

    fn take(&mut self, message: &Recorded<'_>) -> Result<(), DataError> {
        let Recorded { topic, type_name, encoding, log_us, data } = *message;
        if encoding != "cdr" {
            return Err(self.fail(format!("{topic}: encoding {encoding:?}; expected cdr")));
        }
        let Some(numbers) = Numbers::read(type_name, data) else {
            self.signals.left_out.leave_out(topic, "shorter than its type");
            return Ok(());
        };
        self.ahead_us.extend(numbers.stamp_us.map(|stamp_us| stamp_us - log_us));
        let Some(type_name) = of_table(type_name) else {
            self.commands.push((log_us, topic.to_owned(), numbers));
            return Ok(());
        };
        self.types.insert(type_name);
        if let (PRESSURE, [(_, pa), ..]) = (type_name, &numbers.fields[..]) {
            self.lowest_pa = self.lowest_pa.min(*pa);
        }
        self.signal(numbers.stamp_us.unwrap_or(0), type_name, topic, &numbers);
        Ok(())
    }
}

/// Reads a bag, and the numbers that a mapping names, which take the place of the sensors' own.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let mut signals = Signals::new(path, map, "ros2")?;
    signals.is_one_by_one = true;
    for (name, _) in map.iter().flat_map(|map| map.columns()) {
        if name.split_once('[').is_some_and(|(_, rest)| !rest.ends_with(']') || rest == "]") {
            let message = format!("mapped {name}: expected /topic, /topic[element] or /topic.field[element]");
            return Err(DataError::file(path, message));
        }
    }
    let (types, lowest_pa) = (BTreeSet::new(), f64::INFINITY);
    let mut bag = Bag { path, signals, types, lowest_pa, commands: Vec::new(), ahead_us: Vec::new() };
    let faults = files::read(path, &mut bag)?;
    bag.ahead_us.sort_unstable();
    let ahead_us = bag.ahead_us.get(bag.ahead_us.len() / 2).copied().unwrap_or(0);
    // stamps of the same clock, later by what the messages took to the recorder
    let ahead_us = if ahead_us.abs() < SAME_CLOCK_US { 0 } else { ahead_us };
    let commands = std::mem::take(&mut bag.commands);
    let is_unstamped = commands.iter().any(|(.., numbers)| numbers.stamp_us.is_none());
    for (log_us, topic, numbers) in commands {
        bag.signal(numbers.stamp_us.unwrap_or(log_us + ahead_us), NAME, &topic, &numbers);
    }
    let Bag { mut signals, types, lowest_pa, .. } = bag;
    let mut notes = vec!["turned to north-east-down and forward-right-down".to_owned()];
    notes.extend(faults);
    if types.contains(ODOMETRY) && types.iter().filter(|of| **of != PRESSURE).count() < 4 {
        notes.push("what no sensor's topic has is taken from the odometry, which is an estimate".to_owned());
    }
    if types.contains(PRESSURE) {
        let is_gauge = lowest_pa < GAUGE_PA;
        if is_gauge {
            signals.add(PRESSURE, Column::Depth, SURFACE_PA / SEA_WATER_N_PER_M3);
        }
        let from = if is_gauge { "above that of the air" } else { "absolute" };
        notes.push(format!("pressure is {from}: depth for sea water of 1025 kg/m^3"));
    }
    if is_unstamped {
        let shift = if ahead_us == 0 { "" } else { ", put on the clock of the headers" };
        notes.push(format!("mapped messages without a stamp have the recorder's time{shift}"));
    }
    let mut imported = signals.finish(NAME, notes)?;
    // no mapping names what the table takes
    let is_mapped = |name: &str| map.is_some_and(|map| map.columns().any(|(mapped, _)| mapped == name));
    imported.log.sources.get_or_insert_default().retain(|_, source| is_mapped(&source.name));
    Ok(imported)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// A message as a ROS 2 node writes it: little endian, stamp, frame, body.
    fn message(seconds: i32, frames: &[&str], body: &[f64], status: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        bytes.extend(seconds.to_le_bytes());
        bytes.extend(500_000_000_u32.to_le_bytes());
        for frame in frames {
            bytes.resize(bytes.len().next_multiple_of(4), 0);
            bytes.extend((frame.len() as u32 + 1).to_le_bytes());
            bytes.extend(frame.as_bytes());
            bytes.push(0);
        }
        if status {
            bytes.push(0);
            bytes.resize(bytes.len().next_multiple_of(2), 0);
            bytes.extend(1_u16.to_le_bytes());
        }
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        body.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        [vec![0, 1, 0, 0], bytes].concat()
    }

    /// A bag of messages: topic, type, time of the recorder in ns, data.
    fn write(path: &Path, messages: &[(&str, &str, u64, Vec<u8>)]) {
        let file = std::io::BufWriter::new(std::fs::File::create(path).unwrap());
        let writer = mcap::WriteOptions::new().profile("ros2");
        let mut writer = writer.compression(Some(mcap::Compression::Lz4)).create(file).unwrap();
        for (sequence, (topic, schema, log_time, data)) in messages.iter().enumerate() {
            let schema = writer.add_schema(schema, "ros2msg", b"").unwrap();
            let header = mcap::records::MessageHeader {
                channel_id: writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap(),
                sequence: sequence as u32,
                log_time: *log_time,
                publish_time: *log_time,
            };
            writer.write_to_known_channel(&header, data).unwrap();
        }
        writer.finish().unwrap();
    }

    #[test]
    fn val_messages_are_turned_and_joined() {
        let half = std::f64::consts::FRAC_PI_4.sin(); // yaw of 90 degrees from east: heading north
        let imu = [vec![0.0, 0.0, half, half], vec![0.0; 9], vec![0.1, 0.2, 0.3], vec![0.0; 21]].concat();
        let odometry = [vec![10.0, 20.0, -5.0, 0.0, 0.0, half, half], vec![0.0; 36], vec![9.0; 42]].concat();
        let all = [
            ("/imu", "sensor_msgs/msg/Imu", message(100, &["imu"], &imu, false)),
            (
                "/dvl",
                "geometry_msgs/msg/TwistWithCovarianceStamped",
                message(100, &["dvl_link"], &[1.5, 0.2, 0.1, 0.0, 0.0, 0.0], false),
            ),
            ("/pressure", PRESSURE, message(100, &["p"], &[101_325.0 + 2.0 * SEA_WATER_N_PER_M3, 0.0], false)),
            ("/odom", ODOMETRY, message(101, &["map", "base_link"], &odometry, false)),
            ("/chatter", "std_msgs/msg/String", message(101, &[], &[], false)),
        ];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.mcap");
        write(&path, &all.map(|(topic, schema, data)| (topic, schema, 0, data)));
        assert_eq!(is_bag(&std::fs::read(&path).unwrap()), Some(true));
        let imported = super::super::read(&path).unwrap();
        assert_eq!(imported.format, NAME);
        let [first, second] = &imported.log.rows[..] else { panic!("{:?}", imported.log.rows) };
        let [roll, pitch, heading] = first.attitude_rad().unwrap();
        assert!(roll.abs() < 1e-12 && pitch.abs() < 1e-12 && heading.abs() < 1e-12, "{roll} {pitch} {heading}");
        assert_eq!(first.rates_radps(), Some([0.1, -0.2, -0.3]));
        assert_eq!(first.dvl_mps(), Some([1.5, -0.2, -0.1]));
        assert!((first.get(Column::Depth).unwrap() - 2.0).abs() < 1e-9);
        // the position alone is the odometry's: x is east
        assert_eq!((second.gnss_m(), second.dvl_mps(), second.time_us), (Some([20.0, 10.0]), None, 1_000_000));
        assert!(imported.log.notes.iter().any(|note| note.contains("/chatter (1)")), "{:?}", imported.log.notes);
    }

    #[test]
    fn a_fix_counts_where_its_status_says_so() {
        let fix = message(7, &["gps"], &[41.0, -70.0, 3.0], true);
        let parsed = Numbers::read("sensor_msgs/msg/NavSatFix", &fix).unwrap();
        let values: Vec<f64> = parsed.fields.iter().map(|(_, value)| *value).collect();
        assert_eq!((values, parsed.stamp_us), (vec![0.0, 41.0, -70.0], Some(7_500_000)));
        assert!(Numbers::read("sensor_msgs/msg/NavSatFix", &fix[..20]).is_none());
    }

    /// A message in parts: each is aligned to its size and written, as the types' definitions have them.
    fn parts(words: &[(usize, Vec<u8>)]) -> Vec<u8> {
        let mut bytes = Vec::new();
        for (size, word) in words {
            bytes.resize(bytes.len().next_multiple_of(*size), 0);
            bytes.extend(word);
        }
        [vec![0, 1, 0, 0], bytes].concat()
    }

    fn int(value: u32) -> (usize, Vec<u8>) {
        (4, value.to_le_bytes().to_vec())
    }

    fn text(text: &str) -> [(usize, Vec<u8>); 2] {
        [int(text.len() as u32 + 1), (1, [text.as_bytes(), &[0]].concat())]
    }

    fn numbers(values: &[f64]) -> Vec<(usize, Vec<u8>)> {
        let elements = values.iter().map(|value| (8, value.to_le_bytes().to_vec()));
        std::iter::once(int(values.len() as u32)).chain(elements).collect()
    }

    /// The commands of an AUV's thruster and fins in four types, two of them without a stamp; headers of a simulated
    /// clock that begins at 100 s, recorded at 5,000 s.
    #[test]
    fn val_commands_are_those_that_the_mapping_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.mcap");
        let stamp = |seconds: u32| [vec![int(seconds), int(0)], text("base").to_vec()].concat();
        let joints = [
            stamp(101),
            vec![int(2)],
            text("fin_top").to_vec(),
            text("propeller").to_vec(),
            numbers(&[5.0, 0.0]),
            numbers(&[0.0, 100.0]),
            numbers(&[]),
        ];
        // one dimension, its size and stride, no offset
        let layout = [vec![int(1)], text("fins").to_vec(), vec![int(2), int(2), int(0)]].concat();
        let fins = [layout, numbers(&[0.1, -0.2])].concat();
        let actuators = [stamp(102), numbers(&[0.25]), numbers(&[]), numbers(&[])].concat();
        let depth = (8, (-7.0_f64).to_le_bytes().to_vec());
        let pressure = message(100, &["p"], &[101_325.0 + 2.0 * SEA_WATER_N_PER_M3, 0.0], false);
        let at = |seconds: f64| (seconds * 1e9) as u64;
        write(
            &path,
            &[
                ("/pressure", PRESSURE, at(5000.5), pressure),
                ("/joint_states", "sensor_msgs/msg/JointState", at(5001.0), parts(&joints.concat())),
                ("/fins", "std_msgs/msg/Float64MultiArray", at(5001.2), parts(&fins)),
                ("/bottom", "actuator_msgs/msg/Actuators", at(5002.0), parts(&actuators)),
                ("/z", "std_msgs/msg/Float64", at(5002.5), parts(&[depth])),
            ],
        );
        let map = |text: &str| ColumnMap::parse(text, Path::new("m.toml")).unwrap();
        let mapping = "\
            [columns.prop_rpm]\ncolumn = \"/joint_states.velocity[propeller]\"\nunit = \"rad/s\"\n\
            [columns.fin_top_rad]\ncolumn = \"/joint_states.position[fin_top]\"\nunit = \"deg\"\nsign = -1\n\
            [columns.fin_port_rad]\ncolumn = \"/fins[0]\"\n[columns.fin_starboard_rad]\ncolumn = \"/fins[1]\"\n\
            [columns.fin_bottom_rad]\ncolumn = \"/bottom.position[0]\"\n\
            [columns.depth_m]\ncolumn = \"/z\"\nsign = -1\n[constants]\nsound_speed_mps = 1490.0\n";
        let log = super::super::read_mapped(&path, &map(mapping)).unwrap().log;
        let samples = |column: Column| -> Vec<(u64, f64)> {
            log.rows.iter().filter_map(|row| Some((row.time_us, row.get(column)?))).collect()
        };
        // the first; with the last of the five at 1 s all stand in the row
        let one = |column: Column| match samples(column)[..] {
            [sample] => sample,
            [sample, (1_000_000, held)] if held == sample.1 => sample,
            ref other => panic!("{}: {other:?}", column.name()),
        };
        let column = |name: &str| Column::from_name(name).unwrap();
        let (time_us, rpm) = one(column("prop_rpm"));
        assert!(time_us == 0 && (rpm - 100.0 * 30.0 / std::f64::consts::PI).abs() < 1e-9, "{time_us} {rpm}");
        let (time_us, rad) = one(column("fin_top_rad"));
        assert!(time_us == 0 && (rad + 5.0_f64.to_radians()).abs() < 1e-12, "{time_us} {rad}");
        // 5001.2 s of the recorder is 101.2 s of the headers: their clock is 4,900 s behind
        assert_eq!(one(column("fin_port_rad")), (200_000, 0.1));
        assert_eq!(one(column("fin_starboard_rad")), (200_000, -0.2));
        assert_eq!(one(column("fin_bottom_rad")), (1_000_000, 0.25));
        // the mapping's depth in place of the pressure's
        assert_eq!(one(Column::Depth), (1_500_000, 7.0));
        assert!(log.rows.iter().all(|row| row.get(Column::SoundSpeed) == Some(1490.0)), "{:?}", log.rows);
        let notes = log.notes.join("\n");
        assert!(notes.contains("/fins[1] is fin_starboard_rad") && notes.contains("clock of the headers"), "{notes}");
        let plain = super::super::read(&path).unwrap().log;
        assert!(plain.notes.iter().any(|note| note.contains("/fins (1)") && note.contains("--columns")), "{plain:?}");
        for (from, to, complaint) in [
            ("/fins[1]", "/fins[2]", "bag.mcap: mapped /fins[2]: no such number; /fins has data[0], data[1], [0], [1]"),
            ("/fins[1]", "/fins[1", "bag.mcap: mapped /fins[1: expected /topic"),
            ("/z", "/pressure", "bag.mcap: mapped /pressure: no mapping reads sensor_msgs/msg/FluidPressure"),
        ] {
            let error = super::super::read_mapped(&path, &map(&mapping.replace(from, to))).unwrap_err().to_string();
            assert!(error.contains(complaint) && error.lines().count() == 1, "{error}");
        }
        let error = super::super::read_mapped(&path, &map(&format!("[time]\ncolumn = \"/t\"\n{mapping}"))).unwrap_err();
        assert!(error.to_string().contains("mapped /t: a ROS 2 bag has its own times"), "{error}");
    }
}
