//! The real topside on the simulated ship, in this process or as one of its own.

use super::trial;
use anyhow::{Context, bail};
use backseat_topside::{Config, Topside};
use hil_sim::flight::{FlightLog, ShipSide};
use hil_sim::scenario::Scenario;
use hil_sim::ship_end::{self, ShipEnd};
use serde_json::{Value, json};
use std::os::unix::process::CommandExt;
use std::path::Path;

/// How topside takes part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum TopsideKind {
    /// None: the vehicle's modem plays the ship's part.
    Off,
    /// In this process.
    Library,
    /// A process of its own.
    Process,
}

/// The ship's end, and the process behind it if it is one; it ends with this.
pub struct Ship {
    pub end: ShipEnd,
    process: Option<std::process::Child>,
}

impl Drop for Ship {
    fn drop(&mut self) {
        if let Some(process) = &mut self.process {
            // both fail only when it has ended by itself
            let _ = process.kill();
            let _ = process.wait();
        }
    }
}

/// Starts the topside asked for.
pub fn start(
    kind: Option<TopsideKind>,
    realtime: bool,
    scenario: &Scenario,
    folder: &Path,
) -> anyhow::Result<Option<Ship>> {
    let usual = if realtime { TopsideKind::Process } else { TopsideKind::Library };
    let kind = match kind {
        None if scenario.settings.acoustics.topside => usual,
        None | Some(TopsideKind::Off) => return Ok(None),
        Some(kind) => kind,
    };
    let config = ship_end::config(scenario)
        .map_err(|error| anyhow::anyhow!("{}: acoustics: {error}", scenario.settings.name))?;
    if kind == TopsideKind::Library {
        let program = ship_end::InProcess::new(Topside::new(config)?);
        let start_unix_s = scenario.settings.environment.start_unix_s;
        let kept = trial::Kept::new(Box::new(program), folder, start_unix_s)?;
        return Ok(Some(Ship { end: ShipEnd::new(scenario, Box::new(kept)), process: None }));
    }
    if !realtime {
        bail!("--topside process: it has a clock of its own, so it needs --realtime; `library` flies in lock-step");
    }
    if scenario.settings.acoustics.key.is_set() {
        bail!("--topside process: the scenario's key would have to stand in a file; `library` knows it");
    }
    let ports = ship_end::OnPorts::open().context("serial ports of topside")?;
    let file = folder.join("topside.toml");
    std::fs::write(&file, topside_file(scenario, &config, ports.paths()))
        .with_context(|| file.display().to_string())?;
    let program = std::env::current_exe().context("this program's own path")?;
    let output = std::fs::File::create(folder.join("topside.jsonl")).context("topside.jsonl")?;
    let process = std::process::Command::new(program)
        .arg("topside")
        .arg(&file)
        .args(["--json", "--log"])
        .arg(folder.join("topside.mcap"))
        .stdin(std::process::Stdio::null())
        .stdout(output)
        .process_group(0)
        .spawn()
        .context("starting topside")?;
    Ok(Some(Ship { end: ShipEnd::new(scenario, Box::new(ports)), process: Some(process) }))
}

/// A configuration file of `backseat topside` for a scenario.
fn topside_file(scenario: &Scenario, config: &Config, [gnss, modem]: [&str; 2]) -> String {
    let acoustics = &scenario.settings.acoustics;
    let [latitude, longitude] = config.origin_deg.unwrap_or_default();
    let airtime = config.slots.airtime();
    let mut text = format!(
        "[ports]\ngnss = \"{gnss}:19200\"\nmodem = \"{modem}:19200\"\n\n[ship]\norigin_deg = [{latitude:?}, \
         {longitude:?}]\ntransducer_depth_m = {:?}\nacceleration_mps2_per_sqrt_hz = {:?}\n\n[modem]\naddress = \
         {}\nsound_speed_mps = {:?}\ndelay_s = {:?}\nrange_sigma_m = {:?}\nrange_max_m = {:?}\n\n",
        config.transducer_depth_m,
        config.ship_acceleration_mps2_per_sqrt_hz,
        config.address,
        config.sound_speed_mps,
        config.transducer_delay_s,
        config.range_sigma_m,
        config.range_max_m,
    );
    for vehicle in &config.vehicles {
        text += &format!("[[vehicle]]\naddress = {vehicle}\nname = \"iver3\"\n\n");
    }
    text += &format!(
        "[cycle]\nperiod_s = {}\npacket_s = {:?}\nlead_s = {:?}\nturnaround_s = {:?}\n",
        config.slots.period_s(),
        airtime.packet_s,
        airtime.lead_s,
        acoustics.turnaround_s
    );
    for slot in config.slots.slots() {
        text += &format!("\n[[cycle.slot]]\nat_s = {}\nexchange = \"{}\"\n", slot.offset_s, slot.exchange.name());
        if let Some(vehicle) = slot.exchange.vehicle() {
            text += &format!("vehicle = {vehicle}\n");
        }
    }
    text
}

/// The companion's own error, as its board reports it, m.
fn own_error(flight: &FlightLog) -> Option<[f64; 2]> {
    let known = flight.samples.iter().filter(|sample| sample.telemetry.sigma[0] > 0.0);
    quantiles(known.map(|sample| {
        let (truth, state) = (&sample.truth.state, &sample.telemetry.state);
        f64::hypot(truth[0] - state[0], truth[1] - state[1])
    }))
}

/// What became of the companion.
pub fn companion_json(flight: &FlightLog) -> Value {
    let error = own_error(flight).map(|[median, p95]| json!({"median_m": median, "p95_m": p95}));
    json!({"backseat": error, "topside": json(flight), "finished": flight.finished})
}

/// Its two lines of the score table.
pub fn companion_text(flight: &FlightLog) -> String {
    let track = quantiles(flight.ship_side.iter().filter_map(|side| side.vehicle).map(|[error_m, _]| error_m));
    let rows = [("companion: its backseat", own_error(flight)), ("topside: the companion", track)];
    let rows = rows.into_iter().filter_map(|(name, error)| Some((name, error?)));
    rows.map(|(name, [median_m, p95_m])| format!("{name:<36} {median_m:>8.2} {p95_m:>8.2}\n")).collect()
}

/// Median and 95 % of values.
fn quantiles(values: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let at =
        |share: f64| values.get(((values.len() as f64 * share) as usize).min(values.len().saturating_sub(1))).copied();
    Some([at(0.5)?, at(0.95)?])
}

/// How well topside knew ship and vehicle, m; the mean of the vehicle's normalised squared error is 2 where its ellipse
/// is right.
pub fn json(flight: &FlightLog) -> Value {
    let error = |pick: fn(&ShipSide) -> Option<[f64; 2]>| {
        quantiles(flight.ship_side.iter().filter_map(pick).map(|[error_m, _]| error_m))
            .map(|[median, p95]| json!({"median_m": median, "p95_m": p95}))
    };
    if flight.ship_side.is_empty() {
        return Value::Null;
    }
    let squares: Vec<f64> = flight.ship_side.iter().filter_map(|side| side.vehicle).map(|[_, square]| square).collect();
    json!({
        "ship": error(|side| side.ship),
        "vehicle": error(|side| side.vehicle),
        "vehicle_mean_square": (!squares.is_empty()).then(|| squares.iter().sum::<f64>() / squares.len() as f64),
        "vehicle_seconds": squares.len(),
    })
}

/// The two lines of the score table.
pub fn text(flight: &FlightLog) -> String {
    let mut text = String::new();
    for (name, is_ship) in [("topside: the ship", true), ("topside: the vehicle", false)] {
        let side = flight.ship_side.iter().filter_map(|side| if is_ship { side.ship } else { side.vehicle });
        if let Some([median_m, p95_m]) = quantiles(side.map(|[error_m, _]| error_m)) {
            text += &format!("{name:<36} {median_m:>8.2} {p95_m:>8.2}\n");
        }
    }
    text
}
