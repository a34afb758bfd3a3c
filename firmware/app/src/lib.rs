//! The backseat as a sans-IO state machine: bytes and time in, bytes out.
//!
//! [`App`] takes bytes ([`App::receive`]), pulse-per-second edges ([`App::pps`]) and a step every
//! 0.1 s ([`App::step`]), and holds what is to be sent ([`App::transmit`]). It never blocks, reads
//! no clock and allocates nothing; every buffer is fixed and counts what it drops. [`Pump`] moves
//! bytes between it and any five `embedded-io` ports.
//!
//! | module | concept |
//! |---|---|
//! | `app` | the state machine: ports, steps, requests of the host |
//! | `decode` | one link per device port: bytes to events, requests and configuration |
//! | `estimator` | the filter, its queue of events, its inputs, initialisation |
//! | `adaptation` | the adaptive identifier; when its parameters are used, and given up again |
//! | `acoustics` | from the modem's sentences to ranges |
//! | `time`, `geodesy` | local time to UTC; latitude and longitude to the local plane |
//! | `modes` | mode and reason from facts; when a mission has to end |
//! | `command` | `$OMP`, `$OMS`, stop and hand-back |
//! | [`parameters`] | the declared list, transactions |
//! | `mission` | mission transfer |
//! | `telemetry` | records of each step |
//! | `wiggle` | the fins on the bench |
//! | [`store`] | what survives a reset: parameters in flash, the restart record |
//! | `lockstep`, `pump` | clocks and ports |
//! | `held` | options that are zero when empty |
#![no_std]

#[cfg(test)]
extern crate std;

mod acoustics;
mod adaptation;
mod app;
mod command;
mod decode;
mod estimator;
mod event;
mod geodesy;
mod health;
mod held;
mod host;
mod lockstep;
mod mission;
mod modes;
pub mod parameters;
mod pump;
mod queue;
mod ring;
mod steering;
pub mod store;
mod telemetry;
mod time;
mod wiggle;

pub use acoustics::Loss;
pub use app::{App, STEP_US};
pub use geodesy::LocalFrame;
pub use health::Health;
pub use pump::{PortFailure, Progress, Pump, START_US};
