//! A board's codes in words.

use super::Severity;
use backseat_link::named;
use backseat_wire::hostlink::{
    Activity, FaultCause, FaultDiagnosis, FaultReport, FaultState, FittingState, Held, LearntStored, LogState, Mode,
    ModeReason, Naming, Oscillator, ReleaseReason,
};

/// Hours, minutes, seconds of UTC; without it the board's own time.
pub fn time_of_day(utc_us: u64, board_us: u64) -> String {
    if utc_us == 0 {
        return format!("+{:.1} s", board_us as f64 * 1e-6);
    }
    crate::screen::time_of_day(utc_us)
}

/// How bad a mode is.
pub const fn severity(mode: Mode) -> Severity {
    match mode {
        Mode::Navigating => Severity::Info,
        Mode::Initialising | Mode::Degraded => Severity::Warning,
        Mode::Lost | Mode::Safe => Severity::Critical,
    }
}

/// Whether a mode's reason is the operator's own doing.
pub fn intended(mode: Mode, reason: ModeReason) -> bool {
    mode == Mode::Safe && reason == ModeReason::Stopped
}

pub const fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Initialising => "initialising",
        Mode::Navigating => "navigating",
        Mode::Degraded => "degraded",
        Mode::Lost => "lost",
        Mode::Safe => "safe",
    }
}

pub use backseat_link::board::mode_reason as reason;

/// Mode and reason.
pub fn mode(mode: Mode, why: ModeReason) -> String {
    match reason(why) {
        "" => mode_name(mode).to_owned(),
        why => format!("{}: {why}", mode_name(mode)),
    }
}

pub const fn fitting(state: FittingState) -> &'static str {
    match state {
        FittingState::NotFitted => "not fitted",
        FittingState::Silent => "not read",
        FittingState::Ready => "ready",
        FittingState::Active => "active",
        FittingState::Wrong => "wrong",
    }
}

pub const fn release(reason: ReleaseReason) -> &'static str {
    match reason {
        ReleaseReason::Leak => "leak",
        ReleaseReason::TooDeep => "too deep",
        ReleaseReason::SupplyLow => "supply low",
        ReleaseReason::NoAscent => "the vehicle did not rise",
        ReleaseReason::Commanded => "by command",
    }
}

pub const fn oscillator(oscillator: Oscillator) -> &'static str {
    match oscillator {
        Oscillator::Crystal => "crystal",
        Oscillator::Internal => "internal",
    }
}

pub const fn log_state(state: LogState) -> &'static str {
    match state {
        LogState::NotFitted => "not fitted",
        LogState::Searching => "looks for the card",
        LogState::Writing => "written",
        LogState::Failed => "no card",
        LogState::Full => "card is full",
    }
}

pub const fn activity(activity: Activity) -> &'static str {
    match activity {
        Activity::Off => "off",
        Activity::NotUnderWay => "waits for a mission",
        Activity::Surfaced => "waits, surfaced",
        Activity::NoVelocity => "waits for a velocity",
        Activity::NoAttitude => "waits for attitude and rates",
        Activity::Starting => "starting",
        Activity::Adapting => "adapting",
        Activity::Diverged => "diverged",
    }
}

/// What became of what a dive has learnt.
pub fn learnt(stored: &LearntStored) -> (Severity, String) {
    if stored.kept {
        (Severity::Info, "what the dive has learnt is stored for the next one".to_owned())
    } else {
        (Severity::Warning, "what the dive has learnt is not stored: writing the flash failed".to_owned())
    }
}

/// What the fault monitor reports.
pub fn fault(report: &FaultReport) -> (Severity, String) {
    match (&report.diagnosis, report.state) {
        (Some(diagnosis), _) => (Severity::Critical, format!("fault: {}", diagnosis_text(diagnosis))),
        (None, FaultState::Learning) => (Severity::Info, "fault monitor: learns what is normal".to_owned()),
        (None, FaultState::Quiet) => (Severity::Info, "fault monitor: no fault".to_owned()),
        (None, FaultState::Suspicious | FaultState::Diagnosed) => {
            (Severity::Warning, "fault monitor: the vehicle no longer moves as before, cause not known yet".to_owned())
        }
    }
}

fn diagnosis_text(diagnosis: &FaultDiagnosis) -> String {
    let magnitude = diagnosis.magnitude;
    let size = match diagnosis.cause {
        FaultCause::Fin(_) => format!("{:.0} % of its lift lost", 100.0 * magnitude),
        FaultCause::Entanglement => format!("surge drag {:+.0} %", 100.0 * magnitude),
        FaultCause::Fouling => format!("{:.0} % of the thrust lost", 100.0 * magnitude),
        FaultCause::Flooding => format!("{magnitude:.2} kg of water"),
    };
    let rival = diagnosis.rival.map(|rival| format!(", or {}", cause(rival))).unwrap_or_default();
    format!("{}, {size}{rival} (confidence {:.2})", cause(diagnosis.cause), diagnosis.confidence)
}

/// Who steers.
pub fn steered(by_host: Option<&Held>) -> String {
    by_host.map_or_else(|| "no host steers any more".to_owned(), |held| format!("a host steers: {}", helm(held)))
}

/// What a host has the vehicle hold.
pub fn helm(held: &Held) -> String {
    let heading_deg = held.heading_rad.to_degrees().round().rem_euclid(360.0);
    format!("{heading_deg:03.0}° {:.1} m {:.2} m/s", held.depth_m, held.speed_mps)
}

/// What the board names of what has changed.
pub fn naming(naming: &Naming) -> (Severity, String) {
    let (is_warning, text) = named::sentence(naming);
    (if is_warning { Severity::Warning } else { Severity::Info }, text)
}

/// Name of a fault.
pub const fn cause(cause: FaultCause) -> &'static str {
    match cause {
        FaultCause::Fin(0) => "top fin",
        FaultCause::Fin(1) => "bottom fin",
        FaultCause::Fin(2) => "port fin",
        FaultCause::Fin(_) => "starboard fin",
        FaultCause::Entanglement => "something hangs on the hull",
        FaultCause::Fouling => "propeller fouled",
        FaultCause::Flooding => "water in the hull",
    }
}

/// Where the fault monitor stands, one word.
pub const fn fault_state(state: FaultState) -> &'static str {
    match state {
        FaultState::Learning => "learning",
        FaultState::Quiet => "quiet",
        FaultState::Suspicious => "suspicious",
        FaultState::Diagnosed => "diagnosed",
    }
}
