//! How well the declared vehicle and its water are known.

crate::with_defaults! {
    /// Section `[prior]` of the vehicle file: one sigma of what the declaration leaves open. Zero means known.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Priors;
    /// Parameters 10 %, a current of some tenths of a metre per second, a compass of 2 degrees after calibration, fins
    /// set by eye, ballast by scale. 2 mm of the reference vehicle's 15 mm lever are 0.13 rad of pitch trim.
    const DEFAULT {
        /// Relative one sigma of m11, m22, m33.
        mass: [f64; 3] = [0.1; 3],
        /// Relative one sigma of d11 and d66.
        drag: [f64; 2] = [0.1; 2],
        /// Relative one sigma of beta1, beta3, beta5.
        actuators: [f64; 3] = [0.1; 3],
        /// Walk of the parameters, 1/√s.
        walk_per_sqrt_s: f64 = 3.0e-5,
        /// Current per axis, m/s.
        current_mps: f64 = 0.3,
        /// Its walk, m/s/√s.
        current_walk_mps_per_sqrt_s: f64 = 5.0e-5,
        /// Constant part of the compass error, rad.
        heading_rad: f64 = 0.035,
        /// Sine and cosine part, rad.
        hard_iron_rad: f64 = 0.0175,
        /// Trim of the rudders and of the elevators, rad.
        fin_trim_rad: f64 = 0.0175,
        /// Displaced mass, kg.
        buoyancy_kg: f64 = 0.1,
        /// Pitch trim (centre of gravity ahead or astern), rad.
        pitch_trim_rad: f64 = 0.133,
        /// Servo lag, s.
        fin_lag_s: f64 = 0.15,
    }
}

impl Priors {
    /// Everything known.
    pub(crate) const KNOWN: Self = Self {
        mass: [0.0; 3],
        drag: [0.0; 2],
        actuators: [0.0; 3],
        walk_per_sqrt_s: 0.0,
        current_mps: 0.0,
        current_walk_mps_per_sqrt_s: 0.0,
        heading_rad: 0.0,
        hard_iron_rad: 0.0,
        fin_trim_rad: 0.0,
        buoyancy_kg: 0.0,
        pitch_trim_rad: 0.0,
        fin_lag_s: 0.0,
    };
}
