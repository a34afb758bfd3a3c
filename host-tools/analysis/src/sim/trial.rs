//! What a simulated sea trial leaves behind, in the formats of a real one: the vehicle's log without ranges, the log of
//! the ship's receiver, the logs of both modems, all in UTC.

use crate::flight_score;
use anyhow::Context;
use backseat_link::Arrival;
use backseat_logs::session::{Event, Reader};
use backseat_logs::{Column, LogWriter, TruthRow, TruthWriter};
use backseat_topside::{Port, Topside};
use backseat_wire::hostlink;
use hil_sim::flight::FlightLog;
use hil_sim::ship_end::{Known, Program, ProgramError};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Its folder within that of the flight.
pub const FOLDER: &str = "trial";

/// What a vehicle logs without a modem.
const OF_VEHICLE: [&[Column]; 2] =
    [Column::group(Column::PropRpm, Column::DvlW), Column::group(Column::GpsX, Column::GpsY)];

/// A log of sentences, one a line, with seconds since 1970 in front.
struct Sentences {
    file: BufWriter<File>,
    start_unix_s: u32,
    line: Vec<u8>,
}

impl Sentences {
    fn create(path: &Path, start_unix_s: u32) -> anyhow::Result<Self> {
        let file = File::create_new(path).with_context(|| path.display().to_string())?;
        Ok(Self { file: BufWriter::new(file), start_unix_s, line: Vec::new() })
    }

    /// Bytes of which the last came at this simulated time.
    fn write(&mut self, time_us: u64, bytes: &[u8]) -> std::io::Result<()> {
        for byte in bytes {
            match byte {
                b'\n' => {
                    let unix_us = u64::from(self.start_unix_s) * 1_000_000 + time_us;
                    write!(self.file, "{}.{:03} ", unix_us / 1_000_000, unix_us % 1_000_000 / 1000)?;
                    self.file.write_all(&self.line)?;
                    self.file.write_all(b"\n")?;
                    self.line.clear();
                }
                b'\r' => {}
                byte => self.line.push(*byte),
            }
        }
        Ok(())
    }
}

/// A program on the ship, and beside it what a laptop keeps of its receiver and its modem.
pub struct Kept {
    program: Box<dyn Program>,
    gnss: Sentences,
    modem: Sentences,
}

impl Kept {
    /// Keeps `ship.nmea` and `ship_modem.log`.
    ///
    /// # Errors
    /// A folder or file that cannot be made.
    pub fn new(program: Box<dyn Program>, flight: &Path, start_unix_s: u32) -> anyhow::Result<Self> {
        let folder = flight.join(FOLDER);
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        let sentences = |name: &str| Sentences::create(&folder.join(name), start_unix_s);
        Ok(Self { program, gnss: sentences("ship.nmea")?, modem: sentences("ship_modem.log")? })
    }
}

impl Program for Kept {
    fn give(&mut self, now_us: u64, arrivals: &[(Port, Arrival)], step: bool) -> Result<(), ProgramError> {
        for (port, Arrival { time_us, bytes }) in arrivals {
            let (log, name) = match port {
                Port::Gnss => (&mut self.gnss, "ship.nmea"),
                Port::Modem => (&mut self.modem, "ship_modem.log"),
            };
            log.write(*time_us, bytes).map_err(|error| ProgramError::Io { what: name.to_owned(), error })?;
        }
        self.program.give(now_us, arrivals, step)
    }

    fn take(&mut self) -> Result<Vec<u8>, ProgramError> {
        self.program.take()
    }

    fn topside(&self) -> Option<&Topside> {
        self.program.topside()
    }

    fn knows(&self, utc_us: u64, vehicle: u8) -> Option<Known> {
        self.program.knows(utc_us, vehicle)
    }
}

/// Adds the vehicle's part, `vehicle.csv` and `vehicle_modem.log`, and the truth at the same times.
///
/// # Errors
/// A session that cannot be read, a file that cannot be written.
pub fn add_vehicle(flight: &FlightLog, start_unix_s: u32, session: &Path, folder: &Path) -> anyhow::Result<PathBuf> {
    let folder = folder.join(FOLDER);
    let start_us = u64::from(start_unix_s) * 1_000_000;
    let columns = OF_VEHICLE.concat();
    let mut log = LogWriter::with_columns(&folder.join("vehicle.csv"), &columns)?;
    for row in &flight.log.rows {
        if columns.iter().any(|column| row.get(*column).is_some()) {
            let mut row = row.clone();
            row.time_us += start_us;
            log.write(&row)?;
        }
    }
    log.finish()?;
    let mut truth = TruthWriter::create(&folder.join("truth.csv"))?;
    for row in flight_score::truth_of(flight).rows {
        truth.write(&TruthRow { time_us: start_us + row.time_us, ..row })?;
    }
    truth.finish()?;
    let path = folder.join("vehicle_modem.log");
    let mut modem = Sentences::create(&path, start_unix_s)?;
    for entry in Reader::open(session)? {
        let entry = entry?;
        if let Event::Received { port: hostlink::Port::Modem, bytes } = entry.event {
            modem.write(entry.time_us, &bytes).with_context(|| path.display().to_string())?;
        }
    }
    modem.file.flush().with_context(|| path.display().to_string())?;
    Ok(folder)
}
