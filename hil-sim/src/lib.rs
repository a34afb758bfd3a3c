//! Host-in-the-loop simulator: a simulated Iver3, ship, sensors and modem on virtual serial ports.

pub mod acoustics;
pub mod analysis;
pub mod backseat;
pub mod commands;
pub mod consistency;
pub mod dataset;
pub mod devices;
pub mod environment;
pub mod faults;
pub mod flight;
pub mod idsim;
pub mod noise;
pub mod observation;
pub mod packets;
pub mod pty;
pub mod report;
pub mod rng;
pub mod scenario;
pub mod score;
pub mod sensors;
pub mod ship;
pub mod truth;
pub mod world;
