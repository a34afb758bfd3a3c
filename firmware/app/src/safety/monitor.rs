//! The limits of safety in a step: facts from the components, and the decision that follows. The app applies it.

use super::{
    Action, DepthCrossCheck, DepthStep, Fence, MissionProgress, SafetyFacts, SafetyLadder, SurfaceDepth, check_start,
    seconds,
};
use crate::estimator::Estimator;
use crate::inputs::installation::body_to_ned;
use crate::inputs::{Inputs, fresh};
use crate::last_resort::LastResort;
use crate::links::Links;
use crate::parameters::AppSettings;
use crate::steering::Steering;
use crate::time::UtcClock;
use backseat_core::control::mission::Waypoint;
use backseat_core::navigation::Sensor;
use backseat_core::state::{PHI, PSI, R, THETA, U, V, W, X, Y, Z};
use backseat_wire::abort::Abort;
use backseat_wire::hostlink::ModeReason;

/// An altitude is used for so long, µs.
const ALTITUDE_AGE_US: u64 = 3_000_000;
/// An attitude is used for so long, µs.
const ATTITUDE_AGE_US: u64 = 1_000_000;
/// A fix is used for so long, µs.
const FIX_AGE_US: u64 = 2_500_000;
/// Pulse edges have stopped when none has come for so long, µs.
const EDGE_AGE_US: u64 = 5_000_000;
/// An abort is valid for so long after it was sent, µs: a packet lasts seconds, and the ship says it again.
const ABORT_AGE_US: u64 = 60_000_000;
/// Of the largest difference of a source that has come back, the filter keeps this share as its sigma.
const JUMP_SHARE: f64 = 0.4;
/// Time of a step for the cross-check of depth at most, s.
const LONGEST_STEP_S: f64 = 0.5;

/// The components that the limits are judged by.
#[derive(Clone, Copy)]
pub struct Observed<'a> {
    pub settings: &'a AppSettings,
    pub clock: &'a UtcClock,
    pub links: &'a Links,
    pub inputs: &'a Inputs,
    pub estimator: &'a Estimator,
    pub steering: &'a Steering,
    /// Of the stored mission.
    pub fence: &'a Fence,
    pub last_resort: &'a LastResort,
    /// Navigation is degraded.
    pub degraded: bool,
}

/// What a step of the limits decides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision {
    /// No leg is flown, and nothing is watched.
    Idle,
    /// The mission goes on.
    Continue,
    /// A limit is broken: why the mission ends, what follows, and the way home if there is one within the fence.
    End { reason: ModeReason, action: Action, home: Option<Waypoint> },
}

/// The ladder of limits with what it remembers of a mission.
pub struct SafetyMonitor {
    ladder: SafetyLadder,
    progress: MissionProgress,
    depth: DepthCrossCheck,
    surface: SurfaceDepth,
    /// Time of the last step, µs.
    surface_us: u64,
}

impl SafetyMonitor {
    pub const fn new() -> Self {
        Self {
            ladder: SafetyLadder::new(),
            progress: MissionProgress::new(),
            depth: DepthCrossCheck::new(),
            surface: SurfaceDepth::new(),
            surface_us: 0,
        }
    }

    /// A mission begins, or none is under way.
    pub fn restart(&mut self) {
        *self = Self { surface: self.surface, surface_us: self.surface_us, ..Self::new() };
    }

    /// Whether the stored mission may begin, as far as it is known now.
    ///
    /// # Errors
    /// The limit that speaks against it.
    pub fn may_start(&self, observed: &Observed<'_>) -> Result<(), ModeReason> {
        let Observed { settings, links, estimator, steering, fence, last_resort, .. } = *observed;
        last_resort.test(&settings.fittings)?;
        let x = &estimator.output;
        let place_m = estimator.navigator().is_initialised().then(|| [x[X], x[Y]]);
        let surface_m = self.surface.mean_m().filter(|_| asks_surface(settings));
        let (leak, charge_percent) = (links.frontseat.leaks(), links.frontseat.charge_percent());
        check_start(steering.mission(), fence, place_m, leak, charge_percent, surface_m, &settings.safety)
    }

    /// The way home begins.
    pub fn new_leg(&mut self) {
        self.progress.new_leg();
    }

    /// One sigma of depth, m, that covers the drift of the pressure sensor.
    pub fn depth_drift_sigma_m(&self) -> f64 {
        self.depth.sigma_m()
    }

    /// Judges a step.
    #[inline(never)]
    pub fn step(&mut self, now_us: u64, observed: &Observed<'_>) -> Decision {
        let Observed { settings, inputs, estimator, steering, fence, .. } = *observed;
        let dt_s = seconds(self.surface_us, now_us).min(LONGEST_STEP_S);
        self.surface_us = now_us;
        self.surface.step(dt_s, has_fix(now_us, inputs), pressure_m(observed));
        let Some((leg, target)) = steering.leg().zip(steering.leg_target()) else {
            self.restart();
            return Decision::Idle;
        };
        let x = &estimator.output;
        let place_m = [x[X], x[Y]];
        let has_clock = has_clock(now_us, observed.clock);
        if steering.helm().is_some() {
            // the mission stands still: the leg begins anew from where the host lets go
            self.progress.new_leg();
        }
        self.progress.follow(now_us, leg, place_m, has_clock);
        let facts = self.facts(now_us, observed, target, has_clock);
        let Some((reason, action)) = self.ladder.judge(now_us, &facts, &settings.safety) else {
            return Decision::Continue;
        };
        // a straight way home that leaves the fence is none
        let home = self.progress.home(target).filter(|home| fence.contains_leg(place_m, [home.x_m, home.y_m]));
        Decision::End { reason, action, home }
    }

    fn facts(&mut self, now_us: u64, observed: &Observed<'_>, target: &Waypoint, has_clock: bool) -> SafetyFacts {
        let Observed { settings, links, inputs, estimator, steering, fence, last_resort, degraded, .. } = *observed;
        let (navigator, x) = (estimator.navigator(), &estimator.output);
        let sink_mps = body_to_ned(x, &[x[U], x[V], x[W]])[2];
        let pressure_m = pressure_m(observed);
        // as measured: a filter bends its pitch towards a depth that drifts, and the bank's jumps where it takes another
        // filter
        let measured = fresh(inputs.latest.euler_rad, now_us, ATTITUDE_AGE_US);
        let [roll_rad, pitch_rad, _] = measured.unwrap_or([x[PHI], x[THETA], x[PSI]]);
        let dt_s = self.progress.step_s(now_us).min(LONGEST_STEP_S);
        let helm = steering.helm();
        let steered_m = helm.map(|helm| helm.depth_m);
        let depth_m = pressure_m.max(x[Z]);
        self.depth.step(&DepthStep {
            dt_s,
            pressure_m,
            roll_rad,
            pitch_rad,
            yaw_radps: x[R],
            surge_mps: x[U],
            leg_depth_m: steered_m.unwrap_or(target.depth_m),
            leg_speed_mps: helm.map_or(target.speed_mps, |helm| helm.speed_mps),
        });
        let altitude = |latest| fresh(latest, now_us, ALTITUDE_AGE_US);
        let altitudes = [altitude(links.dvl_altitude_m()), altitude(links.frontseat.status.altitude_m)];
        let (leg_s, leg_expected_s) = self.progress.leg_times_s(now_us, target);
        let heard_us = estimator.range_us.unwrap_or(0).max(self.progress.begun_us());
        let level = estimator.level().filter(|_| settings.alert_depth_m > 0.0);
        SafetyFacts {
            depth_m,
            depth_level_m: level.map_or(0.0, |level| level.vertical_m),
            pressure_m,
            sink_mps: sink_mps.max(self.depth.sink_mps),
            altitude_m: altitudes.into_iter().flatten().reduce(f64::min),
            pitch_rad: x[THETA],
            speed_mps: x[U],
            position_m: [x[X], x[Y]],
            outside_polygon: !fence.contains([x[X], x[Y]]),
            depth_jump_m: navigator.main().unconfirmed_sigma(Sensor::Depth) / JUMP_SHARE,
            depth_drift_m: self.depth.drift_m,
            depth_recent_m: self.depth.recent_m,
            has_fix: has_fix(now_us, inputs),
            asks_surface: asks_surface(settings),
            surface_m: self.surface.mean_m(),
            leak: links.frontseat.leaks() || last_resort.leaks(&settings.fittings),
            supply_low: last_resort.is_supply_low(),
            charge_percent: links.frontseat.charge_percent(),
            degraded,
            contact_s: seconds(heard_us, now_us),
            clock_lost: settings.use_range && self.progress.had_clock && !has_clock,
            leg_depth_m: self.progress.asked_depth_m(dt_s, depth_m, target.depth_m, steered_m),
            leg_s,
            leg_expected_s,
            mission_s: seconds(self.progress.begun_us(), now_us),
            returning: steering.returning,
        }
    }
}

/// Depth is checked at the surface.
fn asks_surface(settings: &AppSettings) -> bool {
    settings.alert_depth_m > 0.0 && settings.use_gnss
}

fn has_fix(now_us: u64, inputs: &Inputs) -> bool {
    fresh(inputs.latest.fix_m, now_us, FIX_AGE_US).is_some()
}

/// Of the pressure sensor, at the centre of gravity, m.
fn pressure_m(observed: &Observed<'_>) -> f64 {
    let Observed { settings, inputs, estimator, .. } = *observed;
    let x = &estimator.output;
    let arm_m = &settings.installation.depth_arm_m;
    inputs.latest.depth_m.map_or(x[Z], |(_, depth_m)| depth_m - body_to_ned(x, arm_m)[2])
}

/// Whether an abort from the ship ends the mission that is under way or armed: it is for this vehicle, was sent since
/// the mission was started, and not long ago. A recording is for no other mission; without UTC it cannot be told from
/// one.
pub fn aborts(abort: &Abort, now_us: u64, observed: &Observed<'_>) -> bool {
    let Observed { settings, clock, steering, .. } = *observed;
    let sent_us = u64::from(abort.transmit_s).saturating_mul(1_000_000);
    let Some((present_us, started_us)) = clock.utc_us(now_us).zip(clock.utc_us(steering.armed_us)) else {
        return false;
    };
    let is_new = sent_us >= started_us && sent_us.abs_diff(present_us) <= ABORT_AGE_US;
    is_new && abort.is_for(settings.modem_address) && steering.is_engaged()
}

/// UTC rests on pulse edges, and they come.
fn has_clock(now_us: u64, clock: &UtcClock) -> bool {
    let age_us = clock.last_edge_us.map(|us| now_us.saturating_sub(us));
    clock.fine && age_us.is_some_and(|us| us < EDGE_AGE_US)
}
