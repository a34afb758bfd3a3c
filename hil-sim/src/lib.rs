//! Host-in-the-loop simulator: a simulated Iver3, ship, sensors and modem on virtual serial ports.

pub mod observation;
pub mod rng;
pub mod scenario;
pub mod world;
