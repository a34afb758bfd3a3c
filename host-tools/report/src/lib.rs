//! One [`Report`] value of every command, shown as text, as JSON, and as a single HTML file that opens offline, in light
//! and dark, on a desk and on a phone.
//!
//! ```
//! use backseat_report::{Provenance, Report, Table, plots};
//!
//! let error = [(0.0, 0.0), (0.5, 0.4), (1.0, 0.7)];
//! let bound = [(0.0, 0.1), (0.5, 0.9), (1.0, 0.9)];
//! let figure = plots::error_vs_time(&plots::ErrorPlot {
//!     y_label: "horizontal error [m]",
//!     series: &[("dynamic, no DVL", &error)],
//!     bound: Some(("the filter's own 95 %", &bound)),
//!     scale: plots::Scale::Linear,
//! });
//! let html = Report::new("Navigation without a DVL", "Median error 0.46 m over 3.0 h.")
//!     .table(Table::new("Horizontal error", &["configuration", "median [m]", "95 % [m]"]).row(["dynamic", "0.46", "0.98"]))
//!     .figure("Error against time.", figure)
//!     .provenance(Provenance { command: "backseat navigate log.csv", seed: Some(7), version: "0.1.0" })
//!     .html();
//! assert!(html.contains("Median error 0.46 m"));
//! ```

pub mod console;
mod glossary;
mod html;
mod lettering;
pub mod markdown;
mod palette;
pub mod plots;
mod report;
mod shell;
mod table;
mod text;

pub use report::{Provenance, Report};
pub use shell::word;
pub use table::Table;
