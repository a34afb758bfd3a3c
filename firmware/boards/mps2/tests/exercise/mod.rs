//! What both the ARM images and their host tests run: fixed inputs, no clock, no I/O.

pub mod cases;
pub mod digest;
pub mod feed;
pub mod motion;
#[path = "../../../../tests/random.rs"]
pub mod random;
pub mod vectors;
