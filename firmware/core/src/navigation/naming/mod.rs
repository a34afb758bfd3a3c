//! Naming what has changed, on board and in flight.

mod ask;
mod candidate;
mod causes;
mod coarse;
mod columns;
mod evidence;
mod known;
mod motion;
mod onset;
mod scatter;
mod sensitivities;
mod separate;
mod statement;
mod sums;
mod taken;
#[cfg(test)]
mod tests;
mod unlisted;
mod used;
mod watch;

pub use causes::{ALL as CAUSES, Cause};
pub use known::Known;
pub use sensitivities::Sensitivities;
pub use statement::{Named, Statement};
pub use watch::Naming;
