//! Requests to the board beside its telemetry: identity, images, counters, mission and parameters.
//!
//! One question at a time and none that changes anything, so that a slow line or a program that steers the same board
//! is not disturbed.

use backseat_wire::hostlink::ToBoard;
use std::collections::VecDeque;

/// An answer that takes longer is lost.
const PATIENCE_US: u64 = 1_000_000;
/// Time between two requests until everything was answered once.
const HASTE_US: u64 = 20_000;
/// And then: all parameters take half a minute.
const LEISURE_US: u64 = 150_000;
/// The counters.
const HEALTH_US: u64 = 1_000_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    Hello,
    Health,
    Images,
    Waypoint(u16),
    Parameter(u16),
}

/// Which question is next.
#[derive(Default)]
pub struct Enquiry {
    asked: Option<(Question, u64)>,
    health_us: u64,
    next: VecDeque<Question>,
    /// Everything was answered since the start or the last [`Self::hurry`].
    complete: bool,
    next_us: u64,
}

impl Enquiry {
    /// A new connection, perhaps to another board: everything again.
    pub fn restart(&mut self) {
        *self = Self::default();
        self.next.push_back(Question::Hello);
    }

    /// Much may have changed.
    pub fn hurry(&mut self) {
        self.complete = false;
        self.next.clear();
    }

    /// What to send now.
    pub fn due(&mut self, now_us: u64) -> Option<ToBoard<'static>> {
        if let Some((question, asked_us)) = self.asked {
            if now_us < asked_us + PATIENCE_US {
                return None;
            }
            // the mission and the parameters come round again
            if question == Question::Hello {
                self.next.push_front(question);
            }
            self.asked = None;
        }
        if now_us < self.next_us {
            return None;
        }
        let question = if now_us >= self.health_us {
            self.health_us = now_us + HEALTH_US;
            Question::Health
        } else {
            self.next.pop_front().unwrap_or_else(|| self.another_round())
        };
        self.asked = Some((question, now_us));
        self.next_us = now_us + if self.complete { LEISURE_US } else { HASTE_US };
        Some(match question {
            Question::Hello => ToBoard::Hello,
            Question::Health => ToBoard::HealthGet,
            Question::Images => ToBoard::UpdateGet,
            Question::Waypoint(index) => ToBoard::MissionGet { index },
            Question::Parameter(index) => ToBoard::ParameterGet { index },
        })
    }

    /// Images, mission and parameters once more.
    fn another_round(&mut self) -> Question {
        self.next.extend([Question::Waypoint(0), Question::Parameter(0)]);
        Question::Images
    }

    fn answered(&mut self, question: Question) {
        if self.asked.is_some_and(|(asked, _)| asked == question) {
            self.asked = None;
        }
    }

    pub fn hello(&mut self) {
        self.answered(Question::Hello);
    }

    pub fn health(&mut self) {
        self.answered(Question::Health);
    }

    /// Or the refusal of a board without a second bank.
    pub fn images(&mut self) {
        self.answered(Question::Images);
    }

    /// A waypoint of `count`.
    pub fn waypoint(&mut self, index: u16, count: u16) {
        self.answered(Question::Waypoint(index));
        self.next_of(index, count, Question::Waypoint);
    }

    /// A parameter of `count`.
    pub fn parameter(&mut self, index: u16, count: u16) {
        self.answered(Question::Parameter(index));
        self.next_of(index, count, Question::Parameter);
        self.complete |= index.checked_add(1) == Some(count);
    }

    /// The one behind `index`, if there is one: an answer to another program may have any index.
    fn next_of(&mut self, index: u16, count: u16, question: fn(u16) -> Question) {
        if let Some(next) = index.checked_add(1).filter(|next| *next < count) {
            self.next.push_front(question(next));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_asked_at_once_and_then_at_leisure() {
        const COUNT: u16 = 200;
        let mut enquiry = Enquiry::default();
        enquiry.restart();
        let (mut now_us, mut hellos, mut healths, mut waypoints, mut parameters) = (0, 0, 0, Vec::new(), Vec::new());
        while now_us < 60_000_000 {
            now_us += 10_000;
            if now_us == 50_000_000 {
                enquiry.hurry();
            }
            match enquiry.due(now_us) {
                Some(ToBoard::Hello) => {
                    hellos += 1;
                    enquiry.hello();
                }
                Some(ToBoard::HealthGet) => {
                    healths += 1;
                    enquiry.health();
                }
                Some(ToBoard::UpdateGet) => enquiry.images(),
                Some(ToBoard::MissionGet { index }) => {
                    waypoints.push(index);
                    enquiry.waypoint(index, 3);
                }
                Some(ToBoard::ParameterGet { index }) => {
                    parameters.push((index, now_us));
                    enquiry.parameter(index, COUNT);
                }
                Some(other) => panic!("{other:?} may change something"),
                None => {}
            }
        }
        assert_eq!(hellos, 1);
        assert!((58..=61).contains(&healths), "{healths}");
        assert!(waypoints.starts_with(&[0, 1, 2, 0, 1, 2, 0, 1, 2]), "{waypoints:?}");
        let asked: Vec<u64> =
            parameters.iter().filter(|(index, _)| *index == COUNT - 1).map(|(_, us)| us / 1_000_000).collect();
        // 207 questions at 20 ms, then at 150 ms between the counters; begun anew at 50 s
        assert_eq!(asked.len(), 3, "{asked:?}");
        assert!(
            (4..=5).contains(&asked[0]) && (34..=44).contains(&asked[1]) && (54..=55).contains(&asked[2]),
            "{asked:?}"
        );
    }

    /// `check` asks for a waypoint that cannot be, to learn how many there are.
    #[test]
    fn an_answer_to_another_program_may_have_any_index() {
        let mut enquiry = Enquiry::default();
        enquiry.parameter(u16::MAX, 200);
        enquiry.waypoint(u16::MAX, 3);
        assert!(enquiry.next.is_empty() && !enquiry.complete);
    }

    #[test]
    fn a_board_that_does_not_answer_is_asked_once_a_second() {
        let mut enquiry = Enquiry::default();
        enquiry.restart();
        let asked = (0..1000).filter(|i| enquiry.due(i * 10_000).is_some()).count();
        assert_eq!(asked, 10);
    }
}
