//! The simulated vehicle: its own equations, its own integrator, its own parameter set.
//!
//! Nothing here comes from the backseat's dynamics: a filter that were tested on its own model
//! could not show that the model is wrong. The two are compared, where they should agree, in
//! `tests/simulator/truth`.
//!
//! What this vehicle has and the backseat's model has not: servos of finite speed, a propeller that
//! takes time to spin up, white acceleration disturbance, current that varies with depth and time,
//! a surface at which buoyancy is lost, fins that differ from one another, and what [`Undeclared`] lists.

mod actuators;
mod faults;
mod integrator;
pub mod mounting;
mod parameters;
mod plant;
mod span;
mod undeclared;
mod vehicle;

pub use actuators::Actuators;
pub use faults::{Faults, Flooding, Step};
pub use integrator::runge_kutta_4;
pub use parameters::{Fin, Parameters};
pub use plant::{Plant, State, Water};
pub use span::{Shift, Span};
pub use undeclared::{DragChange, FinFault, Stuck, Undeclared};
pub use vehicle::{Vehicle, VehicleTruth};
