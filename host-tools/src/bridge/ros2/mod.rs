//! ROS 2 without ROS: a DDS participant with the names of topics and types that every ROS 2 of the network knows.

mod messages;

use super::commands::Commands;
use super::counts::Counts;
use super::{Domain, Place};
use crate::monitor::{Severity, words};
use anyhow::{Context, anyhow, ensure};
use backseat_wire::hostlink::{Mode, Telemetry};
use messages::{DiagnosticArray, DiagnosticStatus, KeyValue, Named, Text};
use rustdds::no_key::{DataReader, DataWriter};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{DomainParticipant, DomainParticipantBuilder, Publisher, QosPolicies, QosPolicyBuilder, TopicKind};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use std::time::Instant;

/// What the process may take of memory, bytes. It needs far less.
const MEMORY: u64 = 512 << 20;

/// The library makes a buffer of the size that the first fragment of a message claims, up to 4 GiB, whoever sends it and
/// without end. This bounds all of them: what goes beyond ends the process, and leaves the machine to the others.
pub fn limit_memory() -> anyhow::Result<()> {
    let Rlimit { current, maximum } = getrlimit(Resource::Data);
    let limit = Rlimit { current: Some(current.map_or(MEMORY, |set| set.min(MEMORY))), maximum };
    setrlimit(Resource::Data, limit).context("--ros2: a limit of the memory")?;
    eprintln!("bridge: ROS 2: ends if somebody's messages claim more than {} MiB of memory", MEMORY >> 20);
    Ok(())
}

/// As `rclcpp` and `rclpy` publish: reliable, the last ten. Nothing waits for a reader: what the library cannot take is
/// dropped. It holds 8,192 messages for one that does not acknowledge, and lets it go when its lease is over.
fn qos() -> QosPolicies {
    QosPolicyBuilder::new()
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: 10 })
        .reliability(Reliability::Reliable { max_blocking_time: rustdds::Duration::ZERO })
        .build()
}

/// A topic that is written.
struct Topic<M: Named>(DataWriter<M>);

impl<M: Named> Topic<M> {
    fn open(participant: &DomainParticipant, publisher: &Publisher, name: &str) -> anyhow::Result<Self> {
        let topic = participant.create_topic(format!("rt/{name}"), M::NAME.to_owned(), &qos(), TopicKind::NoKey);
        let topic = topic.map_err(|error| anyhow!("{name}: {error}"))?;
        let writer = publisher.create_datawriter_no_key_cdr(&topic, None);
        Ok(Self(writer.map_err(|error| anyhow!("{name}: {error}"))?))
    }

    fn put(&self, message: M, arrived: Instant, counts: &Counts) {
        counts.note(self.0.write(message, None).is_ok().then_some(arrived));
    }
}

/// The topics of a vehicle.
pub struct Node {
    name: String,
    odometry: Topic<messages::Odometry>,
    water_velocity: Topic<messages::TwistWithCovarianceStamped>,
    pressure: Topic<messages::FluidPressure>,
    transform: Topic<messages::TfMessage>,
    diagnostics: Topic<DiagnosticArray>,
    said: Option<(u64, Mode)>,
    named: String,
    mission: Option<(DataReader<Text>, Topic<Text>)>,
    counts: Counts,
    // what was made of it needs it
    _participant: DomainParticipant,
}

impl Node {
    /// Joins the domain, on every network of this computer or on that of one address; reads missions if they are
    /// accepted.
    pub fn open(domain: Domain, name: &str, accepts: bool) -> anyhow::Result<Self> {
        let is_start = |first: char| first.is_ascii_alphabetic() || first == '_';
        ensure!(
            name.starts_with(is_start) && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'),
            "--name {name}: a name of ROS 2 has letters, digits and underscores, and begins with no digit"
        );
        let failed = |error: &dyn std::fmt::Display| anyhow!("--ros2 {domain}: {error}");
        let mut builder = DomainParticipantBuilder::new(domain.id);
        if let Some(address) = domain.address {
            builder = builder.with_only_networks([address]);
        }
        let participant = builder.build().map_err(|error| failed(&error))?;
        let publisher = participant.create_publisher(&qos()).map_err(|error| failed(&error))?;
        let topic = |what: &str| format!("{name}/{what}");
        let mission = if accepts {
            let wanted = participant.create_topic(
                format!("rt/{}", topic("mission")),
                Text::NAME.to_owned(),
                &qos(),
                TopicKind::NoKey,
            );
            let subscriber = participant.create_subscriber(&qos()).map_err(|error| failed(&error))?;
            let reader = subscriber.create_datareader_no_key_cdr(&wanted.map_err(|error| failed(&error))?, None);
            let reader = reader.map_err(|error| failed(&error))?;
            Some((reader, Topic::open(&participant, &publisher, &topic("answer"))?))
        } else {
            None
        };
        Ok(Self {
            odometry: Topic::open(&participant, &publisher, &topic("odom"))?,
            water_velocity: Topic::open(&participant, &publisher, &topic("water_velocity"))?,
            pressure: Topic::open(&participant, &publisher, &topic("pressure"))?,
            transform: Topic::open(&participant, &publisher, "tf")?,
            diagnostics: Topic::open(&participant, &publisher, "diagnostics")?,
            said: None,
            named: String::new(),
            mission,
            counts: Counts::default(),
            name: name.to_owned(),
            _participant: participant,
        })
    }

    /// A record that has a place.
    pub fn send(&self, place: &Place<'_>) {
        let (name, arrived, counts) = (&self.name, place.arrived, &self.counts);
        self.odometry.put(messages::odometry(place, name), arrived, counts);
        self.water_velocity.put(messages::water_velocity(place, name), arrived, counts);
        self.pressure.put(messages::pressure(place, name), arrived, counts);
        self.transform.put(messages::transform(place, name), arrived, counts);
    }

    /// What the board states of what has changed, from here on.
    pub fn name_causes(&mut self, statement: &str) {
        statement.clone_into(&mut self.named);
        self.said = None;
    }

    /// Mode, level and what is named: once a second, and when they change.
    pub fn diagnose(&mut self, telemetry: &Telemetry, utc_us: u64, arrived: Instant) {
        let now = (utc_us / 1_000_000, telemetry.mode);
        if self.said.replace(now) == Some(now) {
            return;
        }
        let Telemetry { mode, reason, sigma, level_m: [horizontal_m, depth_m], leg, .. } = telemetry;
        let values = [
            ("protection level, horizontal [m]", format!("{horizontal_m:.1}")),
            ("protection level, depth [m]", format!("{depth_m:.1}")),
            ("sigma, horizontal [m]", format!("{:.2}", sigma[0].hypot(sigma[1]))),
            ("leg", leg.map_or_else(|| "-".to_owned(), |leg| (leg + 1).to_string())),
            ("named", self.named.clone()),
        ];
        let status = DiagnosticStatus {
            level: match words::severity(*mode) {
                Severity::Info => 0,
                Severity::Warning => 1,
                Severity::Critical => 2,
            },
            name: format!("{}: navigation", self.name),
            message: words::mode(*mode, *reason),
            hardware_id: self.name.clone(),
            values: values.map(|(key, value)| KeyValue { key: key.to_owned(), value }).into(),
        };
        let message = DiagnosticArray { header: messages::header(utc_us, ""), status: vec![status] };
        self.diagnostics.put(message, arrived, &self.counts);
    }

    /// Hands on what is asked.
    pub fn attend(&mut self, commands: &Commands) {
        let Some((asked, _)) = &mut self.mission else { return };
        loop {
            match asked.take_next_sample() {
                Ok(Some(sample)) if commands.offer("ROS 2", sample.value().data.as_bytes()) => {}
                Ok(None) => return,
                // too much or too long; or what is no string
                Ok(Some(_)) | Err(_) => self.counts.refuse(),
            }
        }
    }

    pub const fn counts(&self) -> &Counts {
        &self.counts
    }

    /// What became of it.
    pub fn answer(&self, data: String) {
        if let Some((_, topic)) = &self.mission {
            topic.put(Text { data }, Instant::now(), &self.counts);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bridge::tests::{place, telemetry};
    use std::net::{Ipv4Addr, UdpSocket};
    use std::time::Duration;

    /// Another participant reads and asks, a third lies at every port that both have.
    #[test]
    fn a_reader_is_served_and_heard_while_others_send_nonsense() {
        let id = 200 + (std::process::id() % 32) as u16;
        let domain = Domain { id, address: Some(Ipv4Addr::LOCALHOST.into()) };
        assert!(Node::open(domain, "1auv", false).err().unwrap().to_string().contains("--name 1auv"));
        let mut node = Node::open(domain, "auv", true).unwrap();
        let other = DomainParticipantBuilder::new(id).with_only_networks([Ipv4Addr::LOCALHOST]).build().unwrap();
        let wanted =
            other.create_topic("rt/auv/odom".into(), messages::Odometry::NAME.into(), &qos(), TopicKind::NoKey);
        let subscriber = other.create_subscriber(&qos()).unwrap();
        let mut reader = subscriber.create_datareader_no_key_cdr::<messages::Odometry>(&wanted.unwrap(), None).unwrap();
        let asks = Topic::<Text>::open(&other, &other.create_publisher(&qos()).unwrap(), "auv/mission").unwrap();
        let (commands, asked) = Commands::kept();
        let liar = UdpSocket::bind("127.0.0.1:0").unwrap();
        let telemetry = telemetry();
        let (mut received, mut heard, mut round) = (0, 0, 0_u64);
        while received < 20 || heard < 1 || node.counts.read()[2] < 1 {
            // of these none but the last is an RTPS message's length; the kind of the first submessage goes round
            for port in 7400 + 250 * id..7416 + 250 * id {
                for length in [0, 3, 19, 24, 200, 1400] {
                    let random = |k: u64| (round.wrapping_mul(6_364_136_223_846_793_005) >> (k % 57)) as u8;
                    let mut bytes = b"RTPS\x02\x03\x01\x0f".to_vec();
                    bytes.extend((0..12).map(|k| random(k + u64::from(port))));
                    bytes.extend([round as u8, 1, 0xFF, 0xFF]);
                    bytes.extend((0..length).map(random));
                    let _ = liar.send_to(&bytes, (Ipv4Addr::LOCALHOST, port));
                    round += 1;
                }
            }
            node.send(&place(&telemetry));
            let data = if (round / 96) % 2 == 0 { "stop".to_owned() } else { "x".repeat(70_000) };
            let _ = asks.0.write(Text { data }, None);
            node.attend(&commands);
            heard += asked.try_iter().count();
            while let Ok(Some(sample)) = reader.take_next_sample() {
                assert_eq!(sample.value().child_frame_id, "auv/base_link");
                received += 1;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        assert_eq!(node.counts.read()[1], 0, "dropped");
    }

    /// One datagram, of nobody whom it knows, says that it begins a message of 1 GiB. In a process of its own, because
    /// that is what ends.
    #[test]
    fn who_claims_too_much_memory_ends_the_process_alone() {
        const CHILD: &str = "BACKSEAT_TEST_DOMAIN";
        let loopback = |id| Domain { id, address: Some(Ipv4Addr::LOCALHOST.into()) };
        if let Ok(id) = std::env::var(CHILD) {
            limit_memory().unwrap();
            let _node = Node::open(loopback(id.parse().unwrap()), "auv", false).unwrap();
            return std::thread::sleep(Duration::from_secs(20));
        }
        let id = 168 + (std::process::id() % 32) as u16;
        let mut child = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "--nocapture", "bridge::ros2::tests::who_claims_too_much_memory_ends_the_process_alone"])
            .env(CHILD, id.to_string())
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        let liar = UdpSocket::bind("127.0.0.1:0").unwrap();
        // to the reader of participants: message 1, fragment 1, one fragment of 1024 bytes
        let mut bytes = b"RTPS\x02\x03\x01\x0f a liar ....\x16\x01\x28\x00\x00\x00\x1c\x00".to_vec();
        bytes.extend(
            b"\x00\x01\x00\xc7\x00\x01\x00\xc2\x00\x00\x00\x00\x01\x00\x00\x00\x01\x00\x00\x00\x01\x00\x00\x04",
        );
        bytes.extend((1_u32 << 30).to_le_bytes());
        bytes.extend([0; 8]);
        while child.try_wait().unwrap().is_none() {
            for port in 7410 + 250 * id..7416 + 250 * id {
                let _ = liar.send_to(&bytes, (Ipv4Addr::LOCALHOST, port));
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains("memory allocation of 1073741824 bytes failed"), "{said}");
    }
}
