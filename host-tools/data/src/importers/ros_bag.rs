//! ROS 2 bags in MCAP: the standard messages of attitude, velocity, pressure and position, CDR encoded.
//!
//! Messages are in the conventions of REP 103 and REP 105: body forward-left-up, world east-north-up; here they are
//! turned to forward-right-down and north-east-down. Times are those of the headers.

use super::Imported;
use super::engine::euler_rad;
use super::mapping::SEA_WATER_N_PER_M3;
use super::messages::Gathering;
use crate::DataError;
use crate::log::Column;
use std::collections::BTreeMap;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "ROS 2 bag";
/// Pressure at the surface, Pa.
pub(super) const SURFACE_PA: f64 = 101_325.0;
/// A gauge shows less than this in shallow water, an absolute sensor never, Pa.
pub(super) const GAUGE_PA: f64 = 50_000.0;

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

/// Reads a bag.
pub(super) fn read(path: &Path) -> Result<Imported, DataError> {
    let fail = |message: String| DataError::file(path, message);
    let bytes = std::fs::read(path).map_err(|e| DataError::io(path, &e))?;
    let options = mcap::read::Options::IgnoreEndMagic;
    let stream = mcap::MessageStream::new_with_options(&bytes, options.into())
        .map_err(|e| fail(format!("not a readable MCAP file: {e}")))?;
    let mut gathering = Gathering::default();
    // the first topic of each type is used
    let mut topics: BTreeMap<&'static str, String> = BTreeMap::new();
    let mut messages = Vec::new();
    let mut notes = Vec::new();
    for message in stream {
        let message = match message {
            Ok(message) => message,
            Err(error) if !messages.is_empty() => {
                notes.push(format!("cut off or broken: the rest is left out ({error})"));
                break;
            }
            Err(error) => return Err(fail(format!("no message can be read: {error}"))),
        };
        let topic = &message.channel.topic;
        let type_name = message.channel.schema.as_ref().map_or("", |schema| schema.name.as_str());
        let Some((name, kind)) = KINDS.into_iter().find(|(name, _)| *name == type_name) else {
            gathering.leave_out(topic, "a message type that is not read");
            continue;
        };
        if message.channel.message_encoding != "cdr" {
            return Err(fail(format!("{topic}: encoding {:?}; expected cdr", message.channel.message_encoding)));
        }
        if topics.entry(name).or_insert_with(|| topic.clone()) != topic {
            gathering.leave_out(topic, "another topic of the same type is used");
            continue;
        }
        let values = Cdr::new(&message.data).and_then(|cdr| parse(kind, cdr));
        match values {
            Some(values) => messages.push((kind, values)),
            None => gathering.leave_out(topic, "shorter than its type"),
        }
    }
    let has = |wanted: Kind| messages.iter().any(|(kind, _)| *kind == wanted);
    let (has_twist, has_fix, has_imu) = (has(Kind::Twist), has(Kind::Fix), has(Kind::Imu));
    let lowest_pa = messages.iter().filter(|(kind, _)| *kind == Kind::Pressure).map(|(_, m)| m.values[0]);
    let surface_pa = if lowest_pa.fold(f64::INFINITY, f64::min) < GAUGE_PA { 0.0 } else { SURFACE_PA };
    for (kind, Stamped { time_us, values: v }) in messages {
        match kind {
            Kind::Imu => gathering.add(time_us, &attitude(&v[..4], Some(&v[4..7]))),
            Kind::Pressure => {
                gathering.add(time_us, &[(Column::Depth, (v[0] - surface_pa) / SEA_WATER_N_PER_M3)]);
            }
            Kind::Twist => gathering.add(time_us, &velocity(&v)),
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
                gathering.add(time_us, &samples);
            }
        }
    }
    let used: Vec<String> = topics.iter().map(|(name, topic)| format!("{topic} ({name})")).collect();
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
    let (seconds, nanoseconds) = (cdr.int()?, cdr.int()? as u32);
    cdr.string()?; // frame_id
    let time_us = i64::from(seconds) * 1_000_000 + i64::from(nanoseconds) / 1000;
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

/// Common data representation of the OMG (CDR, little and big endian), as ROS 2 writes it.
struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    is_little: bool,
}

impl<'a> Cdr<'a> {
    fn new(message: &'a [u8]) -> Option<Self> {
        let (head, bytes) = message.split_at_checked(4)?;
        Some(Self { bytes, at: 0, is_little: head[1] & 1 == 1 })
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.at = self.at.next_multiple_of(N);
        let mut bytes: [u8; N] = self.bytes.get(self.at..self.at + N)?.try_into().ok()?;
        self.at += N;
        if !self.is_little {
            bytes.reverse();
        }
        Some(bytes)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| byte)
    }

    fn short(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn int(&mut self) -> Option<i32> {
        self.take().map(i32::from_le_bytes)
    }

    fn doubles(&mut self, count: usize) -> Option<Vec<f64>> {
        (0..count).map(|_| self.take().map(f64::from_le_bytes)).collect()
    }

    fn string(&mut self) -> Option<()> {
        let length = usize::try_from(self.int()?).ok()?;
        self.at = self.at.checked_add(length)?;
        (self.at <= self.bytes.len()).then_some(())
    }
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

    #[test]
    fn val_messages_are_turned_and_joined() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag.mcap");
        let file = std::io::BufWriter::new(std::fs::File::create(&path).unwrap());
        let writer = mcap::WriteOptions::new().profile("ros2");
        // what most writers of bags take
        let mut writer = writer.compression(Some(mcap::Compression::Zstd)).create(file).unwrap();
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
        for (sequence, (topic, schema, data)) in all.iter().enumerate() {
            let schema = writer.add_schema(schema, "ros2msg", b"").unwrap();
            let channel = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
            let header = mcap::records::MessageHeader {
                channel_id: channel,
                sequence: sequence as u32,
                log_time: 0,
                publish_time: 0,
            };
            writer.write_to_known_channel(&header, data).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
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
}
