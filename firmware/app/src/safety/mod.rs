//! What ends a mission though navigation is valid: one ladder of limits, the worst first.
//!
//! [`LADDER`] is the whole of it: what breaks a limit ([`SafetyFacts`]), how long it has to be broken, what follows. The
//! numbers are the section `safety` of the parameters. What can be known before is refused before: [`check_mission`] at
//! upload and start, [`check_start`] at start. Nothing here enters the filter.

mod depth;
mod fence;
mod monitor;
mod progress;

pub use depth::{DepthCrossCheck, DepthStep, SurfaceDepth};
pub use fence::Fence;
pub use monitor::{Decision, Observed, SafetyMonitor, aborts};
pub use progress::{MissionProgress, seconds};

use crate::time::micros;
use backseat_core::control::HelmCommand;
use backseat_core::control::mission::{Mission, Waypoint};
use backseat_core::parameters::SafetyLimits;
use backseat_wire::hostlink::{ModeReason, Refusal};

/// A depth or altitude that the vehicle reaches within this time counts as reached, s.
const FORESIGHT_S: f64 = 2.0;
/// A mission stays above the greatest depth by this, m: what overshoot and noise need.
const DEPTH_MARGIN_M: f64 = 1.0;
/// A vehicle that is slower than this, up or down, neither rises nor sinks, m/s.
const RISING_MPS: f64 = 0.05;
/// Shallower is at the surface, m.
const SURFACED_M: f64 = 0.25;
/// A leg at least this deep is a dive, m.
const DIVE_M: f64 = 1.0;
/// Nothing is received by GNSS at this depth, m.
const FIX_DEPTH_M: f64 = 2.0;
/// At the surface a pressure sensor says at most this, m: weather is 0.1 m, the hull's draught as much.
const TARE_M: f64 = 0.3;
/// At the surface a fix comes within this time, s: a receiver starts within half a minute.
const SURFACE_FIX_S: f64 = 60.0;
/// The altimeter is not watched above this depth, m: a vehicle is launched in shallow water.
const ALTITUDE_FROM_M: f64 = 0.5;
/// What a leg may take beyond its share, s.
const LEG_SPARE_S: f64 = 60.0;

/// What follows when a limit is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Neutral fins, no propeller, `$OMSTOP`: the vehicle rises by its buoyancy, the frontseat's rules hold.
    StopAndRise,
    /// Neutral with every step, so that the frontseat does not go on: the vehicle rises and waits for its operator.
    Hold,
    /// Straight to where the mission began, at the surface; then stop.
    Return,
    /// Neutral once and no stop: the frontseat goes on with its own mission.
    HandBack,
}

/// The vehicle and its mission in this step, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyFacts {
    /// The deeper of pressure sensor and estimate, m.
    pub depth_m: f64,
    /// Protection level of depth, where an alert limit is declared; else 0, m.
    pub depth_level_m: f64,
    /// Of the pressure sensor, m.
    pub pressure_m: f64,
    /// Downwards, by the filter or by pressure, whichever is more, m/s.
    pub sink_mps: f64,
    /// `None` where no sensor shows the bottom, m.
    pub altitude_m: Option<f64>,
    pub pitch_rad: f64,
    /// Through the water, ahead, m/s.
    pub speed_mps: f64,
    /// North and east, m.
    pub position_m: [f64; 2],
    /// Outside the mission's polygon.
    pub outside_polygon: bool,
    /// By how much the pressure sensor has come back off the filter's depth, m.
    pub depth_jump_m: f64,
    /// By how much it has drifted off what pitch and speed make of depth, m.
    pub depth_drift_m: f64,
    /// The same of the last two minutes, m.
    pub depth_recent_m: f64,
    /// There is a fix of the antenna.
    pub has_fix: bool,
    /// Depth is checked at the surface: an alert limit in depth is declared, and fixes are used.
    pub asks_surface: bool,
    /// What the pressure sensor says at the surface, waves averaged; `None` while it is not known, m.
    pub surface_m: Option<f64>,
    pub leak: bool,
    /// The supply as the board measures it is at its end.
    pub supply_low: bool,
    /// Of the battery; `None` while the frontseat has not said.
    pub charge_percent: Option<f64>,
    /// Navigation is degraded.
    pub degraded: bool,
    /// Since the last acoustic range, or the start of the mission, s.
    pub contact_s: f64,
    /// There was a precise clock in this mission, and there is none now.
    pub clock_lost: bool,
    /// Depth of the leg, m.
    pub leg_depth_m: f64,
    /// Since the leg began, and how long it takes by length and speed, s.
    pub leg_s: f64,
    pub leg_expected_s: f64,
    /// Since the mission began, s.
    pub mission_s: f64,
    /// The way back is flown.
    pub returning: bool,
}

/// One limit.
struct Rung {
    reason: ModeReason,
    action: Action,
    /// How long it has to be broken without a break, s.
    lasts_s: fn(&SafetyLimits) -> f64,
    broken: fn(&SafetyFacts, &SafetyLimits) -> bool,
}

const RUNGS: usize = 22;

/// Of the largest drift of pressure, what may come in two minutes.
const RECENT_SHARE: f64 = 0.5;

/// The ladder: the first limit that is broken for long enough decides.
#[rustfmt::skip] // a limit a row
static LADDER: [Rung; RUNGS] = {
    use Action::{HandBack, Hold, Return, StopAndRise};
    use ModeReason as R;
    const fn rung(
        reason: ModeReason, action: Action, lasts_s: fn(&SafetyLimits) -> f64, broken: fn(&SafetyFacts, &SafetyLimits) -> bool,
    ) -> Rung {
        Rung { reason, action, lasts_s, broken }
    }
    [
        rung(R::Leak,            StopAndRise, |_| 0.0,  |f, _| f.leak),
        rung(R::SupplyLow,       StopAndRise, |_| 0.0,  |f, _| f.supply_low),
        rung(R::TooDeep,         StopAndRise, |_| 0.5,  |f, l| f.soon(f.depth_m + f.depth_level_m) > l.depth_max_m),
        rung(R::TooDeep,         StopAndRise, |_| 3.0,  |f, l| f.depth_m - f.leg_depth_m > l.depth_below_leg_m && f.sink_mps > RISING_MPS),
        rung(R::TooDeep,         StopAndRise, |_| 10.0, |f, l| f.depth_m - f.leg_depth_m > l.depth_below_leg_m && f.sink_mps > -RISING_MPS),
        rung(R::TooLow,          StopAndRise, |_| 1.0,  |f, l| f.depth_m > ALTITUDE_FROM_M && f.altitude_m.is_some_and(|m| m - f.soon(0.0) < l.altitude_min_m)),
        rung(R::DepthDoubtful,   StopAndRise, |_| 1.0,  |f, l| f.depth_jump_m > l.depth_jump_m),
        rung(R::DepthDoubtful,   StopAndRise, |_| 1.0,  |f, l| f.depth_drift_m.abs() > l.depth_drift_m),
        rung(R::DepthDoubtful,   StopAndRise, |_| 1.0,  |f, l| f.depth_recent_m.abs() > RECENT_SHARE * l.depth_drift_m),
        rung(R::DepthDoubtful,   StopAndRise, |_| 10.0, |f, _| f.has_fix && f.pressure_m > FIX_DEPTH_M),
        rung(R::DepthDoubtful,   StopAndRise, |_| SURFACE_FIX_S, |f, _| f.asks_surface && f.pressure_m < SURFACED_M && !f.has_fix),
        rung(R::DepthDoubtful,   StopAndRise, |_| 0.0,  |f, _| f.asks_surface && is_untared(f.surface_m)),
        rung(R::PitchExceeded,   StopAndRise, |_| 3.0,  |f, l| f.pitch_rad.abs() > l.pitch_max_rad),
        rung(R::SpeedExceeded,   StopAndRise, |_| 5.0,  |f, l| f.speed_mps.abs() > l.speed_max_mps),
        rung(R::NoWater,         StopAndRise, |l| l.dive_time_max_s, |f, _| f.leg_depth_m >= DIVE_M && f.pressure_m < SURFACED_M),
        rung(R::OutsideFence,    StopAndRise, |_| 3.0,  |f, l| f.outside_polygon || distance_m([0.0; 2], f.position_m) > l.fence_radius_m),
        rung(R::LegTooLong,      StopAndRise, |_| 0.0,  |f, l| f.leg_s > l.leg_time_factor * f.leg_expected_s + LEG_SPARE_S),
        rung(R::DegradedTooLong, StopAndRise, |l| l.degraded_time_max_s, |f, _| f.degraded),
        rung(R::BatteryLow,      Return,      |_| 10.0, |f, l| !f.returning && f.charge_percent.is_some_and(|p| p < l.battery_min_percent)),
        rung(R::MissionTooLong,  Return,      |_| 0.0,  |f, l| !f.returning && f.mission_s > l.mission_time_max_s),
        rung(R::ContactLost,     Hold,        |_| 0.0,  |f, l| f.contact_s > l.contact_time_max_s),
        rung(R::ClockLost,       HandBack,    |l| l.clock_time_max_s, |f, _| f.clock_lost),
    ]
};

/// The pressure sensor is further off at the surface than weather and draught make it.
fn is_untared(surface_m: Option<f64>) -> bool {
    surface_m.is_some_and(|depth_m| depth_m.abs() > TARE_M)
}

impl SafetyFacts {
    /// What something that grows with depth will be soon, m.
    fn soon(&self, now_m: f64) -> f64 {
        now_m + FORESIGHT_S * self.sink_mps.max(0.0)
    }
}

/// The ladder's memory: since when each limit has been broken.
#[derive(Clone, Copy, Debug)]
pub struct SafetyLadder {
    since_us: [Option<u64>; RUNGS],
}

impl SafetyLadder {
    pub const fn new() -> Self {
        Self { since_us: [None; RUNGS] }
    }

    /// The first limit that has been broken for long enough, and what follows.
    pub fn judge(&mut self, now_us: u64, facts: &SafetyFacts, limits: &SafetyLimits) -> Option<(ModeReason, Action)> {
        let mut verdict = None;
        for (rung, since_us) in LADDER.iter().zip(&mut self.since_us) {
            *since_us = (rung.broken)(facts, limits).then_some(since_us.unwrap_or(now_us));
            let lasted = since_us.is_some_and(|us| now_us.saturating_sub(us) >= micros((rung.lasts_s)(limits)));
            if lasted && verdict.is_none() {
                verdict = Some((rung.reason, rung.action));
            }
        }
        verdict
    }
}

/// Whether a mission keeps its fence and the limits by itself.
///
/// # Errors
/// The limit that it breaks.
pub fn check_mission(mission: &Mission, fence: &Fence, limits: &SafetyLimits) -> Result<(), ModeReason> {
    let (mut before, mut time_s) = (None::<&Waypoint>, 0.0);
    for waypoint in mission.waypoints() {
        if waypoint.depth_m > limits.depth_max_m - DEPTH_MARGIN_M {
            return Err(ModeReason::TooDeep);
        }
        let place_m = [waypoint.x_m, waypoint.y_m];
        let from_m = before.map_or(place_m, |before| [before.x_m, before.y_m]);
        if distance_m([0.0; 2], place_m) > limits.fence_radius_m || !fence.contains_leg(from_m, place_m) {
            return Err(ModeReason::OutsideFence);
        }
        time_s += before.map_or(0.0, |before| leg_time_s([before.x_m, before.y_m], waypoint));
        if time_s > limits.mission_time_max_s {
            return Err(ModeReason::MissionTooLong);
        }
        before = Some(waypoint);
    }
    Ok(())
}

/// Whether the host may steer so: as a leg would be flown.
///
/// # Errors
/// A number that no leg has, or the limit that it breaks.
pub fn check_helm(helm: &HelmCommand, limits: &SafetyLimits) -> Result<(), Refusal> {
    let is_leg = (0.0..=Mission::MAX_DEPTH_M).contains(&helm.depth_m)
        && (Mission::MIN_SPEED_MPS..=Mission::MAX_SPEED_MPS).contains(&helm.speed_mps);
    if !is_leg || !helm.heading_rad.is_finite() {
        return Err(Refusal::OutOfRange);
    }
    if helm.depth_m > limits.depth_max_m - DEPTH_MARGIN_M {
        return Err(Refusal::Unsafe(ModeReason::TooDeep));
    }
    Ok(())
}

/// Whether a mission may begin: with these facts of the vehicle, from this place if it is known.
///
/// # Errors
/// The limit that speaks against it.
pub fn check_start(
    mission: &Mission,
    fence: &Fence,
    place_m: Option<[f64; 2]>,
    leak: bool,
    charge_percent: Option<f64>,
    surface_m: Option<f64>,
    limits: &SafetyLimits,
) -> Result<(), ModeReason> {
    if leak {
        return Err(ModeReason::Leak);
    }
    if is_untared(surface_m) {
        return Err(ModeReason::DepthDoubtful);
    }
    if charge_percent.is_some_and(|percent| percent < limits.battery_min_percent) {
        return Err(ModeReason::BatteryLow);
    }
    check_mission(mission, fence, limits)?;
    let Some((place_m, first)) = place_m.zip(mission.waypoints().first()) else { return Ok(()) };
    let first_m = [first.x_m, first.y_m];
    if distance_m(place_m, first_m) > limits.first_leg_max_m {
        return Err(ModeReason::FirstLegTooLong);
    }
    if fence.contains_leg(place_m, first_m) { Ok(()) } else { Err(ModeReason::OutsideFence) }
}

/// Time of a leg by its length and speed, s.
pub fn leg_time_s(from_m: [f64; 2], to: &Waypoint) -> f64 {
    distance_m(from_m, [to.x_m, to.y_m]) / to.speed_mps
}

fn distance_m(from_m: [f64; 2], to_m: [f64; 2]) -> f64 {
    libm::hypot(to_m[0] - from_m[0], to_m[1] - from_m[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: SafetyLimits = SafetyLimits::DEFAULT;
    const GOOD: SafetyFacts = SafetyFacts {
        depth_m: 3.0,
        depth_level_m: 0.0,
        pressure_m: 3.0,
        sink_mps: 0.0,
        altitude_m: Some(20.0),
        pitch_rad: -0.05,
        speed_mps: 1.0,
        position_m: [100.0, 50.0],
        outside_polygon: false,
        depth_jump_m: 0.0,
        depth_drift_m: 0.5,
        depth_recent_m: 0.5,
        has_fix: false,
        asks_surface: true,
        surface_m: None,
        leak: false,
        supply_low: false,
        charge_percent: Some(80.0),
        degraded: false,
        contact_s: 30.0,
        clock_lost: false,
        leg_depth_m: 3.0,
        leg_s: 900.0,
        leg_expected_s: 1000.0,
        mission_s: 5000.0,
        returning: false,
    };

    /// After how many steps of 0.1 s, at most an hour, and what.
    fn verdict_on(facts: &SafetyFacts) -> Option<(u64, ModeReason, Action)> {
        let mut safety = SafetyLadder::new();
        (0..36_000_u64).find_map(|step| {
            let (reason, action) = safety.judge(step * 100_000, facts, &LIMITS)?;
            Some((step, reason, action))
        })
    }

    #[test]
    fn each_limit_has_its_time_and_its_action() {
        use Action::{HandBack, Hold, Return, StopAndRise};
        let cases = [
            (SafetyFacts { leak: true, ..GOOD }, 0, ModeReason::Leak, StopAndRise),
            (SafetyFacts { supply_low: true, ..GOOD }, 0, ModeReason::SupplyLow, StopAndRise),
            (
                SafetyFacts { depth_m: 99.0, sink_mps: 0.6, leg_depth_m: 98.0, ..GOOD },
                5,
                ModeReason::TooDeep,
                StopAndRise,
            ),
            (SafetyFacts { depth_level_m: 98.0, ..GOOD }, 5, ModeReason::TooDeep, StopAndRise),
            (SafetyFacts { depth_m: 8.1, sink_mps: 0.0, ..GOOD }, 100, ModeReason::TooDeep, StopAndRise),
            (SafetyFacts { depth_m: 8.1, sink_mps: 0.1, ..GOOD }, 30, ModeReason::TooDeep, StopAndRise),
            (SafetyFacts { altitude_m: Some(0.9), ..GOOD }, 10, ModeReason::TooLow, StopAndRise),
            (SafetyFacts { altitude_m: Some(2.0), sink_mps: 0.6, ..GOOD }, 10, ModeReason::TooLow, StopAndRise),
            (SafetyFacts { depth_jump_m: 2.1, ..GOOD }, 10, ModeReason::DepthDoubtful, StopAndRise),
            (SafetyFacts { depth_drift_m: -3.1, ..GOOD }, 10, ModeReason::DepthDoubtful, StopAndRise),
            (SafetyFacts { depth_recent_m: -1.6, ..GOOD }, 10, ModeReason::DepthDoubtful, StopAndRise),
            (SafetyFacts { has_fix: true, ..GOOD }, 100, ModeReason::DepthDoubtful, StopAndRise),
            (SafetyFacts { pressure_m: 0.1, ..GOOD }, 600, ModeReason::DepthDoubtful, StopAndRise),
            (SafetyFacts { surface_m: Some(-0.4), ..GOOD }, 0, ModeReason::DepthDoubtful, StopAndRise),
            (SafetyFacts { pitch_rad: -1.1, ..GOOD }, 30, ModeReason::PitchExceeded, StopAndRise),
            (SafetyFacts { speed_mps: 4.1, ..GOOD }, 50, ModeReason::SpeedExceeded, StopAndRise),
            (SafetyFacts { pressure_m: 0.1, asks_surface: false, ..GOOD }, 1200, ModeReason::NoWater, StopAndRise),
            (SafetyFacts { position_m: [9_000.0, 9_000.0], ..GOOD }, 30, ModeReason::OutsideFence, StopAndRise),
            (SafetyFacts { outside_polygon: true, ..GOOD }, 30, ModeReason::OutsideFence, StopAndRise),
            (SafetyFacts { leg_s: 3_061.0, ..GOOD }, 0, ModeReason::LegTooLong, StopAndRise),
            (SafetyFacts { degraded: true, ..GOOD }, 18_000, ModeReason::DegradedTooLong, StopAndRise),
            (SafetyFacts { charge_percent: Some(9.0), ..GOOD }, 100, ModeReason::BatteryLow, Return),
            (SafetyFacts { mission_s: 43_201.0, ..GOOD }, 0, ModeReason::MissionTooLong, Return),
            (SafetyFacts { contact_s: 1.1e7, ..GOOD }, 0, ModeReason::ContactLost, Hold),
            (SafetyFacts { clock_lost: true, ..GOOD }, 6_000, ModeReason::ClockLost, HandBack),
        ];
        assert_eq!(verdict_on(&GOOD), None);
        for (facts, steps, reason, action) in cases {
            assert_eq!(verdict_on(&facts), Some((steps, reason, action)), "{facts:?}");
        }
        // every rung was met, the largest depth's, the bottom's and the fence's twice
        assert_eq!(cases.len(), RUNGS + 3);
    }

    #[test]
    fn what_is_no_danger_ends_nothing() {
        for facts in [
            // on its way up from a deeper leg
            SafetyFacts { depth_m: 40.0, sink_mps: -0.2, ..GOOD },
            // launched in shallow water
            SafetyFacts { depth_m: 0.1, altitude_m: Some(0.6), leg_depth_m: 0.0, ..GOOD },
            // a level that leaves the largest depth out of reach
            SafetyFacts { depth_level_m: 50.0, ..GOOD },
            SafetyFacts { altitude_m: None, charge_percent: None, ..GOOD },
            // at the surface with a fix, the sensor as the weather leaves it; and where nobody asks
            SafetyFacts { pressure_m: 0.1, has_fix: true, surface_m: Some(0.25), leg_depth_m: 0.0, ..GOOD },
            SafetyFacts { surface_m: Some(1.0), asks_surface: false, ..GOOD },
            // already on its way back
            SafetyFacts { charge_percent: Some(1.0), mission_s: 1e5, returning: true, ..GOOD },
        ] {
            assert_eq!(verdict_on(&facts), None, "{facts:?}");
        }
    }

    #[test]
    fn a_limit_is_broken_without_a_break_or_not_at_all() {
        let mut safety = SafetyLadder::new();
        for step in 0..1000_u64 {
            let pitch_rad = if step % 29 == 0 { 0.0 } else { 1.2 };
            assert_eq!(safety.judge(step * 100_000, &SafetyFacts { pitch_rad, ..GOOD }, &LIMITS), None, "step {step}");
        }
    }

    #[test]
    fn the_worst_comes_first() {
        let facts = SafetyFacts { leak: true, charge_percent: Some(1.0), depth_m: 200.0, ..GOOD };
        assert_eq!(verdict_on(&facts).map(|(_, reason, _)| reason), Some(ModeReason::Leak));
    }

    #[test]
    fn what_can_be_known_before_is_refused_before() {
        let mission = |waypoints: &[Waypoint]| {
            let mut mission = Mission::new();
            for waypoint in waypoints {
                mission.push(*waypoint).unwrap();
            }
            mission
        };
        let first = Waypoint { x_m: 0.0, y_m: 0.0, depth_m: 3.0, speed_mps: 1.0 };
        let check = |waypoints: &[Waypoint]| check_mission(&mission(waypoints), &Fence::new(), &LIMITS);
        assert_eq!(check(&[first, Waypoint { x_m: 1000.0, ..first }]), Ok(()));
        assert_eq!(check(&[Waypoint { depth_m: 99.5, ..first }]), Err(ModeReason::TooDeep));
        assert_eq!(check(&[first, Waypoint { y_m: -10_001.0, ..first }]), Err(ModeReason::OutsideFence));
        let far = Waypoint { x_m: 9_000.0, ..first };
        assert_eq!(check(&[first, far, first, far, first, far]), Err(ModeReason::MissionTooLong));

        let ready = mission(&[first]);
        let start = |place_m, leak, charge| check_start(&ready, &Fence::new(), place_m, leak, charge, None, &LIMITS);
        assert_eq!(start(None, false, None), Ok(()));
        assert_eq!(start(Some([1_999.0, 0.0]), false, Some(10.0)), Ok(()));
        assert_eq!(start(Some([2_001.0, 0.0]), false, Some(10.0)), Err(ModeReason::FirstLegTooLong));
        assert_eq!(start(None, true, None), Err(ModeReason::Leak));
        assert_eq!(start(None, false, Some(9.9)), Err(ModeReason::BatteryLow));
        let tared = |surface_m| check_start(&ready, &Fence::new(), None, false, None, Some(surface_m), &LIMITS);
        assert_eq!([tared(0.25), tared(-0.35)], [Ok(()), Err(ModeReason::DepthDoubtful)]);

        // a triangle around the first waypoint, open to the south of it
        let mut fence = Fence::new();
        for corner_m in [[-20.0, 0.0], [50.0, -50.0], [50.0, 50.0]] {
            fence.push(corner_m).unwrap();
        }
        let check = |waypoints: &[Waypoint]| check_mission(&mission(waypoints), &fence, &LIMITS);
        assert_eq!(check(&[first, Waypoint { x_m: 40.0, ..first }]), Ok(()));
        assert_eq!(check(&[first, Waypoint { x_m: 60.0, ..first }]), Err(ModeReason::OutsideFence));
        assert_eq!(check(&[Waypoint { x_m: -30.0, ..first }]), Err(ModeReason::OutsideFence));
        let start = |place_m| check_start(&ready, &fence, Some(place_m), false, None, None, &LIMITS);
        assert_eq!(start([40.0, 20.0]), Ok(()));
        assert_eq!(start([-30.0, 0.0]), Err(ModeReason::OutsideFence));
    }
}
