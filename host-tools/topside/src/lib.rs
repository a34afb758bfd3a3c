//! The ship's half of the acoustic system, as a sans-IO state machine.
//!
//! [`Topside`] takes bytes of the ship's GNSS receiver and of its Micro-Modem ([`Topside::receive`]), edges of a pulse
//! per second if there are any ([`Topside::pps`]) and a step every 0.1 s or faster ([`Topside::step`]), and holds what
//! is to be sent ([`Topside::transmit`]). It reads no clock, never blocks and allocates nothing.
//!
//! ```text
//! GNSS ─> gnss ─> ship's filter ──> packet of the slot ─┐
//!           └───> clock ──> slot table ─────────────────┼─> modem
//! modem ─> clock checks, uplinks, ranges ─> tracks ─────┘
//! ```
//!
//! | module | concept |
//! |---|---|
//! | `config` | what the ship's half has to be given |
//! | [`slots`] | the cycle and its slots; which of them overlap |
//! | `gnss` | sentences of the GNSS receiver, and what is wrong with them |
//! | [`ship`] | the ship's own filter: position and velocity with their accuracy |
//! | [`track`] | a filter for each vehicle, fed by its uplinks and by ranges |
//! | `modem` | settings and clock of the modem, packets that leave and arrive |
//! | [`hold`] | why nothing is sent |
//! | `names` | what each vehicle names of what has changed |
//! | `event` | what happened, for logs and screens |
//! | [`Topside`] | readiness, sending (slots, the abort), hearing |
//!
//! Time is that of the caller's clock, µs, and UTC in µs since 1970. Positions are north and east of the origin, m.
#![no_std]

#[cfg(test)]
extern crate std;

mod config;
mod event;
mod gnss;
pub mod hold;
mod modem;
mod names;
pub mod ship;
pub mod slots;
mod topside;
pub mod track;
mod walk;

pub use config::{Config, ConfigError, MAX_VEHICLES, Vehicles};
pub use event::Event;
pub use hold::Hold;
pub use modem::{ClockHealth, MAX_RATE};
pub use names::Names;
pub use topside::{ABORT_PACKETS, AbortRefused, Port, Sent, Topside};
