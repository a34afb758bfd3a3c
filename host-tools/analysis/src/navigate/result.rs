//! What a run gave.

use crate::duration::exact_s;
use crate::level::Stated;
use backseat_core::navigation::Level;
use backseat_core::state::{X, Y, Z};
use backseat_estimation::dead_reckoning::Position;
use backseat_estimation::filter::{FilterRun, Health, TrackSample};
use backseat_logs::stats::ErrorSummary;
use backseat_logs::{Log, STATE_COLUMNS, Truth, VehicleFile};
use std::borrow::Cow;
use std::io::{self, Write};

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
    /// The truth of a simulator or of a better system.
    Truth,
    /// Fixes of the vehicle that were withheld.
    Gnss,
}

/// What they are measured against, and (time µs, horizontal error m).
pub type Errors = (Against, Vec<(u64, f64)>);

impl Against {
    /// Its name in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Truth => "truth",
            Self::Gnss => "gnss",
        }
    }
}

/// Columns of the protection level.
pub const LEVELS: &str = "level_horizontal_m,level_depth_m";

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
    /// One sigma per axis of the slow errors of the receivers, m; the estimate's sigma leaves them out.
    pub receiver_bias_m: f64,
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
    /// What the fixes are.
    pub fn fixes(&self) -> String {
        match &self.log.estimated_fixes {
            Some(names) => format!("fixes of the log's own {names} (an estimate, not a measurement)"),
            None => "GNSS fixes".to_owned(),
        }
    }

    /// What it is compared with, for people.
    pub fn words(&self, against: Against) -> String {
        match against {
            Against::Truth => "the truth".to_owned(),
            Against::Gnss => format!("{}, none of which was used after the first", self.fixes()),
        }
    }

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

    /// The protection level along the track, beside the error where there is a truth.
    pub(crate) fn stated(&self) -> Vec<Stated> {
        let Estimate::Filter(run) = &self.estimate else { return Vec::new() };
        run.track
            .iter()
            .zip(&run.levels)
            .map(|(sample, level)| {
                let x = &sample.state;
                let error_m = self.truth.and_then(|truth| truth.at(sample.time_us)).map_or([f64::NAN; 2], |truth| {
                    [(x[X] - truth.state[X]).hypot(x[Y] - truth.state[Y]), (x[Z] - truth.state[Z]).abs()]
                });
                Stated { time_us: sample.time_us, level_m: [level.horizontal_m, level.vertical_m], error_m }
            })
            .collect()
    }

    /// The vehicle with what the robust model has learnt of it, for the next dive; no other model learns anything.
    pub fn learnt(&self, declared: &VehicleFile) -> Option<VehicleFile> {
        let Estimate::Filter(run) = &self.estimate else { return None };
        Some(VehicleFile { learnt: *run.learnt.as_deref()?, ..declared.clone() })
    }

    /// What the head of its file says.
    pub fn learnt_source(&self, declared: &VehicleFile) -> String {
        let log = self.log.path.file_name().map_or_else(|| "a log".into(), |name| name.to_string_lossy());
        let name = &declared.name;
        format!("Vehicle {name} with what `backseat navigate --learn` has learnt from {log}, in section [learnt].")
    }

    /// Times faster than the mission.
    pub fn rate(&self) -> f64 {
        self.log.duration_s() / self.wall_s
    }

    /// The estimate as CSV; the state has the names of a truth CSV.
    ///
    /// # Errors
    /// Those of writing.
    pub fn write_track(&self, out: &mut dyn Write) -> io::Result<()> {
        match &self.estimate {
            Estimate::DeadReckoning(positions) => {
                writeln!(out, "t_s,x_m,y_m")?;
                for p in positions {
                    writeln!(out, "{},{:.4},{:.4}", exact_s(p.time_us), p.position_m[0], p.position_m[1])?;
                }
            }
            Estimate::Filter(run) => {
                let state = STATE_COLUMNS.join(",");
                writeln!(out, "t_s,{state},current_n_mps,current_e_mps,sigma_x_m,sigma_y_m,cov_xy_m2,{LEVELS}")?;
                let none = Level { horizontal_m: f64::NAN, vertical_m: f64::NAN };
                let levels = run.levels.iter().chain(std::iter::repeat(&none));
                for (sample, level) in run.track.iter().zip(levels) {
                    write!(out, "{}", exact_s(sample.time_us))?;
                    for value in sample.state.iter().chain(&sample.current_mps) {
                        write!(out, ",{value:.6}")?;
                    }
                    write!(out, ",{:.4},{:.4},{:.6}", sample.sigma[X], sample.sigma[Y], sample.cov_xy_m2)?;
                    writeln!(out, ",{:.2},{:.2}", level.horizontal_m, level.vertical_m)?;
                }
            }
        }
        Ok(())
    }
}
