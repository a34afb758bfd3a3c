//! Where a sensor sits and how it is turned: kinematics of a point of a rigid body.

/// Columns are the rotated frame's axes: R v turns a vector of the rotated frame back.
pub type Rotation = [[f64; 3]; 3];

/// R of roll, pitch, yaw (yaw first, then pitch, then roll about the turned axes).
#[must_use]
pub fn rotation([roll, pitch, yaw]: [f64; 3]) -> Rotation {
    let (sr, cr) = libm::sincos(roll);
    let (sp, cp) = libm::sincos(pitch);
    let (sy, cy) = libm::sincos(yaw);
    [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
}

/// R v.
#[must_use]
pub fn times(r: &Rotation, v: [f64; 3]) -> [f64; 3] {
    r.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Rᵀ v.
#[must_use]
pub fn into_frame(r: &Rotation, v: [f64; 3]) -> [f64; 3] {
    core::array::from_fn(|i| r[0][i] * v[0] + r[1][i] * v[1] + r[2][i] * v[2])
}

/// Velocity at an arm relative to the centre: ω × r.
#[must_use]
pub fn swing([p, q, r]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [q * z - r * y, r * x - p * z, p * y - q * x]
}

/// Roll, pitch, yaw of a frame turned by `turn` in one of attitude `euler`.
#[must_use]
pub fn turned(euler: [f64; 3], turn: [f64; 3]) -> [f64; 3] {
    let (outer, inner) = (rotation(euler), rotation(turn));
    let m: Rotation =
        core::array::from_fn(|i| core::array::from_fn(|j| (0..3).map(|k| outer[i][k] * inner[k][j]).sum()));
    [libm::atan2(m[2][1], m[2][2]), libm::atan2(-m[2][0], libm::hypot(m[2][1], m[2][2])), libm::atan2(m[1][0], m[0][0])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// A sensor that looks to starboard in a level vehicle heading north looks east.
    #[test]
    fn val_turns_add_up() {
        let [roll, pitch, yaw] = turned([0.0; 3], [0.0, 0.0, FRAC_PI_2]);
        assert!(roll.abs() < 1e-15 && pitch.abs() < 1e-15 && (yaw - FRAC_PI_2).abs() < 1e-15);
        // the vehicle pitches up by 0.1 rad, which rolls that sensor to its right
        let [roll, pitch, _] = turned([0.0, 0.1, 0.0], [0.0, 0.0, FRAC_PI_2]);
        assert!((roll - 0.1).abs() < 1e-12 && pitch.abs() < 1e-12);
        let ahead = into_frame(&rotation([0.0, 0.0, FRAC_PI_2]), [1.0, 0.0, 0.0]);
        assert!(ahead[0].abs() < 1e-15 && (ahead[1] + 1.0).abs() < 1e-15, "ahead is to its port side");
    }

    /// A turn to starboard swings a point ahead to starboard.
    #[test]
    fn val_points_ahead_swing_outwards() {
        assert_eq!(swing([0.0, 0.0, 0.2], [0.5, 0.0, 0.0]), [0.0, 0.1, 0.0]);
    }
}
