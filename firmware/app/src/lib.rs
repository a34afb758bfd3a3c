//! The backseat as a sans-IO state machine: bytes and time in, bytes out.
//!
//! [`App`] takes bytes ([`App::receive`]), pulse-per-second edges ([`App::pps`]) and a step every
//! 0.1 s ([`App::step`]), and holds what is to be sent ([`App::transmit`]). It never blocks, reads
//! no clock and allocates nothing; every buffer is fixed and counts what it drops. [`Pump`] moves
//! bytes between it and any five `embedded-io` ports.
//!
//! | module | concept |
//! |---|---|
//! | `app` | the app from outside: ports, steps, the host link |
//! | `backseat` | the components, and the one place where their decisions are carried out |
//! | [`links`] | one link per device port: bytes to raw samples, requests to the device |
//! | [`inputs`] | the installation: raw samples to measurements; queue, packets, history of the actuators |
//! | `uplink` | the vehicle's own slots of the acoustic cycle: state uplink, pings |
//! | `estimator` | the filter, initialisation, the state at the present |
//! | `adaptation` | the adaptive identifier, the fault monitor |
//! | `steering`, `command`, `wiggle` | missions, commands to the frontseat, hand-back; the fins on the bench |
//! | `modes` | mode and reason from facts; when a mission has to end |
//! | `last_resort`, [`fitted`] | drop weight, abort line, leak detector, supply: what follows; their pins |
//! | `safety` | limits that end a mission though navigation is valid; what follows, as a decision |
//! | `requests`, `host`, `mission`, `telemetry` | requests and their answers; mission transfer; records of each step |
//! | [`parameters`] | the declared list, transactions |
//! | `storage`, [`store`], `persistence` | requests to store; flash and restart record; how a board serves them |
//! | `updates` | requests to renew the firmware |
//! | `recorded` | what goes into the board log |
//! | `time`, `geodesy` | local time to UTC; latitude and longitude to the local plane |
//! | `lockstep`, `pump` | clocks and ports |
//! | `step_watch` | what a watchdog is fed by |
#![no_std]

#[cfg(test)]
extern crate std;

mod adaptation;
mod app;
mod backseat;
mod command;
mod consequences;
mod drivers;
mod estimator;
pub mod fitted;
mod geodesy;
mod health;
mod held;
mod host;
pub mod inputs;
mod last_resort;
mod late;
mod learning;
pub mod links;
mod lockstep;
mod mission;
mod modes;
pub mod parameters;
mod persistence;
mod pump;
mod recorded;
mod requests;
mod ring;
mod safety;
mod separation;
mod steering;
mod step_watch;
mod storage;
pub mod store;
mod telemetry;
mod time;
mod updates;
mod uplink;
mod wiggle;

pub use app::App;
pub use geodesy::LocalFrame;
pub use health::Health;
pub use host::COMMIT;
pub use inputs::Loss;
pub use pump::{PARTIAL_US, PortFailure, Progress, Pump, SILENT_US, START_US};
pub use recorded::{Recorder, poll_recorded, record_start};
pub use ring::Ring;
pub use step_watch::StepWatch;
pub use time::{STEP_US, UtcClock};
pub use updates::Order;

/// A buffer of this size holds any sentence to frontseat or modem.
const SENTENCE: usize = 96;
