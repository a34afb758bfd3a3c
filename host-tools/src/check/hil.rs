//! `backseat check --hil`: a board on the bench without devices, TX and RX of each device port joined behind its
//! transceiver, a pulse per second from a generator. And the signed report.

use super::judge::{self, Look};
use super::line::{CheckLine, Verdict};
use super::{look, wiggle};
use crate::board::Common;
use backseat_link::board::{Board, reason};
use backseat_logs::output::{self, Existing};
use backseat_report::markdown::markdown_table;
use backseat_wire::hostlink::{Health, Port, ResetCause};
use std::fmt::Write as _;
use std::io::IsTerminal;
use std::path::Path;
use std::time::{Duration, Instant};

/// What of the plain check a board without devices can pass.
const WITHOUT_DEVICES: [&str; 6] =
    ["firmware", "last start", "telemetry", "receive losses", "oscillator", "parameters"];
/// Whoever presses the button gets this long.
const RESET: Duration = Duration::from_secs(60);

/// Every check of the bench.
pub fn lines(common: &Common) -> anyhow::Result<Vec<CheckLine>> {
    let mut board = common.connect()?;
    let seen = look(&mut board)?;
    let mut lines = judge::lines(&seen);
    lines.retain(|line| WITHOUT_DEVICES.contains(&line.what));
    let (before, after) = &seen.counters;
    lines.extend(Port::DEVICES.map(|port| joined(port, before, after)));
    lines.push(pulse(&seen));
    lines.push(wiggle(&mut board)?);
    lines.extend(parameter_store(board, common)?);
    Ok(lines)
}

/// What the board sends on a port comes back to it: as frames that it refuses, because no device says such things.
fn joined(port: Port, before: &Health, after: &Health) -> CheckLine {
    let index = port as usize;
    let all = |health: &Health| health.accepted_frames[index].saturating_add(health.rejected_frames[index]);
    let what = ["frontseat TX to RX", "DVL TX to RX", "AHRS TX to RX", "modem TX to RX"][index];
    match (all(after).saturating_sub(all(before)), all(after), port) {
        (0, 0, Port::Dvl) => {
            CheckLine::new(Verdict::Note, what, "the board sends nothing there: join its RX to the TX of the AHRS port")
        }
        (0, 0, _) => CheckLine::new(
            Verdict::Fail,
            what,
            "nothing comes back: transceiver, supply, or the wire between TX and RX",
        ),
        (during, since_start, _) => {
            CheckLine::new(Verdict::Pass, what, format!("{during} frames came back, {since_start} since start"))
        }
    }
}

fn pulse(seen: &Look) -> CheckLine {
    let (before, after) = &seen.counters;
    let edges = after.pps_edges.saturating_sub(before.pps_edges);
    let seconds = seen.watched.as_secs();
    let steady = u64::from(edges).abs_diff(seconds) <= 1;
    CheckLine::new(Verdict::of(steady), "PPS input", format!("{edges} edges in {seconds} s"))
}

/// The set in use is stored, and is there after the reset button.
fn parameter_store(mut board: Board, common: &Common) -> anyhow::Result<Vec<CheckLine>> {
    const STORE: &str = "params store";
    const RESET_BUTTON: &str = "reset button";
    let asked = Instant::now();
    if let Err(refusal) = board.store_parameters()? {
        return Ok(vec![CheckLine::new(Verdict::Fail, STORE, format!("refused: {}", reason(refusal)))]);
    }
    let stored = CheckLine::new(Verdict::Pass, STORE, format!("stored in {:.1} s", asked.elapsed().as_secs_f64()));
    if !std::io::stdin().is_terminal() {
        return Ok(vec![stored, CheckLine::new(Verdict::Note, RESET_BUTTON, "no terminal to ask for it")]);
    }
    let before = board.parameters()?;
    eprintln!("press the reset button of the board (within {} s)", RESET.as_secs());
    let (asked, mut last_us) = (Instant::now(), 0);
    let pressed = loop {
        let now_us = board.listen(Duration::from_millis(500))?.last().map_or(last_us, |record| record.time_us);
        if now_us < last_us || asked.elapsed() > RESET {
            break now_us < last_us;
        }
        last_us = now_us;
    };
    if !pressed {
        return Ok(vec![stored, CheckLine::new(Verdict::Fail, RESET_BUTTON, "no reset was seen")]);
    }
    drop(board);
    let mut board = common.connect()?;
    let cause = board.identity.restart.as_ref().map(|restart| restart.cause);
    let after = board.parameters()?;
    let kept = before.len() == after.len() && before.iter().zip(&after).all(|(a, b)| a.value == b.value);
    let found = match kept {
        true => format!("{} parameters as they were stored", after.len()),
        false => "the parameters are others than before".to_owned(),
    };
    let verdict = Verdict::of(kept && cause == Some(ResetCause::Pin));
    Ok(vec![stored, CheckLine::new(verdict, RESET_BUTTON, format!("cause {cause:?}; {found}"))])
}

/// The report as Markdown; an existing file stays.
///
/// # Errors
/// It cannot be written.
pub fn report(path: &Path, port: &str, when: &str, signed: Option<&str>, lines: &[CheckLine]) -> anyhow::Result<()> {
    let failed = lines.iter().filter(|line| line.verdict == Verdict::Fail).count();
    let mut table = markdown_table(["check", "verdict", "found"]);
    table.add_rows(lines.iter().map(CheckLine::cells));
    let mut text = format!("# Bench report\n\nBoard at {port}, {when} UTC.\n\n{table}\n");
    let outcome =
        if failed == 0 { "passed".to_owned() } else { format!("**{failed} of {} checks failed**", lines.len()) };
    let name = signed.unwrap_or("______________________");
    let _ = write!(text, "\nOutcome: {outcome}.\n\nSigned off by: {name}\n");
    Ok(output::write(path, Existing::Keep, |file| file.write_all(text.as_bytes()))?)
}
