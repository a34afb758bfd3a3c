//! Limits of safety: what ends a mission though navigation is valid.

crate::declared! {
    /// Section `[safety]` of the vehicle file. The app's ladder (`backseat-app`, `safety`) says what follows when one
    /// is broken. A number at the end of its range switches its limit off.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SafetyLimits;
    /// A survey vehicle of this class in coastal waters. Loss of acoustic contact ends no mission.
    const DEFAULT;
    /// Rows of the table of parameters.
    const ROWS {
        [at_most real "safety.depth_max_m", "", "m", [2.0, 11000.0]] "A vehicle deeper than this, or so fast that it will be in 2 s, stops and rises; a mission to less than 1 m above it is refused." depth_max_m: f64 = 100.0,
        [at_most real "safety.depth_below_leg_m", "", "m", [0.5, 11000.0]] "A vehicle deeper than its leg by more than this that has not risen for 10 s stops and rises." depth_below_leg_m: f64 = 5.0,
        [at_least real "safety.altitude_min_m", "", "m", [0.0, 1000.0]] "A vehicle under water that is closer to the bottom, by DVL or altimeter, or will be in 2 s, stops and rises; 0: not watched." altitude_min_m: f64 = 1.0,
        [at_most real "safety.fence_radius_m", "", "m", [10.0, 200000.0]] "A vehicle further from the origin of the local frame stops and rises; a mission that leads there is refused." fence_radius_m: f64 = 10_000.0,
        [at_most real "safety.first_leg_max_m", "", "m", [1.0, 200000.0]] "A mission whose first waypoint is further away than this is not begun." first_leg_max_m: f64 = 2_000.0,
        [at_most real "safety.mission_time_max_s", "", "s", [10.0, 1.0e7]] "A mission that takes longer returns to where it began; one that is longer by its legs and speeds is refused." mission_time_max_s: f64 = 43_200.0,
        [at_most real "safety.leg_time_factor", "", "1", [1.0, 1.0e6]] "A leg that takes longer than this times its length over its speed, and a minute, ends the mission." leg_time_factor: f64 = 3.0,
        [at_least real "safety.battery_min_percent", "", "%", [0.0, 100.0]] "With less charge by the frontseat a mission returns to where it began, and none is begun." battery_min_percent: f64 = 10.0,
        [at_most real "safety.degraded_time_max_s", "", "s", [1.0, 1.0e7]] "A mission whose navigation is degraded for longer without a break ends." degraded_time_max_s: f64 = 1_800.0,
        [at_most real "safety.contact_time_max_s", "", "s", [10.0, 1.0e7]] "A mission without an acoustic range for longer ends at the surface, where the vehicle waits; by default never." contact_time_max_s: f64 = 1.0e7,
        [at_most real "safety.clock_time_max_s", "", "s", [1.0, 1.0e7]] "A mission that uses ranges and whose pulse edges stay away for longer is handed back to the frontseat; one that began without them is not." clock_time_max_s: f64 = 600.0,
        [at_most real "safety.pitch_max_rad", "", "rad", [0.1, 1.6]] "A vehicle that pitches more for 3 s stops and rises." pitch_max_rad: f64 = 1.05,
        [at_most real "safety.speed_max_mps", "", "m/s", [0.5, 30.0]] "A vehicle that is faster through the water for 5 s stops and rises." speed_max_mps: f64 = 4.0,
        [at_most real "safety.dive_time_max_s", "", "s", [5.0, 1.0e7]] "A vehicle that is to dive and has been shallower than 0.25 m for longer stops: no water, or no dive." dive_time_max_s: f64 = 120.0,
        [at_most real "safety.depth_jump_m", "", "m", [0.1, 11000.0]] "A pressure sensor that has come back so far off the filter's depth ends the mission." depth_jump_m: f64 = 1.5,
        [at_most real "safety.depth_drift_m", "", "m", [0.5, 11000.0]] "A pressure sensor that drifts so far off what pitch and speed make of depth, or half as far in two minutes, ends the mission; so does a change of weight that looks the same." depth_drift_m: f64 = 3.0,

    }
}

impl Default for SafetyLimits {
    fn default() -> Self {
        Self::DEFAULT
    }
}
