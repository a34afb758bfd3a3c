//! What is stated: a cause with size, onset and probability, and what else it could be.

use super::causes::Cause;

/// A cause that is named.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Named {
    /// What has changed.
    pub cause: Cause,
    /// By how much, in the cause's unit; the second number of those that have two.
    pub size: [f64; 2],
    /// One sigma of it.
    pub sigma: [f64; 2],
    /// Since when, filter's time, µs.
    pub since_us: u64,
    /// Its probability among all causes.
    pub probability: f64,
    /// What else it could be.
    pub rival: Option<Cause>,
}

impl Named {
    /// All of its bytes zero.
    pub(super) const NONE: Self = Self {
        cause: Cause::FinLost(0),
        size: [0.0; 2],
        sigma: [0.0; 2],
        since_us: 0,
        probability: 0.0,
        rival: Some(Cause::FinLost(0)),
    };
}

/// What is stated at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statement {
    /// Filter's time, µs.
    pub time_us: u64,
    /// The cause, and a second one beside it.
    pub named: [Option<Named>; 2],
    /// Something has changed that no cause of the table explains.
    pub unexplained: bool,
}
