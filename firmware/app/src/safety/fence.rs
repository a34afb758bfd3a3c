//! The fence that comes with a mission: a polygon that mission and vehicle do not leave.

use backseat_core::control::mission::Mission;
use backseat_wire::hostlink::{MAX_FENCE_CORNERS, Refusal};
use heapless::Vec;

/// North and east, m.
type Place = [f64; 2];

/// A simple polygon, convex or not; without corners there is none, and everything is inside.
#[derive(Clone, Debug)]
pub struct Fence {
    /// North and east, m.
    pub corners_m: Vec<Place, MAX_FENCE_CORNERS>,
}

impl Fence {
    pub const fn new() -> Self {
        Self { corners_m: Vec::new() }
    }

    pub fn clear(&mut self) {
        self.corners_m.clear();
    }

    /// Another corner.
    ///
    /// # Errors
    /// No place, or one corner too many.
    pub fn push(&mut self, corner_m: Place) -> Result<(), Refusal> {
        if !corner_m.iter().all(|x_m| x_m.is_finite() && x_m.abs() <= Mission::MAX_COORDINATE_M) {
            return Err(Refusal::OutOfRange);
        }
        self.corners_m.push(corner_m).map_err(|_| Refusal::Sequence)
    }

    /// Each edge, from corner to corner and back to the first.
    fn edges(&self) -> impl Iterator<Item = [Place; 2]> {
        let next = self.corners_m.iter().cycle().skip(1);
        self.corners_m.iter().zip(next).map(|(from, to)| [*from, *to])
    }

    /// There is none, or it is a simple polygon: three corners at least, and no two edges meet but at their corner.
    pub fn is_sound(&self) -> bool {
        let count = self.corners_m.len();
        if count < 3 {
            return count == 0;
        }
        self.edges().enumerate().all(|(index, edge)| {
            self.edges().enumerate().skip(index + 1).all(|(other, later)| {
                let is_next = other == index + 1;
                let is_before = index == 0 && other + 1 == count;
                match (is_next, is_before) {
                    // they share a corner: they may not fold back
                    (true, _) => !folds(edge, later),
                    (_, true) => !folds(later, edge),
                    _ => !meet(edge, later),
                }
            })
        })
    }

    /// Whether a place is inside; one that is no number is not.
    pub fn contains(&self, [x, y]: Place) -> bool {
        if self.corners_m.is_empty() {
            return true;
        }
        // from the place eastwards, an odd number of edges
        self.edges().fold(false, |inside, [[xa, ya], [xb, yb]]| {
            let crosses = (xa > x) != (xb > x) && y < ya + (x - xa) / (xb - xa) * (yb - ya);
            inside != crosses
        })
    }

    /// Whether a straight leg stays inside: both ends, and it meets no edge.
    pub fn contains_leg(&self, from: Place, to: Place) -> bool {
        self.contains(from) && self.contains(to) && !self.edges().any(|edge| meet([from, to], edge))
    }
}

/// Twice the area of the triangle; its sign says on which side of the line the place lies.
fn side([[xa, ya], [xb, yb]]: [Place; 2], [x, y]: Place) -> f64 {
    (xb - xa) * (y - ya) - (yb - ya) * (x - xa)
}

/// Whether a place on the line of a segment lies on the segment.
fn between([a, b]: [Place; 2], place: Place) -> bool {
    a.iter().zip(&b).zip(&place).all(|((a, b), x)| a.min(*b) <= *x && *x <= a.max(*b))
}

/// Whether two segments cross or touch.
fn meet(one: [Place; 2], other: [Place; 2]) -> bool {
    let [a, b] = one.map(|place| side(other, place));
    let [c, d] = other.map(|place| side(one, place));
    let opposite = |p: f64, q: f64| (p > 0.0 && q < 0.0) || (p < 0.0 && q > 0.0);
    let touches = |side: f64, segment, place| side == 0.0 && between(segment, place);
    (opposite(a, b) && opposite(c, d))
        || touches(a, other, one[0])
        || touches(b, other, one[1])
        || touches(c, one, other[0])
        || touches(d, one, other[1])
}

/// Whether an edge has no length, or runs back along the one before it.
fn folds([a, b]: [Place; 2], [_, c]: [Place; 2]) -> bool {
    let [[ux, uy], [vx, vy]] = [[b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]];
    let empty = (ux == 0.0 && uy == 0.0) || (vx == 0.0 && vy == 0.0);
    empty || (ux * vy - uy * vx == 0.0 && ux * vx + uy * vy < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fence(corners_m: &[Place]) -> Fence {
        let mut fence = Fence::new();
        corners_m.iter().for_each(|corner| fence.push(*corner).unwrap());
        fence
    }

    /// A bay: 100 m by 100 m, with a headland from the north that reaches down to x = 30 m.
    const BAY: [Place; 7] =
        [[0.0, 0.0], [100.0, 0.0], [100.0, 40.0], [30.0, 50.0], [100.0, 60.0], [100.0, 100.0], [0.0, 100.0]];

    #[test]
    fn val_places_inside_and_outside_by_hand() {
        let bay = fence(&BAY);
        for inside in [[1.0, 1.0], [90.0, 10.0], [90.0, 90.0], [29.0, 50.0], [50.0, 45.0]] {
            assert!(bay.contains(inside), "{inside:?}");
        }
        for outside in [[90.0, 50.0], [31.0, 50.0], [-1.0, 50.0], [50.0, 101.0], [101.0, 10.0], [f64::NAN, 5.0]] {
            assert!(!bay.contains(outside), "{outside:?}");
        }
        assert!(Fence::new().contains([1e9, f64::NAN]), "none");
    }

    #[test]
    fn val_a_leg_across_the_headland_leaves_the_bay() {
        let bay = fence(&BAY);
        assert!(bay.contains_leg([90.0, 10.0], [20.0, 50.0]));
        assert!(!bay.contains_leg([90.0, 10.0], [90.0, 90.0]), "both ends are inside");
        assert!(!bay.contains_leg([30.0, 10.0], [30.0, 90.0]), "it touches the headland");
        assert!(!bay.contains_leg([20.0, 10.0], [-20.0, 10.0]));
        // whichever way round the corners are written
        let mut other = BAY;
        other.reverse();
        assert!(fence(&other).contains_leg([90.0, 10.0], [20.0, 50.0]));
    }

    #[test]
    fn what_is_no_simple_polygon() {
        assert!(Fence::new().is_sound() && fence(&BAY).is_sound());
        let cases: [&[Place]; 7] = [
            &[[0.0, 0.0]],
            &[[0.0, 0.0], [10.0, 0.0]],
            // an hourglass
            &[[0.0, 0.0], [10.0, 10.0], [10.0, 0.0], [0.0, 10.0]],
            // a corner twice
            &[[0.0, 0.0], [10.0, 0.0], [10.0, 0.0], [0.0, 10.0]],
            // there and back
            &[[0.0, 0.0], [10.0, 0.0], [5.0, 0.0]],
            // the last edge comes back along the first
            &[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [5.0, 0.0]],
            // a corner on another edge
            &[[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [5.0, 0.0], [0.0, 10.0]],
        ];
        for corners_m in cases {
            assert!(!fence(corners_m).is_sound(), "{corners_m:?}");
        }
        let mut full = fence(&[[0.0, 0.0]; MAX_FENCE_CORNERS]);
        assert_eq!(full.push([1.0, 1.0]), Err(Refusal::Sequence));
        assert_eq!(Fence::new().push([f64::NAN, 0.0]), Err(Refusal::OutOfRange));
        assert_eq!(Fence::new().push([0.0, 1.1e5]), Err(Refusal::OutOfRange));
    }
}
