//! The mission transfer of the host link: begin, items in order, commit.

use backseat_core::control::mission::{MAX_WAYPOINTS, Mission, Waypoint};
use backseat_wire::hostlink::{self, Refusal};

/// A mission on its way in.
#[derive(Debug)]
pub struct MissionTransfer {
    staged: Mission,
    /// How many waypoints were announced; 0 while no transfer is open.
    count: u16,
}

impl MissionTransfer {
    pub const fn new() -> Self {
        Self { staged: Mission::new(), count: 0 }
    }

    /// Opens a transfer; one that was open is forgotten.
    pub fn begin(&mut self, count: u16) -> Result<(), Refusal> {
        self.staged.clear();
        self.count = 0;
        if count == 0 || usize::from(count) > MAX_WAYPOINTS {
            return Err(Refusal::Sequence);
        }
        self.count = count;
        Ok(())
    }

    /// The next waypoint. The last one again is taken as a repetition (its answer was lost).
    pub fn item(&mut self, index: u16, waypoint: &hostlink::Waypoint) -> Result<(), Refusal> {
        let waypoint = from_wire(waypoint);
        let have = self.staged.waypoints();
        if index >= self.count {
            return Err(Refusal::Sequence);
        }
        if usize::from(index) + 1 == have.len() && have.last() == Some(&waypoint) {
            return Ok(());
        }
        if usize::from(index) != have.len() {
            return Err(Refusal::Sequence);
        }
        self.staged.push(waypoint).map_err(|_| Refusal::OutOfRange)
    }

    /// The complete mission; the transfer is over either way.
    pub fn commit(&mut self) -> Result<&Mission, Refusal> {
        let complete = self.count > 0 && self.staged.waypoints().len() == usize::from(self.count);
        self.count = 0;
        if complete { Ok(&self.staged) } else { Err(Refusal::Sequence) }
    }
}

fn from_wire(waypoint: &hostlink::Waypoint) -> Waypoint {
    let hostlink::Waypoint { x_m, y_m, depth_m, speed_mps } = *waypoint;
    Waypoint { x_m, y_m, depth_m, speed_mps }
}

/// As the host link shows it.
pub fn to_wire(waypoint: &Waypoint) -> hostlink::Waypoint {
    let Waypoint { x_m, y_m, depth_m, speed_mps } = *waypoint;
    hostlink::Waypoint { x_m, y_m, depth_m, speed_mps }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: hostlink::Waypoint = hostlink::Waypoint { x_m: 10.0, y_m: -5.0, depth_m: 3.0, speed_mps: 1.0 };

    #[test]
    fn in_order_and_complete_or_not_at_all() {
        let mut transfer = MissionTransfer::new();
        assert_eq!(transfer.item(0, &A), Err(Refusal::Sequence));
        assert_eq!(transfer.begin(0), Err(Refusal::Sequence));
        assert_eq!(transfer.begin(2), Ok(()));
        assert_eq!(transfer.item(1, &A), Err(Refusal::Sequence));
        assert_eq!(transfer.item(0, &A), Ok(()));
        assert_eq!(transfer.item(0, &A), Ok(()));
        assert_eq!(transfer.item(1, &hostlink::Waypoint { depth_m: -1.0, ..A }), Err(Refusal::OutOfRange));
        assert_eq!(transfer.item(1, &hostlink::Waypoint { speed_mps: f64::NAN, ..A }), Err(Refusal::OutOfRange));
        assert_eq!(transfer.commit().err(), Some(Refusal::Sequence));
        assert_eq!(transfer.begin(1), Ok(()));
        assert_eq!(transfer.item(0, &A), Ok(()));
        assert_eq!(transfer.item(1, &A), Err(Refusal::Sequence));
        assert_eq!(transfer.commit().map(|mission| mission.waypoints().len()), Ok(1));
        assert_eq!(transfer.commit().err(), Some(Refusal::Sequence));
    }
}
