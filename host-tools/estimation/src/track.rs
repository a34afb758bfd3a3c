//! The estimated track: state and uncertainty over time.

use backseat_core::state::{VehicleState, X, Y};

/// The estimate at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackSample {
    /// Time, µs.
    pub time_us: u64,
    /// Vehicle state.
    pub state: VehicleState,
    /// One sigma of each vehicle state.
    pub sigma: VehicleState,
    /// Covariance of x and y, m².
    pub cov_xy_m2: f64,
    /// Current north, east, m/s (zero where it is not a state).
    pub current_mps: [f64; 2],
}

impl TrackSample {
    /// Length of the semi-axes (m, larger first) of the one-sigma ellipse of the position and the
    /// bearing of the larger, rad from north.
    pub fn ellipse(&self) -> ([f64; 2], f64) {
        let (a, b, c) = (self.sigma[X].powi(2), self.cov_xy_m2, self.sigma[Y].powi(2));
        let (mean, half) = (0.5 * (a + c), (0.25 * (a - c) * (a - c) + b * b).sqrt());
        ([(mean + half).sqrt(), (mean - half).max(0.0).sqrt()], 0.5 * (2.0 * b).atan2(a - c))
    }

    /// √(σx² + σy²), the filter's own bound of the horizontal error (DRMS), m.
    pub fn drms_m(&self) -> f64 {
        self.sigma[X].hypot(self.sigma[Y])
    }
}
