//! Mode of the backseat with its reason: a state machine of five modes.
//!
//! [`judge`] gives the mode that the facts of a step call for; it depends on the present mode by a hysteresis of the
//! position's sigma. A worse mode takes effect in the same step. A better one has to last for [`RECOVERY_US`], so that
//! an intermittent source does not make the mode flicker. Initialising is outside this order: it is entered and left at
//! once.

use crate::parameters::AppSettings;
use crate::time::micros;
use backseat_wire::hostlink::{Mode, ModeReason};

/// Better facts have to last this long, µs.
const RECOVERY_US: u64 = 3_000_000;
/// If attitude or depth has contradicted the filter for longer than this, µs, the vehicle must not be steered by it. A
/// heading that is wrong after a fast turn agrees again within half of this time.
const UNSTEERABLE_US: u64 = 10_000_000;
/// A sigma that was beyond its limit has to fall below this share of it.
const SIGMA_HYSTERESIS: f64 = 0.8;

/// ModeFacts that determine the mode; ages are `None` while a source was never heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModeFacts {
    /// The filter failed in this step.
    pub failed: bool,
    pub initialised: bool,
    pub attitude_age_us: Option<u64>,
    pub depth_age_us: Option<u64>,
    pub frontseat_age_us: Option<u64>,
    /// How long the frontseat has refused commands.
    pub refused_us: Option<u64>,
    /// √(σx² + σy²), m.
    pub position_sigma_m: f64,
    /// Protection level, horizontally and in depth, m.
    pub level_m: [f64; 2],
    /// The position is the one from before a reset, and nothing has confirmed it since.
    pub resumed: bool,
    /// A sensor is suspect, or unconfirmed in a way that the sigma of the position does not cover.
    pub suspect: bool,
    /// How long attitude or depth has contradicted the filter, once it is suspect, µs.
    pub unsteerable_us: Option<u64>,
    /// Steps have come late, too many of them.
    pub overloaded: bool,
    /// A mission is under way.
    pub mission: bool,
}

/// The mode that the facts call for, given the mode `now`.
fn judge(facts: &ModeFacts, settings: &AppSettings, now: Mode) -> (Mode, ModeReason) {
    let stale = |age_us: Option<u64>, timeout_s: f64| age_us.is_none_or(|us| us > micros(timeout_s));
    let attitude = stale(facts.attitude_age_us, settings.attitude_timeout_s);
    let depth = stale(facts.depth_age_us, settings.depth_timeout_s);
    if facts.failed {
        return (Mode::Lost, ModeReason::FilterFailed);
    }
    if !facts.initialised {
        let reason = match (attitude, depth) {
            (true, _) => ModeReason::AttitudeStale,
            (_, true) => ModeReason::DepthStale,
            _ => ModeReason::NoFix,
        };
        return (Mode::Initialising, reason);
    }
    // A sigma above its limit has to fall clearly below it. NaN counts as above every limit.
    let above = |limit_m: f64, was: bool| {
        let limit_m = if was { SIGMA_HYSTERESIS * limit_m } else { limit_m };
        facts.position_sigma_m.is_nan() || facts.position_sigma_m > limit_m
    };
    if above(settings.lost_sigma_m, now == Mode::Lost) {
        return (Mode::Lost, ModeReason::PositionUncertain);
    }
    if stale(facts.frontseat_age_us, settings.frontseat_timeout_s) {
        return (Mode::Safe, ModeReason::FrontseatSilent);
    }
    if facts.overloaded {
        return (Mode::Safe, ModeReason::Overloaded);
    }
    if attitude {
        return (Mode::Safe, ModeReason::AttitudeStale);
    }
    if depth {
        return (Mode::Safe, ModeReason::DepthStale);
    }
    // Without a mission the board sends no commands.
    if facts.mission && facts.refused_us.is_some_and(|us| us > micros(settings.refusal_timeout_s)) {
        return (Mode::Safe, ModeReason::FrontseatRefuses);
    }
    // Whichever of the two is right, attitude or depth is not known.
    if facts.unsteerable_us.is_some_and(|us| us > UNSTEERABLE_US) {
        return (Mode::Safe, ModeReason::Rejections);
    }
    if facts.suspect {
        return (Mode::Degraded, ModeReason::Rejections);
    }
    if above(settings.degraded_sigma_m, matches!(now, Mode::Degraded | Mode::Safe | Mode::Lost)) {
        return (Mode::Degraded, ModeReason::PositionUncertain);
    }
    // Without an alert limit nothing is asked of the level.
    let alerts_m = [settings.alert_horizontal_m, settings.alert_depth_m];
    let share = if matches!(now, Mode::Degraded | Mode::Safe | Mode::Lost) { SIGMA_HYSTERESIS } else { 1.0 };
    if facts.level_m.iter().zip(alerts_m).any(|(level_m, alert_m)| alert_m > 0.0 && *level_m > share * alert_m) {
        return (Mode::Degraded, ModeReason::PositionUncertain);
    }
    if facts.resumed {
        return (Mode::Degraded, ModeReason::Restarted);
    }
    (Mode::Navigating, ModeReason::Nominal)
}

/// How bad a mode is; Initialising has no place in this order.
fn rank(mode: Mode) -> Option<u8> {
    match mode {
        Mode::Initialising => None,
        Mode::Navigating => Some(0),
        Mode::Degraded => Some(1),
        Mode::Safe => Some(2),
        Mode::Lost => Some(3),
    }
}

/// The mode, and what ended the last mission.
#[derive(Clone, Copy, Debug)]
pub struct Modes {
    /// `None` before the first step.
    present: Option<(Mode, ModeReason)>,
    /// Since when the facts have called for something better, µs.
    better_since_us: Option<u64>,
    /// Why the last mission was ended before its time; stays until the next start.
    ended: Option<(Mode, ModeReason)>,
    /// What is shown while the way back is flown.
    returning: Option<(Mode, ModeReason)>,
    /// The board was reset too often, and the operator has not taken note of it.
    pub barred: bool,
    /// By its watchdog: its steps do not end in time.
    pub rests: bool,
}

impl Modes {
    pub const fn new() -> Self {
        Self { present: None, better_since_us: None, ended: None, returning: None, barred: false, rests: false }
    }

    fn standing(&self) -> (Mode, ModeReason) {
        self.present.unwrap_or((Mode::Initialising, ModeReason::NoFix))
    }

    /// Mode and reason.
    pub fn present(&self) -> (Mode, ModeReason) {
        match (self.barred, self.ended, self.returning, self.standing()) {
            (true, ..) if self.rests => (Mode::Safe, ModeReason::Overloaded),
            (true, ..) => (Mode::Safe, ModeReason::Resets),
            (_, Some(ended), ..) => ended,
            (_, _, Some(returning), (Mode::Navigating | Mode::Degraded, _)) => returning,
            (.., standing) => standing,
        }
    }

    /// Navigation is valid, with less than it should have.
    pub fn is_degraded(&self) -> bool {
        self.standing().0 == Mode::Degraded
    }

    /// Whether a mission may begin now.
    pub fn ready(&self) -> bool {
        !self.barred && matches!(self.standing().0, Mode::Navigating | Mode::Degraded)
    }

    /// Whether a mission may be armed: it begins by itself when the filter has initialised.
    pub fn may_arm(&self) -> bool {
        self.ready() || (!self.barred && self.standing().0 == Mode::Initialising)
    }

    /// Takes the step's transition, if there is one; true when a mission under way has to end.
    pub fn update(&mut self, now_us: u64, facts: &ModeFacts, settings: &AppSettings) -> bool {
        let standing = self.standing();
        let wanted = judge(facts, settings, standing.0);
        let is_better = match (rank(wanted.0), rank(standing.0)) {
            (Some(wanted), Some(standing)) => wanted < standing,
            _ => false,
        };
        let since_us = self.better_since_us.filter(|_| is_better).unwrap_or(now_us);
        self.better_since_us = is_better.then_some(since_us);
        // A failed filter starts anew: nothing is waited for.
        let waits = is_better && now_us.saturating_sub(since_us) < RECOVERY_US;
        if !waits {
            self.present = Some(wanted);
            self.better_since_us = None;
        }
        let ends = facts.mission && !self.ready();
        if ends {
            self.ended = self.present;
            self.returning = None;
        }
        ends
    }

    /// A limit of safety ended the mission.
    pub fn ended_by(&mut self, reason: ModeReason) {
        self.ended = Some((Mode::Safe, reason));
        self.returning = None;
    }

    /// A limit of safety makes the mission return.
    pub fn returns_by(&mut self, reason: ModeReason) {
        self.returning = Some((Mode::Degraded, reason));
    }

    /// The way back is over.
    pub fn returned(&mut self) {
        if let Some((_, reason)) = self.returning {
            self.ended_by(reason);
        }
    }

    /// The operator stopped, and knows of resets.
    pub fn stopped(&mut self) {
        self.ended_by(ModeReason::Stopped);
        (self.barred, self.rests) = (false, false);
    }

    /// The frontseat never acknowledged the stop.
    pub fn stop_unanswered(&mut self) {
        self.ended = Some((Mode::Safe, ModeReason::StopUnanswered));
    }

    /// The board was reset too often; whether by its watchdog.
    pub fn barred(&mut self, by_watchdog: bool) {
        (self.barred, self.rests) = (true, by_watchdog);
    }

    /// A mission starts.
    pub fn started(&mut self) {
        self.ended = None;
        self.returning = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: ModeFacts = ModeFacts {
        failed: false,
        initialised: true,
        attitude_age_us: Some(100_000),
        depth_age_us: Some(100_000),
        frontseat_age_us: Some(100_000),
        refused_us: None,
        position_sigma_m: 1.0,
        level_m: [10.0, 2.0],
        resumed: false,
        suspect: false,
        unsteerable_us: None,
        overloaded: false,
        mission: true,
    };
    const STEP_US: u64 = 100_000;

    #[test]
    fn each_fact_has_its_mode() {
        let settings = AppSettings::DEFAULT;
        let uncertain = |position_sigma_m| ModeFacts { position_sigma_m, ..GOOD };
        let cases = [
            (GOOD, Mode::Navigating, ModeReason::Nominal),
            (ModeFacts { overloaded: true, ..GOOD }, Mode::Safe, ModeReason::Overloaded),
            (ModeFacts { resumed: true, ..GOOD }, Mode::Degraded, ModeReason::Restarted),
            (ModeFacts { failed: true, ..GOOD }, Mode::Lost, ModeReason::FilterFailed),
            (ModeFacts { initialised: false, ..GOOD }, Mode::Initialising, ModeReason::NoFix),
            (ModeFacts { initialised: false, depth_age_us: None, ..GOOD }, Mode::Initialising, ModeReason::DepthStale),
            (ModeFacts { attitude_age_us: Some(2_100_000), ..GOOD }, Mode::Safe, ModeReason::AttitudeStale),
            (ModeFacts { attitude_age_us: None, ..GOOD }, Mode::Safe, ModeReason::AttitudeStale),
            (ModeFacts { depth_age_us: Some(2_100_000), ..GOOD }, Mode::Safe, ModeReason::DepthStale),
            (ModeFacts { frontseat_age_us: Some(11_000_000), ..GOOD }, Mode::Safe, ModeReason::FrontseatSilent),
            (ModeFacts { refused_us: Some(4_000_000), ..GOOD }, Mode::Safe, ModeReason::FrontseatRefuses),
            (uncertain(50.0), Mode::Degraded, ModeReason::PositionUncertain),
            (uncertain(500.0), Mode::Lost, ModeReason::PositionUncertain),
            (uncertain(f64::NAN), Mode::Lost, ModeReason::PositionUncertain),
            (ModeFacts { suspect: true, ..GOOD }, Mode::Degraded, ModeReason::Rejections),
            (ModeFacts { suspect: true, unsteerable_us: Some(10_100_000), ..GOOD }, Mode::Safe, ModeReason::Rejections),
            // the worse of two
            (ModeFacts { depth_age_us: None, ..uncertain(500.0) }, Mode::Lost, ModeReason::PositionUncertain),
            (ModeFacts { suspect: true, ..uncertain(50.0) }, Mode::Degraded, ModeReason::Rejections),
        ];
        for (facts, mode, reason) in cases {
            assert_eq!(judge(&facts, &settings, Mode::Navigating), (mode, reason), "{facts:?}");
            let idle = ModeFacts { mission: false, ..facts };
            if reason != ModeReason::FrontseatRefuses {
                assert_eq!(judge(&idle, &settings, Mode::Navigating), (mode, reason), "without a mission: {facts:?}");
            } else {
                assert_eq!(judge(&idle, &settings, Mode::Navigating).0, Mode::Navigating);
            }
        }
    }

    /// A level acts where a limit is declared, on either of the two, and with a margin on the way back.
    #[test]
    fn a_level_beyond_its_alert_limit_degrades() {
        let off = AppSettings::DEFAULT;
        let settings = AppSettings { alert_horizontal_m: 25.0, alert_depth_m: 5.0, ..off };
        let at = |level_m| ModeFacts { level_m, ..GOOD };
        let degraded = (Mode::Degraded, ModeReason::PositionUncertain);
        for (level_m, from, wanted) in [
            ([24.0, 4.0], Mode::Navigating, (Mode::Navigating, ModeReason::Nominal)),
            ([26.0, 4.0], Mode::Navigating, degraded),
            ([24.0, 5.1], Mode::Navigating, degraded),
            ([24.0, 3.0], Mode::Degraded, degraded),
            ([19.0, 3.0], Mode::Degraded, (Mode::Navigating, ModeReason::Nominal)),
            ([f64::INFINITY, 3.0], Mode::Navigating, degraded),
        ] {
            assert_eq!(judge(&at(level_m), &settings, from), wanted, "{level_m:?} from {from:?}");
            assert_eq!(judge(&at(level_m), &off, from), (Mode::Navigating, ModeReason::Nominal));
        }
    }

    /// Modes that stand at `facts`.
    fn at(facts: &ModeFacts) -> Modes {
        let mut modes = Modes::new();
        modes.update(0, facts, &AppSettings::DEFAULT);
        modes
    }

    /// ModeFacts whose judgement is one of the modes.
    fn facts_of(mode: Mode) -> ModeFacts {
        let facts = ModeFacts { mission: false, ..GOOD };
        match mode {
            Mode::Initialising => ModeFacts { initialised: false, ..facts },
            Mode::Navigating => facts,
            Mode::Degraded => ModeFacts { suspect: true, ..facts },
            Mode::Safe => ModeFacts { attitude_age_us: None, ..facts },
            Mode::Lost => ModeFacts { position_sigma_m: 1000.0, ..facts },
        }
    }

    const ALL: [Mode; 5] = [Mode::Initialising, Mode::Navigating, Mode::Degraded, Mode::Safe, Mode::Lost];

    #[test]
    fn every_transition_is_at_once_or_after_three_seconds() {
        let settings = AppSettings::DEFAULT;
        for from in ALL {
            for to in ALL {
                let mut modes = at(&facts_of(from));
                assert_eq!(modes.present().0, from);
                let mut steps = 1;
                while !modes.update(steps * STEP_US, &facts_of(to), &settings) && modes.present().0 != to {
                    assert_eq!(modes.present().0, from, "nothing in between");
                    steps += 1;
                    assert!(steps < 100, "{from:?} to {to:?}");
                }
                let order = |mode| ALL.iter().position(|other| *other == mode);
                let waits = from != Mode::Initialising && to != Mode::Initialising && order(to) < order(from);
                assert_eq!(steps, if waits { 1 + RECOVERY_US / STEP_US } else { 1 }, "{from:?} to {to:?}");
            }
        }
    }

    #[test]
    fn a_source_that_comes_and_goes_does_not_make_the_mode_flicker() {
        let settings = AppSettings::DEFAULT;
        let mut modes = at(&facts_of(Mode::Degraded));
        for step in 1..1000 {
            let facts = facts_of(if step % 25 == 0 { Mode::Degraded } else { Mode::Navigating });
            modes.update(step * STEP_US, &facts, &settings);
            assert_eq!(modes.present().0, Mode::Degraded, "step {step}");
        }
    }

    #[test]
    fn a_sigma_at_its_limit_does_not_make_the_mode_flicker() {
        let settings = AppSettings::DEFAULT;
        for (limit_m, mode, below) in [
            (settings.degraded_sigma_m, Mode::Degraded, Mode::Navigating),
            (settings.lost_sigma_m, Mode::Lost, Mode::Degraded),
        ] {
            let sigma = |position_sigma_m| ModeFacts { position_sigma_m, mission: false, ..GOOD };
            let mut modes = at(&sigma(0.99 * limit_m));
            assert_eq!(modes.present().0, below);
            modes.update(STEP_US, &sigma(1.01 * limit_m), &settings);
            for step in 2..100 {
                modes.update(step * STEP_US, &sigma(0.81 * limit_m), &settings);
                assert_eq!(modes.present().0, mode);
            }
            for step in 100..=130 {
                modes.update(step * STEP_US, &sigma(0.79 * limit_m), &settings);
            }
            assert_eq!(modes.present().0, below);
        }
    }

    #[test]
    fn what_ended_a_mission_stays_until_the_next() {
        let settings = AppSettings::DEFAULT;
        let mut modes = Modes::new();
        assert!(!modes.ready() && modes.may_arm());
        assert!(!modes.update(0, &GOOD, &settings));
        assert!(modes.update(STEP_US, &ModeFacts { depth_age_us: None, ..GOOD }, &settings));
        for step in 2..=40 {
            assert_eq!(modes.may_arm(), step > 32, "step {step}");
            assert!(!modes.update(step * STEP_US, &ModeFacts { mission: false, ..GOOD }, &settings));
            assert_eq!(modes.present(), (Mode::Safe, ModeReason::DepthStale));
        }
        modes.started();
        assert_eq!(modes.present(), (Mode::Navigating, ModeReason::Nominal));
    }

    #[test]
    fn resets_bar_until_the_operator_stops() {
        let settings = AppSettings::DEFAULT;
        let mut modes = Modes::new();
        modes.barred(false);
        modes.update(0, &ModeFacts { mission: false, ..GOOD }, &settings);
        assert_eq!((modes.present(), modes.may_arm(), modes.ready()), ((Mode::Safe, ModeReason::Resets), false, false));
        modes.stopped();
        assert_eq!((modes.present(), modes.may_arm()), ((Mode::Safe, ModeReason::Stopped), true));
        modes.stop_unanswered();
        assert_eq!(modes.present(), (Mode::Safe, ModeReason::StopUnanswered));
    }
}
