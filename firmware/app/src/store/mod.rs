//! What outlasts a reset or a dive: parameters in flash, the restart record, the board log.
//!
//! | module | concept |
//! |---|---|
//! | `record` | layout of one copy of the parameter set |
//! | `flash` | two copies in flash, of which a power cut can hurt only one |
//! | `restart` | the record of each step, and what the resets so far call for |
//! | `board` | how a board serves both |
//! | `recorded` | what goes into the board log |
//!
//! All of it is plain data behind byte slices and `embedded-storage`; the board owns the memory.

mod board;
mod flash;
mod record;
mod recorded;
mod restart;

pub use flash::{Geometry, ParameterFlash, SaveError};
pub use record::{Refused, WORD};
pub use recorded::{Recorder, poll_recorded, record_start};
pub use restart::{
    Navigation, RECORD_BYTES, ResetHistory, Response, RestartRecord, SAFE_AFTER, SAFE_WITHIN_US, newest,
};
