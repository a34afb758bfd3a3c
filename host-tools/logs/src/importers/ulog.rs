//! Logs of PX4 (ULog, `.ulg`), taken apart by PX4's own crate: topics with the names and types of their numbers. Body
//! axes forward, right, down; attitude to north-east-down.

use super::mapping::ColumnMap;
use super::signals::{Hint, Message, Only, Signals, Take, number};
use super::{Imported, layout};
use crate::DataError;
use crate::log::{Column, table};
use px4_ulog::stream_parser::LogParser;
use px4_ulog::stream_parser::model::{DataMessage, FlattenedFieldType as Type};
use std::cell::RefCell;
use std::io::Read;
use std::path::Path;

/// Name of the format.
pub(super) const NAME: &str = "PX4 ULog";

const FIX_3D: Only = Only::From("fix_type", 3.0);
/// The second before firmware 1.14.
const FIX: &[Take] = &[Take::Fix(["latitude_deg", "longitude_deg"], 1.0), Take::Fix(["lat", "lon"], 1e-7)];

static MESSAGES: [Message; 5] = [
    Message {
        name: "vehicle_attitude",
        only: Only::Always,
        takes: &[Take::Quaternion(["q[0]", "q[1]", "q[2]", "q[3]"])],
    },
    Message {
        name: "vehicle_angular_velocity",
        only: Only::Always,
        takes: &[number("xyz[0]", Column::P, 1.0), number("xyz[1]", Column::Q, 1.0), number("xyz[2]", Column::R, 1.0)],
    },
    Message {
        name: "sensor_combined",
        only: Only::Always,
        takes: &[
            number("gyro_rad[0]", Column::P, 1.0),
            number("gyro_rad[1]", Column::Q, 1.0),
            number("gyro_rad[2]", Column::R, 1.0),
        ],
    },
    Message { name: "sensor_gps", only: FIX_3D, takes: FIX },
    Message { name: "vehicle_gps_position", only: FIX_3D, takes: FIX },
];

const OUTPUT: &str = "outputs of any meaning: name propeller and fins by --columns, as actuator_motors.control[0]";
const HINTS: &[Hint] = &[
    ("actuator_outputs", OUTPUT),
    ("actuator_motors", OUTPUT),
    ("actuator_servos", OUTPUT),
    ("actuator_controls_0", OUTPUT),
    ("vehicle_local_position", "the vehicle's own estimate; its z is a depth to name by --columns"),
    ("vehicle_global_position", "the vehicle's own estimate"),
];

/// Whether the beginning of a file is that of such a log.
pub(super) fn is_ulog(beginning: &[u8]) -> bool {
    beginning.starts_with(b"ULog\x01\x12\x35")
}

/// Reads a log.
pub(super) fn read(path: &Path, map: Option<&ColumnMap>) -> Result<Imported, DataError> {
    let signals = RefCell::new(Signals::new(path, map, &MESSAGES)?);
    let mut take = |message: &DataMessage<'_>| take(&mut signals.borrow_mut(), message);
    let mut parser = LogParser::default();
    parser.set_data_message_callback(&mut take);
    let mut file = table::open_bytes(path)?.take(super::MAX_BYTES);
    let (mut block, mut at, mut fault) = (vec![0; 1 << 16], 0, None);
    loop {
        let count = file.read(&mut block).map_err(|e| DataError::io(path, &e))?;
        if count == 0 {
            break;
        }
        if let Err(error) = parser.consume_bytes(&block[..count]) {
            fault = Some(format!("within 64 KiB behind byte {at}: {error}"));
            break;
        }
        at += count;
    }
    drop(parser);
    let mut notes = Vec::new();
    if let Some(fault) = fault {
        notes.push(format!("broken, the rest is left out: {fault}"));
    }
    signals.into_inner().finish(NAME, HINTS, notes)
}

fn take(signals: &mut Signals<'_>, message: &DataMessage<'_>) {
    let format = message.flattened_format;
    let which = match message.multi_id.value() {
        0 => String::new(),
        number => format!("[{number}]"),
    };
    if !signals.wants(format.message_name()) {
        return;
    }
    let mut values = Vec::with_capacity(format.fields.len());
    for field in &format.fields {
        let code = match field.field_type {
            Type::Int8 => b'b',
            Type::UInt8 | Type::Bool => b'B',
            Type::Int16 => b'h',
            Type::UInt16 => b'H',
            Type::Int32 => b'i',
            Type::UInt32 => b'I',
            Type::Int64 => b'q',
            Type::UInt64 => b'Q',
            Type::Float => b'f',
            Type::Double => b'd',
            Type::Char => continue,
        };
        let bytes = message.data.get(usize::from(field.offset)..).unwrap_or_default();
        values.extend(layout::number(code, bytes, false).map(|value| (field.flattened_field_name.as_str(), value)));
    }
    let get = |name: &str| values.iter().find(|(field, _)| *field == name).map(|(_, value)| *value);
    let Some(time_us) = get("timestamp").map(|time_us| time_us as i64) else { return };
    if let Some(utc_us) = get("time_utc_usec").filter(|utc_us| (1e15..1e16).contains(utc_us) && signals.shift_us == 0) {
        signals.shift_us = utc_us as i64 - time_us;
    }
    signals.message(time_us, format.message_name(), &which, &values);
}
