//! Asking the water: where two causes stay open, the manoeuvre that tells them apart, flown on a leg and ended.
//!
//! It begins only while navigation is nominal, on the line and far enough from its end, and ends with any other mode, leg
//! or return. What came of it is told two minutes later, when what it moved has been weighed.

use crate::held::Held;
use crate::parameters::{AppSettings, ControlMode, Separate};
use backseat_core::control::mission::Mission;
use backseat_core::control::trackline::Segment;
use backseat_core::control::{Aside, MANOEUVRES, Manoeuvre};
use backseat_core::navigation::naming::Cause;
use backseat_core::state::VehicleState;
use backseat_wire::hostlink::Question;

/// Most manoeuvres of one mission.
const MOST: u8 = 4;
/// From the end of one to the next, µs: five minutes.
const PAUSE_US: u64 = 300_000_000;
/// Where none is worth it, the causes are looked at again after this time, µs.
const AGAIN_US: u64 = 20_000_000;
/// What it was good for is told so long after its end, µs.
const WEIGHED_US: u64 = 120_000_000;
/// The odds are expected to change by e to this power, or it is not flown: twentyfold.
const LEAST_GAIN: f64 = 3.0;
/// At most so far from line and depth, m.
const OFF_LINE_M: f64 = 5.0;
const OFF_DEPTH_M: f64 = 0.5;
/// What is left of the leg behind the manoeuvre, m.
const LEFT_M: f64 = 40.0;
/// No leg that is shallower, m: naming rests above 2 m.
const LEAST_DEPTH_M: f64 = 2.5;

/// One under way, or not weighed yet.
struct Asked {
    question: Question,
    causes: [Cause; 2],
    manoeuvre: Manoeuvre,
    begun_us: u64,
    leg: u16,
    /// It is over since, µs; 0: it is being flown.
    over_us: u64,
}

/// What is asked, and how often it was.
pub struct Separation {
    asked: Held<Asked>,
    count: u8,
    next_us: u64,
    /// The last question.
    question: Held<Question>,
}

/// What has come of a step.
pub struct SeparationStep {
    /// The departure from the leg.
    pub aside: Option<Aside>,
    /// There is something new to tell.
    pub is_news: bool,
}

impl Separation {
    pub const fn new() -> Self {
        Self { asked: Held::none(), count: 0, next_us: 0, question: Held::none() }
    }

    /// The last question, and what came of it.
    pub fn question(&self) -> Option<Question> {
        self.question.get().copied()
    }

    /// Two causes may be told apart now, if a manoeuvre is worth it.
    pub fn may_ask(&self, now_us: u64, settings: &AppSettings) -> bool {
        self.asked.get().is_none()
            && settings.separate != Separate::Never
            && settings.control_mode == ControlMode::Direct
            && self.count < MOST
            && now_us >= self.next_us
    }

    /// Chooses the manoeuvre with the largest gain of those that the leg has room for, and begins it.
    #[allow(clippy::too_many_arguments)]
    pub fn ask(
        &mut self,
        now_us: u64,
        (leg, segment): (u16, &Segment),
        x: &VehicleState,
        permitted: Separate,
        causes: [Cause; 2],
        odds: f64,
        gain: impl Fn(Manoeuvre) -> f64,
    ) {
        self.next_us = now_us.saturating_add(AGAIN_US);
        let mut best = (LEAST_GAIN, None);
        for manoeuvre in MANOEUVRES {
            let stays = permitted == Separate::Free || !manoeuvre.leaves_line();
            if stays && has_room(manoeuvre, segment, x) {
                let gain = gain(manoeuvre);
                if gain > best.0 {
                    best = (gain, Some(manoeuvre));
                }
            }
        }
        let (expected, Some(manoeuvre)) = best else { return };
        self.count += 1;
        let question = Question {
            time_us: now_us,
            causes: causes.map(Cause::number),
            manoeuvre: manoeuvre.number(),
            expected: expected as f32,
            before: odds as f32,
            after: None,
        };
        self.question.set(question);
        self.asked.set(Asked { question, causes, manoeuvre, begun_us: now_us, leg, over_us: 0 });
    }

    /// One step. `leg`: that is flown while nothing else is asked of the vehicle; `odds`: between two causes.
    pub fn step(&mut self, now_us: u64, leg: Option<u16>, odds: impl Fn([Cause; 2]) -> f64) -> SeparationStep {
        let mut flown = SeparationStep { aside: None, is_news: false };
        let Some(asked) = self.asked.get_mut() else { return flown };
        if asked.over_us == 0 {
            let t_s = now_us.saturating_sub(asked.begun_us) as f64 * 1e-6;
            flown.is_news = now_us == asked.begun_us;
            if leg == Some(asked.leg) && t_s < asked.manoeuvre.duration_s() {
                flown.aside = Some(asked.manoeuvre.aside(t_s));
            } else {
                asked.over_us = now_us;
                self.next_us = now_us.saturating_add(PAUSE_US);
            }
        } else if now_us.saturating_sub(asked.over_us) >= WEIGHED_US {
            self.question.set(Question { after: Some(odds(asked.causes) as f32), ..asked.question });
            self.asked.clear();
            flown.is_news = true;
        }
        flown
    }
}

/// The vehicle is on its leg, and the leg has room for the manoeuvre.
fn has_room(manoeuvre: Manoeuvre, leg: &Segment, x: &VehicleState) -> bool {
    let error = leg.error(x);
    let aside = manoeuvre.aside(0.0).of(leg);
    let later = manoeuvre.aside(0.9 * manoeuvre.duration_s()).of(leg);
    let speeds = [aside.speed_mps, later.speed_mps];
    let needed_m = manoeuvre.duration_s() * speeds[0].max(speeds[1]) + LEFT_M;
    error.cross_m.abs() < OFF_LINE_M
        && error.depth_m.abs() < OFF_DEPTH_M
        && error.along_m > LEFT_M
        && error.remaining_m > needed_m
        && aside.depth_m >= LEAST_DEPTH_M
        && speeds.iter().all(|speed| (Mission::MIN_SPEED_MPS..=Mission::MAX_SPEED_MPS).contains(speed))
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::state::{X, Z};

    const CAUSES: [Cause; 2] = [Cause::FinLost(0), Cause::FinStuck(0)];
    const LEG: Segment = Segment { from_ne_m: [0.0; 2], to_ne_m: [500.0, 0.0], depth_m: 3.0, speed_mps: 1.0 };
    const S: u64 = 1_000_000;

    fn at(north_m: f64) -> VehicleState {
        let mut x = VehicleState::zeros();
        (x[X], x[Z]) = (north_m, 3.0);
        x
    }

    fn asked(permitted: Separate, north_m: f64, gain: impl Fn(Manoeuvre) -> f64) -> Option<u8> {
        let mut own = Separation::new();
        own.ask(S, (2, &LEG), &at(north_m), permitted, CAUSES, 0.5, gain);
        own.question().map(|question| question.manoeuvre)
    }

    #[test]
    fn the_best_is_chosen_where_it_is_permitted_worth_it_and_has_room() {
        let turn = |manoeuvre| if manoeuvre == Manoeuvre::Turn { 9.0 } else { 4.0 };
        assert_eq!(asked(Separate::Free, 200.0, turn), Some(Manoeuvre::Turn.number()));
        assert_eq!(asked(Separate::OnLegs, 200.0, turn), Some(Manoeuvre::Speed.number()));
        assert_eq!(asked(Separate::Free, 200.0, |_| 2.9), None);
        assert_eq!(asked(Separate::Free, 200.0, |_| f64::NAN), None);
        assert_eq!(asked(Separate::Free, 440.0, turn), Some(Manoeuvre::Rudder.number()));
        assert_eq!(asked(Separate::Free, 460.0, turn), None);
        assert_eq!(asked(Separate::Free, 10.0, turn), None);
    }

    #[test]
    fn nothing_is_asked_with_never_nor_too_often() {
        let mut settings = AppSettings::DEFAULT;
        assert!(!Separation::new().may_ask(0, &settings), "the default is never");
        settings.separate = Separate::OnLegs;
        let mut own = Separation::new();
        let mut begun = 0;
        for now_us in (0..4000).map(|second| second * S) {
            if own.may_ask(now_us, &settings) {
                own.ask(now_us, (2, &LEG), &at(200.0), settings.separate, CAUSES, 0.5, |_| 5.0);
                begun += 1;
            }
            own.step(now_us, Some(2), |_| 0.0);
        }
        assert_eq!(begun, MOST);
    }

    #[test]
    fn it_is_told_flown_ended_early_and_weighed() {
        let begin = || {
            let mut own = Separation::new();
            own.ask(S, (2, &LEG), &at(200.0), Separate::OnLegs, CAUSES, 0.5, |_| 5.0);
            own
        };
        let mut own = begin();
        let first = own.step(S, Some(2), |_| 0.0);
        assert!(first.is_news && first.aside == Some(Manoeuvre::Speed.aside(0.0)));
        assert!(own.step(40 * S, Some(2), |_| 0.0).aside.is_some());
        assert!(own.step(41 * S, Some(2), |_| 0.0).aside.is_none());
        assert!(!own.step(160 * S, Some(2), |_| 6.0).is_news);
        assert!(own.step(161 * S, Some(2), |_| 6.0).is_news);
        let question = own.question().unwrap();
        assert_eq!((question.expected, question.before, question.after), (5.0, 0.5, Some(6.0)));
        // another leg, or another mode
        for leg in [Some(3), None] {
            let mut own = begin();
            own.step(S, Some(2), |_| 0.0);
            assert!(own.step(5 * S, leg, |_| 0.0).aside.is_none());
            assert!(own.step(6 * S, Some(2), |_| 0.0).aside.is_none(), "it does not go on");
        }
    }
}
