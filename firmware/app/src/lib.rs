//! The backseat as a sans-IO state machine: bytes and time in, bytes out.
#![no_std]

mod app;
mod lockstep;
mod pump;

pub use app::App;
pub use pump::{PortFailure, Progress, Pump};
