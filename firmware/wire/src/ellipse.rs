//! Shape of the error ellipse of a position, in 14 bits.
//!
//! | bits | meaning |
//! |---|---|
//! | 0 to 4 | shorter over longer half axis: 2^(-n/6), rounded up |
//! | 5 to 13 | bearing of the longer half axis, 1/512 of half a turn |
//!
//! All zero is [`Ellipse::CIRCLE`]. Of what is rounded, the half axes are widened by as much as covers the bearing's
//! rounding, so that the ellipse that is read holds the one that was written.

use core::f64::consts::{LN_2, PI};

/// The longer half axis is widened by this factor, ...
const WIDER: f64 = 1.005;
/// ... and the square of the shorter one by this share of the square of the longer one: the two cover half a step of
/// the bearing, 3 mrad.
const ROUNDER: f64 = 0.001;
const OCTAVE: f64 = 6.0;
const MOST: u16 = 31;
const BEARINGS: f64 = 512.0;

/// An error ellipse but for its size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Shorter over longer half axis, 0 to 1.
    pub share: f64,
    /// Bearing of the longer half axis, rad, [0, pi).
    pub bearing_rad: f64,
}

impl Ellipse {
    /// The same in all directions.
    pub const CIRCLE: Self = Self { share: 1.0, bearing_rad: 0.0 };

    /// One sigma along the longer half axis, m, and shape, of variance north, covariance, variance east, m²; both wide
    /// enough to be rounded.
    #[must_use]
    pub fn of([north, cross, east]: [f64; 3]) -> (f64, Self) {
        let (mean, half) = (0.5 * (north + east), libm::hypot(0.5 * (north - east), cross));
        let (major, minor) = (mean + half, (mean - half).max(0.0) + ROUNDER * (mean + half));
        let bearing_rad = 0.5 * libm::atan2(2.0 * cross, north - east);
        let share = libm::sqrt(minor / major).min(1.0);
        let share = if share.is_nan() { 1.0 } else { share };
        (
            WIDER * libm::sqrt(major),
            Self { share, bearing_rad: if bearing_rad < 0.0 { bearing_rad + PI } else { bearing_rad } },
        )
    }

    /// Variance north, covariance, variance east, m², of one sigma along the longer half axis.
    #[must_use]
    pub fn covariance_m2(&self, sigma_m: f64) -> [f64; 3] {
        let (sin, cos) = libm::sincos(self.bearing_rad);
        let (major, minor) = (sigma_m * sigma_m, sigma_m * sigma_m * self.share * self.share);
        [major * cos * cos + minor * sin * sin, (major - minor) * sin * cos, major * sin * sin + minor * cos * cos]
    }

    pub(crate) fn read(bits: u16) -> Self {
        let share = libm::exp(-f64::from(bits & MOST) * LN_2 / OCTAVE);
        Self { share, bearing_rad: f64::from(bits >> 5 & 511) * (PI / BEARINGS) }
    }

    /// The margin keeps what was read where it was.
    pub(crate) fn bits(&self) -> u16 {
        // casts saturate
        let steps = (libm::floor(1.0e-9 - OCTAVE / LN_2 * libm::log(self.share)) as u16).min(MOST);
        let bearing = libm::round(self.bearing_rad * (BEARINGS / PI)) as u16 & 511;
        steps | bearing << 5
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_half_axes_and_bearing() {
        // half axes of 5 and 3 m at 30 degrees: 25 · 3/4 + 9 / 4 = 21, 16 · √3/4 = 6.93, 25 / 4 + 9 · 3/4 = 13
        let (sigma_m, ellipse) = Ellipse::of([21.0, 4.0 * libm::sqrt(3.0), 13.0]);
        assert!((sigma_m - 5.025).abs() < 1e-9 && (ellipse.share - libm::sqrt(9.025 / 25.0)).abs() < 1e-9);
        assert!((ellipse.bearing_rad - PI / 6.0).abs() < 1e-9, "{ellipse:?}");
        assert_eq!(Ellipse::of([0.0; 3]), (0.0, Ellipse::CIRCLE));
        assert_eq!(Ellipse::read(0), Ellipse::CIRCLE);
        for bits in 0..1 << 14 {
            assert_eq!(Ellipse::read(bits).bits(), bits);
        }
    }

    /// The difference of what is read and what was written has no negative half axis, and is not large.
    #[test]
    fn val_what_is_read_holds_what_was_written() {
        for place in 0..20_000 {
            let place = f64::from(place);
            let (angle, ratio) = (place * 0.618, libm::exp(-(place * 0.317 % 5.0)));
            let (sin, cos) = libm::sincos(angle);
            let minor = ratio * ratio;
            let truth = [cos * cos + minor * sin * sin, (1.0 - minor) * sin * cos, sin * sin + minor * cos * cos];
            let (sigma_m, ellipse) = Ellipse::of(truth);
            let read = Ellipse::read(ellipse.bits()).covariance_m2(sigma_m);
            let [north, cross, east]: [f64; 3] = core::array::from_fn(|i| read[i] - truth[i]);
            assert!(
                north >= 0.0 && east >= 0.0 && north * east >= cross * cross,
                "{ratio} {angle}: {read:?} {truth:?}"
            );
            let most = 1.26 * 1.01 * (minor + ROUNDER) - minor + 0.011;
            assert!(north + east < most + 1.0e-3, "{ratio} {angle}: {} {most}", north + east);
        }
    }
}
