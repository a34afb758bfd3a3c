//! The protection level: a distance that the error of position or depth exceeds with a declared probability only.
//!
//! The filter's P says how far the noise of the sensors lets the estimate be off, if the sensors are what they are
//! declared to be. It does not say what a wrong sensor does, nor what becomes of a current that was learnt an hour ago.
//! The level does, by solution separation, as in aviation (ARAIM: J. Blanch et al., IEEE Trans. Aerospace and
//! Electronic Systems 51, 2015):
//!
//! 1. A table ([`hypotheses`]) declares what may be wrong: how often, and by how much.
//! 2. For each entry an [`account`] of its own is kept beside the filter: position, current, and what cannot be learnt
//!    for good (speed, course, the offsets of ship and receivers, range scale and delay, DVL scale and yaw), each with
//!    a sigma and a memory. Where the entry holds, its account is honest: its prior allows what the entry says.
//! 3. Truth is around the honest account, and the estimate x₀ that is flown by is |x₀ − x_k| from it. [`risk`] weighs the
//!    accounts by what they predicted and finds the distance that the error exceeds with the declared probability.
//!
//! Nothing is decided and nothing is timed: where two accounts contradict each other, the level is as large as their
//! distance, for as long as they do. The accounts never touch the filter, so estimates and digest are the same with or
//! without them. They are driven by the velocity through the water that the filter has; all that is taught by ranges
//! is their own.

mod account;
mod hypotheses;
mod level;
mod risk;
mod vertical;

pub use account::Nuisance;
pub use hypotheses::{Area, Declared, HYPOTHESES, Hypothesis};
pub use level::{Aiding, Followed, Level, ProtectionLevel};
