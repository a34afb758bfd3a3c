//! When something happens.

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
