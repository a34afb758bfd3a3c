//! Files: what is read is what was written, and what is wrong is told with its place.

mod broken;
mod foreign;
mod limits;
mod parameters;
#[path = "../../../../firmware/tests/random.rs"]
mod random;
mod round_trip;
mod session;
