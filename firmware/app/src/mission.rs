//! The mission transfer of the host link: begin, items and corners of the fence in order, commit.

use crate::safety::Fence;
use backseat_core::control::mission::{MAX_WAYPOINTS, Mission, Waypoint};
use backseat_wire::hostlink::{self, MAX_FENCE_CORNERS, Refusal};

/// A mission on its way in.
#[derive(Debug)]
pub struct MissionTransfer {
    staged: Mission,
    /// How many waypoints were announced; 0 while no transfer is open.
    count: u16,
    staged_fence: Fence,
    /// How many corners were announced.
    corners: u8,
}

impl MissionTransfer {
    pub const fn new() -> Self {
        Self { staged: Mission::new(), count: 0, staged_fence: Fence::new(), corners: 0 }
    }

    /// Opens a transfer; one that was open is forgotten.
    pub fn begin(&mut self, count: u16) -> Result<(), Refusal> {
        self.staged.clear();
        self.staged_fence.clear();
        (self.count, self.corners) = (0, 0);
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

    /// The next corner of the fence; the last one again is taken as a repetition.
    pub fn corner(&mut self, index: u8, count: u8, corner_m: [f64; 2]) -> Result<(), Refusal> {
        let have = &self.staged_fence.corners_m;
        let announced = if have.is_empty() { count } else { self.corners };
        if self.count == 0 || count != announced || index >= count || usize::from(count) > MAX_FENCE_CORNERS {
            return Err(Refusal::Sequence);
        }
        if usize::from(index) + 1 == have.len() && have.last() == Some(&corner_m) {
            return Ok(());
        }
        if usize::from(index) != have.len() {
            return Err(Refusal::Sequence);
        }
        self.corners = count;
        self.staged_fence.push(corner_m)
    }

    /// The complete mission and its fence; the transfer is over either way.
    pub fn commit(&mut self) -> Result<(&Mission, &Fence), Refusal> {
        let complete = self.count > 0
            && self.staged.waypoints().len() == usize::from(self.count)
            && self.staged_fence.corners_m.len() == usize::from(self.corners);
        self.count = 0;
        match (complete, self.staged_fence.is_sound()) {
            (false, _) => Err(Refusal::Sequence),
            (_, false) => Err(Refusal::Fence),
            _ => Ok((&self.staged, &self.staged_fence)),
        }
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
        assert_eq!(transfer.commit().map(|(mission, _)| mission.waypoints().len()), Ok(1));
        assert_eq!(transfer.commit().err(), Some(Refusal::Sequence));
    }

    #[test]
    fn a_fence_comes_whole_or_the_mission_does_not() {
        const CORNERS: [[f64; 2]; 3] = [[0.0, -50.0], [100.0, 0.0], [0.0, 50.0]];
        let mut transfer = MissionTransfer::new();
        assert_eq!(transfer.corner(0, 3, CORNERS[0]), Err(Refusal::Sequence), "no transfer is open");
        let mut send = |corners: &[[f64; 2]], count| {
            transfer.begin(1).unwrap();
            transfer.item(0, &A).unwrap();
            for (index, corner_m) in (0..).zip(corners) {
                transfer.corner(index, count, *corner_m)?;
                transfer.corner(index, count, *corner_m)?;
            }
            transfer.commit().map(|(_, fence)| fence.corners_m.len())
        };
        assert_eq!(send(&CORNERS, 3), Ok(3));
        assert_eq!(send(&[], 0), Ok(0), "the fence before is forgotten");
        assert_eq!(send(&CORNERS[..2], 3), Err(Refusal::Sequence));
        assert_eq!(send(&CORNERS[..2], 2), Err(Refusal::Fence));
        assert_eq!(send(&CORNERS, 33), Err(Refusal::Sequence));
        assert_eq!(send(&[[f64::INFINITY, 0.0]], 3), Err(Refusal::OutOfRange));
        transfer.begin(1).unwrap();
        assert_eq!(transfer.corner(1, 3, CORNERS[1]), Err(Refusal::Sequence));
        assert_eq!(transfer.corner(0, 3, CORNERS[0]), Ok(()));
        assert_eq!(transfer.corner(1, 4, CORNERS[1]), Err(Refusal::Sequence), "another count");
    }
}
