//! Missions in the simulator.

mod figures;
mod flight;
mod flown;
mod named;
mod report;
mod ship;
mod topside_score;
mod trial;

pub use flight::{Options, fly, simulate};
pub use flown::{Flown, REPORT, SESSION, VEHICLE};
pub use report::{picture, report};
pub use ship::TopsideKind;
