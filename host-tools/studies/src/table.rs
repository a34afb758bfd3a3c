//! How tables and their numbers are written, Markdown.

use backseat_data::stats::{mean, mean_ci95};
use comfy_table::{Table, presets};

/// A Markdown table with this header.
pub fn markdown_table<T: Into<String>>(header: impl IntoIterator<Item = T>) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::ASCII_MARKDOWN).set_header(header.into_iter().map(Into::into).collect::<Vec<String>>());
    table
}

/// Mean and its 95 % interval to so many digits, `1.20 (1.00 to 1.40)`.
pub fn with_interval(samples: &[f64], digits: usize) -> String {
    match (mean(samples), mean_ci95(samples)) {
        (Some(mean), Some((low, high))) => format!("{mean:.digits$} ({low:.digits$} to {high:.digits$})"),
        (Some(mean), None) => format!("{mean:.digits$}"),
        _ => String::new(),
    }
}
