//! Limits of safety: what ends a mission though navigation is valid.

/// Section `[safety]` of the vehicle file. The app's ladder (`backseat-app`, `safety`) says what follows when one is
/// broken. A number at the end of its range switches its limit off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyLimits {
    /// Deepest depth, measured or estimated, m.
    pub depth_max_m: f64,
    /// Deepest distance below the depth of the leg, unless the vehicle rises, m.
    pub depth_below_leg_m: f64,
    /// Least altitude over the bottom under water, m.
    pub altitude_min_m: f64,
    /// Radius of the fence around the origin of the local frame, m.
    pub fence_radius_m: f64,
    /// Longest way to the first waypoint, m.
    pub first_leg_max_m: f64,
    /// Longest mission, s.
    pub mission_time_max_s: f64,
    /// A leg may take so many times its length over its speed, and a minute.
    pub leg_time_factor: f64,
    /// Least charge of the battery, %.
    pub battery_min_percent: f64,
    /// Longest time of degraded navigation, s.
    pub degraded_time_max_s: f64,
    /// Longest time without an acoustic range, s.
    pub contact_time_max_s: f64,
    /// Longest time without the precise clock that there was before, s.
    pub clock_time_max_s: f64,
    /// Steepest pitch, rad.
    pub pitch_max_rad: f64,
    /// Fastest speed through the water, m/s.
    pub speed_max_mps: f64,
    /// A vehicle that is to dive has left the surface within this time, s.
    pub dive_time_max_s: f64,
    /// Largest jump of the pressure sensor against the filter, m.
    pub depth_jump_m: f64,
    /// Largest drift of the pressure sensor against pitch and speed in ten minutes, m; half of it in two.
    pub depth_drift_m: f64,
}

impl SafetyLimits {
    /// A survey vehicle of this class in coastal waters. Loss of acoustic contact ends no mission.
    pub const DEFAULT: Self = Self {
        depth_max_m: 100.0,
        depth_below_leg_m: 5.0,
        altitude_min_m: 1.0,
        fence_radius_m: 10_000.0,
        first_leg_max_m: 2_000.0,
        mission_time_max_s: 43_200.0,
        leg_time_factor: 3.0,
        battery_min_percent: 10.0,
        degraded_time_max_s: 1_800.0,
        contact_time_max_s: 1.0e7,
        clock_time_max_s: 600.0,
        pitch_max_rad: 1.05,
        speed_max_mps: 4.0,
        dive_time_max_s: 120.0,
        depth_jump_m: 1.5,
        depth_drift_m: 3.0,
    };
}

impl Default for SafetyLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}
