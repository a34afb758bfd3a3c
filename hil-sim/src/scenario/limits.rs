//! `[limits]`: what a row of the fault table must keep.

use crate::quantity;
use serde::Deserialize;

/// `[limits]` of a scenario.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Why these limits: the reasoning, in the table's notes.
    pub why: String,
    /// Largest horizontal error from the first fault on, m.
    #[serde(deserialize_with = "quantity::length")]
    pub error_m: f64,
    /// Horizontal error at the end of the flight, m.
    #[serde(default, deserialize_with = "quantity::length")]
    pub end_error_m: Option<f64>,
    /// Least share of the mission's time in mode `navigating`.
    #[serde(default, deserialize_with = "quantity::share")]
    pub navigating: f64,
    /// What becomes of the mission.
    pub mission: End,
    /// Reasons of which at least one must be shown for not navigating; none if empty.
    #[serde(default)]
    pub reasons: Vec<String>,
    /// Why the vehicle sinks once it is no longer steered, whatever is commanded: then its depth is judged up to the
    /// mission's end.
    #[serde(default)]
    pub sinks: Option<String>,
    /// Why no data on board can reveal the fault: then an error beyond three sigmas is listed and not judged.
    #[serde(default)]
    pub unrevealable: Option<String>,
}

/// What becomes of a mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// Flown to its end.
    Flown,
    /// Ended by the backseat, with neutral fins and stop.
    Ended,
    /// Either.
    Any,
}
