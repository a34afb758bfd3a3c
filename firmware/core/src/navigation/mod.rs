//! The centralized extended Kalman filter (CEKF) of chapter 2.

mod config;
mod measurement;

pub use config::{NavigationConfig, ProcessModel, ProcessNoise, SensorNoise, ShipNoise, WaterCurrentConfig};
pub use measurement::{
    AcousticPath, CloneId, FusionOutcome, FusionRecord, Fusions, Measurement, Sensor, ShipEnd, ShipReport, VehicleEnd,
};
