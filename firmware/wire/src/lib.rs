//! Serial protocols of the backseat, one file each: parse and emit.
//!
//! The firmware parses what the simulator emits and the other way round, with the same file. Everything is `no_std`,
//! without allocation, and returns an [`Error`] for any input that is not of the protocol: nothing here panics.
//! Stream decoders are fed slices (`feed(&mut bytes)` until it returns `None`), keep what is incomplete in a fixed
//! buffer, find the next frame after noise, and count what they refuse by cause ([`Counts`]).
//!
//! | device | frames | text sentences |
//! |---|---|---|
//! | Iver frontseat | | [`iver::FromFrontseat`], [`iver::ToFrontseat`], [`gps`] through [`nmea::Framer`] |
//! | DVL | [`dvl::pd0`], [`dvl::pd4`] (also PD5) | [`dvl::pd6`] |
//! | AHRS | [`ahrs::gx3`], [`ahrs::mip`] | [`ahrs::os5000`] |
//! | WHOI Micro-Modem | payloads [`ship_state`], [`vehicle_state`] | [`modem::FromModem`], [`modem::ToModem`] |
//! | PC | [`hostlink`] | |
//! | memory card | [`boardlog`] | |
//!
//! SI units and radians, except latitude and longitude in degrees. What no public source settles (depth unit, fin byte
//! calibration, mounting angle, Doppler sign, clock encoding) is an explicit parameter.
#![no_std]

pub mod abort;
pub mod ahrs;
pub mod boardlog;
pub mod calendar;
pub mod decimal;
pub mod dvl;
pub mod ellipse;
mod error;
mod framer;
pub mod gps;
pub mod hex;
pub mod hostlink;
pub mod iver;
pub mod modem;
pub mod named;
pub mod nmea;
mod packet;
pub mod ship_state;
mod units;
pub mod vehicle_state;
mod write;

pub use decimal::Decimal;
pub use error::{Counts, Error};
