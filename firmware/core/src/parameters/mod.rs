//! Everything that is declared about a vehicle: one table.
//!
//! A [`Row`] declares a key of the vehicle file: its name, symbol, unit, range, one sentence of help, whether it may change
//! while a mission runs, and where its numbers are in a struct; the defaults are the constants of that struct. The list of
//! the board, the vehicle file, the commands `backseat params`, the page docs/guide/parameters.md and the checks of ranges
//! derive from these rows. What belongs to the app alone (its protocols and ports) is declared by rows of the same type
//! there. The effects have a catalogue of their own ([`crate::effects`]).
//!
//! To add a parameter: a field and its default, and a row. To add a section: its struct, its rows, its name in `SECTIONS`,
//! and its place in the app's list.

mod installation;
mod joint;
mod row;
mod table;

pub use installation::Installation;
pub use joint::{Inconsistent, joint_check};
pub(crate) use row::check_with;
pub use row::{Declaration, Kind, ParameterError, Row, Shape, check, count};
pub use table::{CONTROL, FILTER, INSTALLATION, NOISE, PRIOR, SENSORS, VEHICLE};
#[cfg(not(target_os = "none"))]
pub use table::{SECTIONS, Section};
