//! The real topside on the simulated ship, in this process or as one of its own.

use super::trial;
use anyhow::{Context, anyhow, bail};
use backseat_topside::{Config, Topside};
use hil_sim::scenario::Scenario;
use hil_sim::ship_end::{self, InProcess, OnPorts, Program, ProgramClock, ShipEnd};
use std::path::Path;
use std::str::FromStr;

/// How topside takes part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TopsideKind {
    /// None: the vehicle's modem plays the ship's part.
    Off,
    /// In this process.
    #[default]
    Library,
    /// A process of its own.
    Process,
}

impl FromStr for TopsideKind {
    type Err = &'static str;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        match name {
            "off" => Ok(Self::Off),
            "library" => Ok(Self::Library),
            "process" => Ok(Self::Process),
            _ => Err("expected off, library or process"),
        }
    }
}

/// Starts the topside asked for, or the `usual` one where the scenario has it. The backseat is started after it: it
/// waits two seconds for a clock, which a busy machine takes for a program to start.
pub fn start(
    asked: Option<TopsideKind>,
    usual: TopsideKind,
    realtime: bool,
    scenario: &Scenario,
    folder: &Path,
    say: &dyn Fn(&str),
) -> anyhow::Result<Option<Box<dyn Program>>> {
    let name = &scenario.settings.name;
    let misplaced = ship_end::fault_of_lone_modem(scenario);
    let off = asked == Some(TopsideKind::Off) || asked.is_none() && !scenario.settings.acoustics.topside;
    if let Some(fault) = ship_end::fault_of_receiver(scenario)
        && (off || misplaced.is_some())
    {
        bail!("{name}: the fault {fault} is one of the ship's receiver, which topside alone hears");
    }
    let kind = match (asked, misplaced) {
        _ if off => return Ok(None),
        (None, Some(fault)) => {
            say(&format!("{name}: no topside on the ship, because of its fault {fault}"));
            return Ok(None);
        }
        (Some(_), Some(fault)) => {
            bail!("topside: the fault {fault} is one of the vehicle's modem when it plays the ship's part: `off`")
        }
        (kind, None) => kind.unwrap_or(usual),
    };
    let config = ship_end::config(scenario)
        .map_err(|error| anyhow!("{name}: acoustics: {error}; topside `off` flies without it"))?;
    if kind == TopsideKind::Process {
        return Ok(Some(Box::new(process(realtime, scenario, &config, folder, say)?)));
    }
    if realtime {
        bail!("topside `library` has no clock of its own; `process` flies in real time");
    }
    Ok(Some(Box::new(InProcess::new(Topside::new(config)?))))
}

/// The ship's end with this program, which keeps the logs of receiver and modem.
pub fn end(scenario: &Scenario, program: Box<dyn Program>, folder: &Path) -> anyhow::Result<ShipEnd> {
    let kept = trial::Kept::new(program, folder, scenario.settings.environment.start_unix_s)?;
    Ok(ShipEnd::new(scenario, Box::new(kept)))
}

/// Starts this program again, as the ship's.
fn process(
    realtime: bool,
    scenario: &Scenario,
    config: &Config,
    folder: &Path,
    say: &dyn Fn(&str),
) -> anyhow::Result<OnPorts> {
    let program = std::env::current_exe().context("this program's own path")?;
    let clock = if realtime { ProgramClock::Own } else { ProgramClock::Lockstep };
    let file = folder.join("topside.toml");
    let command = |paths: &[&str]| {
        let [gnss, modem, host] = paths else { return Err(std::io::ErrorKind::InvalidInput.into()) };
        std::fs::write(&file, topside_file(scenario, config, [gnss, modem]))?;
        say(&format!("topside: gnss {gnss}, modem {modem}, host {host}"));
        let mut command = std::process::Command::new(program);
        command.arg("__topside").arg(&file).arg(host).args(realtime.then_some("--realtime"));
        Ok(command)
    };
    Ok(OnPorts::start(clock, config.key, &folder.join("topside.jsonl"), command)?)
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
    for (vehicle, number) in config.vehicles.iter().zip(0..) {
        let name = if number == 0 { "iver3".to_owned() } else { format!("companion{number}") };
        text += &format!("[[vehicle]]\naddress = {vehicle}\nname = \"{name}\"\n\n");
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
