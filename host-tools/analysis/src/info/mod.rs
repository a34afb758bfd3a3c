//! What a file is, whether it is plausible, and what can be done with it: `backseat info`.

mod log;
mod other;
mod settings;

pub use log::{report, verdict};
pub use other::describe;
pub(crate) use settings::instead_of_log;

/// A time in the unit that suits it.
fn span(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.1} s"),
        s if s < 7200.0 => format!("{:.1} min", s / 60.0),
        s => format!("{:.2} h", s / 3600.0),
    }
}
