//! Process noise of the vehicle and noise of its sensors.

crate::declared! {
    /// Square roots of the acceleration power spectral densities of the vehicle. Zero would make the covariance singular
    /// in time; 10 m/s^2 within a second leaves nothing to the model.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ProcessNoise;
    /// Dynamic model: what the model leaves unexplained of the reference vehicle.
    const DYNAMIC;
    /// Rows of the table of parameters.
    const ROWS {
        [vector[0, 3 of 3] "noise.linear_mps2_per_sqrt_hz", "sigma_u, sigma_v, sigma_w", "m/s^2/sqrt(Hz)", [1.0e-6, 10.0]] "Acceleration in surge, sway, heave that the dynamic model does not explain." linear_mps2_per_sqrt_hz: [f64; 3] = [3.0e-3, 2.0e-3, 2.0e-3],
        [vector[0, 3 of 3] "noise.angular_radps2_per_sqrt_hz", "sigma_p, sigma_q, sigma_r", "rad/s^2/sqrt(Hz)", [1.0e-6, 10.0]] "Acceleration in roll, pitch, yaw that the dynamic model does not explain." angular_radps2_per_sqrt_hz: [f64; 3] = [3.0e-3, 1.0e-3, 1.0e-3],

    }
}

impl ProcessNoise {
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

crate::declared! {
    /// One-sigma white noise of each sensor. The lower limits lie well below the resolution of any such sensor: a filter
    /// that trusts one without bound is singular.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SensorNoise;
    /// Of the reference vehicle.
    const DEFAULT;
    /// Rows of the table of parameters.
    const ROWS {
        [real "sensors.depth_m", "sigma_z", "m", [1.0e-4, 10.0]] "Noise of depth." depth_m: f64 = 0.06,
        [real "sensors.attitude_rad", "sigma_phi", "rad", [1.0e-5, 0.5]] "Noise of roll, pitch, heading." attitude_rad: f64 = 0.017_453_292_519_943_295,
        [real "sensors.heading_rad", "sigma_psi", "rad", [0.0, 0.5]] "Noise of heading, where it differs from that of roll and pitch; 0: it does not." heading_rad: f64 = 0.0,
        [real "sensors.rates_radps", "sigma_omega", "rad/s", [1.0e-6, 0.5]] "Noise of p, q, r." rates_radps: f64 = 0.008_726_646_259_971_648,
        [real "sensors.dvl_mps", "sigma_d", "m/s", [1.0e-4, 1.0]] "Noise of the DVL's velocity per axis." dvl_mps: f64 = 0.01,
        [real "sensors.range_m", "sigma_rho", "m", [1.0e-3, 100.0]] "Noise of the acoustic range." range_m: f64 = 1.0,
        [real "sensors.range_rate_mps", "sigma_rho_dot", "m/s", [1.0e-3, 10.0]] "Noise of the acoustic range rate." range_rate_mps: f64 = 0.1,
        [real "sensors.gnss_m", "sigma_g", "m", [1.0e-3, 100.0]] "Noise of a fix of the surfaced vehicle per axis." gnss_m: f64 = 1.5,
        [real "sensors.ship_gnss_m", "sigma_s", "m", [1.0e-3, 100.0]] "Noise of a fix of the ship per axis." ship_gnss_m: f64 = 0.5,

    }
}

impl SensorNoise {
    /// Of roll, pitch and heading, rad.
    #[must_use]
    pub fn angles_rad(&self) -> [f64; 3] {
        let heading_rad = if self.heading_rad > 0.0 { self.heading_rad } else { self.attitude_rad };
        [self.attitude_rad, self.attitude_rad, heading_rad]
    }
}
