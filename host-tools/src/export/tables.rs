//! `--csv`: a vehicle log and the board's own records, one file each.

use crate::decode::{Found, What};
use anyhow::Context;
use backseat_logs::session::{FusionRow, TelemetryRow};
use backseat_logs::{Column, LogRow, LogWriter};
use csv::Writer;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

pub const VEHICLE_LOG: &str = "vehicle_log.csv";
pub const TELEMETRY: &str = "telemetry.csv";
pub const FUSION: &str = "fusion.csv";
pub const EVENTS: &str = "events.csv";
const FILES: [&str; 4] = [VEHICLE_LOG, TELEMETRY, FUSION, EVENTS];

/// Longest time from the arrival of a range to its report, µs: rows wait so long to be put in order.
const ORDER_US: u64 = 30_000_000;

/// The files under way.
pub struct Tables {
    vehicle_log: LogWriter,
    /// Rows that earlier ones may still precede, in order of time.
    waiting: Vec<LogRow>,
    newest_us: u64,
    telemetry: Writer<File>,
    fusion: Writer<File>,
    events: Writer<File>,
    /// Rows written, in the order of [`FILES`].
    rows: [u64; 4],
}

impl Tables {
    /// Begins the files in `folder`, which is made if need be.
    pub fn create(folder: &Path, force: bool) -> anyhow::Result<Self> {
        fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let paths = FILES.map(|name| folder.join(name));
        let taken = paths.iter().find(|path| path.exists() && !force);
        if let Some(path) = taken {
            anyhow::bail!("{}: exists already", path.display());
        }
        for path in paths.iter().filter(|path| path.exists()) {
            fs::remove_file(path).with_context(|| path.display().to_string())?;
        }
        let [vehicle_log, telemetry, fusion, events] = paths;
        let table = |path: PathBuf| {
            let file = File::create_new(&path).with_context(|| path.display().to_string())?;
            Ok::<_, anyhow::Error>(Writer::from_writer(file))
        };
        let mut events = table(events)?;
        events.write_record(["t_s", "kind", "event"])?;
        Ok(Self {
            vehicle_log: LogWriter::with_columns(&vehicle_log, &[Column::STANDARD, &[Column::TwoWayRange]].concat())?,
            waiting: Vec::new(),
            newest_us: 0,
            telemetry: table(telemetry)?,
            fusion: table(fusion)?,
            events,
            rows: [0, 0, 0, 0],
        })
    }

    pub fn take(&mut self, found: &Found<'_>) -> anyhow::Result<()> {
        match &found.what {
            What::Measured(row) => {
                let place = self.waiting.partition_point(|earlier| earlier.time_us <= row.time_us);
                self.waiting.insert(place, (*row).clone());
                self.newest_us = self.newest_us.max(row.time_us);
                if self.waiting[0].time_us + 2 * ORDER_US < self.newest_us {
                    self.write_until(self.newest_us - ORDER_US)?;
                }
            }
            What::Telemetry(telemetry) => {
                self.rows[1] += 1;
                self.telemetry.serialize(TelemetryRow::from(*telemetry).at(found.time_us))?;
            }
            What::Fusion(fusion) => {
                self.rows[2] += 1;
                self.fusion.serialize(FusionRow::from(*fusion).at(found.time_us))?;
            }
            What::Event(kind, text) => {
                self.rows[3] += 1;
                self.events.write_record([&format!("{}", found.time_us as f64 / 1e6), kind.name(), text])?;
            }
            What::VehicleFix(_) | What::ShipFix(_) | What::Identification(_) | What::Estimates(_) => {}
        }
        Ok(())
    }

    fn write_until(&mut self, until_us: u64) -> anyhow::Result<()> {
        let count = self.waiting.partition_point(|row| row.time_us < until_us);
        for row in self.waiting.drain(..count) {
            self.vehicle_log.write(&row)?;
        }
        self.rows[0] += count as u64;
        Ok(())
    }

    /// Ends the files; their names and rows.
    pub fn finish(mut self) -> anyhow::Result<[(&'static str, u64); 4]> {
        self.write_until(u64::MAX)?;
        self.vehicle_log.finish()?;
        self.telemetry.flush()?;
        self.fusion.flush()?;
        self.events.flush()?;
        let mut rows = self.rows.into_iter();
        Ok(FILES.map(|name| (name, rows.next().unwrap_or(0))))
    }
}
