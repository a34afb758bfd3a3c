//! Fin and motor bytes of `$OMP` and what they mean on one vehicle.
//!
//! Sign, gain and centre are not public and differ between vehicles (a non-stock tail needs its own): a calibration
//! table, measured on the bench. One count is about a third of a degree, so the angle commanded is not the angle asked
//! for: use [`ServoCalibration::fins_rad`] of the bytes sent.

use crate::{Error, hex};

/// Bytes of `$OMP`, in the order of the wire; 0x80 is centred or stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ServoBytes {
    /// Top, bottom, port, starboard.
    pub fins: [u8; 4],
    /// Motor.
    pub motor: u8,
}

impl ServoBytes {
    /// Everything centred, motor stopped.
    pub const NEUTRAL: Self = Self { fins: [0x80; 4], motor: 0x80 };

    pub(crate) fn parse(digits: &[u8]) -> Result<Self, Error> {
        let mut bytes = [0; 5];
        hex::decode_exact(digits, &mut bytes)?;
        let [top, bottom, port, starboard, motor] = bytes;
        Ok(Self { fins: [top, bottom, port, starboard], motor })
    }
}

/// A linear servo: `count = null + counts_per_unit * value`, rounded, and kept within 1 to 254 (some servos ignore the
/// extremes).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearServo {
    /// Signed gain, counts per rad (fins) or per rad/s (motor).
    pub counts_per_unit: f64,
    /// Count of value 0.
    pub null: u8,
    /// Largest magnitude commanded, rad or rad/s.
    pub limit: f64,
}

impl LinearServo {
    /// The count that is sent for `value`; not finite is `null`.
    pub fn to_byte(&self, value: f64) -> u8 {
        if !value.is_finite() {
            return self.null.clamp(1, 254);
        }
        // Whole counts within the limit (the margin is for rounding); casts saturate and take NaN to 0, so that no
        // calibration leaves the range.
        let most = libm::floor(libm::fabs(self.counts_per_unit * self.limit) + 1.0e-9) as i32;
        let counts = libm::round(self.counts_per_unit * value) as i32;
        // Not `clamp`, which checks its bounds with a panic.
        let counts = counts.max(-most).min(most);
        i32::from(self.null).saturating_add(counts).clamp(1, 254) as u8
    }

    /// The value that a count commands.
    pub fn to_value(&self, byte: u8) -> f64 {
        (f64::from(byte) - f64::from(self.null)) / self.counts_per_unit
    }
}

/// What fin and motor bytes mean. Fin angles are those of the project: positive moves the leading edge towards -z of
/// the fin frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoCalibration {
    /// Top, bottom, port, starboard, rad.
    pub fins: [LinearServo; 4],
    /// Propeller, rad/s.
    pub motor: LinearServo,
}

impl ServoCalibration {
    /// A guess to start a bench calibration from: ±45° over the byte, fins to ±30°, propeller to ±200 rad/s, all signs
    /// positive.
    pub const NOMINAL: Self = Self {
        fins: [LinearServo {
            counts_per_unit: 127.0 / core::f64::consts::FRAC_PI_4,
            null: 0x80,
            limit: core::f64::consts::FRAC_PI_6,
        }; 4],
        motor: LinearServo { counts_per_unit: 126.0 / 200.0, null: 0x80, limit: 200.0 },
    };

    /// The bytes to send for fin angles [top, bottom, port, starboard], rad, and propeller, rad/s.
    pub fn bytes(&self, fins_rad: [f64; 4], propeller_radps: f64) -> ServoBytes {
        let mut fins = [0; 4];
        for ((byte, servo), angle) in fins.iter_mut().zip(&self.fins).zip(fins_rad) {
            *byte = servo.to_byte(angle);
        }
        ServoBytes { fins, motor: self.motor.to_byte(propeller_radps) }
    }

    /// Fin angles that bytes command, rad.
    pub fn fins_rad(&self, bytes: &ServoBytes) -> [f64; 4] {
        let mut angles = [0.0; 4];
        for ((angle, servo), byte) in angles.iter_mut().zip(&self.fins).zip(bytes.fins) {
            *angle = servo.to_value(byte);
        }
        angles
    }

    /// Propeller speed that bytes command, rad/s.
    pub fn propeller_radps(&self, bytes: &ServoBytes) -> f64 {
        self.motor.to_value(bytes.motor)
    }
}
