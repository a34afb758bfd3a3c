//! One check of a board, and how it came out.

use serde_json::{Value, json};
use std::fmt;

/// How a check came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Pass,
    Fail,
    /// For the operator to judge.
    Note,
}

impl Verdict {
    pub const fn of(passed: bool) -> Self {
        if passed { Self::Pass } else { Self::Fail }
    }

    /// Passed; what is not fails, or is a note where that is excused.
    pub const fn graded(passed: bool, excused: bool) -> Self {
        if !passed && excused { Self::Note } else { Self::of(passed) }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::Pass => "ok",
            Self::Fail => "FAIL",
            Self::Note => "note",
        }
    }
}

/// One check.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CheckLine {
    pub verdict: Verdict,
    pub what: &'static str,
    found: String,
}

impl CheckLine {
    pub fn new(verdict: Verdict, what: &'static str, found: impl Into<String>) -> Self {
        Self { verdict, what, found: found.into() }
    }

    /// Check, verdict and what was found.
    pub fn cells(&self) -> [&str; 3] {
        [self.what, self.verdict.name(), &self.found]
    }

    pub fn json(&self) -> Value {
        json!({"check": self.what, "verdict": self.verdict.name().to_lowercase(), "found": self.found})
    }
}

impl fmt::Display for CheckLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<4}  {:<15}  {}", self.verdict.name(), self.what, self.found)
    }
}
