//! What was written of a diagnosis, and how it was asked for.

use std::path::Path;

/// The options by which a log was diagnosed, each with a space before it, for the next command.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// By which any command reads the log.
    pub read: String,
    /// What is joined to it, and which run is taken.
    pub beside: String,
    /// What the result is judged by.
    pub judge: String,
    /// The declared vehicle.
    pub vehicle: String,
    /// Whether `navigate` can use the log by itself.
    pub is_navigable: bool,
}

/// Files that were written of a diagnosis, and how it was asked for.
#[derive(Clone, Debug, Default)]
pub struct Files<'a> {
    /// The vehicle with the effects.
    pub vehicle: Option<&'a Path>,
    /// The proposed terms, and the effects that no vehicle file holds.
    pub terms: Option<&'a Path>,
    /// How it was asked for.
    pub options: Options,
}
