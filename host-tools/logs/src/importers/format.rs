//! A format of a table as data: which columns it has, what they mean and what is left out.

use super::line_time::DateOrder;
use crate::log::Column;

/// What a column of a table is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Role {
    /// Times this factor: seconds since the start.
    Seconds(f64),
    /// Times this factor: seconds since some other start; the first row is zero.
    Epoch(f64),
    /// The number in a label (`M11` is 11).
    Label(Column),
    /// A label of the run: where it changes, the times begin again.
    Run,
    /// The row is left out where this is `True`.
    LeftOut,
    /// Seconds at which a ping arrived: the time of the row and the arrival.
    Arrival,
    /// `HH:MM:SS`, with or without AM and PM, which starts again every day; or `MM:SS.s`, as spreadsheets show it, which
    /// starts again every hour.
    TimeOfDay,
    /// A date and a time, as `yyyy-mm-dd hh:mm:ss.s`; the first row is zero.
    Instant(DateOrder),
    /// Days since a day that is so many before 1970; the first row is zero.
    Days(f64),
    /// `M/D/YYYY` or `M/D/YY`.
    Date,
    /// Latitude (0) or longitude (1), in radians or degrees.
    Place {
        /// Which of the two.
        axis: usize,
        /// In radians.
        is_in_radians: bool,
    },
    /// A position beside it is a fix where this is more than zero.
    Satellites,
    /// A position beside it is a fix where this is zero.
    FixStatus,
    /// Part of a quaternion (0: w, 1 to 3: x, y, z) from body to the local frame.
    Quaternion {
        /// Which part.
        part: usize,
        /// East-north-up and forward-left-up instead of north-east-down and forward-right-down.
        is_enu_flu: bool,
    },
    /// (value + `offset`) · `scale` is a sample of the log.
    Sample {
        /// Where it goes.
        column: Column,
        /// Factor to the log's unit.
        scale: f64,
        /// Added before, in the table's unit.
        offset: f64,
    },
}

impl Role {
    /// What it becomes.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Seconds(_) | Self::Epoch(_) | Self::TimeOfDay | Self::Instant(_) | Self::Days(_) => "the time",
            Self::Arrival => "the time and toa_s",
            Self::Label(_) => "the number in the label",
            Self::Run => "the number of the run",
            Self::LeftOut => "whether the row is left out",
            Self::Date => "the date",
            Self::Place { .. } => "a position, gps_x_m and gps_y_m",
            Self::Satellites | Self::FixStatus => "whether the position is a fix",
            Self::Quaternion { .. } => "part of the attitude, roll_rad, pitch_rad and heading_rad",
            Self::Sample { column, .. } => column.name(),
        }
    }

    /// Whether it gives a row its time.
    pub(super) const fn is_time(self) -> bool {
        matches!(
            self,
            Self::Seconds(_) | Self::Epoch(_) | Self::Arrival | Self::TimeOfDay | Self::Instant(_) | Self::Days(_)
        )
    }
}

/// A column that is read.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// Name in the header.
    pub name: String,
    /// What it is for.
    pub role: Role,
}

/// A table's format.
#[derive(Clone, Debug)]
pub(super) struct Format {
    /// Name in messages.
    pub name: String,
    /// What may stand between two cells.
    pub separators: Vec<u8>,
    /// Columns that are read, the preferred ones first where several fill the same place.
    pub columns: Vec<Known>,
    /// Names that must be there.
    pub needed: Vec<String>,
    /// Every column must be there.
    pub every_column_needed: bool,
    /// A file is a run, named as the file without the beginnings listed here.
    pub file_is_run: Option<Vec<String>>,
    /// Samples that every row has.
    pub constants: Vec<(Column, f64)>,
    /// Part of a name (lower case), and why such columns are left out.
    pub dropped: Vec<(String, String)>,
    /// What a reader of the log must know.
    pub remarks: Vec<String>,
}
