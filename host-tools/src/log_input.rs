//! The options by which every command reads a log.

use crate::output::Output;
use backseat_analysis::navigate::Trial;
use backseat_analysis::read_log::ReadLog;
use backseat_analysis::refusal;
use backseat_logs::VehicleFile;
use backseat_report::console::{self, Spinner};
use backseat_report::word;
use std::path::{Path, PathBuf};

/// How a log is to be read.
#[derive(clap::Args)]
pub struct LogInput {
    /// Column mapping for a table of another maker: `[time]` with column, unit (s, ms, us, min, h, d, hms, iso, dmy, mdy) and base (start
    /// or epoch), and for each column of the vehicle log, such as `[columns.depth_m]`, its column, unit, sign, scale,
    /// offset. In a log of messages (ROS 2 bag, MOOS, LSTS, ArduPilot, MAVLink, PX4) the same with their numbers as
    /// columns, such as RCOU.C1
    #[arg(long = "columns", value_name = "MAP.toml")]
    map: Option<PathBuf>,
    /// Leave out the notes on how the log was read: what was recognised, assumed and dropped, and remarks on its
    /// columns, which `info` makes
    #[arg(long)]
    quiet: bool,
}

impl LogInput {
    /// Reads and examines a log.
    ///
    /// # Errors
    /// The log or the mapping cannot be read.
    pub fn read(&self, path: &Path) -> anyhow::Result<ReadLog> {
        let spinner = Spinner::new("read");
        spinner.set(&path.display().to_string());
        let mut read = ReadLog::of(path, self.map.as_deref())?;
        drop(spinner);
        if self.quiet {
            read.log.notes.clear();
            read.reader_notes.clear();
        }
        Ok(read)
    }

    /// Whether a command goes on with its logs: what contradicts physics is refused, unless `--force` was given. Says what
    /// was found: in the refusal, in the notes, and on stderr what `--force` goes on with.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn is_admitted(&self, logs: &mut [&mut ReadLog], command: &str, output: &Output) -> anyhow::Result<bool> {
        let refused = logs.iter().find_map(|read| refusal::of(read, command));
        if let Some(report) = refused.filter(|_| !output.is_forced()) {
            output.print(&report)?;
            return Ok(false);
        }
        for read in logs {
            for finding in read.examination.suspicions() {
                console::tell(&format!("warning: {}: {}", read.log.path.display(), finding.message));
            }
            if !self.quiet {
                read.note_findings();
            }
        }
        Ok(true)
    }

    /// Whether the log is one of a mapping.
    pub const fn is_mapped(&self) -> bool {
        self.map.is_some()
    }
}

/// Logs of a trial that are joined to the vehicle's, by time.
#[derive(clap::Args)]
pub struct Beside {
    /// Log of the ship: its GNSS (NMEA with RMC and GGA) and, where it has them, the fixes of its USBL ($PSIMSSB, USBLLONG),
    /// joined by time
    #[arg(long, value_name = "SHIP.nmea")]
    ship: Option<PathBuf>,
    /// Log of the vehicle's modem, or of the ship's, or of both by giving it twice ($CARXD and $CACST), joined by time
    #[arg(long, value_name = "MODEM.log")]
    modem: Vec<PathBuf>,
    /// Latitude and longitude of the origin of the vehicle's log, degrees, where it has positions in metres alone
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true, value_parser = origin)]
    origin: Option<[f64; 2]>,
}

impl Beside {
    /// Joins them to the vehicle's log.
    ///
    /// # Errors
    /// As [`Trial::join`].
    pub fn join(&self, read: &mut ReadLog, vehicle: &VehicleFile) -> anyhow::Result<()> {
        let Self { ship, modem, origin } = self;
        Trial { ship: ship.clone(), modem: modem.clone(), origin_deg: *origin }.join(read, vehicle)
    }

    /// The same for the next command, each with a space before it.
    pub fn options(&self) -> String {
        let ship = self.ship.iter().map(|path| format!(" --ship {}", word(path)));
        let modem = self.modem.iter().map(|path| format!(" --modem {}", word(path)));
        let origin = self.origin.iter().map(|[latitude, longitude]| format!(" --origin {latitude},{longitude}"));
        ship.chain(modem).chain(origin).collect()
    }
}

fn origin(text: &str) -> Result<[f64; 2], String> {
    let degrees = |text: &str, most: f64| text.trim().parse().ok().filter(|degrees: &f64| degrees.abs() <= most);
    let origin = text
        .split_once(',')
        .and_then(|(latitude, longitude)| Some([degrees(latitude, 90.0)?, degrees(longitude, 180.0)?]));
    origin.ok_or_else(|| "expected latitude and longitude in degrees, such as 41.53,-70.67".to_owned())
}

/// Does the work; if that fails, says what the reader recognised and left out, which is often why.
///
/// # Errors
/// Those of the work.
pub fn explain_failure<T>(read: &ReadLog, work: impl FnOnce() -> anyhow::Result<T>) -> anyhow::Result<T> {
    work().inspect_err(|_| read.reader_notes.iter().for_each(|note| console::tell(&format!("note: {note}"))))
}
