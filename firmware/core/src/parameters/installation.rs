//! Where the sensors sit in the vehicle, how they are turned, and how late their data arrive.

use core::f64::consts::PI;

crate::declared! {
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
    const DEFAULT;
    /// Rows of the table of parameters.
    const ROWS {
        [vector[0, 3 of 3] "installation.dvl_arm_m", "r_d", "m", [-20.0, 20.0]] "DVL from the centre of gravity, body frame." dvl_arm_m: [f64; 3] = [0.0; 3],
        [vector[0, 3 of 3] "installation.dvl_turn_rad", "", "rad", [-PI, PI]] "Roll, pitch, yaw of the DVL's axes in the body." dvl_turn_rad: [f64; 3] = [0.0; 3],
        [live real "installation.dvl_delay_s", "", "s", [0.0, 2.0]] "Time from the validity of a DVL velocity to the arrival of its last byte." dvl_delay_s: f64 = 0.0,
        [vector[0, 3 of 3] "installation.ahrs_turn_rad", "", "rad", [-PI, PI]] "Roll, pitch, yaw of the AHRS' axes in the body." ahrs_turn_rad: [f64; 3] = [0.0; 3],
        [live real "installation.ahrs_delay_s", "", "s", [0.0, 2.0]] "Time from the validity of attitude and rates to the arrival of their last byte." ahrs_delay_s: f64 = 0.0,
        [vector[0, 3 of 3] "installation.depth_arm_m", "r_z", "m", [-20.0, 20.0]] "Pressure sensor from the centre of gravity, body frame." depth_arm_m: [f64; 3] = [0.0; 3],
        [live real "installation.depth_delay_s", "", "s", [0.0, 2.0]] "Time from the validity of a depth to the arrival of its last byte." depth_delay_s: f64 = 0.0,
        [vector[0, 3 of 3] "installation.gnss_arm_m", "r_g", "m", [-20.0, 20.0]] "GNSS antenna from the centre of gravity, body frame." gnss_arm_m: [f64; 3] = [0.0; 3],
        [live real "installation.gnss_delay_s", "", "s", [0.0, 2.0]] "Time from the validity of a fix to the arrival of its last byte." gnss_delay_s: f64 = 0.3,
        [vector[0, 3 of 3] "installation.transducer_arm_m", "r_t", "m", [-20.0, 20.0]] "Acoustic transducer from the centre of gravity, body frame." transducer_arm_m: [f64; 3] = [0.0; 3],
        [live real "installation.transducer_delay_s", "", "s", [-1.0, 1.0]] "Calibrated delay of modem and hardware, subtracted from every time of flight." transducer_delay_s: f64 = 0.0,
        // From fresh water at 0 degrees (1403) and the Baltic to hot brine, with room for a modem's own scale.
        [live real "installation.sound_speed_mps", "c", "m/s", [1300.0, 1700.0]] "Sound speed that turns times of flight into ranges." sound_speed_mps: f64 = 1500.0,
        [real "installation.ship_transducer_depth_m", "z_s", "m", [0.0, 100.0]] "Depth of the ship's transducer; on the vehicle the ship's packets say it." ship_transducer_depth_m: f64 = 0.0,

    }
}

impl Default for Installation {
    fn default() -> Self {
        Self::DEFAULT
    }
}
