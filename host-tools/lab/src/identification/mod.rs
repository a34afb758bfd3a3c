//! Studies of identification on simulated experiments: methods, fault detection, compensation, planned missions.

mod accelerations;
mod command;
mod compensation;
mod excitation_planning;
mod faults;
mod identified_vehicle;
mod methods;
mod plan_flight;

pub use command::{FaultArgs, MethodArgs, PlanArgs};
