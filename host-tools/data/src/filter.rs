//! The flight filter over a vehicle log.

use crate::{DataError, Log, VehicleFile};
use backseat_core::navigation::{FusionRecord, NavigationConfig, Sensor};
use backseat_core::state::VehicleState;
use std::time::Duration;

/// Where the ship's state at time of launch comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShipSource {
    /// Ship GNSS at full rate; the ship is a state of the filter, cloned at time of launch.
    Centralized,
    /// `ship_x_m`, `ship_y_m` of the packet only; its error is taken as independent.
    Packet,
}

/// What of a log the filter uses, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterOptions {
    /// Models and noise.
    pub navigation: NavigationConfig,
    /// Fuse DVL bottom track.
    pub use_dvl: bool,
    /// Fuse body rates.
    pub use_rates: bool,
    /// Fuse acoustic ranges.
    pub use_range: bool,
    /// Fuse acoustic range rates.
    pub use_range_rate: bool,
    /// The ship's end of the acoustic paths.
    pub ship: ShipSource,
    /// Time between samples of the track, µs.
    pub track_interval_us: u64,
}

impl FilterOptions {
    /// All sensors, centralized, with the noise of a vehicle file.
    #[must_use]
    pub fn new(_vehicle: &VehicleFile, _model: backseat_core::navigation::ProcessModel) -> Self {
        todo!()
    }
}

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

/// How one sensor agreed with the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorSummary {
    /// Which.
    pub sensor: Sensor,
    /// Scalars fused.
    pub fused: u64,
    /// Scalars rejected (gated, invalid or stale).
    pub rejected: u64,
    /// Mean normalised innovation squared of all scalars that had a variance; 1 if consistent.
    pub nis: f64,
}

/// What the filter made of a log.
#[derive(Clone, Debug)]
pub struct FilterRun {
    /// The estimate, at the interval asked for.
    pub track: Vec<TrackSample>,
    /// Every fusion, in order.
    pub fusions: Vec<FusionRecord>,
    /// Per sensor that had a measurement.
    pub sensors: Vec<SensorSummary>,
    /// Digest of state and covariance at every row.
    pub digest: u64,
    /// Time taken.
    pub wall: Duration,
}

/// Runs the filter over a log from its first fix to its end.
///
/// # Errors
/// If the log has no fix to start from or the vehicle cannot be simulated.
pub fn run(_log: &Log, _vehicle: &VehicleFile, _options: &FilterOptions) -> Result<FilterRun, DataError> {
    todo!()
}
