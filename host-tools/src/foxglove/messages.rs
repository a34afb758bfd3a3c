//! Messages of Foxglove's well-known schemas, as JSON. Its world has x east, y north, z up; the vehicle's frame has x
//! forward, y to port, z up.

use backseat_wire::hostlink::Telemetry;
use nalgebra::UnitQuaternion;
use serde_json::{Map, Value, json};
use std::f64::consts::FRAC_PI_2;

/// The frame that is fixed to the world, at the mission's origin.
pub const WORLD: &str = "map";
/// The vehicle's.
pub const VEHICLE: &str = "vehicle";

/// A message and its schema.
pub struct Message {
    pub schema: &'static str,
    pub json: Value,
}

fn stamp(time_ns: u64) -> Value {
    json!({"sec": time_ns / 1_000_000_000, "nsec": time_ns % 1_000_000_000})
}

/// What the covariance of a fix is known to be.
enum Covariance {
    Unknown,
    Full([f64; 9]),
}

fn location_fix(time_ns: u64, [latitude, longitude]: [f64; 2], altitude: f64, covariance: Covariance) -> Message {
    let (position_covariance, position_covariance_type) = match covariance {
        Covariance::Unknown => ([0.0; 9], 0),
        Covariance::Full(covariance) => (covariance, 3),
    };
    let json = json!({
        "timestamp": stamp(time_ns),
        "frame_id": WORLD,
        "latitude": latitude,
        "longitude": longitude,
        "altitude": altitude,
        "position_covariance": position_covariance,
        "position_covariance_type": position_covariance_type,
    });
    Message { schema: "foxglove.LocationFix", json }
}

/// A fix at the surface that says nothing of its accuracy.
pub fn surface_fix(time_ns: u64, position_deg: [f64; 2]) -> Message {
    location_fix(time_ns, position_deg, 0.0, Covariance::Unknown)
}

/// The estimated position, with its covariance.
pub fn estimated_fix(time_ns: u64, position_deg: [f64; 2], telemetry: &Telemetry) -> Message {
    let [north, east, down, ..] = telemetry.sigma.map(|sigma| sigma * sigma);
    let cross = telemetry.cov_xy_m2;
    let covariance = [east, cross, 0.0, cross, north, 0.0, 0.0, 0.0, down];
    location_fix(time_ns, position_deg, -telemetry.state[2], Covariance::Full(covariance))
}

fn xyz([x, y, z]: [f64; 3]) -> Value {
    json!({"x": x, "y": y, "z": z})
}

/// Position and orientation in Foxglove's axes.
fn placed(telemetry: &Telemetry) -> (Value, Value) {
    let [north, east, down, roll, pitch, heading, ..] = telemetry.state;
    let q = UnitQuaternion::from_euler_angles(roll, -pitch, FRAC_PI_2 - heading);
    (xyz([east, north, -down]), json!({"x": q.i, "y": q.j, "z": q.k, "w": q.w}))
}

/// The estimated pose.
pub fn pose(telemetry: &Telemetry) -> Value {
    let (position, orientation) = placed(telemetry);
    json!({"position": position, "orientation": orientation})
}

pub fn pose_in_frame(time_ns: u64, telemetry: &Telemetry) -> Message {
    let json = json!({"timestamp": stamp(time_ns), "frame_id": WORLD, "pose": pose(telemetry)});
    Message { schema: "foxglove.PoseInFrame", json }
}

/// A whole track.
pub fn poses_in_frame(time_ns: u64, poses: Vec<Value>) -> Message {
    let json = json!({"timestamp": stamp(time_ns), "frame_id": WORLD, "poses": poses});
    Message { schema: "foxglove.PosesInFrame", json }
}

pub fn frame_transform(time_ns: u64, telemetry: &Telemetry) -> Message {
    let (translation, rotation) = placed(telemetry);
    let json = json!({
        "timestamp": stamp(time_ns),
        "parent_frame_id": WORLD,
        "child_frame_id": VEHICLE,
        "translation": translation,
        "rotation": rotation,
    });
    Message { schema: "foxglove.FrameTransform", json }
}

/// An event, as a line of a log.
pub fn log(time_ns: u64, warning: bool, name: &str, message: &str) -> Message {
    let level = if warning { 3 } else { 2 };
    let json = json!({
        "timestamp": stamp(time_ns),
        "level": level,
        "message": message,
        "name": name,
        "file": "",
        "line": 0,
    });
    Message { schema: "foxglove.Log", json }
}

/// The JSON schema of messages like this one: Foxglove plots what a schema declares.
pub fn schema_of(name: &str, sample: &Value) -> Value {
    let mut schema = type_of(sample);
    schema["title"] = name.into();
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
    schema
}

fn type_of(sample: &Value) -> Value {
    match sample {
        Value::Bool(_) => json!({"type": "boolean"}),
        // a number that is missing in the sample
        Value::Number(_) | Value::Null => json!({"type": "number"}),
        Value::String(_) => json!({"type": "string"}),
        Value::Array(items) => json!({"type": "array", "items": items.first().map_or(json!({}), type_of)}),
        Value::Object(fields) if fields.len() == 2 && fields.contains_key("sec") && fields.contains_key("nsec") => {
            let whole = json!({"type": "integer", "minimum": 0});
            json!({"type": "object", "title": "time", "properties": {"sec": whole, "nsec": whole}})
        }
        Value::Object(fields) => {
            let properties: Map<String, Value> =
                fields.iter().map(|(name, field)| (name.clone(), type_of(field))).collect();
            json!({"type": "object", "properties": properties})
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Rotation3, Vector3};

    #[test]
    fn val_the_quaternion_is_the_rotation_in_other_axes() {
        let (roll, pitch, heading) = (0.3, -0.4, 2.0);
        // body forward-right-down to north-east-down, then both sets of axes exchanged
        let to_ned = Rotation3::from_euler_angles(roll, pitch, heading);
        let world = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
        let body = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let expected = world * to_ned.matrix() * body;
        let q = UnitQuaternion::from_euler_angles(roll, -pitch, FRAC_PI_2 - heading);
        // rounding of a few products
        assert!((q.to_rotation_matrix().matrix() - expected).norm() < 1e-14);
    }

    #[test]
    fn schemas_name_every_field() {
        let sample = json!({"timestamp": {"sec": 1, "nsec": 2}, "x": [0.5], "name": "a", "ok": true, "none": null});
        let schema = schema_of("backseat.Sample", &sample);
        assert_eq!((&schema["title"], &schema["type"]), (&"backseat.Sample".into(), &"object".into()));
        let properties = &schema["properties"];
        assert_eq!(properties["timestamp"]["title"], "time");
        assert_eq!(properties["x"], json!({"type": "array", "items": {"type": "number"}}));
        assert_eq!((&properties["none"]["type"], &properties["ok"]["type"]), (&"number".into(), &"boolean".into()));
    }
}
