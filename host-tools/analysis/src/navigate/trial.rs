//! What a trial leaves behind, put together: the vehicle's log, the ship's receiver, the vehicle's modem.
//!
//! All times are brought to UTC by the readers. The vehicle's own clock is another matter: nothing in its log says how
//! far it is off. The ranges do: they are to where the vehicle was at their arrival in UTC, so that the track of the
//! log, moved in time by the right amount, fits them best.

use crate::read_log::ReadLog;
use crate::uses;
use anyhow::bail;
use backseat_core::navigation::ProcessModel;
use backseat_core::state::{X, Y};
use backseat_estimation::filter::{self, FilterOptions, TrackSample};
use backseat_estimation::inputs;
use backseat_logs::importers;
use backseat_logs::log::{Column, LogRow};
use backseat_logs::stats::median;
use backseat_logs::{Log, VehicleFile};
use std::path::{Path, PathBuf};

/// North and east of what a log beside the vehicle's may hold.
const PLACES: [[Column; 2]; 3] =
    [[Column::GpsX, Column::GpsY], [Column::ShipX, Column::ShipY], [Column::ShipGpsX, Column::ShipGpsY]];
/// Largest offset of the vehicle's clock that is looked for, s.
const LARGEST_S: f64 = 120.0;
/// Steps of the search, s: coarse over everything, then fine about the best.
const STEPS_S: [f64; 3] = [1.0, 0.1, 0.01];
/// Ranges from which on a clock can be set by them.
const LEAST_RANGES: usize = 12;

/// The logs of the ship and of the modem.
#[derive(Clone, Debug, Default)]
pub struct Trial {
    /// Log of the ship's GNSS (NMEA with RMC and GGA), with the fixes of its USBL or without.
    pub ship: Option<PathBuf>,
    /// Logs of the vehicle's modem, of the ship's, or of both ($CARXD and $CACST).
    pub modem: Vec<PathBuf>,
    /// Latitude and longitude of the origin of the vehicle's log, degrees, where it has positions in metres alone.
    pub origin_deg: Option<[f64; 2]>,
}

impl Trial {
    /// Joins the logs that were given to that of the vehicle.
    ///
    /// # Errors
    /// A log that cannot be read, has no date or no origin, or has no time in common with the vehicle's.
    pub fn join(&self, read: &mut ReadLog, vehicle: &VehicleFile) -> anyhow::Result<()> {
        if self.ship.is_none() && self.modem.is_empty() {
            return Ok(());
        }
        read.log.origin_deg = self.origin_deg.or(read.log.origin_deg);
        let mut others = Vec::new();
        let modems = self.modem.iter().map(|path| (path, false));
        for (path, is_ship) in self.ship.iter().map(|path| (path, true)).chain(modems) {
            let found = ReadLog::of(path, None)?;
            read.log.notes.extend(found.log.notes.iter().map(|note| format!("{}: {note}", path.display())));
            others.extend(beside(&read.log, &found.log, path, is_ship)?);
        }
        let offset = clock_offset(&read.log, &others, vehicle)?;
        if let Some(offset) = &offset {
            read.log.notes.push(offset.note());
        }
        let offset_us = offset.map_or(0, |offset| (offset.seconds * 1e6).round() as i64);
        let end_us = read.log.rows.last().map_or(0, |row| row.time_us as i64);
        let mut joined = 0;
        for (time_us, mut row) in others {
            let time_us = time_us + offset_us;
            if !(0..=end_us).contains(&time_us) {
                continue;
            }
            row.time_us = time_us.unsigned_abs();
            for column in [Column::Tol, Column::Toa] {
                if let Some(time_s) = row.get(column) {
                    row.set(column, time_s + offset_us as f64 / 1e6);
                }
            }
            if row.get(Column::Tol).is_none_or(|time_s| time_s >= 0.0) {
                read.log.rows.push(row);
                joined += 1;
            }
        }
        if joined == 0 {
            bail!(
                "{}: no time in common with the ship's and the modem's logs: look at the dates (the vehicle's must be UTC)",
                read.log.path.display()
            );
        }
        read.log.rows.sort_by_key(|row| row.time_us);
        Ok(())
    }
}

/// Rows of another log with their times in µs from the vehicle's start and places about its origin; fixes of the ship
/// become the ship's.
fn beside(log: &Log, other: &Log, path: &Path, is_ship: bool) -> anyhow::Result<Vec<(i64, LogRow)>> {
    let dated = |log: &Log, path: &Path| match log.start_unix_us {
        Some(start_us) => Ok(start_us),
        None => bail!(
            "{}: its times have no date (seconds since 1970, or a date beside the time), so that nothing can be joined to it",
            path.display()
        ),
    };
    let shift_us = dated(other, path)? - dated(log, &log.path)?;
    let placed = |log: &Log, path: &Path| match log.origin_deg {
        Some(origin_deg) => Ok(origin_deg),
        None => bail!(
            "{}: positions in metres without the latitude and longitude of their origin: nothing can be joined to it by place",
            path.display()
        ),
    };
    // a ship's modem has heard ranges alone, which are nowhere
    let has_places = PLACES.into_iter().any(|[column, _]| other.has(column));
    let [north_m, east_m] =
        if has_places { importers::local_m(placed(log, &log.path)?, placed(other, path)?) } else { [0.0; 2] };
    let moved = other.rows.iter().map(|row| {
        let mut row = row.clone();
        for (column, shift) in PLACES.into_iter().flat_map(|[north, east]| [(north, north_m), (east, east_m)]) {
            if let Some(value) = row.get(column) {
                row.set(column, value + shift);
            }
        }
        for column in [Column::Tol, Column::Toa] {
            if let Some(time_s) = row.get(column) {
                row.set(column, time_s + shift_us as f64 / 1e6);
            }
        }
        // with fixes by USBL it says itself what is the ship's
        if is_ship && !other.has(Column::ShipGpsX) {
            let fix = [row.get(Column::GpsX), row.get(Column::GpsY)].map(|value| value.unwrap_or(f64::NAN));
            row = LogRow::new(row.time_us);
            row.set_all(Column::ShipGpsX, &fix);
        }
        (row.time_us as i64 + shift_us, row)
    });
    Ok(moved.filter(|(_, row)| !row.is_empty()).collect())
}

/// How far the vehicle's clock is ahead of UTC.
struct Offset {
    seconds: f64,
    ranges: usize,
    /// Median distance of the ranges from the track, m, as the clocks stand and with the offset.
    misfit_m: [f64; 2],
}

impl Offset {
    fn note(&self) -> String {
        let [before, after] = self.misfit_m;
        let way = if self.seconds >= 0.0 { "ahead of" } else { "behind" };
        format!(
            "the vehicle's clock is {:.2} s {way} that of the modem by {} ranges (they miss its track by {before:.1} m as it \
             stands, by {after:.1} m when moved; median): the other logs were moved to it",
            self.seconds.abs(),
            self.ranges
        )
    }
}

/// The offset at which the ranges fit the track of the vehicle's log alone; `None` with too few ranges, or where every
/// offset fits as well.
fn clock_offset(log: &Log, others: &[(i64, LogRow)], vehicle: &VehicleFile) -> anyhow::Result<Option<Offset>> {
    // when the vehicle was at its end of the path, the range, and where the ship was at its own
    let mut ranges: Vec<(i64, f64, [f64; 2])> = others
        .iter()
        .filter_map(|(time_us, row)| Some((*time_us, row.get(Column::Range)?, row.ship_at_launch_m()?)))
        .collect();
    let mut fixes: Vec<(i64, [f64; 2])> =
        others.iter().filter_map(|(time_us, row)| Some((*time_us, row.ship_gnss_m()?))).collect();
    fixes.sort_by_key(|(time_us, _)| *time_us);
    ranges.extend(others.iter().filter_map(|(time_us, row)| {
        let launch_us = (row.get(Column::Tol)? * 1e6).round() as i64;
        Some((launch_us, row.get(Column::UplinkRange)?, importers::place_between(&fixes, *time_us)?))
    }));
    if ranges.len() < LEAST_RANGES {
        return Ok(None);
    }
    let track = own_track(log, vehicle)?;
    let misfit = |seconds: f64| -> Option<f64> {
        let misses: Vec<f64> = ranges
            .iter()
            .filter_map(|(time_us, range_m, ship_m)| {
                let [x_m, y_m, z_m] = at(&track, *time_us + (seconds * 1e6) as i64)?;
                let slant_m = (x_m - ship_m[0]).hypot(y_m - ship_m[1]).hypot(z_m);
                Some((slant_m - range_m).abs())
            })
            .collect();
        // an offset that leaves most ranges outside of the log explains nothing
        median(&misses).filter(|_| 2 * misses.len() >= ranges.len())
    };
    let Some(before) = misfit(0.0) else {
        bail!("{}: the ranges of the modem's log are not within its times: look at the dates", log.path.display());
    };
    let (mut best, mut least) = (0.0, before);
    let mut reach = LARGEST_S;
    for step in STEPS_S {
        let middle = best;
        let count = (reach / step).round() as i32;
        for k in -count..=count {
            let seconds = middle + f64::from(k) * step;
            if let Some(value) = misfit(seconds).filter(|value| *value < least) {
                (best, least) = (seconds, value);
            }
        }
        reach = step;
    }
    Ok(Some(Offset { seconds: best, ranges: ranges.len(), misfit_m: [before, least] }))
}

/// The track of the vehicle's log by itself, without ranges.
fn own_track(log: &Log, vehicle: &VehicleFile) -> anyhow::Result<Vec<TrackSample>> {
    let log = inputs::at_centre(log, &vehicle.installation);
    let model = if uses::has_actuators(&log) { ProcessModel::Dynamic } else { ProcessModel::Kinematic };
    Ok(filter::run(&log, vehicle, &FilterOptions::new(vehicle, model))?.track)
}

/// North, east and depth at a time, between the samples of the track.
fn at(track: &[TrackSample], time_us: i64) -> Option<[f64; 3]> {
    let time_us = u64::try_from(time_us).ok()?;
    let after = track.partition_point(|sample| sample.time_us < time_us);
    let (b, a) = (track.get(after)?, track.get(after.checked_sub(1)?)?);
    let share = (time_us - a.time_us) as f64 / (b.time_us - a.time_us).max(1) as f64;
    Some([X, Y, 2].map(|place| a.state[place] + share * (b.state[place] - a.state[place])))
}
