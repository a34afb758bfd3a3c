//! State that survives a reset: parameters in flash, the records of a restart and of crashes.
//!
//! | module | concept |
//! |---|---|
//! | `record` | layout of one copy of the parameter set |
//! | `flash` | two copies in flash, of which a power cut can hurt only one |
//! | `images` | two images of the firmware, of which one always starts |
//! | `under_way` | whether a mission was under way, where the supply was lost |
//! | `crash` | what faults and panics leave behind |
//! | `restart` | the record of each step, and how to start after a reset |
//!
//! All of it is plain data behind byte slices and `embedded-storage`; the board owns the memory.

mod crash;
mod flash;
mod images;
mod record;
mod restart;
mod under_way;

pub use crash::{
    CRASH_WORDS, CRASHES, CrashMemory, CrashSlot, forget_crashes, keep_crash, kept_crashes, take_last_crash,
};
pub use flash::{Geometry, ParameterFlash, SaveError};
pub use images::{Chip, ImageFlash, Start, TRIAL_STARTS};
pub use record::{FINGERPRINT, Refused, WORD};
pub use restart::{
    Coasted, Navigation, RECORD_BYTES, ResetHistory, Response, RestartRecord, SAFE_AFTER, SAFE_WITHIN_US, coast_m,
    newest,
};
pub use under_way::MarkError;
