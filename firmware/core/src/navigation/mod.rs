//! Navigation: the centralized extended Kalman filter (CEKF) of chapter 2, made robust.
//!
//! A [`Navigator`] is moved through time by [`Navigator::predict`] and corrected by [`Navigator::fuse`]; it reads no
//! clock, no bytes and never panics.
//!
//! **State.** Vehicle 12 | augmented states, up to 20 | ship 6 | delayed states, two of 6. The process model is the
//! vehicle's dynamics driven by fins and propeller; a delayed state keeps what a later acoustic measurement needs.
//!
//! **Unknowns are states.** The nominal filter takes the declared vehicle as exact. With parameters wrong by 10 % it
//! errs by ten metres, in an undeclared current by thirty. The robust filter ([`NavigationConfig::make_robust`])
//! estimates what the declaration leaves open ([`Priors`]): the logarithms of eight parameters of the model, the
//! current, the biases of the compass, the trims of the fins, buoyancy, pitch trim and the lag of the servos. A
//! logarithm keeps a parameter's sign; a linear factor can lose it and then diverges. Half of these states would be
//! worse than none: without the trims, thrust and current absorb the effect of the trims, and the position is lost.
//!
//! The columns ∂v̇/∂state have closed forms. The plant is Y θ = h with the regressor Y of the identifier, so that
//! M ∂v̇/∂ ln θ_j = −Y_j θ_j; trims and lag enter by the fins' wrench per angle. Only these columns, the live block and
//! its cross covariances are computed: a state that does not move costs nothing but its row.
//!
//! **The bank.** To estimate a known quantity costs accuracy, and a steady current cannot follow a tide. A
//! [`Navigator`] therefore runs three filters, a robust one whose current changes, a robust one whose current is
//! steady, and the nominal one, and weighs them by the likelihood of their ranges.
//!
//! **Findings.** [`Filter::estimates`] gives each augmented state with its sigma, and whether the motion has separated
//! it from the others. A current and the speed along a single line, or hard iron and a current on north-south lines,
//! are not separable: the filter uses such estimates, but they are not findings. The first minutes are the worst; a
//! dive may start from what the last one has learnt ([`Learnt`]).
//!
//! ```text
//! navigator       the bank                          filter          one filter: state and covariance
//! layout          which state stands where          discretisation  f, F -> Φ, Γ, Q_d, step of x
//! estimate        x̂                                 propagation     P -> Φ P Φᵀ + Γ … + Q_d
//! covariance      P, lower triangle                 prediction      time update
//! row             sparse row of H                   cloning         delayed states
//! observation     ν, h, R of a measurement          meas_*, models  one aiding source each; h(x) and H(x)
//! acoustic        the ends of an acoustic path      fusion          measurement update
//! innovation_monitor  the gate, and sources that contradict the filter
//! innovation_window   chi-square of a source over a window
//! integrity       what the covariance of the position leaves out
//! effects         the catalogue's effects in the filter   effect_states   what is estimated, and its priors
//! estimates       augmented states, with sigma      observer        each step as a linear map, for a smoother
//! learnt          the prior that a dive leaves
//! config, initial, measurement, consistency, error  the interface
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
mod estimates;
mod evidence;
mod filter;
mod fusion;
mod initial;
mod innovation_monitor;
mod innovation_window;
mod integrity;
mod layout;
mod learnt;
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
mod waves;

pub use crate::parameters::{LEARNT_NAMES, LEARNT_STATES, LEARNT_UNITS, Learnt, NotPositiveDefinite};
pub use crate::parameters::{Priors, ProcessNoise, SensorNoise};
pub use config::{NavigationConfig, ProcessModel, ShipNoise, SurfaceNoise};
pub use consistency::{Consistency, NisTally, nees_position, nees_vehicle};
pub use effect_states::{EffectState, EffectStates, StateParameter};
pub use error::{CloneError, ConfigError, NavigationError};
pub use estimates::{ESTIMATE_NAMES, ESTIMATE_UNITS, StateEstimate};
pub use evidence::Evidence;
pub use filter::Filter;
pub use initial::{InitialShip, InitialSpeed, InitialState};
pub use integrity::{Apart, Integrity};
pub use measurement::{
    AcousticPath, CloneId, FusionOutcome, FusionRecord, Fusions, Measurement, Sensor, ShipEnd, ShipReport, VehicleEnd,
};
pub use navigator::{BankMember, MEMBERS, Navigator};
pub use observer::{Appended, LinearStep, MAX_STATES, Observer, ScalarUpdate, Transition};
pub use prediction::MAX_GAP_US;
