//! For how long to search.

use std::time::Duration;

/// The time that a variable of the environment gives, which has to be set.
pub fn seconds(variable: &str) -> Duration {
    let text = std::env::var(variable).unwrap_or_else(|_| panic!("{variable} is not set"));
    Duration::from_secs(text.parse().unwrap_or_else(|_| panic!("{variable}: expected whole seconds")))
}
