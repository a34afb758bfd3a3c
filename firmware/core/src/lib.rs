//! Numbers of the backseat: the vehicle's dynamics, the navigation filter and the controllers.
//!
//! No I/O, no clock, no allocation, no panics: fixed-size matrices in, fixed-size matrices out.
//! Conventions: north-east-down (NED) local frame; body frame forward-starboard-down at the centre
//! of gravity; SI units and radians; Euler angles roll, pitch, heading (ZYX), heading true; body
//! velocity is relative to the water; time is integer microseconds and always an argument.
//!
//! Equation numbers refer to Z. J. Harris, *Model-based Cooperative Acoustic Navigation and
//! Parameter Identification for Underactuated Underwater Vehicles* (Johns Hopkins University);
//! "corrected" marks an equation whose print has a sign or dimension error.
#![no_std]

pub mod control;
pub mod dynamics;
pub mod effects;
pub mod identification;
pub mod navigation;
pub mod parameters;
pub mod state;

#[cfg(test)]
#[path = "../../tests/random.rs"]
mod random;
