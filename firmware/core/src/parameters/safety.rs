//! Limits of safety: what ends a mission though navigation is valid.

crate::with_defaults! {
    /// Section `[safety]` of the vehicle file. The app's ladder (`backseat-app`, `safety`) says what follows when one
    /// is broken. A number at the end of its range switches its limit off.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SafetyLimits;
    /// A survey vehicle of this class in coastal waters. Loss of acoustic contact ends no mission.
    const DEFAULT {
        /// Deepest depth, measured or estimated, m.
        depth_max_m: f64 = 100.0,
        /// Deepest distance below the depth of the leg, unless the vehicle rises, m.
        depth_below_leg_m: f64 = 5.0,
        /// Least altitude over the bottom under water, m.
        altitude_min_m: f64 = 1.0,
        /// Radius of the fence around the origin of the local frame, m.
        fence_radius_m: f64 = 10_000.0,
        /// Longest way to the first waypoint, m.
        first_leg_max_m: f64 = 2_000.0,
        /// Longest mission, s.
        mission_time_max_s: f64 = 43_200.0,
        /// A leg may take so many times its length over its speed, and a minute.
        leg_time_factor: f64 = 3.0,
        /// Least charge of the battery, %.
        battery_min_percent: f64 = 10.0,
        /// Longest time of degraded navigation, s.
        degraded_time_max_s: f64 = 1_800.0,
        /// Longest time without an acoustic range, s.
        contact_time_max_s: f64 = 1.0e7,
        /// Longest time without the precise clock that there was before, s.
        clock_time_max_s: f64 = 600.0,
        /// Steepest pitch, rad.
        pitch_max_rad: f64 = 1.05,
        /// Fastest speed through the water, m/s.
        speed_max_mps: f64 = 4.0,
        /// A vehicle that is to dive has left the surface within this time, s.
        dive_time_max_s: f64 = 120.0,
        /// Largest jump of the pressure sensor against the filter, m.
        depth_jump_m: f64 = 1.5,
        /// Largest drift of the pressure sensor against pitch and speed in ten minutes, m; half of it in two.
        depth_drift_m: f64 = 3.0,
    }
}

impl Default for SafetyLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}
