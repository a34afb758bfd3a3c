//! When something happens, and what is different meanwhile.

/// A stretch of time, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Span {
    /// Its first instant.
    pub from_s: f64,
    /// The first after it.
    pub until_s: f64,
}

impl Span {
    /// Whether a time lies in it.
    pub fn holds(&self, time_s: f64) -> bool {
        (self.from_s..self.until_s).contains(&time_s)
    }
}

/// A quantity that is larger for a while.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shift {
    /// By how much, in its unit.
    pub by: f64,
    /// When.
    pub when: Span,
}

impl Shift {
    /// What it adds at a time.
    pub fn at(&self, time_s: f64) -> f64 {
        if self.when.holds(time_s) { self.by } else { 0.0 }
    }
}
