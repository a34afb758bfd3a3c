//! Adaptive identification: against the reference numbers, its own invariants, and on a simulated vehicle.

mod convergence;
mod fault;
mod filter;
mod laws;
mod robustness;
mod simulation;
mod support;
mod vectors;
