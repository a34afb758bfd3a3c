//! What is measured after the ship has left, put into the log of a flight that did without.

use super::worlds::since_s;
use backseat_logs::log::{Column, Log, LogRow};
use hil_sim::flight::FlightLog;
use hil_sim::rng::{Source, Stream};
use std::f64::consts::FRAC_PI_2;

const HOUR_S: f64 = 3600.0;
/// How long a DVL or a receiver works, s.
const ON_S: f64 = 60.0;
/// How far off the other end of a range is, m.
const RANGE_M: f64 = 300.0;
/// Noise of a range, m.
pub const RANGE_SIGMA_M: f64 = 1.0;
/// Noise of a fix per axis, m.
pub const FIX_SIGMA_M: f64 = 1.5;
const SOUND_SPEED_MPS: f64 = 1500.0;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aid {
    /// Depth and attitude.
    Nothing,
    /// Bottom track.
    Dvl,
    /// A range to a place that is known.
    Range,
    /// Fixes once.
    OneFix,
    /// Fixes often.
    Fixes,
}

impl Aid {
    /// All, in the order of the table.
    pub const ALL: [Self; 5] = [Self::Nothing, Self::Dvl, Self::Range, Self::OneFix, Self::Fixes];

    /// As its row is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "robust",
            Self::Dvl => "DVL",
            Self::Range => "range",
            Self::OneFix => "fix",
            Self::Fixes => "fixes",
        }
    }

    /// For the table.
    pub fn about(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Dvl => "DVL for a minute an hour",
            Self::Range => "one range an hour, each from another side",
            Self::OneFix => "GNSS for a minute after 2.5 h",
            Self::Fixes => "GNSS for a minute an hour",
        }
    }

    /// Whether it works at this time since the ship left, s. At the end it helps nobody any more.
    fn works(self, time_s: f64) -> bool {
        let hourly = (0.5 * HOUR_S..4.5 * HOUR_S).contains(&time_s);
        match self {
            Self::Nothing => false,
            Self::Range => hourly && time_s.rem_euclid(HOUR_S) < 0.5,
            Self::Dvl | Self::Fixes => hourly && time_s.rem_euclid(HOUR_S) < ON_S,
            Self::OneFix => (2.5 * HOUR_S..2.5 * HOUR_S + ON_S).contains(&time_s),
        }
    }
}

/// The log of a flight with what an aid measures. The vehicle flies as it did without, at depth even where a fix is
/// taken.
pub fn aided(flight: &FlightLog, aid: Aid, seed: u64) -> Log {
    let mut log = flight.log.clone();
    for row in &mut log.rows {
        let time_s = since_s(row.time_us);
        if aid == Aid::Dvl && row.time_us < 1_000_000 {
            // A filter with a DVL starts by it: the vehicle is at rest.
            row.set_all(Column::DvlU, &[0.0; 3]);
        } else if aid != Aid::Dvl || !aid.works(time_s) {
            row.set_all(Column::DvlU, &[f64::NAN; 3]);
        }
    }
    let mut random = Stream::new(seed, Source::Study);
    for sample in &flight.samples {
        let (truth, time_s) = (&sample.truth, since_s(sample.truth.time_us));
        if !aid.works(time_s) {
            continue;
        }
        let [north_m, east_m, down_m, ..] = truth.state;
        let mut row = LogRow::new(truth.time_us);
        match aid {
            Aid::Nothing | Aid::Dvl => continue,
            Aid::Range => {
                let (sin, cos) = libm::sincos(FRAC_PI_2 * (time_s / HOUR_S).round());
                let range_m = RANGE_M.hypot(down_m) + RANGE_SIGMA_M * random.normal();
                let arrival_s = truth.time_us as f64 * 1e-6;
                row.set(Column::Range, range_m)
                    .set(Column::Tol, arrival_s - range_m / SOUND_SPEED_MPS)
                    .set(Column::Toa, arrival_s)
                    .set_all(Column::ShipX, &[north_m + RANGE_M * cos, east_m + RANGE_M * sin]);
            }
            Aid::OneFix | Aid::Fixes => {
                let [north, east] = random.normals::<2>(FIX_SIGMA_M);
                row.set_all(Column::GpsX, &[north_m + north, east_m + east]);
            }
        }
        log.rows.push(row);
    }
    log.rows.sort_by_key(|row| row.time_us);
    log
}
