//! A fix by USBL in either of the forms that makers write: range and two angles, or a vector.

use super::{Column, LogRow};

/// One sigma of the direction where a log does not state it, rad: one degree.
pub const USBL_ANGLE_SIGMA_RAD: f64 = 0.0175;

/// What a USBL measured from its array to the other end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Usbl {
    /// Slant range, m.
    pub range_m: f64,
    /// Clockwise from true north, or from the bow, rad.
    pub bearing_rad: f64,
    /// Positive up, rad.
    pub elevation_rad: f64,
    /// One sigma of the range, m, where it is stated.
    pub range_sigma_m: Option<f64>,
    /// One sigma of the direction, rad.
    pub angle_sigma_rad: f64,
    /// The array is on the vehicle: bearing from the bow, elevation above the deck.
    pub on_vehicle: bool,
}

impl Usbl {
    /// From the array to the other end: north, east, down, or forward, starboard, down, m.
    pub fn vector_m(&self) -> [f64; 3] {
        let ((sin_b, cos_b), (sin_e, cos_e)) = (self.bearing_rad.sin_cos(), self.elevation_rad.sin_cos());
        [cos_e * cos_b, cos_e * sin_b, -sin_e].map(|part| part * self.range_m)
    }

    /// The same with another vector.
    #[must_use]
    pub fn with_vector_m(self, [north, east, down]: [f64; 3]) -> Self {
        let ground_m = north.hypot(east);
        Self {
            range_m: ground_m.hypot(down),
            bearing_rad: east.atan2(north),
            elevation_rad: (-down).atan2(ground_m),
            ..self
        }
    }
}

impl LogRow {
    /// The fix by USBL of this row, from range and angles or from a vector.
    pub fn usbl(&self) -> Option<Usbl> {
        let positive = |column| self.get(column).filter(|sigma| *sigma > 0.0);
        let fix = |[range_m, bearing_rad, elevation_rad]: [f64; 3]| Usbl {
            range_m,
            bearing_rad,
            elevation_rad,
            range_sigma_m: positive(Column::UsblRangeSigma),
            angle_sigma_rad: positive(Column::UsblAngleSigma).unwrap_or(USBL_ANGLE_SIGMA_RAD),
            on_vehicle: self.get(Column::UsblOnVehicle).is_some_and(|on| on != 0.0),
        };
        let polar = self.group(Column::UsblRange).map(fix);
        polar.or_else(|| Some(fix([0.0; 3]).with_vector_m(self.group(Column::UsblNorth)?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ahead to the east, 3 of 5 m down: both forms are one fix.
    #[test]
    fn val_both_forms_are_one_fix() {
        let mut row = LogRow::new(0);
        let vector = row.set_all(Column::UsblNorth, &[0.0, 4.0, 3.0]).usbl().unwrap();
        let elevation = -(3.0_f64 / 5.0).asin();
        let mut row = LogRow::new(0);
        row.set_all(Column::UsblRange, &[5.0, std::f64::consts::FRAC_PI_2, elevation]);
        let polar = row.set(Column::UsblAngleSigma, 0.01).usbl().unwrap();
        assert_eq!((vector.angle_sigma_rad, polar.angle_sigma_rad), (USBL_ANGLE_SIGMA_RAD, 0.01));
        for fix in [vector, polar] {
            for (value, expected) in fix.vector_m().iter().zip([0.0, 4.0, 3.0]) {
                assert!((value - expected).abs() < 1e-12, "{fix:?}"); // rounding
            }
        }
        assert!(LogRow::new(0).set(Column::UsblRange, 5.0).usbl().is_none(), "a range alone is no fix");
    }
}
