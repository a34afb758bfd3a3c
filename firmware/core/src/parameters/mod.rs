//! Everything that is declared about a vehicle: one table.
//!
//! A [`Row`] declares a key of the vehicle file: its name, symbol, unit, range, one sentence of help, whether it may
//! change while a mission runs, and where its numbers are in a struct; the defaults are the constants of that struct.
//! The list of the board, the vehicle file, the commands `backseat params`, the page docs/guide/parameters.md and the
//! checks of ranges derive from these rows. The rows of section `[app]` stand with what they configure: the filter
//! ([`crate::navigation::NavigationConfig::ROWS`]), the controller ([`crate::control::ControlConfig::ROWS`]) and the
//! app (its protocols and ports). The effects have a catalogue of their own ([`crate::effects`]).
//!
//! To add a parameter: an entry of its struct's `declared`. To add a section: its struct, its name in `SECTIONS`, and its
//! place in the app's list.

mod defaults;
mod installation;
mod joint;
mod learnt;
mod noise;
mod priors;
mod row;
mod safety;
mod sections;
mod vehicle;

pub use installation::Installation;
pub use joint::{Inconsistent, cross_drag_limit, joint_check};
pub use learnt::{HANDLING, LEARNT, LEARNT_NAMES, LEARNT_STATES, LEARNT_UNITS, Learnt, NotPositiveDefinite};
pub use noise::{ProcessNoise, SensorNoise};
pub use priors::Priors;
pub use row::{Declaration, Kind, ParameterError, Row, Shape, UnderWay, check, count};
pub use safety::SafetyLimits;
#[cfg(not(target_os = "none"))]
pub use sections::{Presence, SECTIONS, Section};
pub use vehicle::{FINS, FinGeometry, VehicleParameters};
