//! The receiver against its own motion: do its fixes go where its speed over ground says?
//!
//! The speed over ground comes from the Doppler of the carriers, the fixes from the travel times of the codes. Whoever
//! draws a receiver off by its codes, or a receiver that loses its corrections, moves the fixes and not the speed. What
//! the fixes have moved more than the speed is summed and forgotten within [`MEMORY_S`].

/// A receiver is drawn off slowly so as not to be noticed: 0.3 m/s for 100 s (Humphreys et al. 2008).
const MEMORY_S: f64 = 100.0;
/// A constant error of the speed, m/s: `$GPRMC` has it in tenths of a knot.
const ROUNDING_MPS: f64 = 0.026;
/// So many sigmas are a contradiction.
const GATE_SIGMAS: f64 = 5.0;

#[derive(Clone, Copy, Debug)]
struct Last {
    time_us: u64,
    position_m: [f64; 2],
    velocity_mps: [f64; 2],
}

/// What fixes and speed have come apart by.
#[derive(Clone, Copy, Debug, Default)]
pub struct Walk {
    last: Option<Last>,
    apart_m: [f64; 2],
}

impl Walk {
    /// Before the first fix.
    pub const NEW: Self = Self { last: None, apart_m: [0.0; 2] };

    /// Starts again: the ship is elsewhere.
    pub fn clear(&mut self) {
        *self = Self::NEW;
    }

    /// A fix with its speed over ground and the sigmas of both per axis. By how much the fixes have moved without the
    /// ship, north and east, m, where that is a contradiction; it is then forgotten here.
    pub fn take(
        &mut self,
        time_us: u64,
        position_m: [f64; 2],
        velocity_mps: [f64; 2],
        [fix_m, speed_mps]: [f64; 2],
    ) -> Option<[f64; 2]> {
        let last = self.last.replace(Last { time_us, position_m, velocity_mps })?;
        let step_s = time_us.saturating_sub(last.time_us) as f64 * 1.0e-6;
        if step_s <= 0.0 || step_s > MEMORY_S {
            self.apart_m = [0.0; 2];
            return None;
        }
        let kept = libm::exp(-step_s / MEMORY_S);
        for axis in 0..2 {
            let moved_m = position_m[axis] - last.position_m[axis];
            let sailed_m = 0.5 * step_s * (velocity_mps[axis] + last.velocity_mps[axis]);
            self.apart_m[axis] = kept * self.apart_m[axis] + moved_m - sailed_m;
        }
        // two fixes; the speed's noise of each step; its rounding, which may last
        let rounding_m = ROUNDING_MPS * MEMORY_S;
        let noise = speed_mps * speed_mps * step_s * MEMORY_S * 0.5;
        let limit = GATE_SIGMAS * libm::sqrt(2.0 * fix_m * fix_m + noise + rounding_m * rounding_m);
        (libm::hypot(self.apart_m[0], self.apart_m[1]) > limit).then(|| core::mem::take(&mut self.apart_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first contradiction of a ship that goes north at 2.05 m/s, told as 2.06 (4.0 knots), while its fixes are drawn
    /// east from 300 s on: when, s, and how far, m.
    fn first(drawn_mps: f64) -> Option<(u64, f64)> {
        let mut walk = Walk::NEW;
        (0..1200).find_map(|second| {
            let time_s = second as f64;
            let noise = 1.5 * libm::sin(17.0 * time_s);
            let fix = [2.05 * time_s + noise, drawn_mps * (time_s - 300.0).max(0.0) - noise];
            let apart = walk.take(second * 1_000_000, fix, [2.06, 0.0], [1.5, 0.1])?;
            Some((second, apart[1]))
        })
    }

    #[test]
    fn val_a_receiver_that_is_drawn_off_is_noticed_and_a_rounded_speed_is_not() {
        assert_eq!(first(0.0), None);
        let (second, east_m) = first(0.3).unwrap();
        // 0.3 m/s · 100 s · (1 − e^(−t/100)) reaches 5 · √(2 · 1.5² + 0.5 + 2.6²) = 17 m after 84 s
        assert!((370..400).contains(&second) && (14.0..21.0).contains(&east_m), "{second} s, {east_m} m");
        assert_eq!(first(0.05), None, "5 m within the memory are the receiver's own slow error");
    }

    #[test]
    fn a_gap_starts_it_again() {
        let mut walk = Walk::NEW;
        assert_eq!(walk.take(0, [0.0; 2], [0.0; 2], [1.0, 0.1]), None);
        assert_eq!(walk.take(200_000_000, [100.0, 0.0], [0.0; 2], [1.0, 0.1]), None);
        assert_eq!(walk.take(201_000_000, [100.0, 0.0], [0.0; 2], [1.0, 0.1]), None);
        assert_eq!(walk.take(202_000_000, [150.0, 0.0], [0.0; 2], [1.0, 0.1]), Some([50.0, 0.0]));
    }
}
