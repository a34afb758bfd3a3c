//! The limits of safety carried out: facts from the components, and what follows when a limit is broken.

use crate::backseat::Backseat;
use crate::inputs::fresh;
use crate::inputs::installation::body_to_ned;
use crate::safety::{self, Action, DepthStep, Facts, seconds};
use crate::steering::Orders;
use backseat_core::control::mission::Waypoint;
use backseat_core::navigation::Sensor;
use backseat_core::state::{PHI, PSI, R, THETA, U, V, W, X, Y, Z};
use backseat_wire::hostlink::ModeReason;

/// An altitude is used for so long, µs.
const ALTITUDE_AGE_US: u64 = 3_000_000;
/// An attitude is used for so long, µs.
const ATTITUDE_AGE_US: u64 = 1_000_000;
/// A fix is used for so long, µs.
const FIX_AGE_US: u64 = 2_500_000;
/// Pulse edges have stopped when none has come for so long, µs.
const EDGE_AGE_US: u64 = 5_000_000;
/// An abort is heeded for so long after it was sent, µs: a packet lasts seconds, and the ship says it again.
const ABORT_AGE_US: u64 = 60_000_000;
/// Of the largest difference of a source that has come back, the filter keeps this share as its sigma.
const JUMP_SHARE: f64 = 0.4;
/// Time of a step for the depth's witness at most, s.
const LONGEST_STEP_S: f64 = 0.5;

impl Backseat {
    /// Whether the stored mission may begin, as far as it is known now.
    ///
    /// # Errors
    /// The limit that speaks against it.
    pub fn may_start(&self) -> Result<(), ModeReason> {
        let limits = &self.parameters.active().app.safety;
        let x = self.estimator.output();
        let place_m = self.estimator.navigator().is_initialised().then(|| [x[X], x[Y]]);
        let frontseat = &self.links.frontseat;
        safety::check_start(
            self.steering.mission(),
            &self.fence,
            place_m,
            frontseat.leaks(),
            frontseat.charge_percent(),
            limits,
        )
    }

    /// An armed mission begins, or not.
    pub(crate) fn begin(&mut self) {
        if !self.steering.is_armed() {
            return;
        }
        match self.may_start() {
            Ok(()) => self.steering.begin(self.estimator.output()),
            Err(reason) => {
                self.steering.disarm();
                self.modes.ended_by(reason);
            }
        }
    }

    /// Ends a mission, under way or armed, that the ship aborts.
    #[inline(never)]
    pub(crate) fn heed_abort(&mut self, now_us: u64, orders: &mut Orders) {
        let Some(abort) = self.links.take_abort() else { return };
        let settings = &self.parameters.active().app;
        let sent_us = u64::from(abort.transmit_s).saturating_mul(1_000_000);
        // Sent since the mission was started, and not long ago: a recording is for no other mission. Without UTC it
        // cannot be told from one.
        let Some(present_us) = self.clock.utc_us(now_us) else { return };
        let Some(started_us) = self.clock.utc_us(self.steering.armed_us()) else { return };
        let is_new = sent_us >= started_us && sent_us.abs_diff(present_us) <= ABORT_AGE_US;
        if !is_new || !abort.is_for(settings.modem_address) || !self.steering.is_engaged() {
            return;
        }
        self.steering.disarm();
        if self.steering.under_way() {
            self.steering.hand_back(now_us, settings, orders);
        }
        self.modes.ended_by(ModeReason::Aborted);
    }

    /// Ends a mission that breaks a limit.
    #[inline(never)]
    pub(crate) fn keep_safe(&mut self, now_us: u64, orders: &mut Orders) {
        let Some((leg, target)) = self.steering.leg().zip(self.steering.leg_target().copied()) else {
            self.voyage.end();
            self.safety.restart();
            self.witness.restart();
            self.modes.returned();
            return;
        };
        let x = self.estimator.output();
        let place_m = [x[X], x[Y]];
        self.voyage.follow(now_us, leg, place_m, self.has_clock(now_us));
        let facts = self.safety_facts(now_us, &target);
        self.estimator.set_depth_drift(self.witness.sigma_m());
        let settings = &self.parameters.active().app;
        let Some((reason, action)) = self.safety.judge(now_us, &facts, &settings.safety) else { return };
        // a straight way home that leaves the fence is none
        let home = self.voyage.home(&target).filter(|home| self.fence.contains_leg(place_m, [home.x_m, home.y_m]));
        match (action, home) {
            (Action::Return, Some(home)) if self.steering.return_to(home, self.estimator.output()) => {
                self.voyage.new_leg();
                self.modes.returns_by(reason);
                return;
            }
            (Action::StopAndRise | Action::Return, _) => self.steering.hand_back(now_us, settings, orders),
            (Action::Hold, _) => self.steering.hold(),
            (Action::HandBack, _) => self.steering.lapse(now_us, settings, orders),
        }
        self.modes.ended_by(reason);
    }

    /// UTC rests on pulse edges, and they come.
    fn has_clock(&self, now_us: u64) -> bool {
        let age_us = self.clock.last_edge_us().map(|us| now_us.saturating_sub(us));
        self.clock.is_fine() && age_us.is_some_and(|us| us < EDGE_AGE_US)
    }

    fn safety_facts(&mut self, now_us: u64, target: &Waypoint) -> Facts {
        let has_clock = self.has_clock(now_us);
        let Self { parameters, links, inputs, estimator, steering, modes, voyage, witness, fence, .. } = self;
        let settings = &parameters.active().app;
        let (navigator, x) = (estimator.navigator(), estimator.output());
        let sink_mps = body_to_ned(x, &[x[U], x[V], x[W]])[2];
        let pressure_m = inputs
            .latest()
            .depth_m
            .map_or(x[Z], |(_, depth_m)| depth_m - body_to_ned(x, &settings.installation.depth_arm_m)[2]);
        // as measured: a filter bends its pitch towards a depth that drifts, and the bank's jumps where it takes another
        // filter
        let measured = fresh(inputs.latest().euler_rad, now_us, ATTITUDE_AGE_US);
        let [roll_rad, pitch_rad, _] = measured.unwrap_or([x[PHI], x[THETA], x[PSI]]);
        let dt_s = voyage.step_s(now_us).min(LONGEST_STEP_S);
        witness.step(&DepthStep {
            dt_s,
            pressure_m,
            roll_rad,
            pitch_rad,
            yaw_radps: x[R],
            surge_mps: x[U],
            leg_depth_m: target.depth_m,
            leg_speed_mps: target.speed_mps,
        });
        let altitude = |latest| fresh(latest, now_us, ALTITUDE_AGE_US);
        let altitudes = [altitude(links.dvl_altitude_m()), altitude(links.frontseat.altitude_m())];
        let (leg_s, leg_expected_s) = voyage.leg_times_s(now_us, target);
        let heard_us = estimator.range_us().unwrap_or(0).max(voyage.begun_us());
        Facts {
            depth_m: pressure_m.max(x[Z]),
            pressure_m,
            sink_mps: sink_mps.max(witness.sink_mps()),
            altitude_m: altitudes.into_iter().flatten().reduce(f64::min),
            pitch_rad: x[THETA],
            speed_mps: x[U],
            position_m: [x[X], x[Y]],
            outside_polygon: !fence.contains([x[X], x[Y]]),
            depth_jump_m: navigator.main().unconfirmed_sigma(Sensor::Depth) / JUMP_SHARE,
            depth_drift_m: witness.drift_m(),
            depth_recent_m: witness.recent_m(),
            has_fix: fresh(inputs.latest().fix_m, now_us, FIX_AGE_US).is_some(),
            leak: links.frontseat.leaks(),
            charge_percent: links.frontseat.charge_percent(),
            degraded: modes.is_degraded(),
            contact_s: seconds(heard_us, now_us),
            clock_lost: settings.use_range && voyage.had_clock() && !has_clock,
            leg_depth_m: target.depth_m,
            leg_s,
            leg_expected_s,
            mission_s: seconds(voyage.begun_us(), now_us),
            returning: steering.is_returning(),
        }
    }
}
