//! How well the declared vehicle and its water are known.

/// Section `[prior]` of the vehicle file: one sigma of what the declaration leaves open. Zero means known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Priors {
    /// Relative one sigma of m11, m22, m33.
    pub mass: [f64; 3],
    /// Relative one sigma of d11 and d66.
    pub drag: [f64; 2],
    /// Relative one sigma of beta1, beta3, beta5.
    pub actuators: [f64; 3],
    /// Walk of the parameters, 1/√s.
    pub walk_per_sqrt_s: f64,
    /// Current per axis, m/s.
    pub current_mps: f64,
    /// Its walk, m/s/√s.
    pub current_walk_mps_per_sqrt_s: f64,
    /// Constant part of the compass error, rad.
    pub heading_rad: f64,
    /// Sine and cosine part, rad.
    pub hard_iron_rad: f64,
    /// Trim of the rudders and of the elevators, rad.
    pub fin_trim_rad: f64,
    /// Displaced mass, kg.
    pub buoyancy_kg: f64,
    /// Pitch trim (centre of gravity ahead or astern), rad.
    pub pitch_trim_rad: f64,
    /// Servo lag, s.
    pub fin_lag_s: f64,
}

impl Priors {
    /// Parameters 10 %, a current of some tenths of a metre per second, a compass of 2 degrees after calibration, fins
    /// set by eye, ballast by scale. 2 mm of the reference vehicle's 15 mm lever are 0.13 rad of pitch trim.
    pub const DEFAULT: Self = Self {
        mass: [0.1; 3],
        drag: [0.1; 2],
        actuators: [0.1; 3],
        walk_per_sqrt_s: 3.0e-5,
        current_mps: 0.3,
        current_walk_mps_per_sqrt_s: 5.0e-5,
        heading_rad: 0.035,
        hard_iron_rad: 0.0175,
        fin_trim_rad: 0.0175,
        buoyancy_kg: 0.1,
        pitch_trim_rad: 0.133,
        fin_lag_s: 0.15,
    };

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
