//! Where the backseat stands, and why: one function from facts to mode.

use crate::estimator::timeout_us;
use crate::parameters::AppSettings;
use backseat_wire::hostlink::{Mode, ModeReason};

/// The facts a mode rests on; ages are `None` while a source was never heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
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
    /// The position is the one from before a reset, and nothing has confirmed it since.
    pub resumed: bool,
    /// Longest row of rejections of one sensor.
    pub rejections: u32,
    /// A mission is under way.
    pub mission: bool,
}

/// Judges facts without memory.
///
/// | mode | means | a mission under way |
/// |---|---|---|
/// | Initialising | no filter yet | cannot be |
/// | Navigating, Degraded | goes on | goes on |
/// | Lost, Safe | position or a needed source is gone | ends: neutral, stop, hand back |
fn judge(facts: &Facts, settings: &AppSettings) -> (Mode, ModeReason) {
    let stale = |age_us: Option<u64>, timeout_s: f64| age_us.is_none_or(|us| us > timeout_us(timeout_s));
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
    // Without a mission nobody steers by it, so a missing source only degrades.
    let missing = if facts.mission { Mode::Safe } else { Mode::Degraded };
    if stale(facts.frontseat_age_us, settings.frontseat_timeout_s) {
        return (missing, ModeReason::FrontseatSilent);
    }
    if attitude {
        return (missing, ModeReason::AttitudeStale);
    }
    if depth {
        return (missing, ModeReason::DepthStale);
    }
    if facts.mission && facts.refused_us.is_some_and(|us| us > timeout_us(settings.refusal_timeout_s)) {
        return (Mode::Safe, ModeReason::FrontseatRefuses);
    }
    if facts.position_sigma_m.is_nan() || facts.position_sigma_m > settings.lost_sigma_m {
        return (Mode::Lost, ModeReason::PositionUncertain);
    }
    if facts.position_sigma_m > settings.degraded_sigma_m {
        return (Mode::Degraded, ModeReason::PositionUncertain);
    }
    if facts.resumed {
        return (Mode::Degraded, ModeReason::Restarted);
    }
    if facts.rejections >= u32::from(settings.rejections_in_a_row) {
        return (Mode::Degraded, ModeReason::Rejections);
    }
    (Mode::Navigating, ModeReason::Nominal)
}

/// The mode, and what ended the last mission.
#[derive(Clone, Copy, Debug)]
pub struct Modes {
    /// `None` before the first step.
    present: Option<(Mode, ModeReason)>,
    /// Why the last mission was ended before its time; stays until the next start.
    ended: Option<(Mode, ModeReason)>,
}

impl Modes {
    pub const fn new() -> Self {
        Self { present: None, ended: None }
    }

    fn judged(&self) -> (Mode, ModeReason) {
        self.present.unwrap_or((Mode::Initialising, ModeReason::NoFix))
    }

    /// Mode and reason.
    pub fn present(&self) -> (Mode, ModeReason) {
        self.ended.unwrap_or(self.judged())
    }

    /// Whether a mission may be started now.
    pub fn ready(&self) -> bool {
        matches!(self.judged().0, Mode::Navigating | Mode::Degraded)
    }

    /// Whether navigation is lost, so that it will not become valid by waiting.
    pub fn is_lost(&self) -> bool {
        self.judged().0 == Mode::Lost
    }

    /// Judges the facts; true when a mission under way has to end.
    pub fn update(&mut self, facts: &Facts, settings: &AppSettings) -> bool {
        self.present = Some(judge(facts, settings));
        let ends = facts.mission && !self.ready();
        if ends {
            self.ended = self.present;
        }
        ends
    }

    /// The operator stopped.
    pub fn stopped(&mut self) {
        self.ended = Some((Mode::Safe, ModeReason::Stopped));
    }

    /// The board was reset too often.
    pub fn barred(&mut self) {
        self.ended = Some((Mode::Safe, ModeReason::Resets));
    }

    /// A mission starts.
    pub fn started(&mut self) {
        self.ended = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: Facts = Facts {
        failed: false,
        initialised: true,
        attitude_age_us: Some(100_000),
        depth_age_us: Some(100_000),
        frontseat_age_us: Some(100_000),
        refused_us: None,
        position_sigma_m: 1.0,
        resumed: false,
        rejections: 0,
        mission: true,
    };

    #[test]
    fn each_fact_has_its_mode() {
        let settings = AppSettings::DEFAULT;
        let cases = [
            (GOOD, Mode::Navigating, ModeReason::Nominal),
            (Facts { resumed: true, ..GOOD }, Mode::Degraded, ModeReason::Restarted),
            (Facts { failed: true, ..GOOD }, Mode::Lost, ModeReason::FilterFailed),
            (Facts { initialised: false, ..GOOD }, Mode::Initialising, ModeReason::NoFix),
            (Facts { initialised: false, depth_age_us: None, ..GOOD }, Mode::Initialising, ModeReason::DepthStale),
            (Facts { attitude_age_us: Some(2_100_000), ..GOOD }, Mode::Safe, ModeReason::AttitudeStale),
            (Facts { attitude_age_us: None, mission: false, ..GOOD }, Mode::Degraded, ModeReason::AttitudeStale),
            (Facts { depth_age_us: Some(2_100_000), ..GOOD }, Mode::Safe, ModeReason::DepthStale),
            (Facts { frontseat_age_us: Some(11_000_000), ..GOOD }, Mode::Safe, ModeReason::FrontseatSilent),
            (Facts { refused_us: Some(4_000_000), ..GOOD }, Mode::Safe, ModeReason::FrontseatRefuses),
            (Facts { refused_us: Some(4_000_000), mission: false, ..GOOD }, Mode::Navigating, ModeReason::Nominal),
            (Facts { position_sigma_m: 50.0, ..GOOD }, Mode::Degraded, ModeReason::PositionUncertain),
            (Facts { position_sigma_m: 500.0, ..GOOD }, Mode::Lost, ModeReason::PositionUncertain),
            (Facts { position_sigma_m: f64::NAN, ..GOOD }, Mode::Lost, ModeReason::PositionUncertain),
            (Facts { rejections: 10, ..GOOD }, Mode::Degraded, ModeReason::Rejections),
        ];
        for (facts, mode, reason) in cases {
            assert_eq!(judge(&facts, &settings), (mode, reason), "{facts:?}");
        }
    }

    #[test]
    fn what_ended_a_mission_stays_until_the_next() {
        let settings = AppSettings::DEFAULT;
        let mut modes = Modes::new();
        assert!(!modes.ready());
        assert!(!modes.update(&GOOD, &settings));
        assert!(modes.update(&Facts { depth_age_us: None, ..GOOD }, &settings));
        assert!(!modes.update(&Facts { mission: false, ..GOOD }, &settings));
        assert_eq!(modes.present(), (Mode::Safe, ModeReason::DepthStale));
        assert!(modes.ready());
        modes.started();
        assert_eq!(modes.present(), (Mode::Navigating, ModeReason::Nominal));
    }
}
