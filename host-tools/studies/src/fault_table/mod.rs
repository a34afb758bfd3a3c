//! Fault table: built-in scenarios with faults, flown and compared with the limits that each states.
//!
//! | module | |
//! |---|---|
//! | `rows` | the built-in rows, and how one is flown |
//! | `judge`, `commands` | a flight watched step by step; its sentences to the frontseat |
//! | `table` | the table of all rows |

mod command;
mod commands;
mod judge;
mod rows;
mod table;

pub use command::{Args, run};
pub use commands::CommandWatch;
pub use judge::{Judge, JudgedFlight, Spell};
pub use rows::{Row, fly, rows};
pub use table::{Summary, markdown, to_json};
