//! Whether what a vehicle file describes flies.

mod examination;
mod flight;
mod manoeuvres;
mod report;
mod stability;

pub use examination::{Beside, Findings, Misfit, examine, own_speed_mps, unflyable};
pub use flight::ShortFlight;
pub use manoeuvres::{Cruise, Dive, Turn};
pub use report::report;
pub use stability::Mode;
