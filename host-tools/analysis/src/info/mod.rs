//! What a file is, whether it is plausible, and what can be done with it: `backseat info`.

mod log;
mod other;

pub use log::{report, verdict};
pub use other::describe;
