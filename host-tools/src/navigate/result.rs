//! What a run gave, as JSON and as a track.

use backseat_core::state::{X, Y};
use backseat_estimation::dead_reckoning::Position;
use backseat_estimation::filter::{FilterRun, Health, TrackSample};
use backseat_logs::stats::ErrorSummary;
use backseat_logs::{Log, STATE_COLUMNS, Truth};
use serde_json::{Map, Value, json};
use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

/// The estimate, by whichever way.
pub enum Estimate {
    /// By the filter.
    Filter(Box<FilterRun>),
    /// By summing up heading and speed.
    DeadReckoning(Vec<Position>),
}

/// What errors are measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Against {
    Truth,
    /// Fixes of the vehicle that were withheld.
    Gnss,
}

/// What they are measured against, and (time µs, horizontal error m).
pub type Errors = (Against, Vec<(u64, f64)>);

impl Against {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Truth => "truth",
            Self::Gnss => "gnss",
        }
    }
}

/// Everything there is to say about a run.
pub struct NavigationResult<'a> {
    /// Model and measurements used, in words.
    pub description: String,
    /// Name of the log's format.
    pub format: &'static str,
    /// At the centre of gravity.
    pub log: Cow<'a, Log>,
    /// The track.
    pub estimate: Estimate,
    /// What it was compared with.
    pub truth: Option<&'a Truth>,
    /// Horizontal errors; `None` without anything to compare with.
    pub errors: Option<Errors>,
    /// (time µs, horizontal error m) of the smoothed track against the truth.
    pub smoothed_errors: Option<Vec<(u64, f64)>>,
    /// Whether the result is to be trusted.
    pub health: Health,
    /// What was assumed and left out.
    pub notes: Vec<String>,
    /// Time taken to read the log, s.
    pub read_s: f64,
    /// Reading the log and running the filter.
    pub wall_s: f64,
}

impl Estimate {
    /// Where it went.
    pub fn positions(&self) -> Vec<Position> {
        match self {
            Self::Filter(run) => positions(&run.track),
            Self::DeadReckoning(positions) => positions.clone(),
        }
    }

    /// The smoothed track, if it was asked for.
    pub fn smoothed(&self) -> Option<&[TrackSample]> {
        match self {
            Self::Filter(run) => run.smoothed.as_deref(),
            Self::DeadReckoning(_) => None,
        }
    }

    /// North and east at the end, m.
    pub fn last_m(&self) -> Option<[f64; 2]> {
        match self {
            Self::Filter(run) => run.track.last().map(|sample| [sample.state[X], sample.state[Y]]),
            Self::DeadReckoning(positions) => positions.last().map(|position| position.position_m),
        }
    }
}

/// Where a track goes.
pub fn positions(track: &[TrackSample]) -> Vec<Position> {
    track.iter().map(|s| Position { time_us: s.time_us, position_m: [s.state[X], s.state[Y]] }).collect()
}

impl NavigationResult<'_> {
    /// Of the estimate, against the truth or the fixes that were withheld.
    pub fn error_summary(&self) -> Option<(Against, ErrorSummary)> {
        let (against, errors) = self.errors.as_ref()?;
        let errors: Vec<f64> = errors.iter().map(|(_, error)| *error).collect();
        Some((*against, ErrorSummary::of(&errors)?))
    }

    /// Of the smoothed track against the truth.
    pub fn smoothed_summary(&self) -> Option<ErrorSummary> {
        let errors: Vec<f64> = self.smoothed_errors.as_ref()?.iter().map(|(_, error)| *error).collect();
        ErrorSummary::of(&errors)
    }

    /// Times faster than the mission.
    pub fn rate(&self) -> f64 {
        self.log.duration_s() / self.wall_s
    }

    /// The JSON object of the command, with the paths of the report and the track that were written.
    pub fn json(&self, report: Option<&Path>, track: Option<&Path>) -> String {
        let summary = |error: ErrorSummary| {
            json!({"median_m": error.median_m, "p95_m": error.p95_m, "max_m": error.max_m, "rms_m": error.rms_m,
                "samples": error.count})
        };
        let error = self.error_summary().map(|(_, error)| summary(error));
        let smoothed_error = self.smoothed_summary().map(summary);
        let (mut nis, mut fused, mut rejected) = (Map::new(), Map::new(), Map::new());
        let (mut digest, mut estimates) = (Value::Null, Value::Null);
        if let Estimate::Filter(run) = &self.estimate {
            for sensor in &run.sensors {
                nis.insert(sensor.sensor.name().to_owned(), json!(sensor.nis));
                fused.insert(sensor.sensor.name().to_owned(), json!(sensor.fused));
                rejected.insert(sensor.sensor.name().to_owned(), json!(sensor.rejected));
            }
            estimates = super::estimates::json(run);
            // As text: JSON's numbers are doubles and lose the last bits.
            digest = json!(format!("{:016x}", run.digest));
        }
        let sensors: Map<String, Value> = self
            .health
            .sensors
            .iter()
            .map(|sensor| {
                let value = json!({"refused_share": sensor.refused, "lag_one_correlation": sensor.lag_one});
                (sensor.sensor.name().to_owned(), value)
            })
            .collect();
        let [x_m, y_m] = self.estimate.last_m().unwrap_or([f64::NAN; 2]);
        let object = json!({
            "configuration": self.description,
            "error": error,
            "smoothed_error": smoothed_error,
            "error_against": self.errors.as_ref().map(|(against, _)| against.name()),
            "final": {"x_m": x_m, "y_m": y_m},
            "nis": nis,
            "fused": fused,
            "rejected": rejected,
            "trust": if self.health.doubts.is_empty() { "ok" } else { "suspicious" },
            "doubts": self.health.doubts,
            "health": {"sensors": sensors, "rms_over_drms": self.health.rms_over_drms},
            "estimates": estimates,
            "simulated_s": self.log.duration_s(),
            "wall_s": self.wall_s,
            "digest": digest,
            "notes": self.notes,
            "report": report.map(|path| path.display().to_string()),
            "track": track.map(|path| path.display().to_string()),
        });
        format!("{object}\n")
    }

    /// The estimate as CSV; the state has the names of a truth CSV.
    pub fn write_track(&self, out: &mut dyn Write) -> io::Result<()> {
        match &self.estimate {
            Estimate::DeadReckoning(positions) => {
                writeln!(out, "t_s,x_m,y_m")?;
                for p in positions {
                    writeln!(out, "{},{:.4},{:.4}", seconds(p.time_us), p.position_m[0], p.position_m[1])?;
                }
            }
            Estimate::Filter(run) => {
                let state = STATE_COLUMNS.join(",");
                writeln!(out, "t_s,{state},current_n_mps,current_e_mps,sigma_x_m,sigma_y_m,cov_xy_m2")?;
                for sample in &run.track {
                    write!(out, "{}", seconds(sample.time_us))?;
                    for value in sample.state.iter().chain(&sample.current_mps) {
                        write!(out, ",{value:.6}")?;
                    }
                    writeln!(out, ",{:.4},{:.4},{:.6}", sample.sigma[X], sample.sigma[Y], sample.cov_xy_m2)?;
                }
            }
        }
        Ok(())
    }
}

/// Whole microseconds as seconds.
fn seconds(time_us: u64) -> String {
    format!("{}.{:06}", time_us / 1_000_000, time_us % 1_000_000)
}
