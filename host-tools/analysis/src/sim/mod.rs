//! Missions in the simulator.

mod figures;
mod flight;
mod report;
mod ship;
mod topside_score;
mod trial;

pub use flight::{Flown, Options, REPORT, SESSION, fly, simulate};
pub use report::{picture, report};
pub use ship::TopsideKind;
