//! The centralized extended Kalman filter (CEKF) of chapter 2.

mod config;
mod consistency;
mod error;
mod initial;
mod measurement;
mod navigator;

pub use config::{NavigationConfig, ProcessModel, ProcessNoise, SensorNoise, ShipNoise, WaterCurrentConfig};
pub use consistency::{Consistency, NisTally};
pub use error::{CloneError, ConfigError, NavigationError};
pub use initial::{InitialShip, InitialSpeed, InitialState};
pub use measurement::{
    AcousticPath, CloneId, FusionOutcome, FusionRecord, Fusions, Measurement, Sensor, ShipEnd, ShipReport, VehicleEnd,
};
pub use navigator::{MAX_GAP_US, Navigator};
