//! Studies of identification on simulated experiments: methods, fault detection, compensation, planned missions.

mod accelerations;
mod command;
mod compensation;
pub mod experiment;
mod faults;
mod methods;
pub mod plan;

pub use command::{FaultArguments, MethodArguments, PlanArguments};
