//! Why a board does not do what it is asked.

use super::mode::ModeReason;
use serde::{Deserialize, Serialize};

/// Why a request was refused.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Refusal {
    /// No parameter of that name.
    UnknownParameter,
    /// Value not finite or outside [min, max].
    OutOfRange,
    /// Item out of order, too many items, or commit before all have come.
    Sequence,
    /// Not while a mission runs.
    UnderWay,
    /// The filter or the controller cannot be built from the set; the old one stays active.
    InvalidSet,
    /// Not in this mode: navigation has to be valid first.
    NotReady,
    /// The board has no memory for it, or is busy with it.
    NoStore,
    /// The memory refused; what was stored before is still there.
    StoreFailed,
    /// A mission runs or waits to begin, and parameters are not unlocked.
    Locked,
    /// Parameters that are each in range do not go together; the old set stays active.
    Inconsistent {
        /// The rule that does not hold (`backseat_core::parameters::Inconsistent`).
        rule: u8,
    },
    /// The board keeps its own clock: it is not at rest, or lock-step was not announced (a step at time zero without
    /// chunks).
    OwnClock,
    /// A safety limit may only become stricter while a mission runs or is armed.
    Relaxes,
    /// What was asked for is not safe.
    Unsafe(ModeReason),
    /// The fence is no simple polygon: fewer than three corners, or two of its edges meet.
    Fence,
    /// The board has a key, and takes what changes a flight only signed.
    Unsigned,
    /// Signed by another key, for another start of the board, or heard before.
    Forged,
    /// The image that runs is on trial: it is to be confirmed first.
    OnTrial,
    /// No image for this chip, or larger than its bank.
    NotAnImage,
    /// What is in flash has another CRC than what was announced.
    ImageDamaged,
    /// The board's parameters do not permit it.
    NotPermitted,
}
