//! The centralized extended Kalman filter (CEKF) of chapter 2.
//!
//! One [`Navigator`] holds vehicle, ship, effect states and up to two delayed states. It is moved
//! through time by [`Navigator::predict`] and corrected by [`Navigator::fuse`]; it reads no clock,
//! no bytes and never panics.
//!
//! ```text
//! layout          which state stands where          discretisation  f, F -> Φ, Q_d, step of x
//! estimate        x̂                                 propagation     P -> Φ P Φᵀ + Q_d
//! covariance      P, lower triangle                 prediction      time update
//! row             sparse row of H                   cloning         delayed states
//! observation     ν, h, R of a measurement          meas_*          one aiding source each
//! acoustic        the ends of an acoustic path      fusion, gate    measurement update
//! effects, effect_states  what the declared model lacks: fixed, or estimated
//! observer        each step as a linear map, for a smoother on a host
//! config, initial, measurement, consistency, error  what the outside sees
//! ```

mod acoustic;
mod cloning;
mod config;
mod consistency;
mod covariance;
mod digest;
mod discretisation;
mod effect_states;
mod effects;
mod error;
mod estimate;
mod filter;
mod fusion;
mod initial;
mod innovation_monitor;
mod layout;
mod meas_attitude;
mod meas_depth;
mod meas_dvl;
mod meas_range;
mod meas_range_rate;
mod meas_rates;
mod meas_ship_gnss;
mod meas_two_way;
mod meas_vehicle_gnss;
mod measurement;
pub mod models;
mod navigator;
mod observation;
mod observer;
mod prediction;
mod propagation;
mod row;
#[cfg(test)]
mod tests;

pub use config::{NavigationConfig, ProcessModel, ProcessNoise, SensorNoise, ShipNoise, SurfaceNoise};
pub use consistency::{Consistency, NisTally, nees_position, nees_vehicle};
pub use effect_states::{EffectState, EffectStates, Priors, StateParameter};
pub use error::{CloneError, ConfigError, NavigationError};
pub use filter::Filter;
pub use initial::{InitialShip, InitialSpeed, InitialState};
pub use measurement::{
    AcousticPath, CloneId, FusionOutcome, FusionRecord, Fusions, Measurement, Sensor, ShipEnd, ShipReport, VehicleEnd,
};
pub use navigator::{BankMember, EVIDENCE_MEMORY, MEMBERS, Navigator};
pub use observer::{Appended, LinearStep, MAX_STATES, Observer, ScalarUpdate, Transition};
pub use prediction::MAX_GAP_US;
