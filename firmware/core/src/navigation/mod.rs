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
//! **Rooms.** Each imports only from those below it, and from the file that defines what it needs.
//!
//! ```text
//! naming      what has changed, by name: beside the nominal filter, and touching nothing
//! bank        navigator: the bank and its mixture; evidence: the likelihood of ranges
//! integrity   level: what the error exceeds with a declared probability only; hypotheses: the table of what may be wrong;
//!             account: position by one entry of it; vertical: the same of depth
//! filter      cekf: one filter; prediction: time update; fusion: measurement update; peers: that of
//!             ranges to other vehicles; cloning: delayed states; effects: the catalogue's effects in the filter;
//!             estimates: augmented states with sigma; learnt: the prior that a dive leaves
//! trust       innovation_monitor: the gate, and sources that contradict the filter; innovation_window: chi-square of a
//!             source over a window; waves; peers: which vehicles are believed; consistency: NIS and NEES;
//!             integrity: what P leaves out of the position
//! sources     one aiding source each, h(x) and H(x); acoustic: the ends of an acoustic path; models: pure geometry
//! algebra     layout: which state stands where; estimate: x̂; covariance: P, lower triangle; row: sparse row of H;
//!             observation: ν, h, R of a measurement; discretisation: f, F -> Φ, Γ, Q_d, step of x; propagation:
//!             P -> Φ P Φᵀ + Γ … + Q_d; observer: each step as a linear map, for a smoother; digest
//! interface   config, measurement, initial, error, effect_states (what is estimated, and its priors), fixed_effects
//! ```

mod algebra;
mod bank;
mod filter;
mod integrity;
mod interface;
pub mod naming;
mod sources;
mod trust;

pub use crate::parameters::{LEARNT_NAMES, LEARNT_STATES, LEARNT_UNITS, Learnt, NotPositiveDefinite};
pub use crate::parameters::{Priors, ProcessNoise, SensorNoise};
pub use algebra::observer::{Appended, LinearStep, MAX_STATES, Observer, ScalarUpdate, Transition};
pub use bank::evidence::Evidence;
pub use bank::navigator::{BankMember, MEMBERS, Navigator};
pub use filter::cekf::Filter;
pub use filter::estimates::{ESTIMATE_NAMES, ESTIMATE_UNITS, StateEstimate};
pub use filter::prediction::MAX_GAP_US;
pub use integrity::{Aiding, Area, Declared, Followed, HYPOTHESES, Hypothesis, Level, Nuisance, ProtectionLevel};
pub use interface::config::{LONGEST_HOLD_S, NavigationConfig, ProcessModel, ShipNoise, SurfaceNoise};
pub use interface::effect_states::{EffectState, EffectStates, StateParameter};
pub use interface::error::{CloneError, ConfigError, NavigationError};
pub use interface::initial::{InitialShip, InitialSpeed, InitialState};
pub use interface::measurement::{
    AcousticPath, CloneId, FusionOutcome, FusionRecord, Fusions, Measurement, PeerReport, Sensor, ShipEnd, ShipReport,
    UsblAxes, UsblFix, VehicleEnd,
};
pub use sources::models;
pub use sources::usbl::triad;
pub use trust::consistency::{Consistency, NisTally, nees_position, nees_vehicle};
pub use trust::innovation_monitor::InnovationMonitor;
pub use trust::integrity::{Integrity, MixtureOffset};
