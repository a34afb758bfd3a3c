//! What a board does, and why.

use serde::{Deserialize, Serialize};

/// Where the backseat stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Waiting for a first fix and sensors.
    Initialising = 1, // an Option's None is zero
    /// Navigation is valid.
    Navigating,
    /// Navigation runs on less than it needs.
    Degraded,
    /// Position is no longer known to its own bound.
    Lost,
    /// Neutral fins, stopped, frontseat in charge.
    Safe,
}

/// Why the mode is what it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ModeReason {
    /// Nothing to complain about.
    Nominal,
    /// No position fix yet.
    NoFix,
    /// Attitude is missing or stale.
    AttitudeStale,
    /// Depth is missing or stale.
    DepthStale,
    /// The frontseat is silent.
    FrontseatSilent,
    /// The frontseat refuses commands.
    FrontseatRefuses,
    /// A source and the filter contradict each other.
    Rejections,
    /// The position's own sigma exceeds its limit.
    PositionUncertain,
    /// The filter failed numerically.
    FilterFailed,
    /// Stopped by the operator.
    Stopped,
    /// The board was reset under way and carries on from its last position.
    Restarted,
    /// The board was reset too often in too short a time.
    Resets,
    /// The frontseat never acknowledged the stop.
    StopUnanswered,
    /// Water in the hull.
    Leak,
    /// Deeper than allowed, or than the leg.
    TooDeep,
    /// Too close to the bottom.
    TooLow,
    /// The pressure sensor contradicts the model: it jumped, drifts, or the vehicle's weight has changed.
    DepthDoubtful,
    /// Pitches too much.
    PitchExceeded,
    /// Too fast.
    SpeedExceeded,
    /// Does not leave the surface: no water, or no dive.
    NoWater,
    /// Outside the fence.
    OutsideFence,
    /// The first waypoint is too far away.
    FirstLegTooLong,
    /// A leg takes too long.
    LegTooLong,
    /// The mission takes too long.
    MissionTooLong,
    /// Too little charge.
    BatteryLow,
    /// Degraded for too long.
    DegradedTooLong,
    /// No acoustic range for too long.
    ContactLost,
    /// No precise clock for too long.
    ClockLost,
    /// The ship's acoustic abort.
    Aborted,
    /// The board's steps come late, too many of them.
    Overloaded,
    /// Last-resort hardware that is fitted does not pass its test.
    FittingFailed,
    /// The supply is below its last level.
    SupplyLow,
}
