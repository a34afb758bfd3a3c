//! Acceleration of the body from an AHRS: (4.2.2), corrected.
//!
//! An accelerometer feels specific force, dv/dt less gravity, at its own place and in its own axes:
//! a_m = R_wb (dv_m/dt − g e3), with v_m the sensor's velocity in the world. The thesis' (4.10) has the sign of the
//! rotation's derivative wrong, and its (4.13)-(4.20) contradict Table 4.4: level and at rest a sensor reads −9.81 m/s²
//! in heave.

use nalgebra::{Matrix3, Vector3};

/// How a sensor is mounted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mounting {
    /// From the centre of gravity to the sensor, body axes, m.
    pub lever_m: Vector3<f64>,
    /// From sensor axes to body axes.
    pub rotation: Matrix3<f64>,
}

impl Mounting {
    /// At the centre of gravity, aligned.
    #[must_use]
    pub fn ideal() -> Self {
        Self { lever_m: Vector3::zeros(), rotation: Matrix3::identity() }
    }
}

/// dν/dt, the derivative of the body velocity of the centre of gravity in body axes, m/s²:
/// a_m + Rᵀ g e3 − ω x ν − ω̇ x r − ω x (ω x r).
///
/// `specific_force` is what the sensor reads (its own axes, m/s²), `down` = Rᵀ e3, `velocity` ν (m/s), `rates` ω and
/// `angular_acceleration` ω̇ in body axes.
#[must_use]
pub fn body_acceleration(
    specific_force: &Vector3<f64>,
    mounting: &Mounting,
    g_mps2: f64,
    down: &Vector3<f64>,
    velocity: &Vector3<f64>,
    rates: &Vector3<f64>,
    angular_acceleration: &Vector3<f64>,
) -> Vector3<f64> {
    let lever = &mounting.lever_m;
    mounting.rotation * specific_force + down * g_mps2
        - rates.cross(velocity)
        - angular_acceleration.cross(lever)
        - rates.cross(&rates.cross(lever))
}

/// What the sensor reads: the inverse of [`body_acceleration`].
#[must_use]
pub fn specific_force(
    acceleration: &Vector3<f64>,
    mounting: &Mounting,
    g_mps2: f64,
    down: &Vector3<f64>,
    velocity: &Vector3<f64>,
    rates: &Vector3<f64>,
    angular_acceleration: &Vector3<f64>,
) -> Vector3<f64> {
    let lever = &mounting.lever_m;
    let felt = acceleration - down * g_mps2
        + rates.cross(velocity)
        + angular_acceleration.cross(lever)
        + rates.cross(&rates.cross(lever));
    mounting.rotation.transpose() * felt
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::dynamics::Attitude;

    #[test]
    fn val_a_level_sensor_at_rest_reads_minus_g_in_heave() {
        // Table 4.4.
        let zero = Vector3::zeros();
        let read = specific_force(&zero, &Mounting::ideal(), 9.81, &Vector3::z(), &zero, &zero, &zero);
        assert_eq!(read, Vector3::new(0.0, 0.0, -9.81));
    }

    #[test]
    fn val_the_acceleration_is_that_of_a_motion_in_the_world() {
        // A sensor fixed to a body whose position and attitude are smooth functions of time; everything it reads and
        // the body's acceleration by differences in the world frame, none of the formulas above.
        let g = 9.81;
        let mounting = Mounting {
            lever_m: Vector3::new(0.4, -0.1, 0.05),
            rotation: Attitude::new(&Vector3::new(0.3, -0.2, 1.0)).rotation(),
        };
        let euler = |t: f64| Vector3::new(0.3 * (0.7 * t).sin(), 0.2 * (0.9 * t).cos(), 0.5 * t);
        let rotation = |t: f64| Attitude::new(&euler(t)).rotation();
        let position = |t: f64| Vector3::new(1.5 * t + 0.3 * (0.5 * t).sin(), (0.4 * t).cos(), 0.2 * (0.6 * t).sin());
        let sensor = |t: f64| position(t) + rotation(t) * mounting.lever_m;
        let h = 1.0e-3;
        let t = 2.3;
        let velocity = |t: f64| rotation(t).transpose() * (position(t + h) - position(t - h)) / (2.0 * h);
        let rates = |t: f64| {
            let skew = rotation(t).transpose() * (rotation(t + h) - rotation(t - h)) / (2.0 * h);
            Vector3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)])
        };
        let world = (sensor(t + h) - sensor(t) * 2.0 + sensor(t - h)) / (h * h);
        let read = mounting.rotation.transpose() * rotation(t).transpose() * (world - Vector3::z() * g);
        let expected = (velocity(t + h) - velocity(t - h)) / (2.0 * h);
        let turning = (rates(t + h) - rates(t - h)) / (2.0 * h);
        let down = Attitude::new(&euler(t)).down();
        let found = body_acceleration(&read, &mounting, g, &down, &velocity(t), &rates(t), &turning);
        // Differences of order h².
        assert!((found - expected).amax() < 1.0e-5, "{found} instead of {expected}");
        let back = specific_force(&found, &mounting, g, &down, &velocity(t), &rates(t), &turning);
        assert!((back - read).amax() < 1.0e-12);
    }
}
