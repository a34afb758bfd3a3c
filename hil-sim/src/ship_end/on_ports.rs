//! Topside as a process of its own on three pseudo-terminals: GNSS receiver, modem, and the simulator's line.

use super::program::{Known, Program, ProgramError, announced};
use backseat_link::{Arrival, Client, Process};
use backseat_topside::Port;
use backseat_topside::ship::ShipEstimate;
use backseat_topside::track::VehicleEstimate;
use backseat_wire::hostlink;
use backseat_wire::ship_state::Key;
use serde::Deserialize;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Whose clock the process runs on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProgramClock {
    /// Its own.
    Own,
    /// The simulator's: one message after the other over the host link, as with the backseat.
    Lockstep,
}

/// A line of what topside prints once a second, as far as it is judged.
#[derive(Clone, Debug, Deserialize)]
struct Said {
    utc_s: Option<f64>,
    ship: Option<SaidShip>,
    vehicles: Vec<SaidVehicle>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct SaidShip {
    position_m: [f64; 2],
    velocity_mps: [f64; 2],
    position_sigma_m: [f64; 2],
    velocity_sigma_mps: [f64; 2],
}

#[derive(Clone, Copy, Debug, Deserialize)]
struct SaidVehicle {
    address: u8,
    position_m: Option<[f64; 2]>,
    velocity_mps: Option<[f64; 2]>,
    covariance_m2: Option<[f64; 3]>,
}

/// The file into which the process prints, read as it grows.
struct Printed {
    path: PathBuf,
    file: File,
    /// Of a line that is not complete yet.
    begun: Vec<u8>,
    last: Option<Said>,
}

impl Printed {
    fn read(&mut self) -> Result<(), ProgramError> {
        let failed = |error| ProgramError::Io { what: self.path.display().to_string(), error };
        self.file.read_to_end(&mut self.begun).map_err(failed)?;
        let Some(end) = self.begun.iter().rposition(|byte| *byte == b'\n') else { return Ok(()) };
        let begin = self.begun[..end].iter().rposition(|byte| *byte == b'\n').map_or(0, |newline| newline + 1);
        let said = serde_json::from_slice(&self.begun[begin..end]);
        self.last = Some(said.map_err(|error| failed(error.into()))?);
        self.begun.drain(..=end);
        Ok(())
    }
}

/// Topside in a process of its own; it ends with this.
pub struct OnPorts {
    client: Client<Process>,
    clock: ProgramClock,
    printed: Printed,
    given: Given,
}

/// What the process was given last.
#[derive(Clone, Copy, Default)]
struct Given {
    time_us: u64,
    /// It owes an answer of the lock-step.
    owes: bool,
    step: bool,
}

impl OnPorts {
    /// Starts the command that is given the paths of GNSS, modem and host line, and prints into `printed`, one JSON object
    /// a second. The key goes over the host line: it stands in no file.
    ///
    /// # Errors
    /// A process that does not start, or does not answer.
    pub fn start(
        clock: ProgramClock,
        key: Key,
        printed: &Path,
        command: impl FnOnce(&[&str]) -> io::Result<Command>,
    ) -> Result<Self, ProgramError> {
        let lines = [announced(Port::Gnss), announced(Port::Modem), hostlink::Port::Host];
        let output =
            File::create(printed).map_err(|error| ProgramError::Io { what: printed.display().to_string(), error })?;
        let process = Process::start(&lines, |paths| {
            let mut command = command(paths)?;
            command.stdout(output);
            Ok(command)
        });
        let begun = |error| ProgramError::Io { what: "starting it".to_owned(), error };
        let mut client = Client::new(process.map_err(begun)?);
        client.hello()?;
        if key.is_set() {
            client.set_key(key)?;
        }
        let file = File::open(printed).map_err(begun)?;
        let printed = Printed { path: printed.to_owned(), file, begun: Vec::new(), last: None };
        Ok(Self { client, clock, printed, given: Given::default() })
    }

    /// Process id.
    pub fn pid(&mut self) -> u32 {
        self.client.ports().pid()
    }

    /// Paths of its ends: GNSS, modem and host line.
    pub fn paths(&mut self) -> Vec<String> {
        self.client.ports().paths().map(str::to_owned).collect()
    }
}

impl Program for OnPorts {
    fn give(&mut self, now_us: u64, arrivals: &[(Port, Arrival)], step: bool) -> Result<(), ProgramError> {
        // nothing comes of nothing: it sends only what bytes or a step give rise to
        let owes = self.clock == ProgramClock::Lockstep && (step || !arrivals.is_empty());
        self.given = Given { time_us: now_us, owes, step };
        if owes {
            let arrivals: Vec<_> = arrivals.iter().map(|(port, arrival)| (announced(*port), arrival.clone())).collect();
            self.client.begin_step(now_us, &[], &arrivals)?;
        }
        if self.clock == ProgramClock::Own {
            for (port, arrival) in arrivals {
                self.client.deliver(now_us, announced(*port), &arrival.bytes)?;
            }
        }
        Ok(())
    }

    fn take(&mut self) -> Result<Vec<u8>, ProgramError> {
        let modem = announced(Port::Modem);
        let Given { time_us, owes, step } = std::mem::take(&mut self.given);
        let sent = match self.clock {
            ProgramClock::Lockstep if owes => std::mem::take(&mut self.client.end_step(time_us)?.sent[modem as usize]),
            ProgramClock::Lockstep => Vec::new(),
            ProgramClock::Own => self.client.collect(time_us, modem)?,
        };
        if step {
            self.printed.read()?;
        }
        Ok(sent)
    }

    fn knows(&self, utc_us: u64, vehicle: u8) -> Option<Known> {
        let said = self.printed.last.as_ref();
        // what was said is carried on to the time that is asked for
        let ahead_s = said.and_then(|said| said.utc_s).map(|utc_s| utc_us as f64 * 1e-6 - utc_s);
        let at = |position_m: [f64; 2], velocity_mps: [f64; 2], ahead_s: f64| {
            [0, 1].map(|i| position_m[i] + velocity_mps[i] * ahead_s)
        };
        let ship = said.and_then(|said| said.ship).zip(ahead_s).map(|(ship, ahead_s)| ShipEstimate {
            position_m: at(ship.position_m, ship.velocity_mps, ahead_s),
            velocity_mps: ship.velocity_mps,
            position_sigma_m: ship.position_sigma_m,
            velocity_sigma_mps: ship.velocity_sigma_mps,
        });
        let track = said.and_then(|said| said.vehicles.iter().find(|track| track.address == vehicle));
        let vehicle = track.zip(ahead_s).and_then(|(track, ahead_s)| {
            let (velocity_mps, covariance_m2) = (track.velocity_mps?, track.covariance_m2?);
            let position_m = at(track.position_m?, velocity_mps, ahead_s);
            Some(VehicleEstimate { position_m, velocity_mps, covariance_m2 })
        });
        Some(Known { ship, vehicle })
    }
}
