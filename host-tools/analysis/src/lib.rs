//! What each command computes, as values: for the command line, for Python and for the laboratory.

pub mod ensemble;
pub mod fault_table;
pub mod flight_score;
pub mod provenance;
pub mod read_log;
pub mod track_score;
mod undeclared;
pub mod uses;
