//! What sensors make: the largest noise that is plausible of each kind, and the drift of dead reckoning per distance run.
//!
//! One sigma each, white and correlated parts together, without what an effect of the catalogue describes (a hard iron, an
//! arm, a scale). A vehicle file may declare more; it then holds. Noise that is estimated from residuals is bounded by
//! these figures, and an error beyond them is none that the sensors make.

use backseat_core::navigation::SensorNoise;

/// A kind of sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorKind {
    /// Depth, m.
    Depth,
    /// Roll or pitch, rad.
    RollPitch,
    /// Heading, rad.
    Heading,
    /// p, q or r, rad/s.
    Rates,
    /// A velocity of a Doppler log, m/s.
    Dvl,
    /// North or east of a GNSS fix of a vehicle at the surface, m.
    Gnss,
    /// Acoustic range, m.
    Range,
    /// Rate of an acoustic range, m/s.
    RangeRate,
    /// Across the direction of a USBL, m.
    Usbl,
    /// Rate of depth, m/s.
    DepthRate,
    /// Speed through the water, m/s.
    WaterSpeed,
}

impl SensorKind {
    /// The largest one sigma of a sensor of its class, in its unit.
    #[must_use]
    pub const fn of_class(self) -> f64 {
        match self {
            // An error band of 0.25 % of 200 m full scale, that of a plain strain gauge.
            Self::Depth => 0.5,
            // Accuracy in motion of a MEMS attitude sensor: 2.0 degrees (MicroStrain 3DM-GX3-25, data sheet).
            Self::RollPitch => 0.035,
            // The same, 2.0 degrees, and once more in square for a field that varies about a small hull.
            Self::Heading => 0.052,
            // 0.03 degrees/s/√Hz over 50 Hz is 0.2 degrees/s (3DM-GX3-25, data sheet); five times that for vibration.
            Self::Rates => 0.0175,
            // The reference vehicle's log is declared with a tenth of this; ten times that is a single ping near the
            // largest height, or on the water.
            Self::Dvl => 0.1,
            // 15 m in 95 % of cases at the worst site is 6 m an axis (GPS Standard Positioning Service Performance Standard,
            // 5th edition, 2020).
            Self::Gnss => 6.0,
            // A travel time that errs by 2 ms: a packet's arrival by a late path in shallow water.
            Self::Range => 3.0,
            // The Doppler of a packet to 2e-4 of the speed of sound.
            Self::RangeRate => 0.3,
            // Three degrees, an array that is not calibrated, at 500 m.
            Self::Usbl => 25.0,
            // Two depths that err by 0.2 m, a second apart.
            Self::DepthRate => 0.3,
            // The speed by the propeller's turns or a paddle wheel, to 10 % of 1.5 m/s.
            Self::WaterSpeed => 0.15,
        }
    }

    /// What a vehicle file declares of it; `None` of kinds that no vehicle file holds.
    #[must_use]
    pub fn declared(self, sensors: &SensorNoise) -> Option<f64> {
        let [roll_rad, _, heading_rad] = sensors.angles_rad();
        Some(match self {
            Self::Depth => sensors.depth_m,
            Self::RollPitch => roll_rad,
            Self::Heading => heading_rad,
            Self::Rates => sensors.rates_radps,
            Self::Dvl => sensors.dvl_mps,
            Self::Gnss => sensors.gnss_m,
            Self::Range => sensors.range_m,
            Self::RangeRate => sensors.range_rate_mps,
            Self::DepthRate | Self::WaterSpeed | Self::Usbl => return None,
        })
    }

    /// The largest plausible one sigma: that of its class, or what is declared if that is more.
    #[must_use]
    pub fn most(self, sensors: &SensorNoise) -> f64 {
        self.declared(sensors).unwrap_or(0.0).max(self.of_class())
    }
}

/// What carries a position between fixes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// Heading and a Doppler log on the bottom.
    BottomTrack,
    /// Heading and a speed through the water, or the vehicle's dynamics, the current known.
    WaterSpeed,
}

impl Carrier {
    /// Largest plausible error of a position per distance run since the last fix, one sigma.
    #[must_use]
    pub const fn drift(self) -> f64 {
        match self {
            // A heading to 2 degrees is 3.5 % across the track; a Doppler log to 1 % along it (the standard grade of the
            // smallest logs, Water Linked A50 data sheet), and the two in square.
            Self::BottomTrack => 0.04,
            // A speed to 10 % along the track, as of SensorKind::WaterSpeed at 1.5 m/s.
            Self::WaterSpeed => 0.1,
        }
    }
}

/// The largest plausible distance between a dead-reckoned position and a fix, one sigma of both axes together, after
/// `distance_m` since the fixes that started it.
#[must_use]
pub fn most_position_error_m(carrier: Carrier, distance_m: f64, sensors: &SensorNoise) -> f64 {
    // Fixes err at the start and at the end, on two axes each.
    (2.0 * SensorKind::Gnss.most(sensors)).hypot(carrier.drift() * distance_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VehicleFile;

    #[test]
    fn what_is_declared_holds_where_it_is_more() {
        let mut sensors = VehicleFile::reference().sensors;
        assert_eq!(SensorKind::Gnss.most(&sensors), SensorKind::Gnss.of_class());
        sensors.gnss_m = 20.0;
        assert_eq!(SensorKind::Gnss.most(&sensors), 20.0);
        assert_eq!(SensorKind::WaterSpeed.most(&sensors), SensorKind::WaterSpeed.of_class());
    }

    #[test]
    fn the_reference_vehicle_declares_less_than_its_class_may_make() {
        let sensors = VehicleFile::reference().sensors;
        for kind in [
            SensorKind::Depth,
            SensorKind::RollPitch,
            SensorKind::Heading,
            SensorKind::Rates,
            SensorKind::Dvl,
            SensorKind::Gnss,
            SensorKind::Range,
            SensorKind::RangeRate,
        ] {
            assert!(kind.declared(&sensors).unwrap() <= kind.of_class(), "{kind:?}");
        }
    }

    #[test]
    fn a_kilometre_without_a_doppler_log_may_err_by_a_hundred_metres_and_the_fixes() {
        let sensors = VehicleFile::reference().sensors;
        let error_m = most_position_error_m(Carrier::WaterSpeed, 1000.0, &sensors);
        assert!((error_m - 12.0_f64.hypot(100.0)).abs() < 1e-9, "{error_m}");
    }
}
