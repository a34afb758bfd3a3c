//! Where the sensors sit in the vehicle, how they are turned, and how late their data arrive.

crate::with_defaults! {
    /// Section `[installation]` of the vehicle file.
    ///
    /// A lever arm is the position of the sensor relative to the centre of gravity, body frame, m. A turn is roll,
    /// pitch and yaw (ZYX) of the sensor's axes relative to the body axes, rad: `v_body = R(turn) v_sensor`. A delay is
    /// the time from the moment that a measurement is valid for to the arrival of its last byte, s.
    ///
    /// Attitude and body rates do not depend on where the AHRS sits: it has no lever arm. Depth, position and range
    /// have no axes: these sensors have no turn.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Installation;
    /// Every sensor at the centre of gravity, in the body axes and without delay, but for the 0.3 s that a GNSS
    /// receiver takes to compute and send a fix; sound speed of sea water at about 10 °C.
    const DEFAULT {
        /// DVL: lever arm, m.
        dvl_arm_m: [f64; 3] = [0.0; 3],
        /// DVL: turn of its axes, rad. The direction of beam 3 is not part of it: it belongs to the decoding.
        dvl_turn_rad: [f64; 3] = [0.0; 3],
        /// DVL: delay, s.
        dvl_delay_s: f64 = 0.0,
        /// AHRS: turn of its axes, rad.
        ahrs_turn_rad: [f64; 3] = [0.0; 3],
        /// AHRS: delay of attitude and body rates, s.
        ahrs_delay_s: f64 = 0.0,
        /// Pressure sensor: lever arm, m.
        depth_arm_m: [f64; 3] = [0.0; 3],
        /// Pressure sensor: delay, s.
        depth_delay_s: f64 = 0.0,
        /// GNSS antenna: lever arm, m.
        gnss_arm_m: [f64; 3] = [0.0; 3],
        /// GNSS: delay of a fix, s.
        gnss_delay_s: f64 = 0.3,
        /// Acoustic transducer: lever arm, m.
        transducer_arm_m: [f64; 3] = [0.0; 3],
        /// Acoustic transducer: delay of modem and hardware in every time of flight (calibrated), s.
        transducer_delay_s: f64 = 0.0,
        /// Sound speed c that turns times of flight into ranges, m/s.
        sound_speed_mps: f64 = 1500.0,
        /// Depth of the ship's transducer, m; on the vehicle the ship's packets give it.
        ship_transducer_depth_m: f64 = 0.0,
    }
}

impl Default for Installation {
    fn default() -> Self {
        Self::DEFAULT
    }
}
