//! Process noise of the vehicle and noise of its sensors.

/// Square roots of the acceleration power spectral densities of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcessNoise {
    /// u, v, w: m/s²/√Hz.
    pub linear_mps2_per_sqrt_hz: [f64; 3],
    /// p, q, r: rad/s²/√Hz.
    pub angular_radps2_per_sqrt_hz: [f64; 3],
}

impl ProcessNoise {
    /// Dynamic model: what the model leaves unexplained of the reference vehicle.
    pub const DYNAMIC: Self = Self {
        linear_mps2_per_sqrt_hz: [3.0e-3, 2.0e-3, 2.0e-3],
        angular_radps2_per_sqrt_hz: [3.0e-3, 1.0e-3, 1.0e-3],
    };
    /// Kinematic model with a DVL ("loose"): covers the vehicle's manoeuvres.
    pub const KINEMATIC: Self = Self {
        linear_mps2_per_sqrt_hz: [1.0e-2, 2.0e-2, 1.0e-2],
        angular_radps2_per_sqrt_hz: [2.0e-2, 2.0e-2, 5.0e-2],
    };

    /// Power spectral densities of the accelerations along u, v, w, p, q, r.
    pub(crate) fn psd(&self) -> [f64; 6] {
        let ([u, v, w], [p, q, r]) = (self.linear_mps2_per_sqrt_hz, self.angular_radps2_per_sqrt_hz);
        [u, v, w, p, q, r].map(|root| root * root)
    }
}

/// One-sigma white noise of each sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorNoise {
    /// Depth, m.
    pub depth_m: f64,
    /// Roll, pitch, and heading if it has none of its own, rad.
    pub attitude_rad: f64,
    /// Heading, rad; 0: that of roll and pitch.
    pub heading_rad: f64,
    /// p, q, r, rad/s.
    pub rates_radps: f64,
    /// DVL velocity per axis, m/s.
    pub dvl_mps: f64,
    /// Acoustic range, m.
    pub range_m: f64,
    /// Acoustic range rate, m/s.
    pub range_rate_mps: f64,
    /// GNSS of the surfaced vehicle per axis, m.
    pub gnss_m: f64,
    /// GNSS of the ship per axis, m.
    pub ship_gnss_m: f64,
}

impl SensorNoise {
    /// Of roll, pitch and heading, rad.
    #[must_use]
    pub fn angles_rad(&self) -> [f64; 3] {
        let heading_rad = if self.heading_rad > 0.0 { self.heading_rad } else { self.attitude_rad };
        [self.attitude_rad, self.attitude_rad, heading_rad]
    }
}
