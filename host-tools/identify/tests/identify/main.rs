//! The methods against reference numbers, other derivations, and simulated experiments.

mod convergence;
mod sensitivities;
mod vectors;
