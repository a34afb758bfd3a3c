//! ROS 2 bags, as MCAP, SQLite (`.db3`) or a folder of such files: the standard messages of attitude, velocity,
//! pressure and position, CDR encoded.
//!
//! Messages are in the conventions of REP 103 and REP 105: body forward-left-up, world east-north-up; here they are
//! turned to forward-right-down and north-east-down. Times are those of the headers.
//!
//! Commands of propeller and fins come in types that say nothing of their meaning: a mapping names them (`mapped`).

mod cdr;
mod files;
mod mapped;
mod sqlite;
mod zstd;

use super::Imported;
use super::engine::euler_rad;
use super::mapping::ColumnMap;
use super::messages::Gathering;
use crate::DataError;
use crate::log::Column;
use crate::log::units::SEA_WATER_N_PER_M3;
use cdr::Cdr;
use files::{Recorded, Take};
use mapped::{Mapped, Sources};
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "ROS 2 bag";
/// Pressure at the surface, Pa.
pub(super) const SURFACE_PA: f64 = 101_325.0;
/// A gauge shows less than this in shallow water, an absolute sensor never, Pa.
pub(super) const GAUGE_PA: f64 = 50_000.0;

/// Clocks that differ by less are one, µs.
const SAME_CLOCK_US: i64 = 1_000_000;

/// What a message type is read for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Imu,
    Odometry,
    Pressure,
    Twist,
    Fix,
}

const KINDS: [(&str, Kind); 5] = [
    ("sensor_msgs/msg/Imu", Kind::Imu),
    ("nav_msgs/msg/Odometry", Kind::Odometry),
    ("sensor_msgs/msg/FluidPressure", Kind::Pressure),
    ("geometry_msgs/msg/TwistWithCovarianceStamped", Kind::Twist),
    ("sensor_msgs/msg/NavSatFix", Kind::Fix),
];

/// Whether the beginning of a file (from 32 bytes on) is that of an MCAP file, and whether it is one of ROS 2, by the
/// profile of its first record.
#[must_use]
pub fn is_bag(beginning: &[u8]) -> Option<bool> {
    let rest = beginning.strip_prefix(mcap::MAGIC)?;
    // opcode 1, length of the record, length of the profile, profile
    let profile = rest.get(13..17);
    Some(rest.first() == Some(&1) && profile == Some(b"ros2"))
}

/// Reads a bag, and the numbers that a mapping names, which take the place of the sensors' own.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let sources = map.map_or_else(|| Ok(Sources::default()), |map| Sources::new(path, map))?;
    let mut imported = read_with(path, sources)?;
    // its mapping names topics, which no row of a table is
    imported.log.sources = Some(BTreeMap::new());
    for row in &mut imported.log.rows {
        for &(column, value) in map.iter().flat_map(|map| map.format().constants.iter()) {
            if row.get(column).is_none() {
                row.set(column, value);
            }
        }
    }
    Ok(imported)
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
    sources: Sources<'a>,
    gathering: Gathering,
    /// The first topic of each type is used.
    topics: BTreeMap<&'static str, String>,
    messages: Vec<(Kind, Stamped)>,
    commands: Vec<(i64, Mapped)>,
    /// What the clock of the headers is ahead of the recorder's, µs.
    ahead_us: Vec<i64>,
    /// Topics of no use, with their count and the reason.
    unread: BTreeMap<String, (usize, String)>,
}

impl Bag<'_> {
    fn fail(&self, message: String) -> DataError {
        DataError::file(self.path, message)
    }
}

impl Take for Bag<'_> {
    fn wants(&mut self, topic: &str, type_name: &str) -> Result<bool, DataError> {
        let (is_nameable, is_mapped) = (mapped::is_nameable(type_name), self.sources.has_topic(topic));
        if is_mapped && !is_nameable {
            return Err(self.fail(format!("mapped {topic}: no mapping reads {type_name}")));
        }
        if is_mapped || KINDS.iter().any(|(name, _)| *name == type_name) {
            return Ok(true);
        }
        if let Some((count, _)) = self.unread.get_mut(topic) {
            *count += 1;
            return Ok(false);
        }
        let lower = type_name.to_lowercase();
        let could_be = COULD_BE.iter().find(|(part, _)| lower.contains(&part.to_lowercase()));
        let reason = match could_be {
            _ if is_nameable => "numbers of any meaning: name them by --columns".to_owned(),
            Some((_, could_be)) => format!("{type_name} is not read, {could_be}"),
            None => format!("{type_name} is not read"),
        };
        self.unread.insert(topic.to_owned(), (1, reason));
        Ok(false)
    }

    fn take(&mut self, message: &Recorded<'_>) -> Result<(), DataError> {
        let Recorded { topic, type_name, encoding, log_us, data } = *message;
        if encoding != "cdr" {
            return Err(self.fail(format!("{topic}: encoding {encoding:?}; expected cdr")));
        }
        let Some((name, kind)) = KINDS.into_iter().find(|(name, _)| *name == type_name) else {
            match self.sources.read(topic, type_name, data) {
                Some(mapped) => {
                    self.ahead_us.extend(mapped.stamp_us.map(|stamp_us| stamp_us - log_us));
                    self.commands.push((log_us, mapped));
                }
                None => self.gathering.leave_out(topic, "shorter than its type"),
            }
            return Ok(());
        };
        if self.topics.entry(name).or_insert_with(|| topic.to_owned()) != topic {
            self.gathering.leave_out(topic, "another topic of the same type is used");
            return Ok(());
        }
        match Cdr::new(data).and_then(|cdr| parse(kind, cdr)) {
            Some(values) => {
                self.ahead_us.push(values.time_us - log_us);
                self.messages.push((kind, values));
            }
            None => self.gathering.leave_out(topic, "shorter than its type"),
        }
        Ok(())
    }
}

fn read_with(path: &Path, sources: Sources<'_>) -> Result<Imported, DataError> {
    let mut bag = Bag {
        path,
        sources,
        gathering: Gathering::default(),
        topics: BTreeMap::new(),
        messages: Vec::new(),
        commands: Vec::new(),
        ahead_us: Vec::new(),
        unread: BTreeMap::new(),
    };
    let mut notes = files::read(path, &mut bag)?;
    let fail = |message: String| DataError::file(path, message);
    let Bag { sources, mut gathering, topics, messages, commands, mut ahead_us, unread, .. } = bag;
    for (topic, (count, reason)) in unread {
        gathering.leave_out_so_many(&topic, count, reason);
    }
    if let Some(name) = sources.missing() {
        return Err(fail(format!("mapped {name}: no such topic, field or element in the bag")));
    }
    let has = |wanted: Kind| messages.iter().any(|(kind, _)| *kind == wanted);
    let (has_twist, has_fix, has_imu) = (has(Kind::Twist), has(Kind::Fix), has(Kind::Imu));
    let lowest_pa = messages.iter().filter(|(kind, _)| *kind == Kind::Pressure).map(|(_, m)| m.values[0]);
    let surface_pa = if lowest_pa.fold(f64::INFINITY, f64::min) < GAUGE_PA { 0.0 } else { SURFACE_PA };
    let add = |gathering: &mut Gathering, time_us: i64, samples: &[(Column, f64)]| {
        let samples: Vec<_> = samples.iter().filter(|(column, _)| !sources.fills(*column)).copied().collect();
        gathering.add(time_us, &samples);
    };
    for (kind, Stamped { time_us, values: v }) in messages {
        match kind {
            Kind::Imu => add(&mut gathering, time_us, &attitude(&v[..4], Some(&v[4..7]))),
            Kind::Pressure => {
                let depth_m = (v[0] - surface_pa) / SEA_WATER_N_PER_M3;
                add(&mut gathering, time_us, &[(Column::Depth, depth_m)]);
            }
            Kind::Twist => add(&mut gathering, time_us, &velocity(&v)),
            // status below zero: no fix
            Kind::Fix if v[0] < 0.0 => {}
            Kind::Fix => gathering.add_fix(time_us, v[1], v[2]),
            Kind::Odometry => {
                let mut samples = Vec::new();
                if !has_imu {
                    samples.extend(attitude(&v[3..7], None));
                }
                if !has_twist {
                    samples.extend(velocity(&v[7..10]));
                }
                if !has_fix {
                    samples.extend([(Column::GpsX, v[1]), (Column::GpsY, v[0])]);
                }
                add(&mut gathering, time_us, &samples);
            }
        }
    }
    ahead_us.sort_unstable();
    let ahead_us = ahead_us.get(ahead_us.len() / 2).copied().unwrap_or(0);
    // stamps of the same clock, later by what the messages took to the recorder
    let ahead_us = if ahead_us.abs() < SAME_CLOCK_US { 0 } else { ahead_us };
    let is_unstamped = commands.iter().any(|(_, mapped)| mapped.stamp_us.is_none());
    for (log_us, Mapped { stamp_us, samples }) in commands {
        gathering.add(stamp_us.unwrap_or(log_us + ahead_us), &samples);
    }
    let mut used: Vec<String> = topics.iter().map(|(name, topic)| format!("{topic} ({name})")).collect();
    if used.is_empty() {
        used.push("nothing by itself".to_owned());
    }
    notes.insert(
        0,
        format!("{NAME}; recognised: {}; turned to north-east-down and forward-right-down", used.join(", ")),
    );
    if topics.contains_key(KINDS[1].0) && !(has_fix && has_twist && has_imu) {
        notes.push("what no sensor's topic has is taken from the odometry, which is an estimate".to_owned());
    }
    if topics.contains_key(KINDS[2].0) {
        let from = if surface_pa > 0.0 { "absolute" } else { "above that of the air" };
        notes.push(format!("pressure is {from}: depth for sea water of 1025 kg/m^3"));
    }
    notes.extend(sources.note());
    if is_unstamped {
        let shift = if ahead_us == 0 { "" } else { ", put on the clock of the headers" };
        notes.push(format!("mapped messages without a stamp have the recorder's time{shift}"));
    }
    Ok(Imported { format: NAME, log: gathering.finish(path, notes)? })
}

/// Attitude of a quaternion x, y, z, w in ROS' frames, and rates.
fn attitude(q: &[f64], rates: Option<&[f64]>) -> Vec<(Column, f64)> {
    let mut samples = Vec::new();
    if let [x, y, z, w] = *q
        && let Some([roll, pitch, heading]) = euler_rad([w, x, y, z], true)
    {
        samples.extend([(Column::Roll, roll), (Column::Pitch, pitch), (Column::Heading, heading)]);
    }
    if let Some(&[p, q, r]) = rates {
        samples.extend([(Column::P, p), (Column::Q, -q), (Column::R, -r)]);
    }
    samples
}

fn velocity(v: &[f64]) -> Vec<(Column, f64)> {
    match *v {
        [x, y, z, ..] => vec![(Column::DvlU, x), (Column::DvlV, -y), (Column::DvlW, -z)],
        _ => Vec::new(),
    }
}

/// The numbers of a message that are used.
struct Stamped {
    time_us: i64,
    values: Vec<f64>,
}

/// The numbers of a message in their order; `None` if it is too short.
fn parse(kind: Kind, mut cdr: Cdr<'_>) -> Option<Stamped> {
    let time_us = cdr.header_us()?;
    let values = match kind {
        Kind::Imu => {
            let orientation = cdr.doubles(4)?;
            cdr.doubles(9)?; // its covariance
            [orientation, cdr.doubles(3)?].concat()
        }
        Kind::Pressure => cdr.doubles(1)?,
        Kind::Twist => cdr.doubles(3)?,
        Kind::Fix => {
            let status = f64::from(cdr.byte()? as i8);
            cdr.short()?; // service
            [vec![status], cdr.doubles(2)?].concat()
        }
        Kind::Odometry => {
            cdr.string()?; // child_frame_id
            let pose = cdr.doubles(7)?;
            cdr.doubles(36)?;
            [pose, cdr.doubles(3)?].concat()
        }
    };
    Some(Stamped { time_us, values })
}

#[cfg(test)]
mod tests {
    use super::*;

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
            ("/imu", KINDS[0].0, message(100, &["imu"], &imu, false)),
            ("/dvl", KINDS[3].0, message(100, &["dvl_link"], &[1.5, 0.2, 0.1, 0.0, 0.0, 0.0], false)),
            ("/pressure", KINDS[2].0, message(100, &["p"], &[101_325.0 + 2.0 * SEA_WATER_N_PER_M3, 0.0], false)),
            ("/odom", KINDS[1].0, message(101, &["map", "base_link"], &odometry, false)),
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
        let parsed = Cdr::new(&fix).and_then(|cdr| parse(Kind::Fix, cdr)).unwrap();
        assert_eq!((parsed.values, parsed.time_us), (vec![0.0, 41.0, -70.0], 7_500_000));
        assert!(Cdr::new(&fix[..20]).and_then(|cdr| parse(Kind::Fix, cdr)).is_none());
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
                ("/pressure", KINDS[2].0, at(5000.5), pressure),
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
            ("/fins[1]", "/fins[2]", "bag.mcap: mapped /fins[2]: no such topic"),
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
