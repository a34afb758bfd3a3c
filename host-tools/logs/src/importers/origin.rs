//! Latitude and longitude as metres about an origin.

use crate::log::units::RAD_PER_DEG;

/// Origin of the local plane: the log's first fix.
pub(super) struct Origin {
    latitude_deg: f64,
    longitude_deg: f64,
    m_per_deg: [f64; 2],
}

impl Origin {
    /// Radii of curvature of the WGS 84 ellipsoid at the origin; a mission of 10 km errs by metres.
    pub(super) fn new(latitude_deg: f64, longitude_deg: f64) -> Self {
        const A_M: f64 = 6_378_137.0;
        const E2: f64 = 6.694_379_990_141_32e-3;
        let (sin, cos) = (latitude_deg * RAD_PER_DEG).sin_cos();
        let w2 = 1.0 - E2 * sin * sin;
        let (meridian_m, prime_m) = (A_M * (1.0 - E2) / (w2 * w2.sqrt()), A_M / w2.sqrt());
        Self { latitude_deg, longitude_deg, m_per_deg: [meridian_m * RAD_PER_DEG, prime_m * cos * RAD_PER_DEG] }
    }

    /// Latitude and longitude, degrees.
    pub(super) const fn degrees(&self) -> [f64; 2] {
        [self.latitude_deg, self.longitude_deg]
    }

    /// North and east of the origin, m.
    pub(super) fn local_m(&self, latitude_deg: f64, longitude_deg: f64) -> [f64; 2] {
        let east_deg = (longitude_deg - self.longitude_deg + 540.0).rem_euclid(360.0) - 180.0;
        [(latitude_deg - self.latitude_deg) * self.m_per_deg[0], east_deg * self.m_per_deg[1]]
    }
}
