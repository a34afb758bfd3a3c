//! The water: its current at a time.

use crate::scenario::Current;
use crate::truth::Water;
use std::f64::consts::TAU;

/// The current around the vehicle at a time since the start, s.
#[must_use]
pub fn water_at(current: &Current, time_s: f64) -> Water {
    let (sin, cos) = libm::sincos(current.tide_phase_rad + TAU * time_s / current.tide_period_s);
    Water {
        surface_mps: [current.north_mps + current.tide_mps * cos, current.east_mps + current.tide_mps * sin],
        shear_mps_per_m: [current.shear_north_mps_per_m, current.shear_east_mps_per_m],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tide_turns_clockwise_once_a_period_on_top_of_the_steady_current() {
        let current = Current { east_mps: 0.1, tide_mps: 0.2, tide_period_s: 4000.0, ..Current::default() };
        let quarter = water_at(&current, 1000.0).surface_mps;
        // Rounding of sin and cos only.
        assert!((quarter[0]).abs() < 1e-15 && (quarter[1] - 0.3).abs() < 1e-15);
        let whole = water_at(&current, 4000.0).surface_mps;
        assert!((whole[0] - 0.2).abs() < 1e-15 && (whole[1] - 0.1).abs() < 1e-15);
    }

    #[test]
    fn shear_is_linear_below_the_surface() {
        let current = Current { north_mps: 0.1, shear_north_mps_per_m: -0.01, ..Current::default() };
        let water = water_at(&current, 0.0);
        assert_eq!(water.at_depth(5.0), [0.05, 0.0]);
        assert_eq!(water.at_depth(-1.0), [0.1, 0.0]);
    }
}
