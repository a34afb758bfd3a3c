//! Identification of simulated experiments.

mod convergence;
mod sensitivities;
mod timing;
mod vectors;
