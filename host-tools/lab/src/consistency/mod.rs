//! Consistency: is the filter's covariance that of its errors?
//!
//! An ensemble of short flights whose truth is drawn as the filter declares it (`declared`): start from the prior P0,
//! accelerations and walks of the declared power density, sensors with the declared noise, effects from their own
//! priors. Vehicle and ship move by the simulator's equations and integrator, never by the filter's. Over the runs
//!
//! - ANEES, the average of eᵀ P⁻¹ e, and ANIS, the average of ν² / S, have known distributions if the filter is
//!   consistent ([`Band`]);
//! - no filter's mean squared error can be below the posterior Cramér-Rao bound (`bound`).
//!
//! ```text
//! case         worlds and filters: models, priors, effects
//! declared     the world that behaves as declared       motion   its equations, and their coordinates for the bound
//! ensemble     runs of filter and world, NEES and NIS   bound    Tichavský's recursion
//! statistics   averages over the runs, chi_square bands  survey   the same for real flights, packets  their ship
//! ```

mod block;
mod bound;
mod case;
mod chi_square;
mod command;
mod declared;
mod ensemble;
mod motion;
mod packets;
mod statistics;
mod survey;

pub use block::Block;
pub use bound::{Bound, Bounds, Least, Moments, bounds};
pub use case::{DeclaredCase, DeclaredEffect, EffectPrior, cases};
pub use chi_square::Band;
pub use command::{Args, run as run_command};
pub use declared::{DeclaredFlight, DeclaredWorld, TrueState};
pub use ensemble::{Ensemble, ErrorSample, FilteredRun, Square, measurement_names, run, run_in};
pub use motion::{Motion, Smooth};
pub use statistics::{Inside, blocks, errors, innovations};
pub use survey::surveys;
