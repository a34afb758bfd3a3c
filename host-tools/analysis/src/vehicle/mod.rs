//! Vehicle files from a data sheet, and whether what they describe flies.

mod examination;
mod flight;
mod manoeuvres;
mod report;
mod sizes;
mod stability;

pub use examination::{Beside, Findings, Misfit, examine, own_speed_mps, unflyable};
pub use flight::ShortFlight;
pub use manoeuvres::{Cruise, Dive, Turn};
pub use report::report;
pub use sizes::{Sizes, TEMPLATES, Template};
pub use stability::Mode;
