//! Latitude and longitude to the mission's local north-east plane, and back.
//!
//! The plane is tangent to the WGS84 ellipsoid at the mission's origin: a point on the ellipsoid
//! goes to earth-centred coordinates and is rotated into north-east-down of the origin; the down
//! component is dropped. Distances are true to d³/(6 R²): 0.5 mm at 5 km, 4 mm at 10 km.

/// WGS84 semi-major axis, m.
const A_M: f64 = 6_378_137.0;
/// WGS84 first eccentricity squared.
const E2: f64 = 6.694_379_990_141_317e-3;
const RAD_PER_DEG: f64 = core::f64::consts::PI / 180.0;

/// A tangent plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    lat_deg: f64,
    lon_deg: f64,
}

/// Point of the ellipsoid (height 0) in earth-centred, earth-fixed coordinates, m.
fn earth_centred(lat_rad: f64, lon_rad: f64) -> [f64; 3] {
    let (sin_lat, cos_lat) = (libm::sin(lat_rad), libm::cos(lat_rad));
    let n_m = A_M / libm::sqrt(1.0 - E2 * sin_lat * sin_lat);
    [n_m * cos_lat * libm::cos(lon_rad), n_m * cos_lat * libm::sin(lon_rad), n_m * (1.0 - E2) * sin_lat]
}

impl LocalFrame {
    /// Tangent at this origin, degrees.
    #[must_use]
    pub const fn new(lat_deg: f64, lon_deg: f64) -> Self {
        Self { lat_deg, lon_deg }
    }

    /// North and east of a position on the ellipsoid, m.
    #[must_use]
    pub fn to_local(&self, lat_deg: f64, lon_deg: f64) -> [f64; 2] {
        let (lat0, lon0) = (self.lat_deg * RAD_PER_DEG, self.lon_deg * RAD_PER_DEG);
        let origin = earth_centred(lat0, lon0);
        let point = earth_centred(lat_deg * RAD_PER_DEG, lon_deg * RAD_PER_DEG);
        let d = [point[0] - origin[0], point[1] - origin[1], point[2] - origin[2]];
        let (sin_lat, cos_lat) = (libm::sin(lat0), libm::cos(lat0));
        let (sin_lon, cos_lon) = (libm::sin(lon0), libm::cos(lon0));
        let outward = cos_lon * d[0] + sin_lon * d[1];
        [cos_lat * d[2] - sin_lat * outward, cos_lon * d[1] - sin_lon * d[0]]
    }

    /// Latitude and longitude (degrees) of the ellipsoid's point with this north and east, m.
    ///
    /// Fixed-point iteration of [`Self::to_local`] with the origin's radii of curvature; each round
    /// gains about three digits within 100 km, so six rounds leave rounding only.
    #[must_use]
    pub fn to_geodetic(&self, local_m: [f64; 2]) -> (f64, f64) {
        let (sin_lat, cos_lat) = (libm::sin(self.lat_deg * RAD_PER_DEG), libm::cos(self.lat_deg * RAD_PER_DEG));
        let w2 = 1.0 - E2 * sin_lat * sin_lat;
        let prime_vertical_m = A_M / libm::sqrt(w2);
        let meridian_m = prime_vertical_m * (1.0 - E2) / w2;
        let (mut lat_deg, mut lon_deg) = (self.lat_deg, self.lon_deg);
        for _ in 0..6 {
            let [north_m, east_m] = self.to_local(lat_deg, lon_deg);
            lat_deg += (local_m[0] - north_m) / meridian_m / RAD_PER_DEG;
            lon_deg += (local_m[1] - east_m) / (prime_vertical_m * cos_lat) / RAD_PER_DEG;
        }
        (lat_deg, lon_deg)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One second of arc at 45° N: the meridian radius is 6 367 381.816 m and the parallel's is
    /// 4 517 590.879 m (Bowring's tables of the WGS84 ellipsoid), times the angle.
    #[test]
    fn val_arc_seconds_have_the_ellipsoids_lengths() {
        let frame = LocalFrame::new(45.0, -70.0);
        let second = 1.0 / 3600.0;
        let [north, east] = frame.to_local(45.0 + second, -70.0);
        // tolerance: curvature over 31 m is far below 0.1 mm
        assert!((north - 6_367_381.816 * second * RAD_PER_DEG).abs() < 1e-4, "{north}");
        assert!(east.abs() < 1e-9);
        let [north, east] = frame.to_local(45.0, -70.0 + second);
        assert!((east - 4_517_590.879 * second * RAD_PER_DEG).abs() < 1e-4, "{east}");
        assert!(north.abs() < 1e-3);
    }

    #[test]
    fn there_and_back() {
        for (lat, lon) in [(41.5, -70.7), (0.0, 179.9999), (-33.9, 18.4), (69.0, 0.0)] {
            let frame = LocalFrame::new(lat, lon);
            for local in [[0.0, 0.0], [5_000.0, -3_000.0], [-12.5, 9_800.0]] {
                let (lat_deg, lon_deg) = frame.to_geodetic(local);
                let back = frame.to_local(lat_deg, lon_deg);
                // tolerance: 1e-9 degree is 0.1 mm; iteration ends below it
                assert!((back[0] - local[0]).abs() < 1e-6 && (back[1] - local[1]).abs() < 1e-6, "{back:?}");
            }
        }
    }
}
