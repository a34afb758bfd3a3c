//! Refusals, and reasons of modes, in words.

use backseat_core::parameters::Inconsistent;
use backseat_wire::hostlink::{ModeReason, Refusal};

/// Why the board does not do it.
#[must_use]
pub fn reason(refusal: Refusal) -> String {
    let text = match refusal {
        Refusal::UnknownParameter => "it has no such parameter",
        Refusal::OutOfRange => "a number is outside its range",
        Refusal::Sequence => "items arrived out of order, there are too many, or some are missing",
        Refusal::UnderWay => "a mission runs or is armed; stop it first (backseat mission stop)",
        Refusal::InvalidSet => "the filter or the controller cannot be built from these numbers",
        Refusal::NotReady => {
            "not now: navigation is lost, flash is being written, the fins are being tested, or the frontseat has not \
             acknowledged a stop"
        }
        Refusal::NoStore => "it has no flash for that, or is still writing it",
        Refusal::Locked => "a mission runs or is armed; --unlock admits the parameters that may change under way",
        Refusal::StoreFailed => "writing its flash failed; what was stored before is still there",
        Refusal::Inconsistent { rule } => match Inconsistent::of_rule(rule) {
            Some(inconsistent) => return inconsistent.to_string(),
            None => "parameters do not go together (by a rule of newer firmware than this program)",
        },
        Refusal::OwnClock => {
            "it keeps its own clock: a mission runs, is armed or is being stopped, or the resets were not acknowledged \
             (backseat mission stop), or the simulator did not begin with time zero"
        }
        Refusal::Relaxes => "a safety limit may only become stricter while a mission runs or is armed",
        Refusal::Fence => "the fence is no simple polygon: fewer than three corners, or two of its edges meet",
        Refusal::Unsigned => {
            "it has a key, and takes what changes a flight only from whoever has it (--key FILE; of a simulation \
             [acoustics] key)"
        }
        Refusal::Forged => "its key is another than the one given, or another program signed a request meanwhile",
        Refusal::OnTrial => "its firmware is on trial: confirm it (backseat update --confirm), or let it return",
        Refusal::NotAnImage => "it is no image for this board's chip, or larger than a bank of its flash",
        Refusal::ImageDamaged => "what is in its flash has another CRC than the file; the old firmware runs on",
        Refusal::NotPermitted => {
            "its parameters do not permit it: app.helm has to be 1, and app.control_law 0 or 1, before the mission starts"
        }
        Refusal::Unsafe(cause) => {
            return format!("not safe by the limits of its section safety: {}", mode_reason(cause));
        }
    };
    text.to_owned()
}

/// Why a mode is what it is; empty where there is nothing to say.
#[must_use]
pub const fn mode_reason(reason: ModeReason) -> &'static str {
    match reason {
        ModeReason::Nominal => "",
        ModeReason::NoFix => "no position fix yet",
        ModeReason::AttitudeStale => "attitude missing or stale",
        ModeReason::DepthStale => "depth missing or stale",
        ModeReason::FrontseatSilent => "the frontseat is silent",
        ModeReason::FrontseatRefuses => "the frontseat refuses commands",
        ModeReason::Rejections => "a source and the filter contradict each other",
        ModeReason::PositionUncertain => "position uncertain",
        ModeReason::FilterFailed => "the filter failed numerically",
        ModeReason::Stopped => "stopped by the operator",
        ModeReason::Restarted => "reset under way; position dates from before",
        ModeReason::Resets => "reset too often",
        ModeReason::StopUnanswered => "the frontseat does not acknowledge the stop",
        ModeReason::Leak => "a leak, by the frontseat or the board's own detector",
        ModeReason::TooDeep => "too deep (safety.depth_max_m, depth_below_leg_m)",
        ModeReason::TooLow => "too close to the bottom (safety.altitude_min_m)",
        ModeReason::DepthDoubtful => {
            "depth sensor doubtful, or the weight has changed (safety.depth_jump_m, depth_drift_m)"
        }
        ModeReason::PitchExceeded => "pitches too much (safety.pitch_max_rad)",
        ModeReason::SpeedExceeded => "too fast (safety.speed_max_mps)",
        ModeReason::NoWater => "does not dive: no water? (safety.dive_time_max_s)",
        ModeReason::OutsideFence => "outside the fence (safety.fence_radius_m, or the mission's [fence])",
        ModeReason::FirstLegTooLong => "first waypoint too far away (safety.first_leg_max_m)",
        ModeReason::LegTooLong => "the leg takes too long (safety.leg_time_factor)",
        ModeReason::MissionTooLong => "the mission is too long (safety.mission_time_max_s)",
        ModeReason::BatteryLow => "battery low (safety.battery_min_percent)",
        ModeReason::DegradedTooLong => "degraded for too long (safety.degraded_time_max_s)",
        ModeReason::ContactLost => "no acoustic range for too long (safety.contact_time_max_s)",
        ModeReason::ClockLost => "precise clock lost (safety.clock_time_max_s)",
        ModeReason::Overloaded => "the board's steps come late: it does not keep up",
        ModeReason::FittingFailed => "last-resort hardware does not pass its test: see backseat check",
        ModeReason::SupplyLow => "the supply is below its last level (app.supply_last_v)",
        ModeReason::Aborted => "the ship's acoustic abort",
    }
}
