//! Simulator of an Iver3, its ship, sensors and acoustic modems, which flies missions against a backseat.

pub mod acoustics;
pub mod backseat;
pub mod dataset;
pub mod devices;
pub mod ending;
pub mod environment;
pub mod faults;
pub mod fittings;
pub mod flight;
pub mod noise;
pub mod observation;
mod quantity;
pub mod rng;
pub mod scenario;
pub mod sensors;
pub mod ship;
pub mod ship_end;
pub mod truth;
pub mod world;
