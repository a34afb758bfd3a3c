//! Fault table: built-in scenarios with faults, flown and compared with the limits that each states.
//!
//! | module | |
//! |---|---|
//! | `rows` | the built-in rows, and how one is flown |
//! | `random` | rows drawn by a seed: two or three faults at a time |
//! | `judge`, `commands` | a flight watched step by step; its sentences to the frontseat |
//! | `table` | the table of all rows |
//! | `command` | `cargo lab faults` |

mod command;
mod commands;
mod judge;
mod random;
mod rows;
mod table;

pub use command::{Args, run};
pub use commands::CommandWatch;
pub use judge::{Judge, JudgedFlight, Spell};
pub use random::drawn;
pub use rows::{Row, fly, rows, ship_of};
pub use table::{Summary, drawn_markdown, markdown};
