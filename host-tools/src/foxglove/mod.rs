//! What Foxglove is told: topics of its well-known schemas and of ours, in a file (`export --foxglove`) or live (`bridge`).

mod messages;

use crate::decode::{EventKind, Found, What};
use backseat_app::LocalFrame;
use backseat_logs::session::{EstimatesRow, FusionRow, TelemetryRow};
use backseat_logs::{Column, LogRow};
use backseat_wire::hostlink::{Mode, Telemetry};
use messages::Message;
use serde_json::{Map, Value};
use std::collections::{BTreeMap, HashMap};

/// The layout that shows these topics.
pub const LAYOUT: &str = include_str!("../../foxglove/layout.json");
/// On the map and in the track a position a second is enough: each record where they come 0.84 to 1.2 s apart.
const TRACK_NS: u64 = 750_000_000;

/// Where messages go.
pub trait Sink {
    /// A topic that is new, with the JSON schema of its messages; the number that they come with.
    ///
    /// # Errors
    /// It cannot be written.
    fn channel(&mut self, topic: &str, schema: &str, json_schema: &[u8]) -> anyhow::Result<u16>;

    /// One message, JSON; nanoseconds since 1970.
    ///
    /// # Errors
    /// It cannot be written.
    fn message(&mut self, channel: u16, time_ns: u64, json: &[u8]) -> anyhow::Result<()>;
}

/// The topics of one sink.
pub struct Topics<S> {
    pub sink: S,
    channels: HashMap<String, u16>,
    /// Nanoseconds since 1970 of the log's time zero.
    pub zero_ns: i64,
    tracked_ns: Option<u64>,
    track: Vec<Value>,
    track_began_ns: u64,
    /// Handed to the sink so far.
    pub messages: u64,
}

impl<S: Sink> Topics<S> {
    /// `utc_offset_us` is UTC at the log's time zero, 0 where it is not known.
    pub fn new(sink: S, utc_offset_us: i64) -> Self {
        Self {
            sink,
            channels: HashMap::new(),
            zero_ns: utc_offset_us.saturating_mul(1000),
            tracked_ns: None,
            track: Vec::new(),
            track_began_ns: 0,
            messages: 0,
        }
    }

    /// What was decoded.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn take(&mut self, found: &Found<'_>, frame: LocalFrame) -> anyhow::Result<()> {
        let time_ns = found.time_us.saturating_mul(1000).saturating_add_signed(self.zero_ns);
        match &found.what {
            What::Measured(row) => self.measured(time_ns, row),
            What::VehicleFix(position_deg) => {
                self.put("/gps/fix", time_ns, messages::surface_fix(time_ns, *position_deg))
            }
            What::ShipFix(position_deg) => {
                self.put("/ship/fix", time_ns, messages::surface_fix(time_ns, *position_deg))
            }
            What::Telemetry(telemetry) => {
                let json = serde_json::to_value(TelemetryRow::from(*telemetry).at(found.time_us))?;
                self.put("/telemetry", time_ns, Message { schema: "backseat.Telemetry", json })?;
                if telemetry.mode == Mode::Initialising { Ok(()) } else { self.place(time_ns, telemetry, frame) }
            }
            What::Fusion(fusion) => {
                let row = FusionRow::from(*fusion).at(found.time_us);
                let topic = format!("/fusion/{}/{}", row.sensor, row.axis);
                self.put(&topic, time_ns, Message { schema: "backseat.Fusion", json: serde_json::to_value(row)? })
            }
            What::Identification(record) => {
                let json = serde_json::to_value(record)?;
                self.put("/identification", time_ns, Message { schema: "backseat.Identification", json })
            }
            What::Estimates(record) => {
                let json = serde_json::to_value(EstimatesRow::from(*record).at(found.time_us))?;
                self.put("/estimates", time_ns, Message { schema: "backseat.Estimates", json })
            }
            What::Event(kind, text) => {
                let warning = matches!(kind, EventKind::Loss | EventKind::Recorder);
                self.put("/events", time_ns, messages::log(time_ns, warning, kind.name(), text))
            }
        }
    }

    /// The vehicle on the map and in space.
    fn place(&mut self, time_ns: u64, telemetry: &Telemetry, frame: LocalFrame) -> anyhow::Result<()> {
        self.put("/tf", time_ns, messages::frame_transform(time_ns, telemetry))?;
        self.put("/vehicle/pose", time_ns, messages::pose_in_frame(time_ns, telemetry))?;
        if self.tracked_ns.is_some_and(|last_ns| time_ns < last_ns + TRACK_NS) {
            return Ok(());
        }
        if self.tracked_ns.replace(time_ns).is_none() {
            self.track_began_ns = time_ns;
        }
        self.track.push(messages::pose(telemetry));
        let (latitude, longitude) = frame.to_geodetic([telemetry.state[0], telemetry.state[1]]);
        let fix = messages::estimated_fix(time_ns, [latitude, longitude], telemetry);
        self.put("/vehicle/fix", time_ns, fix)
    }

    /// A row's samples, each group of columns on a topic of its own.
    fn measured(&mut self, time_ns: u64, row: &LogRow) -> anyhow::Result<()> {
        let mut groups: BTreeMap<&str, Map<String, Value>> = BTreeMap::new();
        for column in Column::STANDARD {
            if let Some(value) = row.get(*column) {
                groups.entry(group(*column)).or_default().insert(column.name().to_owned(), value.into());
            }
        }
        for (group, fields) in groups {
            let schema = match group {
                "actuators" => "backseat.Actuators",
                "acoustics" => "backseat.Acoustics",
                "attitude" => "backseat.Attitude",
                "rates" => "backseat.Rates",
                "dvl" => "backseat.Dvl",
                "depth" => "backseat.Depth",
                _ => "backseat.Position",
            };
            self.put(&format!("/measured/{group}"), time_ns, Message { schema, json: Value::Object(fields) })?;
        }
        Ok(())
    }

    fn put(&mut self, topic: &str, time_ns: u64, mut message: Message) -> anyhow::Result<()> {
        let channel = match self.channels.get(topic) {
            Some(channel) => *channel,
            None => {
                let schema = serde_json::to_vec(&messages::schema_of(message.schema, &message.json))?;
                let channel = self.sink.channel(topic, message.schema, &schema)?;
                self.channels.insert(topic.to_owned(), channel);
                channel
            }
        };
        // What is missing is left out: a schema has one type for each field.
        if let Value::Object(fields) = &mut message.json {
            fields.retain(|_, value| !value.is_null());
        }
        self.messages += 1;
        self.sink.message(channel, time_ns, &serde_json::to_vec(&message.json)?)
    }

    /// The whole track, and the sink.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> anyhow::Result<(S, u64)> {
        if !self.track.is_empty() {
            let track = messages::poses_in_frame(self.track_began_ns, std::mem::take(&mut self.track));
            self.put("/vehicle/track", self.track_began_ns, track)?;
        }
        Ok((self.sink, self.messages))
    }
}

/// Topic of a column.
const fn group(column: Column) -> &'static str {
    match column {
        Column::PropRpm | Column::FinTop | Column::FinBottom | Column::FinPort | Column::FinStarboard => "actuators",
        Column::Depth => "depth",
        Column::Roll | Column::Pitch | Column::Heading => "attitude",
        Column::P | Column::Q | Column::R => "rates",
        Column::DvlU | Column::DvlV | Column::DvlW => "dvl",
        Column::GpsX | Column::GpsY => "gps",
        Column::ShipGpsX | Column::ShipGpsY => "ship",
        _ => "acoustics",
    }
}
