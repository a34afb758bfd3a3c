//! Verdicts on what was observed of a board.

use super::line::{CheckLine, Verdict};
use backseat_analysis::reach::{self, FlightSetup};
use backseat_app::parameters::PARAMETER_SCHEMA;
use backseat_link::board::{Declared, Identity};
use backseat_logs::data_sheets;
use backseat_wire::calendar::DateTime;
use backseat_wire::hostlink::{
    BoardLog, Hardware, Health, Images, KeptCrash, LogState, Mode, ModeReason, Oscillator, Port, Restart, Stack,
    StoredImage, Telemetry,
};
use std::time::Duration;

/// Telemetry comes ten times a second; a busy computer may hold some up.
const LEAST_RATE_HZ: f64 = 8.0;

/// Two clocks that are set differ by less; which of them is wrong is for the operator to say.
const CLOCK_DIFFERENCE_S: f64 = 5.0;

/// What was observed of a board.
pub struct Look {
    pub identity: Identity,
    /// None: it has no second bank.
    pub images: Option<Images>,
    pub parameters: Vec<Declared>,
    pub waypoints: usize,
    /// Before and after the watch.
    pub counters: (Health, Health),
    /// During the watch.
    pub telemetry: Vec<Telemetry>,
    pub watched: Duration,
    /// This computer's clock at its end, µs since 1970.
    pub now_us: u64,
    /// The board has a key.
    pub has_key: bool,
}

/// Every check, in the order of a table.
pub fn lines(look: &Look) -> Vec<CheckLine> {
    let Identity { restart: last, earlier_crashes, .. } = &look.identity;
    let mut lines = vec![firmware(&look.identity), restart(last.as_ref())];
    lines.extend(earlier(earlier_crashes));
    lines.push(telemetry(look));
    lines.extend(look.images.as_ref().map(images));
    lines.extend(Port::DEVICES.map(|port| device(look, port)));
    lines.extend([
        losses(look),
        steps(look),
        clock(look),
        oscillator(look),
        log(look),
        hardware(look),
        pps(look),
        mode(look),
        parameters(&look.parameters),
        priors(&look.parameters),
        alert(&look.parameters),
        mission(look.waypoints),
        key(look),
    ]);
    lines
}

fn firmware(identity: &Identity) -> CheckLine {
    let Identity { firmware, schema, image, .. } = identity;
    let same = *schema == PARAMETER_SCHEMA;
    let other = if same { String::new() } else { format!("; this program knows version {PARAMETER_SCHEMA}") };
    let verdict = if same { Verdict::Pass } else { Verdict::Note };
    CheckLine::new(verdict, "firmware", format!("{firmware} ({image}), parameter list version {schema}{other}"))
}

/// Of the two banks: no mission starts while an image is on trial.
fn images(images: &Images) -> CheckLine {
    let (verdict, found) = match (images.trial, images.other) {
        (Some(starts), _) => {
            let found = format!("on trial, start {starts}: no mission starts. Next: backseat update PORT --confirm");
            (Verdict::Fail, found)
        }
        (None, Some(StoredImage { image, starts: 1.., confirmed: false })) => {
            (Verdict::Note, format!("back from image {:08x}, which was started and not confirmed", image.build))
        }
        (None, _) => (Verdict::Pass, "the one that runs stays".to_owned()),
    };
    CheckLine::new(verdict, "image", found)
}

fn restart(restart: Option<&Restart>) -> CheckLine {
    let Some(Restart { cause, resets, safe, crash }) = restart else {
        return CheckLine::new(Verdict::Note, "last start", "cause unknown to the board");
    };
    let barred = if *safe { "; too many in ten minutes: safe mode" } else { "" };
    let before = crash.map_or(String::new(), |crash| format!("; before it: {crash}"));
    let found = format!("{cause:?}; {resets} resets by a fault since power-on{barred}{before}");
    CheckLine::new(Verdict::of(*resets == 0 && !safe), "last start", found)
}

/// Crashes before the last, which the board keeps until a card has them.
fn earlier(crashes: &[KeptCrash]) -> Option<CheckLine> {
    let found: Vec<String> = crashes.iter().map(ToString::to_string).collect();
    (!found.is_empty()).then(|| CheckLine::new(Verdict::Note, "earlier crashes", found.join("; ")))
}

fn telemetry(look: &Look) -> CheckLine {
    let rate_hz = look.telemetry.len() as f64 / look.watched.as_secs_f64();
    let found = if look.telemetry.is_empty() {
        "none; a board in lock-step waits for its simulator".to_owned()
    } else {
        format!("{rate_hz:.1} records a second")
    };
    CheckLine::new(Verdict::of(rate_hz >= LEAST_RATE_HZ), "telemetry", found)
}

/// Whether a parameter of the board is on.
fn is_on(look: &Look, name: &str) -> bool {
    value(look, name).is_some_and(|value| value != 0.0)
}

fn value(look: &Look, name: &str) -> Option<f64> {
    look.parameters.iter().find(|parameter| parameter.name == name).map(|parameter| parameter.value)
}

fn uses_ranges(look: &Look) -> bool {
    is_on(look, "app.use_range") || is_on(look, "app.use_range_rate")
}

fn device(look: &Look, port: Port) -> CheckLine {
    let (what, needed) = match port {
        Port::Frontseat => ("frontseat port", true),
        // 3: the velocity comes in the frontseat's sentence
        Port::Dvl => (
            "DVL port",
            (is_on(look, "app.use_dvl") || is_on(look, "app.use_water_track"))
                && value(look, "app.dvl_source") != Some(3.0),
        ),
        Port::Ahrs => ("AHRS port", !is_on(look, "app.attitude_source")),
        Port::Modem | Port::Host => ("modem port", uses_ranges(look)),
    };
    let index = port as usize;
    let (before, after) = &look.counters;
    let during = |counts: fn(&Health) -> [u32; 4]| counts(after)[index].saturating_sub(counts(before)[index]);
    let (accepted, rejected) = (during(|health| health.accepted_frames), during(|health| health.rejected_frames));
    let all = (after.accepted_frames[index], after.rejected_frames[index]);
    // A modem without packets is silent; it answers when it is configured.
    let heard = if port == Port::Modem { all.0 > 0 } else { accepted > 0 };
    let verdict = Verdict::graded(heard && rejected <= accepted, !needed && !heard);
    let seconds = look.watched.as_secs();
    let unused = if needed { "" } else { "; the parameters do not use this port" };
    let found = format!(
        "{accepted} good and {rejected} refused frames in {seconds} s ({} and {} since start){unused}",
        all.0, all.1
    );
    CheckLine::new(verdict, what, found)
}

/// Bytes that reached the board and not its decoders: too much at once, or a line that is wired or set wrong.
fn losses(look: &Look) -> CheckLine {
    const WHAT: &str = "receive losses";
    let (before, after) = &look.counters;
    let losses: Vec<String> = Port::NAMES
        .iter()
        .zip(before.receive_losses.iter().zip(after.receive_losses))
        .filter(|(_, (_, all))| *all > 0)
        .map(|(name, (before, all))| format!("{name} {} ({all} since start)", all.saturating_sub(*before)))
        .collect();
    let verdict = Verdict::graded(losses.is_empty(), before.receive_losses == after.receive_losses);
    let found = match losses.is_empty() {
        true => "none on any port since start".to_owned(),
        false => format!("in {} s: {}", look.watched.as_secs(), losses.join(", ")),
    };
    CheckLine::new(verdict, WHAT, found)
}

/// Steps that did not come in time: a computer that is too busy, or a board whose step takes too long.
fn steps(look: &Look) -> CheckLine {
    let (before, after) = &look.counters;
    let during = after.late_steps.saturating_sub(before.late_steps);
    let verdict = Verdict::graded(after.late_steps == 0, during == 0);
    let found = match after.late_steps {
        0 => "all in time since start".to_owned(),
        all => format!(
            "{during} late in {} s ({all} since start, the latest by {:.0} ms)",
            look.watched.as_secs(),
            f64::from(after.latest_step_us) * 1e-3
        ),
    };
    CheckLine::new(verdict, "steps", found)
}

fn clock(look: &Look) -> CheckLine {
    let verdict = |known| if uses_ranges(look) { Verdict::of(known) } else { Verdict::Note };
    let utc_us = look.telemetry.last().map_or(0, |record| record.utc_us);
    if utc_us == 0 {
        let found = "unknown: no GPS sentence with a valid time yet";
        return CheckLine::new(verdict(false), "clock", found);
    }
    let seconds = (utc_us as f64 - look.now_us as f64) * 1e-6;
    let found = format!("{} UTC, {seconds:+.1} s from this computer's clock", date(utc_us));
    let close = seconds.abs() < CLOCK_DIFFERENCE_S;
    CheckLine::new(if close { Verdict::Pass } else { Verdict::Note }, "clock", found)
}

/// Date and time of day.
pub fn date(utc_us: u64) -> String {
    let Ok(DateTime { date, time }) = DateTime::from_unix_us(utc_us) else { return format!("{utc_us} µs") };
    let ((year, month, day), (hour, minute, second, _)) = (date.parts(), time.parts());
    format!("{year:04}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}")
}

/// What counts the board's time: without a crystal one-way ranges need every edge of the pulse per second.
fn oscillator(look: &Look) -> CheckLine {
    const WHAT: &str = "oscillator";
    let (_, health) = &look.counters;
    let (found, verdict) = match (health.oscillator, health.synchronised) {
        (Oscillator::Crystal, _) => ("external, 20 ppm", Verdict::Pass),
        (Oscillator::Internal, true) => {
            ("internal, 1 %: no clock at HSE; ranges need the pulse per second", Verdict::Note)
        }
        (Oscillator::Internal, false) => (
            "internal, 1 %: no clock at HSE, and UTC does not rest on the pulse per second: one-way ranges are refused",
            if uses_ranges(look) { Verdict::Fail } else { Verdict::Note },
        ),
    };
    CheckLine::new(verdict, WHAT, found)
}

/// Without the board's own log nobody learns afterwards what it did.
fn log(look: &Look) -> CheckLine {
    let BoardLog { state, lost_records } = look.counters.1.log;
    // what an older board does not have, is required
    let required = value(look, "app.log_required") != Some(0.0);
    let (found, verdict) = match state {
        LogState::NotFitted => ("this board keeps none".to_owned(), Verdict::Note),
        LogState::Writing if lost_records == 0 => ("being written".to_owned(), Verdict::Pass),
        LogState::Writing => (format!("being written; {lost_records} records lost since start"), Verdict::Note),
        LogState::Searching => ("the card has not answered yet".to_owned(), Verdict::Fail),
        LogState::Failed => ("no card, or it failed; it is tried again every 10 s".to_owned(), Verdict::Fail),
        LogState::Full => (
            format!("the card is full, {lost_records} records lost since start; empty it, or take another"),
            Verdict::Fail,
        ),
    };
    match (verdict, required) {
        (Verdict::Fail, false) => {
            CheckLine::new(Verdict::Note, "board log", found + "; the mission does not require it (app.log_required)")
        }
        _ => CheckLine::new(verdict, "board log", found),
    }
}

/// What should not happen on a board that is about to dive; what it has room for, where it says so.
fn hardware(look: &Look) -> CheckLine {
    const WHAT: &str = "hardware";
    let Some(hardware) = look.counters.1.hardware else {
        return CheckLine::new(Verdict::Note, WHAT, "a computer stands in for the board");
    };
    let Hardware {
        supply_dips,
        brown_out_level,
        wrong_bits: [mended, lost],
        longest_step_us,
        load_permille,
        lost_edges,
        stacks,
    } = hardware;
    let mut found = vec![format!(
        "load {:.0} %, longest step {:.1} ms, stacks {} bytes",
        0.1 * f64::from(load_permille),
        1e-3 * f64::from(longest_step_us),
        stacks.map(|stack| format!("{} of {}", stack.used, stack.room)).join(" and ")
    )];
    if supply_dips > 0 {
        found.push(format!("the supply fell {supply_dips} times"));
    }
    if hardware.has_low_brown_out() {
        found.push(format!("brown-out level {brown_out_level}: set 3 (README of the board, option bytes)"));
    }
    if mended + lost > 0 {
        found.push(format!("wrong bits in memory: {mended} corrected, {lost} not"));
    }
    if lost_edges > 0 {
        found.push(format!("{lost_edges} pulse edges too fast to be told apart"));
    }
    let verdict = match (supply_dips + lost, found.len()) {
        (1.., _) => Verdict::Fail,
        _ if hardware.is_loaded() || stacks.iter().any(Stack::is_narrow) => Verdict::Fail,
        (0, 1) => Verdict::Pass,
        _ => Verdict::Note,
    };
    CheckLine::new(verdict, WHAT, found.join("; "))
}

fn pps(look: &Look) -> CheckLine {
    let (before, after) = &look.counters;
    let edges = after.pps_edges.saturating_sub(before.pps_edges);
    let seconds = look.watched.as_secs();
    let synchronised =
        if after.synchronised { "UTC is synchronised to them" } else { "UTC is not synchronised to them" };
    let found = format!("{edges} edges in {seconds} s, {synchronised}");
    let steady = u64::from(edges).abs_diff(seconds) <= 1 && after.synchronised;
    // a computer has no such input, in the simulator none is missed; a board always reports its hardware
    if after.hardware.is_none() && after.pps_edges == 0 {
        let found = "a computer stands in for the board, and has no such input: at sea one-way ranges need the board";
        return CheckLine::new(Verdict::Note, "PPS", found);
    }
    CheckLine::new(Verdict::graded(steady, !uses_ranges(look)), "PPS", found)
}

fn mode(look: &Look) -> CheckLine {
    let Some(Telemetry { mode, reason, state, sigma, .. }) = look.telemetry.last() else {
        return CheckLine::new(Verdict::Fail, "mode", "not received");
    };
    let verdict = match (mode, reason) {
        (Mode::Navigating, _) => Verdict::Pass,
        // Where a bench has no sky, or after the operator's own stop.
        (Mode::Initialising, ModeReason::NoFix) | (Mode::Degraded, _) | (Mode::Safe, ModeReason::Stopped) => {
            Verdict::Note
        }
        _ => Verdict::Fail,
    };
    let place = if sigma[0] > 0.0 {
        format!("; x {:.1} m, y {:.1} m, one sigma {:.1} m", state[0], state[1], sigma[0].hypot(sigma[1]))
    } else {
        String::new()
    };
    CheckLine::new(verdict, "mode", format!("{mode:?}, {reason:?}{place}"))
}

fn parameters(parameters: &[Declared]) -> CheckLine {
    let outside: Vec<&str> = parameters
        .iter()
        .filter(|p| !(p.min..=p.max).contains(&p.value))
        .map(|parameter| parameter.name.as_str())
        .collect();
    let own = parameters.iter().filter(|parameter| parameter.value != parameter.default).count();
    let outside_range =
        if outside.is_empty() { String::new() } else { format!("; outside their range: {}", outside.join(", ")) };
    let found = format!("{} read, {own} not at their default{outside_range}", parameters.len());
    CheckLine::new(Verdict::of(outside.is_empty()), "parameters", found)
}

/// What is declared better than any device is sold.
fn priors(parameters: &[Declared]) -> CheckLine {
    let of = |name: &str| parameters.iter().find(|parameter| parameter.name == name).map(|found| found.value);
    let below = data_sheets::below(of);
    let said: Vec<String> = below.iter().map(|(name, text)| format!("{name}: {text}")).collect();
    let none = said.is_empty();
    let found = if none { "none is below its device's data sheet".to_owned() } else { said.join("; ") };
    CheckLine::new(if none { Verdict::Pass } else { Verdict::Note }, "priors", found)
}

/// Limits of the protection level, and whether they can be kept.
fn alert(parameters: &[Declared]) -> CheckLine {
    const WHAT: &str = "alert limits";
    let flown = FlightSetup::by(parameters.iter().map(|parameter| (parameter.name.as_str(), parameter.value)));
    let [horizontal_m, depth_m] = flown.alerts_m;
    if flown.alerts_m == [0.0; 2] {
        let found = "none: the protection level is stated and nothing acts on it";
        return CheckLine::new(Verdict::Note, WHAT, found);
    }
    let said = reach::unreachable(&flown);
    let verdict = if said.is_empty() { Verdict::Pass } else { Verdict::Fail };
    let limits = format!("{horizontal_m} m horizontally, {depth_m} m in depth (0: none)");
    CheckLine::new(verdict, WHAT, [vec![limits], said].concat().join("; "))
}

fn mission(waypoints: usize) -> CheckLine {
    match waypoints {
        0 => CheckLine::new(Verdict::Note, "mission", "none stored"),
        count => CheckLine::new(Verdict::Pass, "mission", format!("{count} waypoints stored")),
    }
}

/// Who may change a flight: whoever has the key, or everybody at the port.
fn key(look: &Look) -> CheckLine {
    let (_, after) = &look.counters;
    let (verdict, found) = match (look.has_key, after.refused_requests) {
        (false, _) => (Verdict::Note, "none: whoever reaches the host port can change the flight".to_owned()),
        (true, 0) => (Verdict::Pass, "set; what changes a flight has to be signed".to_owned()),
        (true, refused) => (Verdict::Note, format!("set; {refused} requests refused that were not signed by it")),
    };
    CheckLine::new(verdict, "key", found)
}

#[cfg(test)]
mod tests;
