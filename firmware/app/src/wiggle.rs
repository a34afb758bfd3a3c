//! Fin check on the bench: one fin after the other moves to either side, the propeller stopped.

/// How far, rad: seen from across a bench, and harmless.
const ANGLE_RAD: f64 = 0.15;
/// How long to each side, µs.
const SIDE_US: u64 = 500_000;

/// A wiggle under way; it ends by itself, four fins later.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wiggle {
    /// Time of its first step, once that was taken.
    begun_us: Option<u64>,
}

impl Wiggle {
    /// Fins [top, bottom, port, starboard] at this time, rad; `None` when it is over.
    pub fn fins_rad(&mut self, now_us: u64) -> Option<[f64; 4]> {
        let begun_us = *self.begun_us.get_or_insert(now_us);
        let side = now_us.saturating_sub(begun_us) / SIDE_US;
        let mut fins_rad = [0.0; 4];
        let fin = usize::try_from(side / 2).ok()?;
        *fins_rad.get_mut(fin)? = if side.is_multiple_of(2) { ANGLE_RAD } else { -ANGLE_RAD };
        Some(fins_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_fin_to_either_side_and_then_no_more() {
        let mut wiggle = Wiggle::default();
        let seen: std::vec::Vec<_> = (0..50).map_while(|step| wiggle.fins_rad(7 + step * 100_000)).collect();
        assert_eq!(seen.len(), 40);
        for fin in 0..4 {
            for (side, angle_rad) in [(0, ANGLE_RAD), (5, -ANGLE_RAD)] {
                let mut expected = [0.0; 4];
                expected[fin] = angle_rad;
                assert_eq!(seen[10 * fin + side], expected);
            }
        }
        assert_eq!(wiggle.fins_rad(u64::MAX), None);
    }
}
