//! Corrections for the installation: turns and delays on arrival, lever arms once attitude and rates are known.

use super::{SensorSample, Stamp};
use crate::time::micros;
use backseat_core::dynamics::Attitude;
use backseat_core::navigation::Measurement;
use backseat_core::parameters::Installation;
use backseat_core::state::{P, PHI, PSI, Q, R, THETA, VehicleState, X, Y, Z};
use nalgebra::{Matrix3, Vector3};

/// The sample in body axes, and the time at which it is valid, µs.
#[must_use]
pub fn mounted(stamp: Stamp, sample: SensorSample, installation: &Installation) -> (u64, SensorSample) {
    let delay_s = match sample {
        SensorSample::Depth { .. } => installation.depth_delay_s,
        SensorSample::Attitude { .. } | SensorSample::Rates { .. } => installation.ahrs_delay_s,
        SensorSample::BottomTrack { .. } | SensorSample::WaterTrack { .. } => installation.dvl_delay_s,
        SensorSample::Fix { .. } => installation.gnss_delay_s,
        SensorSample::Acoustic(_) => 0.0,
    };
    let time_us = match stamp {
        Stamp::Arrival(arrival_us) => arrival_us.saturating_sub(micros(delay_s)),
        Stamp::Own(time_us) => time_us,
    };
    let sample = match sample {
        SensorSample::Attitude { euler_rad } => {
            SensorSample::Attitude { euler_rad: body_attitude(euler_rad, &installation.ahrs_turn_rad) }
        }
        SensorSample::Rates { rates_radps } => {
            SensorSample::Rates { rates_radps: turned(rates_radps, &installation.ahrs_turn_rad) }
        }
        SensorSample::BottomTrack { velocity_mps } => {
            SensorSample::BottomTrack { velocity_mps: turned(velocity_mps, &installation.dvl_turn_rad) }
        }
        SensorSample::WaterTrack { velocity_mps } => {
            SensorSample::WaterTrack { velocity_mps: turned(velocity_mps, &installation.dvl_turn_rad) }
        }
        SensorSample::Depth { .. } | SensorSample::Fix { .. } | SensorSample::Acoustic(_) => sample,
    };
    (time_us, sample)
}

/// The longest delay that the filter waits for, µs.
///
/// The filter waits for neither fixes nor ranges. A fix comes at the surface, carries its own time and is moved along
/// with the velocity. For a range the delayed state is taken when the packet begins.
#[must_use]
pub fn horizon_us(installation: &Installation) -> u64 {
    micros(installation.depth_delay_s.max(installation.ahrs_delay_s).max(installation.dvl_delay_s))
}

/// The sample of [`mounted`] as a measurement of the centre of gravity; `None` for the modem's reports.
///
/// `x` is the vehicle at the filter's time, of which attitude and rates are used; a fix is `late_s` older than that and
/// is moved along with `velocity_ned_mps`, over ground.
#[must_use]
pub fn measurement(
    sample: &SensorSample,
    installation: &Installation,
    x: &VehicleState,
    velocity_ned_mps: [f64; 2],
    late_s: f64,
) -> Option<Measurement> {
    let dvl = |velocity_mps| velocity_at_centre([x[P], x[Q], x[R]], velocity_mps, &installation.dvl_arm_m);
    Some(match *sample {
        SensorSample::Depth { depth_m } => {
            Measurement::Depth { z_m: depth_m - body_to_ned(x, &installation.depth_arm_m)[2] }
        }
        SensorSample::Attitude { euler_rad } => Measurement::Attitude { euler_rad },
        SensorSample::Rates { rates_radps } => Measurement::Rates { rates_radps },
        SensorSample::BottomTrack { velocity_mps } => Measurement::BottomTrack { velocity_mps: dvl(velocity_mps) },
        SensorSample::WaterTrack { velocity_mps } => Measurement::WaterTrack { velocity_mps: dvl(velocity_mps) },
        SensorSample::Fix { position_m } => {
            let arm_m = body_to_ned(x, &installation.gnss_arm_m);
            let along = |i: usize| velocity_ned_mps[i] * late_s - arm_m[i];
            Measurement::VehicleGnss { position_m: [position_m[0] + along(0), position_m[1] + along(1)] }
        }
        SensorSample::Acoustic(_) => return None,
    })
}

/// Velocity at the centre of gravity of one measured at an arm, body axes: v − ω × r.
#[must_use]
pub fn velocity_at_centre(omega: [f64; 3], v: [f64; 3], r: &[f64; 3]) -> [f64; 3] {
    [
        v[0] - (omega[1] * r[2] - omega[2] * r[1]),
        v[1] - (omega[2] * r[0] - omega[0] * r[2]),
        v[2] - (omega[0] * r[1] - omega[1] * r[0]),
    ]
}

/// How much further from the ship's transducer the vehicle's is than the centre of gravity, m, at the attitude of `x`:
/// the path turns little within a packet.
#[must_use]
pub fn arm_along_path_m(x: &VehicleState, arm_m: &[f64; 3], ship_m: [f64; 2], ship_transducer_depth_m: f64) -> f64 {
    let d = [x[X] - ship_m[0], x[Y] - ship_m[1], x[Z] - ship_transducer_depth_m];
    let distance_m = libm::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    let arm_ned_m = body_to_ned(x, arm_m);
    if distance_m > 1.0 { (d[0] * arm_ned_m[0] + d[1] * arm_ned_m[1] + d[2] * arm_ned_m[2]) / distance_m } else { 0.0 }
}

/// R(φ, θ, ψ) a.
pub(crate) fn body_to_ned(x: &VehicleState, a: &[f64; 3]) -> [f64; 3] {
    let (sf, cf) = libm::sincos(x[PHI]);
    let (st, ct) = libm::sincos(x[THETA]);
    let (sp, cp) = libm::sincos(x[PSI]);
    let level = [ct * a[0] + st * (sf * a[1] + cf * a[2]), cf * a[1] - sf * a[2]];
    [cp * level[0] - sp * level[1], sp * level[0] + cp * level[1], -st * a[0] + ct * (sf * a[1] + cf * a[2])]
}

fn rotation(euler_rad: &[f64; 3]) -> Matrix3<f64> {
    Attitude::new(&Vector3::from(*euler_rad)).rotation()
}

/// A vector of the sensor's axes in body axes; without a turn the same bits.
fn turned(v: [f64; 3], turn_rad: &[f64; 3]) -> [f64; 3] {
    if *turn_rad == [0.0; 3] { v } else { (rotation(turn_rad) * Vector3::from(v)).into() }
}

/// The body's attitude from that of the sensor: R(body) = R(sensor) R(turn)ᵀ; without a turn the same bits.
fn body_attitude(sensor_rad: [f64; 3], turn_rad: &[f64; 3]) -> [f64; 3] {
    if *turn_rad == [0.0; 3] {
        return sensor_rad;
    }
    let r = rotation(&sensor_rad) * rotation(turn_rad).transpose();
    [libm::atan2(r[(2, 1)], r[(2, 2)]), libm::asin((-r[(2, 0)]).clamp(-1.0, 1.0)), libm::atan2(r[(1, 0)], r[(0, 0)])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::FRAC_PI_2;

    /// A sensor ahead of the centre of gravity of a vehicle that yaws to starboard and pitches up moves to starboard
    /// and upwards by ω × r.
    #[test]
    fn val_velocities_move_to_the_centre_of_gravity() {
        let (q, r, arm_m) = (0.1, 0.2, 0.5);
        let measured = [1.0, r * arm_m, -q * arm_m];
        assert_eq!(velocity_at_centre([0.0, q, r], measured, &[arm_m, 0.0, 0.0]), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn val_arms_turn_with_the_vehicle() {
        let mut x = VehicleState::zeros();
        x[PSI] = FRAC_PI_2;
        let ned = body_to_ned(&x, &[1.0, 0.0, 0.2]);
        assert!((ned[0]).abs() < 1e-15 && (ned[1] - 1.0).abs() < 1e-15 && (ned[2] - 0.2).abs() < 1e-15);
        // the ship lies west, so a transducer ahead of the centre of gravity is further away
        let further = arm_along_path_m(&x, &[1.0, 0.0, 0.0], [0.0, -100.0], 0.0);
        assert!((further - 1.0).abs() < 1e-12, "{further}");
    }

    /// A DVL turned to starboard by 90° reads the vehicle's surge as motion to its port side.
    #[test]
    fn val_a_turned_dvl() {
        let installation =
            Installation { dvl_turn_rad: [0.0, 0.0, FRAC_PI_2], dvl_delay_s: 0.25, ..Installation::DEFAULT };
        let raw = SensorSample::BottomTrack { velocity_mps: [0.0, -1.5, 0.1] };
        let (time_us, sample) = mounted(Stamp::Arrival(1_000_000), raw, &installation);
        let SensorSample::BottomTrack { velocity_mps: [u, v, w] } = sample else { panic!("{sample:?}") };
        assert_eq!(time_us, 750_000);
        assert!((u - 1.5).abs() < 1e-15 && v.abs() < 1e-15 && (w - 0.1).abs() < 1e-15, "{sample:?}");
        let (time_us, _) = mounted(Stamp::Own(1_000_000), raw, &installation);
        assert_eq!(time_us, 1_000_000, "the device's own time has no delay");
    }

    /// An AHRS yawed by 90° and upside down, in a vehicle that heads north, pitched up by 0.1 rad: worked out by hand.
    #[test]
    fn val_a_turned_ahrs() {
        let turn = |ahrs_turn_rad| Installation { ahrs_turn_rad, ..Installation::DEFAULT };
        // the sensor's x axis points to starboard, level: it heads east, and the vehicle's pitch is its roll
        let raw = SensorSample::Attitude { euler_rad: [0.1, 0.0, FRAC_PI_2] };
        let (_, sample) = mounted(Stamp::Own(0), raw, &turn([0.0, 0.0, FRAC_PI_2]));
        let SensorSample::Attitude { euler_rad: [roll, pitch, heading] } = sample else { panic!("{sample:?}") };
        assert!(roll.abs() < 1e-15 && (pitch - 0.1).abs() < 1e-15 && heading.abs() < 1e-15, "{sample:?}");
        let raw = SensorSample::Rates { rates_radps: [0.1, 0.2, 0.3] };
        let (_, sample) = mounted(Stamp::Own(0), raw, &turn([core::f64::consts::PI, 0.0, 0.0]));
        let SensorSample::Rates { rates_radps: [p, q, r] } = sample else { panic!("{sample:?}") };
        assert!((p - 0.1).abs() < 1e-15 && (q + 0.2).abs() < 1e-15 && (r + 0.3).abs() < 1e-15, "{sample:?}");
    }

    #[test]
    fn the_filter_waits_for_the_latest_sensor() {
        assert_eq!(horizon_us(&Installation::DEFAULT), 0);
        let late = Installation { dvl_delay_s: 0.3, ahrs_delay_s: 0.1, gnss_delay_s: 1.0, ..Installation::DEFAULT };
        assert_eq!(horizon_us(&late), 300_000);
    }
}
