//! Studies of identification on simulated experiments: methods, fault detection, compensation, planned missions.

mod accelerations;
mod command;
mod compensation;
mod excitation_planning;
pub mod experiment;
mod faults;
mod methods;
mod plan_flight;

pub use command::{FaultArgs, LimitArgs, MethodArgs, PlanArgs};
