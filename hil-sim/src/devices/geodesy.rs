//! Local north-east frame and WGS-84, through the earth-centred frame (never the app's projection).

use map_3d::{Ellipsoid, enu2geodetic, geodetic2enu};

/// A tangent frame at sea level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    latitude_rad: f64,
    longitude_rad: f64,
}

impl LocalFrame {
    /// With its origin at these WGS-84 degrees, north and east positive.
    pub fn new(latitude_deg: f64, longitude_deg: f64) -> Self {
        Self { latitude_rad: latitude_deg.to_radians(), longitude_rad: longitude_deg.to_radians() }
    }

    /// Latitude and longitude, degrees, of a point [north, east], m, at sea level.
    pub fn to_degrees(&self, [north_m, east_m]: [f64; 2]) -> [f64; 2] {
        let (latitude, longitude, _) =
            enu2geodetic(east_m, north_m, 0.0, self.latitude_rad, self.longitude_rad, 0.0, Ellipsoid::WGS84);
        [latitude.to_degrees(), longitude.to_degrees()]
    }

    /// North and east, m, of a point at sea level.
    pub fn to_metres(&self, [latitude_deg, longitude_deg]: [f64; 2]) -> [f64; 2] {
        let (east, north, _) = geodetic2enu(
            latitude_deg.to_radians(),
            longitude_deg.to_radians(),
            0.0,
            self.latitude_rad,
            self.longitude_rad,
            0.0,
            Ellipsoid::WGS84,
        );
        [north, east]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_a_minute_of_latitude_is_a_nautical_mile() {
        let frame = LocalFrame::new(45.0, -70.0);
        let [north, east] = frame.to_metres([45.0 + 1.0 / 60.0, -70.0]);
        // Meridian radius at 45 degrees is 6 367.4 km: a minute is 1852.2 m.
        assert!((north - 1852.2).abs() < 0.5 && east.abs() < 1e-6, "{north} {east}");
        let back = frame.to_degrees([north, east]);
        // The chord leaves the ellipsoid by 0.27 m at a mile: its foot differs by micrometres.
        assert!((back[0] - 45.0 - 1.0 / 60.0).abs() < 1e-9 && (back[1] + 70.0).abs() < 1e-9, "{back:?}");
    }
}
