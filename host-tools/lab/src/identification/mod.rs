//! Studies of identification on simulated experiments: methods, fault detection, compensation, planned missions.

mod acceleration;
mod accelerations;
mod command;
mod compensation;
mod excitation_planning;
mod faults;
mod gtls;
mod identified_vehicle;
mod methods;
pub mod nullspace;
mod plan_flight;

pub use command::{FaultArgs, MethodArgs, PlanArgs};
pub use gtls::gtls;
