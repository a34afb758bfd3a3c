//! Host link: postcard messages in COBS frames with a CRC, between the board and a PC.
//!
//! One message carries clock, pulse-per-second edges and the chunks sent per port
//! ([`Step`]); its answer carries what the board sent and its digest ([`StepDone`]).

mod codec;
mod crash;
mod fittings;
mod health;
mod identification;
mod images;
mod messages;
mod mode;
mod refusal;
mod signed;
mod signing;

pub use codec::{CRC, Decoder, Frame, MAX_FRAME, MAX_MESSAGE, encode};
pub use crash::{Crash, KeptCrash, Task};
pub use fittings::{FittingReadings, FittingState, Fittings, ReleaseReason};
pub use health::{BoardLog, Hardware, Health, LogState, Oscillator, Stack};
pub use identification::{
    Activity, Decision, DecisionReason, Estimate, Estimates, FaultCause, FaultDiagnosis, FaultReport, FaultState,
    Identification, LearntStored, MAX_ESTIMATES, MAX_NAMED, NamedCause, Naming, Question, UsedFor, Visibility,
};
pub use images::{Image, ImageId, Images, StoredImage, UPDATE_CHUNK};
pub use messages::{
    Chunk, FromBoard, FusionTelemetry, Held, MAX_CHUNKS, MAX_FENCE_CORNERS, MAX_PPS, ParameterInfo, Port, ResetCause,
    Restart, Ship, Steered, Step, StepDone, Telemetry, ToBoard, Waypoint,
};
pub use mode::{Mode, ModeReason};
pub use refusal::Refusal;
pub use signed::Signed;
