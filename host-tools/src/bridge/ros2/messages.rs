//! Messages of ROS 2's common interfaces, as far as the bridge sends and reads them, and a telemetry record in them: a
//! world of x east, y north, z up, a vehicle of x forward, y to port, z up (REP 103). A fixed array of 36 is six of
//! six, which CDR writes alike.

use crate::bridge::Place;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// The frame that is fixed to the world, at the mission's origin (REP 105).
const WORLD: &str = "map";
/// Standard atmosphere at the surface, Pa, and standard gravity, m/s².
const SURFACE_PA: f64 = 101_325.0;
const GRAVITY_MPS2: f64 = 9.806_65;

/// What a type is called on the wire.
pub trait Named: Serialize {
    const NAME: &'static str;
}

macro_rules! messages {
    ($($(#[$doc:meta])* $name:ident $($wire:literal)? { $($field:ident: $type:ty),* $(,)? })*) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, Serialize, Deserialize)]
        pub struct $name { $(pub $field: $type),* }
        $(impl Named for $name { const NAME: &'static str = $wire; })?
    )*};
}

messages! {
    Time { sec: i32, nanosec: u32 }
    Header { stamp: Time, frame_id: String }
    /// `Point` and `Vector3` alike.
    Xyz { x: f64, y: f64, z: f64 }
    Quaternion { x: f64, y: f64, z: f64, w: f64 }
    Pose { position: Xyz, orientation: Quaternion }
    PoseWithCovariance { pose: Pose, covariance: [[f64; 6]; 6] }
    Twist { linear: Xyz, angular: Xyz }
    TwistWithCovariance { twist: Twist, covariance: [[f64; 6]; 6] }
    Transform { translation: Xyz, rotation: Quaternion }
    TransformStamped { header: Header, child_frame_id: String, transform: Transform }
    KeyValue { key: String, value: String }
    DiagnosticStatus { level: u8, name: String, message: String, hardware_id: String, values: Vec<KeyValue> }
    Odometry "nav_msgs::msg::dds_::Odometry_" {
        header: Header, child_frame_id: String, pose: PoseWithCovariance, twist: TwistWithCovariance,
    }
    TwistWithCovarianceStamped "geometry_msgs::msg::dds_::TwistWithCovarianceStamped_" {
        header: Header, twist: TwistWithCovariance,
    }
    FluidPressure "sensor_msgs::msg::dds_::FluidPressure_" { header: Header, fluid_pressure: f64, variance: f64 }
    DiagnosticArray "diagnostic_msgs::msg::dds_::DiagnosticArray_" { header: Header, status: Vec<DiagnosticStatus> }
    TfMessage "tf2_msgs::msg::dds_::TFMessage_" { transforms: Vec<TransformStamped> }
    Text "std_msgs::msg::dds_::String_" { data: String }
}

/// The vehicle's own frame.
fn vehicle(name: &str) -> String {
    format!("{name}/base_link")
}

pub fn header(utc_us: u64, frame_id: &str) -> Header {
    let sec = i32::try_from(utc_us / 1_000_000).unwrap_or(i32::MAX);
    let nanosec = (utc_us % 1_000_000) as u32 * 1000;
    Header { stamp: Time { sec, nanosec }, frame_id: frame_id.to_owned() }
}

const fn xyz([x, y, z]: [f64; 3]) -> Xyz {
    Xyz { x, y, z }
}

/// Position and orientation in ROS' axes.
fn pose(place: &Place<'_>) -> Pose {
    let [north, east, down, roll, pitch, heading, ..] = place.telemetry.state;
    let q = UnitQuaternion::from_euler_angles(roll, -pitch, FRAC_PI_2 - heading);
    Pose { position: xyz([east, north, -down]), orientation: Quaternion { x: q.i, y: q.j, z: q.k, w: q.w } }
}

fn diagonal(sigma: [f64; 6]) -> [[f64; 6]; 6] {
    let mut covariance = [[0.0; 6]; 6];
    sigma.iter().enumerate().for_each(|(place, sigma)| covariance[place][place] = sigma * sigma);
    covariance
}

/// A velocity in the body's axes, forward, to starboard and down, with the rates.
fn twist(place: &Place<'_>, [u, v, w]: [f64; 3]) -> TwistWithCovariance {
    let [.., p, q, r] = place.telemetry.state;
    let [.., su, sv, sw, sp, sq, sr] = place.telemetry.sigma;
    let twist = Twist { linear: xyz([u, -v, -w]), angular: xyz([p, -q, -r]) };
    TwistWithCovariance { twist, covariance: diagonal([su, sv, sw, sp, sq, sr]) }
}

/// The pose in the world, the velocity over ground in the vehicle's axes. The record has no sigma of the current: that
/// of the velocity is that through the water.
pub fn odometry(place: &Place<'_>, name: &str) -> Odometry {
    let [.., roll, pitch, heading, u, v, w, _, _, _] = place.telemetry.state;
    let [north, east] = place.telemetry.current_mps;
    let body = UnitQuaternion::from_euler_angles(roll, pitch, heading).inverse() * Vector3::new(north, east, 0.0);
    let [sn, se, sd, sr, sp, sh, ..] = place.telemetry.sigma;
    let mut covariance = diagonal([se, sn, sd, sr, sp, sh]);
    (covariance[0][1], covariance[1][0]) = (place.telemetry.cov_xy_m2, place.telemetry.cov_xy_m2);
    Odometry {
        header: header(place.utc_us, WORLD),
        child_frame_id: vehicle(name),
        pose: PoseWithCovariance { pose: pose(place), covariance },
        twist: twist(place, [u + body.x, v + body.y, w + body.z]),
    }
}

/// The velocity through the water.
pub fn water_velocity(place: &Place<'_>, name: &str) -> TwistWithCovarianceStamped {
    let [.., u, v, w, _, _, _] = place.telemetry.state;
    TwistWithCovarianceStamped { header: header(place.utc_us, &vehicle(name)), twist: twist(place, [u, v, w]) }
}

/// What an ideal sensor at the estimated depth would show, Pa.
pub fn pressure(place: &Place<'_>, name: &str) -> FluidPressure {
    let pa_per_m = place.density_kg_per_m3 * GRAVITY_MPS2;
    FluidPressure {
        header: header(place.utc_us, &vehicle(name)),
        fluid_pressure: SURFACE_PA + pa_per_m * place.telemetry.state[2],
        variance: (pa_per_m * place.telemetry.sigma[2]).powi(2),
    }
}

/// The vehicle's frame in the world's.
pub fn transform(place: &Place<'_>, name: &str) -> TfMessage {
    let Pose { position, orientation } = pose(place);
    TfMessage {
        transforms: vec![TransformStamped {
            header: header(place.utc_us, WORLD),
            child_frame_id: vehicle(name),
            transform: Transform { translation: position, rotation: orientation },
        }],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bridge::tests::{place, telemetry};

    /// Heading east at 1.2 m/s, pitched down by 0.5, in a current of 0.1 m/s to the north, which comes from starboard.
    #[test]
    fn val_axes_and_covariances_are_those_of_ros() {
        let mut telemetry = telemetry();
        (telemetry.state[4], telemetry.state[11]) = (-0.5, 0.2);
        (telemetry.sigma[0], telemetry.sigma[1], telemetry.cov_xy_m2) = (3.0, 2.0, 0.7);
        let place = place(&telemetry);
        let Odometry { header, child_frame_id, pose, twist } = odometry(&place, "auv");
        assert_eq!((header.stamp.sec, header.stamp.nanosec, header.frame_id.as_str()), (1, 500_000_000, "map"));
        assert_eq!(child_frame_id, "auv/base_link");
        let Xyz { x, y, z } = pose.pose.position;
        assert_eq!([x, y, z], [20.0, 10.0, -5.0]);
        assert_eq!(pose.covariance[0][..2], [4.0, 0.7]);
        assert_eq!(pose.covariance[1][..2], [0.7, 9.0]);
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
        // yaw counter-clockwise from east: none; bow down is a positive turn about the axis to port
        let Quaternion { x, y, z, w } = pose.pose.orientation;
        [(x, 0.0), (y, 0.25_f64.sin()), (z, 0.0), (w, 0.25_f64.cos())].iter().for_each(|(f, e)| close(*f, *e));
        let Twist { linear, angular } = twist.twist;
        [(linear.x, 1.2), (linear.y, 0.1), (linear.z, 0.0), (angular.z, -0.2)].iter().for_each(|(f, e)| close(*f, *e));
        close(water_velocity(&place, "auv").twist.twist.linear.y, 0.0);
        close(pressure(&place, "auv").fluid_pressure, 101_325.0 + 1025.0 * 9.806_65 * 5.0);
    }
}
