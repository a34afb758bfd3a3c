//! Dead reckoning: what a vehicle knows without acoustics (Figure 3.3), to compare the filter with.

use backseat_core::effects::{EffectSet, ParameterId};
use backseat_core::state::{X, Y};
use backseat_logs::log::{Column, Log, LogRow};
use backseat_logs::{DataError, Truth};

/// Longest step that is integrated, s: across a longer gap the position stands still.
const MAX_STEP_S: f64 = 10.0;

/// Which velocity is summed up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// DVL velocity over ground, turned by the attitude measured last.
    CompassDvl,
    /// Logged speed along the logged heading.
    HeadingSpeed,
}

/// A horizontal position at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Time, µs.
    pub time_us: u64,
    /// North, east, m.
    pub position_m: [f64; 2],
}

/// Sums up velocity from the log's first fix of the vehicle; later fixes are withheld. Of the declared effects those of
/// compass, speed and current count.
///
/// # Errors
/// If the log has no fix, or no heading and velocity after it.
pub fn run(log: &Log, method: Method, effects: &EffectSet) -> Result<Vec<Position>, DataError> {
    let fail = |message: &str| DataError::file(&log.path, format!("dead reckoning cannot start: {message}"));
    let (first, fix) = log
        .rows
        .iter()
        .enumerate()
        .find_map(|(index, row)| Some((index, row.gnss_m()?)))
        .ok_or_else(|| fail("no fix of the vehicle (gps_x_m, gps_y_m)"))?;
    let start_us = log.rows[first].time_us;
    let mut positions = vec![Position { time_us: start_us, position_m: fix }];
    let corrections = Corrections::new(effects);
    let mut attitude = Attitude::default();
    // Velocity over ground of the previous sample, north and east.
    let mut previous: Option<[f64; 2]> = None;
    for row in &log.rows {
        attitude.update(row);
        let Some(velocity) = attitude.velocity(row, method, &corrections) else { continue };
        if row.time_us <= start_us {
            previous = Some(velocity);
            continue;
        }
        let last = positions[positions.len() - 1];
        let step_s = (row.time_us - last.time_us) as f64 * 1e-6;
        let before = previous.unwrap_or(velocity);
        let mut position_m = last.position_m;
        if step_s <= MAX_STEP_S {
            for axis in 0..2 {
                position_m[axis] += 0.5 * (before[axis] + velocity[axis]) * step_s;
            }
        }
        positions.push(Position { time_us: row.time_us, position_m });
        previous = Some(velocity);
    }
    if positions.len() < 2 {
        return Err(fail(match method {
            Method::CompassDvl => "no heading_rad with dvl_u_mps, dvl_v_mps, dvl_w_mps after the first fix",
            Method::HeadingSpeed => "no heading_rad with a speed after the first fix",
        }));
    }
    Ok(positions)
}

/// The latest Euler angles; roll and pitch are zero until measured.
#[derive(Default)]
struct Attitude {
    roll_rad: f64,
    pitch_rad: f64,
    heading_rad: Option<f64>,
}

impl Attitude {
    fn update(&mut self, row: &LogRow) {
        self.roll_rad = row.get(Column::Roll).unwrap_or(self.roll_rad);
        self.pitch_rad = row.get(Column::Pitch).unwrap_or(self.pitch_rad);
        self.heading_rad = row.get(Column::Heading).or(self.heading_rad);
    }

    /// North and east velocity of a row that measures one.
    fn velocity(&self, row: &LogRow, method: Method, corrections: &Corrections) -> Option<[f64; 2]> {
        let (sin_psi, cos_psi) = corrections.heading_rad(self.heading_rad?, method).sin_cos();
        let [ahead, right] = match method {
            Method::HeadingSpeed => [row.get(Column::SpeedLog)?, 0.0],
            Method::CompassDvl => {
                // Ry(θ) Rx(φ): the horizontal part of the body velocity, along and across the heading.
                let [u, v, w] = row.dvl_mps()?;
                let (sin_phi, cos_phi) = self.roll_rad.sin_cos();
                let (sin_theta, cos_theta) = self.pitch_rad.sin_cos();
                [u * cos_theta + (v * sin_phi + w * cos_phi) * sin_theta, v * cos_phi - w * sin_phi]
            }
        };
        let [north, east] = match method {
            Method::HeadingSpeed => corrections.current_mps,
            // Bottom track has it.
            Method::CompassDvl => [0.0; 2],
        };
        let (ahead, right) = (ahead / corrections.scale, right / corrections.scale);
        Some([ahead * cos_psi - right * sin_psi + north, ahead * sin_psi + right * cos_psi + east])
    }
}

/// Declared effects on compass, speed and way.
struct Corrections {
    /// Constant, sine and cosine of the compass error, rad.
    compass_rad: [f64; 3],
    /// Measured over true speed.
    scale: f64,
    /// The DVL is turned to starboard by this, rad.
    turned_rad: f64,
    current_mps: [f64; 2],
}

impl Corrections {
    fn new(effects: &EffectSet) -> Self {
        let value = |effect, parameter| ParameterId::find(effect, parameter).map_or(0.0, |id| effects.get(id));
        Self {
            compass_rad: ["const_rad", "sin_rad", "cos_rad"].map(|name| value("heading_bias", name)),
            scale: 1.0 + value("dvl_scale", "ratio"),
            turned_rad: value("dvl_misalignment", "yaw_rad"),
            current_mps: ["north_mps", "east_mps"].map(|name| value("water_current", name)),
        }
    }

    /// The direction along which the measured velocity points.
    fn heading_rad(&self, measured_rad: f64, method: Method) -> f64 {
        let [constant, sine, cosine] = self.compass_rad;
        // The error depends on the true heading: small, so that a few steps find it.
        let mut heading_rad = measured_rad;
        for _ in 0..4 {
            let (sin, cos) = heading_rad.sin_cos();
            heading_rad = measured_rad - (constant + sine * sin + cosine * cos);
        }
        heading_rad + if method == Method::CompassDvl { self.turned_rad } else { 0.0 }
    }
}

/// Horizontal errors (time µs, m) of positions against the truth, where it covers their time.
#[must_use]
pub fn errors_against_truth(positions: &[Position], truth: &Truth) -> Vec<(u64, f64)> {
    let error =
        |p: &Position| Some((p.time_us, truth.horizontal_error_m(p.time_us, p.position_m[X], p.position_m[Y])?));
    positions.iter().filter_map(error).collect()
}

/// Horizontal errors (time µs, m) of positions, interpolated linearly, against the log's fixes of the
/// vehicle after the first position.
#[must_use]
pub fn errors_against_fixes(positions: &[Position], log: &Log) -> Vec<(u64, f64)> {
    let mut errors = Vec::new();
    for row in &log.rows {
        let Some(fix) = row.gnss_m() else { continue };
        let after = positions.partition_point(|position| position.time_us < row.time_us);
        let (Some(b), Some(a)) = (positions.get(after), after.checked_sub(1).map(|before| &positions[before])) else {
            continue;
        };
        let share = (row.time_us - a.time_us) as f64 / (b.time_us - a.time_us) as f64;
        let at = |axis: usize| a.position_m[axis] + share * (b.position_m[axis] - a.position_m[axis]);
        errors.push((row.time_us, (at(0) - fix[0]).hypot(at(1) - fix[1])));
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// 100 s to the east at 1 m/s by DVL and 1.1 m/s by the log, from a fix at (5, 0).
    fn eastward() -> Log {
        let mut rows = Vec::new();
        for second in 0..=100_u64 {
            let mut row = LogRow::new(second * 1_000_000);
            row.set(Column::Heading, FRAC_PI_2).set_all(Column::DvlU, &[1.0, 0.0, 0.0]).set(Column::SpeedLog, 1.1);
            if second % 50 == 0 {
                row.set_all(Column::GpsX, &[5.0, second as f64]);
            }
            rows.push(row);
        }
        Log { rows, ..Log::default() }
    }

    #[test]
    fn val_straight_line() {
        let log = eastward();
        let positions = run(&log, Method::CompassDvl, &EffectSet::NONE).unwrap();
        let end = positions.last().unwrap().position_m;
        assert!((end[0] - 5.0).abs() < 1e-9 && (end[1] - 100.0).abs() < 1e-9, "{end:?}"); // rounding of 100 sums
        let positions = run(&log, Method::HeadingSpeed, &EffectSet::NONE).unwrap();
        let errors = errors_against_fixes(&positions, &log);
        assert_eq!(errors.len(), 2);
        assert!((errors[0].1 - 5.0).abs() < 1e-9 && (errors[1].1 - 10.0).abs() < 1e-9, "{errors:?}");
    }

    #[test]
    fn val_declared_effects_bring_the_vehicle_to_its_fixes() {
        let mut log = eastward();
        // The compass reads 0.2 rad too much at east, the speed log 10 % too much; a current of 0.1 m/s to the south.
        for row in &mut log.rows {
            let second = row.time_us as f64 * 1e-6;
            row.set(Column::Heading, FRAC_PI_2 + 0.2);
            if row.gnss_m().is_some() {
                row.set_all(Column::GpsX, &[5.0 - 0.1 * second, second]);
            }
        }
        let mut effects = EffectSet::NONE;
        for (effect, parameter, value) in [
            ("heading_bias", "const_rad", 0.05),
            ("heading_bias", "sin_rad", 0.15),
            ("dvl_scale", "ratio", 0.1),
            ("water_current", "north_mps", -0.1),
        ] {
            effects.set(ParameterId::find(effect, parameter).unwrap(), value);
        }
        let errors = errors_against_fixes(&run(&log, Method::HeadingSpeed, &effects).unwrap(), &log);
        assert!(errors.iter().all(|(_, error)| *error < 1e-6), "{errors:?}");
        let plain = errors_against_fixes(&run(&log, Method::HeadingSpeed, &EffectSet::NONE).unwrap(), &log);
        // 1.1 (-sin 0.2, cos 0.2) less (-0.1, 1) m/s over 100 s
        assert!((plain[1].1 - 14.19).abs() < 0.01, "{plain:?}");
    }

    #[test]
    fn val_pitched_vehicle_moves_less_far() {
        let mut log = eastward();
        let pitch = 0.3_f64;
        for row in &mut log.rows {
            row.set(Column::Pitch, pitch);
        }
        let end = run(&log, Method::CompassDvl, &EffectSet::NONE).unwrap().last().unwrap().position_m;
        assert!((end[1] - 100.0 * pitch.cos()).abs() < 1e-9); // rounding of 100 sums
    }

    #[test]
    fn needs_a_fix_and_a_velocity() {
        let mut log = eastward();
        for row in &mut log.rows {
            row.set(Column::SpeedLog, f64::NAN);
        }
        assert!(run(&log, Method::HeadingSpeed, &EffectSet::NONE).unwrap_err().to_string().contains("speed"));
        assert!(run(&Log::default(), Method::CompassDvl, &EffectSet::NONE).unwrap_err().to_string().contains("no fix"));
    }
}
