//! The commands that talk to a board, as a user runs them, against the app on pseudo-terminals.

mod arm;
pub mod bench;
mod bridge;
mod check;
mod learning;
mod mission;
mod monitor;
mod params;
mod usage;
