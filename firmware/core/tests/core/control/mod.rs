//! Trackline following: against the reference numbers, in closed loop on the model, and against absurd input.

mod closed_loop;
mod helm;
mod properties;
mod simulation;
mod vectors;
