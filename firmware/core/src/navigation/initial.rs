//! Initialisation (2.3.1.2): from the last fix and the DVL or the commanded speed.

use super::{NavigationConfig, ShipReport};
use crate::state::VehicleState;

/// Where the first velocity comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum InitialSpeed {
    /// DVL velocity in body axes, m/s.
    Dvl([f64; 3]),
    /// Commanded (or model) surge speed, m/s.
    Commanded(f64),
}

/// State and one sigma at the start; cross covariances are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialState {
    /// x_v.
    pub state: VehicleState,
    /// One sigma of each vehicle state.
    pub sigma: VehicleState,
}

impl InitialState {
    /// From the last fix (north, east, one sigma per axis), present depth, Euler angles, rates and speed.
    #[must_use]
    pub fn from_fix(
        _fix_m: [f64; 2],
        _fix_sigma_m: f64,
        _depth_m: f64,
        _euler_rad: [f64; 3],
        _rates_radps: [f64; 3],
        _speed: InitialSpeed,
        _config: &NavigationConfig,
    ) -> Self {
        todo!()
    }
}

/// The ship at the start: [x y ψ ẋ ẏ ψ̇] and one sigma of each; cross covariances are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialShip {
    /// North, east (m), heading (rad), north and east velocity (m/s), turn rate (rad/s).
    pub state: [f64; 6],
    /// One sigma of each.
    pub sigma: [f64; 6],
}

impl InitialShip {
    /// From its first GNSS fix; speed unknown.
    #[must_use]
    pub fn from_fix(_position_m: [f64; 2], _config: &NavigationConfig) -> Self {
        todo!()
    }

    /// From a report in an acoustic packet (valid at the present time).
    #[must_use]
    pub fn from_report(_report: &ShipReport) -> Self {
        todo!()
    }
}
