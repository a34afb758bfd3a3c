//! Last-resort hardware: abort line, drop weight, leak detector, supply.

use serde::{Deserialize, Serialize};

/// What the inputs say, and what the pins of the outputs really do; `None`: not fitted, or not read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FittingReadings {
    /// The abort line is active.
    pub abort_line: Option<bool>,
    /// The drop weight's release is active.
    pub drop_weight: Option<bool>,
    /// The leak detector is wet.
    pub leak: Option<bool>,
    /// The vehicle's supply, V.
    pub supply_v: Option<f32>,
}

/// How one of them stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum FittingState {
    /// By the parameters there is none.
    #[default]
    NotFitted,
    /// There is one, and it is not read: the board has no pin for it, or has not started since it was declared.
    Silent,
    /// An output at rest, an input as it should be before a dive.
    Ready,
    /// Line active, weight released, detector wet, supply below its last level.
    Active,
    /// The pin does not follow the command, or the reading is no supply.
    Wrong,
}

/// Why the drop weight was released.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ReleaseReason {
    /// Water in the hull.
    Leak,
    /// Deeper than the largest depth and a margin.
    TooDeep,
    /// The supply is below its last level.
    SupplyLow,
    /// The mission was ended, and the vehicle does not rise.
    NoAscent,
    /// The operator's command.
    Commanded,
}

/// All of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Fittings {
    /// In the order of [`Self::NAMES`].
    pub states: [FittingState; 4],
    /// The vehicle's supply, V; 0 while it is not read.
    pub supply_v: f32,
    /// The abort line is commanded active.
    pub aborts: bool,
    /// The drop weight is commanded to fall.
    pub released: Option<ReleaseReason>,
}

impl Fittings {
    /// Names for people.
    pub const NAMES: [&str; 4] = ["abort line", "drop weight", "leak detector", "supply"];
}
