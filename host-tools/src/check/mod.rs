//! `backseat check`: the board on the bench, looked at over its host port.

mod fittings;
mod hil;
mod judge;
mod launch;
mod line;

use crate::board::Common;
use anyhow::bail;
use backseat_link::board::{Board, reason};
use backseat_logs::output::{self, Existing};
use backseat_wire::hostlink::Telemetry;
use judge::Look;
use line::{CheckLine, Verdict};
use serde_json::json;
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

const EXAMPLES: &str = "\
Example:
  backseat check /dev/ttyACM0 --wiggle
  backseat check /dev/ttyACM0 --report launch.html --sign-off Name
  backseat check /dev/ttyACM0 --hil --report bench.md --sign-off Name

ok: passed. FAIL: failed; the exit code is then 1. note: for you to judge. A sensor that the parameters do not use may be
missing. --wiggle moves each fin to both sides, one second a fin, with the propeller commanded to stop; it is refused
while a mission runs. Switch the propeller's supply off or keep clear of the blades all the same. Watch that the top,
bottom, port and starboard fin move in this order, each to its positive side first. --drop-weight really releases it.
--hil checks a board without devices: join TX and RX of each device port behind its transceiver, and give the PPS input
1 Hz. It commands the fins, stores the parameters in use, and asks for the reset button.";

/// How long the board is watched: slower sources have a second's period.
const WATCH: Duration = Duration::from_secs(3);
/// The app's wiggle takes 4 s; a little before and after it.
const WIGGLE: Duration = Duration::from_millis(5500);

/// Check a board on the bench: link, ports, clock, PPS, mode, parameters, mission
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    common: Common,
    /// Move the fins as well, with the propeller stopped
    #[arg(long, conflicts_with = "hil")]
    wiggle: bool,
    /// Release the drop weight for two seconds as well
    #[arg(long, conflicts_with = "hil")]
    drop_weight: bool,
    /// Check a board without devices, TX and RX of each device port joined
    #[arg(long)]
    hil: bool,
    /// Write a report of it: before a launch the page "go" or "no go" (HTML), with --hil the bench report (Markdown)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Whoever answers for the report
    #[arg(long, value_name = "NAME", requires = "report")]
    sign_off: Option<String>,
}

/// Observes the board, judges and prints.
pub fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(path) = &args.report {
        output::check(path, Existing::Keep)?;
    }
    let lines = if args.hil { hil::lines(&args.common)? } else { with_devices(args)? };
    if let Some(path) = &args.report {
        let (port, when) = (args.common.port.to_string(), judge::date(now_us()));
        if args.hil {
            hil::report(path, &port, &when, args.sign_off.as_deref(), &lines)?;
        } else {
            launch::page(path, &port, &when, args.sign_off.as_deref(), &lines)?;
        }
    }
    let failed = lines.iter().filter(|line| line.verdict == Verdict::Fail).count();
    let list: Vec<_> = lines.iter().map(CheckLine::json).collect();
    let mut table: String = lines.iter().map(|line| format!("{line}\n")).collect();
    if !args.hil {
        table += &format!("\n{}\n", launch::verdict(&lines));
    }
    args.common.say(&json!({"passed": failed == 0, "checks": list}), &table)?;
    if failed > 0 {
        bail!("{}: {failed} of {} checks failed", args.common.port, lines.len());
    }
    Ok(())
}

fn with_devices(args: &Args) -> anyhow::Result<Vec<CheckLine>> {
    let mut board = args.common.connect()?;
    let look = look(&mut board)?;
    let mut lines = judge::lines(&look);
    lines.push(fittings::line(&look.counters.1.fittings));
    if args.wiggle {
        lines.push(wiggle(&mut board)?);
    }
    if args.drop_weight {
        lines.push(fittings::drop_weight(&mut board)?);
    }
    Ok(lines)
}

/// This computer's clock, µs since 1970.
fn now_us() -> u64 {
    SystemTime::UNIX_EPOCH.elapsed().map_or(0, |elapsed| elapsed.as_micros() as u64)
}

fn look(board: &mut Board) -> anyhow::Result<Look> {
    let parameters = board.parameters()?;
    let waypoints = board.mission()?.len();
    let has_key = board.has_key()?;
    // one without a second bank refuses
    let images = board.images().ok();
    let before = board.health()?;
    let telemetry = board.listen(WATCH)?;
    let now_us = now_us();
    let after = board.health()?;
    Ok(Look {
        identity: board.identity.clone(),
        images,
        parameters,
        waypoints,
        counters: (before, after),
        telemetry,
        watched: WATCH,
        now_us,
        has_key,
    })
}

fn wiggle(board: &mut Board) -> anyhow::Result<CheckLine> {
    if let Err(refusal) = board.wiggle()? {
        return Ok(CheckLine::new(Verdict::Fail, "fin wiggle", format!("refused: {}", reason(refusal))));
    }
    let records = board.listen(WIGGLE)?;
    let moved = |fin: usize| {
        let angles = || records.iter().map(move |record: &Telemetry| record.fins_rad[fin]);
        angles().any(|angle| angle > 0.1) && angles().any(|angle| angle < -0.1)
    };
    let still = records.iter().all(|record| record.propeller_radps == 0.0);
    let rests = records.last().is_some_and(|record| record.fins_rad.iter().all(|angle| angle.abs() < 0.02));
    let fins = (0..4).filter(|fin| moved(*fin)).count();
    let about = format!(
        "{fins} of 4 fins commanded to both sides, {}, propeller {}: did they move?",
        if rests { "back at neutral" } else { "not back at neutral" },
        if still { "stopped" } else { "commanded to turn" },
    );
    Ok(CheckLine::new(Verdict::of(fins == 4 && still && rests), "fin wiggle", about))
}
