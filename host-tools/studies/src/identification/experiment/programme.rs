//! Open-loop inputs.

use backseat_core::dynamics::ActuatorInput;
use core::f64::consts::TAU;

/// Periods (s) of propeller (two), rudder (two), elevator (two) and roll.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Programme([f64; 7]);

impl Programme {
    /// Inputs of the identification.
    pub const IDENTIFICATION: Self = Self([97.0, 41.0, 37.0, 13.0, 29.0, 11.0, 5.3]);
    /// Inputs of the validation: other frequencies.
    pub const VALIDATION: Self = Self([71.0, 31.0, 53.0, 17.0, 43.0, 9.0, 6.7]);

    /// Commands at a time, s.
    #[must_use]
    pub fn input(&self, time_s: f64) -> ActuatorInput {
        let [propeller, slow, rudder, fast_rudder, elevator, fast_elevator, roll] =
            self.0.map(|period| libm::sin(TAU * time_s / period));
        let yaw = 0.14 * rudder + 0.08 * fast_rudder;
        let pitch = 0.10 * elevator + 0.06 * fast_elevator;
        let twist = 0.06 * roll;
        ActuatorInput {
            propeller_radps: 110.0 + 40.0 * propeller + 15.0 * slow,
            fins_rad: [twist + yaw, twist - yaw, twist - pitch, twist + pitch],
        }
    }
}
