//! What each command computes, as values: for the command line, for Python and for the laboratory.

pub mod bench;
mod columns;
pub mod diagnose;
mod duration;
pub mod effect;
pub mod flight_score;
pub mod identify;
pub mod info;
mod level;
pub mod map;
pub mod mission_file;
pub mod navigate;
pub mod provenance;
pub mod reach;
pub mod read_log;
pub mod refusal;
pub mod replay;
mod settings_file;
pub mod sim;
pub mod topside_config;
pub mod track_score;
mod undeclared;
pub mod uses;
pub mod vehicle;
