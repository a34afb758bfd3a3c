//! The mission, its legs, and who steers.

use super::{Model, Severity, words};
use backseat_wire::hostlink::{Held, Mode, Steered, Telemetry, Waypoint};

/// A board says it every ten seconds while a host steers: what is older was not heard to end, µs.
const LASTS_US: u64 = 12_000_000;

impl Model {
    /// What the vehicle holds as a host asked for, instead of its leg.
    pub fn helm(&self) -> Option<Held> {
        let (steered, record) = (self.steered?, self.telemetry.as_ref()?);
        let is_told = record.leg.is_some() && record.time_us.saturating_sub(steered.time_us) < LASTS_US;
        steered.by_host.filter(|_| is_told)
    }

    pub(super) fn steered(&mut self, steered: Steered) {
        let before = self.helm();
        self.steered = Some(steered);
        if before.is_some() != steered.by_host.is_some() {
            self.note(Severity::Info, words::steered(steered.by_host.as_ref()));
        }
    }

    pub(super) fn leg_changed(&mut self, before: Option<u16>, record: &Telemetry) {
        match (before, record.leg) {
            (None, Some(leg)) => {
                self.enquiry.hurry();
                self.note(Severity::Info, format!("mission under way, leg {}", leg + 1));
            }
            (Some(_), None) if record.mode == Mode::Navigating || record.mode == Mode::Degraded => {
                self.note(Severity::Info, "mission flown to its end".into());
            }
            (Some(_), None) => self.note(Severity::Warning, "mission ended before its time".into()),
            (Some(before), Some(leg)) if before != leg => self.note(Severity::Info, format!("leg {}", leg + 1)),
            _ => {}
        }
    }

    pub(super) fn waypoint(&mut self, index: u16, count: u16, waypoint: Option<Waypoint>) {
        self.enquiry.waypoint(index, count);
        let (index, count) = (usize::from(index), usize::from(count));
        match waypoint {
            Some(waypoint) if index < self.mission.len() => self.mission[index] = waypoint,
            // in order, so that none is missing in between
            Some(waypoint) if index == self.mission.len() => self.mission.push(waypoint),
            _ => {}
        }
        self.mission.truncate(count);
    }
}
