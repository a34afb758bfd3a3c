//! Studies of identification on simulated experiments: methods, fault detection, compensation, planned missions.

mod acceleration;
mod accelerations;
mod compensation;
pub mod excitation_planning;
pub mod faults;
mod gtls;
mod identified_vehicle;
pub mod methods;
pub mod nullspace;
mod plan_flight;

pub use gtls::gtls;
