//! A number with its interval, as the pages print it.

use backseat_logs::stats::{mean, mean_ci95};

/// Mean and its 95 % interval to this number of digits, `1.20 (1.00 to 1.40)`.
pub fn with_interval(samples: &[f64], digits: usize) -> String {
    match (mean(samples), mean_ci95(samples)) {
        (Some(mean), Some((low, high))) => format!("{mean:.digits$} ({low:.digits$} to {high:.digits$})"),
        (Some(mean), None) => format!("{mean:.digits$}"),
        _ => String::new(),
    }
}
