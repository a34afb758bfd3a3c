//! Logs of messages, one quantity or one sensor at a time: gathered into the rows of a vehicle log.

use super::origin::Origin;
use crate::DataError;
use crate::log::{Column, Log, LogRow};
use backseat_core::state::wrap_angle;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;

/// Messages within this time share a row, µs: roll, pitch and heading are of use only together, and some logs write
/// them one by one.
const TOGETHER_US: i64 = 30_000;

/// So many names of what is left out for one reason are shown.
const MOST_NAMES: usize = 20;

/// From here on a time counts from 1970 and not from a start, µs: 1973.
const LEAST_UNIX_US: i64 = 100_000_000_000_000;

/// A vehicle log in the making.
#[derive(Default)]
pub(super) struct Gathering {
    /// Only messages of the very same time share a row.
    pub is_exact: bool,
    /// Rows with the time of the log that is read, µs.
    rows: Vec<(i64, LogRow)>,
    origin: Option<Origin>,
    /// The first time that a row refers to, µs.
    first_us: Option<i64>,
    /// How many messages were left out, by reason and name.
    left_out: BTreeMap<(Cow<'static, str>, String), usize>,
}

impl Gathering {
    /// Adds samples of one time.
    pub(super) fn add(&mut self, time_us: i64, samples: &[(Column, f64)]) {
        let is_free = |row: &LogRow| samples.iter().all(|(column, _)| row.get(*column).is_none());
        let together_us = if self.is_exact { 0 } else { TOGETHER_US };
        let last = self.rows.last_mut().filter(|(row_us, row)| (time_us - row_us).abs() <= together_us && is_free(row));
        let row = match last {
            Some((_, row)) => row,
            None => {
                self.rows.push((time_us, LogRow::new(0)));
                let Some((_, row)) = self.rows.last_mut() else { return };
                row
            }
        };
        for &(column, value) in samples.iter().filter(|(_, value)| value.is_finite()) {
            row.set(column, if column == Column::Heading { wrap_angle(value) } else { value });
        }
    }

    /// Adds a fix.
    pub(super) fn add_fix(&mut self, time_us: i64, latitude_deg: f64, longitude_deg: f64) {
        self.add_place(time_us, [Column::GpsX, Column::GpsY], [latitude_deg, longitude_deg]);
    }

    /// Adds a fix of the ship; north and east of the first place, m.
    pub(super) fn add_ship_fix(&mut self, time_us: i64, place_deg: [f64; 2]) -> Option<[f64; 2]> {
        self.add_place(time_us, [Column::ShipGpsX, Column::ShipGpsY], place_deg)
    }

    fn add_place(&mut self, time_us: i64, [north, east]: [Column; 2], place_deg: [f64; 2]) -> Option<[f64; 2]> {
        if !(place_deg[0].abs() <= 90.0 && place_deg[1].abs() <= 180.0) {
            return None;
        }
        let [x_m, y_m] = self.local_m(place_deg);
        self.add(time_us, &[(north, x_m), (east, y_m)]);
        Some([x_m, y_m])
    }

    /// Adds what was measured of sound, by its launch and its arrival in µs since 1970.
    pub(super) fn add_flight(&mut self, [launch_us, arrival_us]: [i64; 2], mut samples: Vec<(Column, f64)>) {
        samples.extend([(Column::Tol, launch_us as f64 * 1e-6), (Column::Toa, arrival_us as f64 * 1e-6)]);
        // the log begins at the launch, so that no time in it is negative
        self.first_us = Some(self.first_us.map_or(launch_us, |first_us| first_us.min(launch_us)));
        self.add(arrival_us, &samples);
    }

    /// North and east of the first place, m.
    pub(super) fn local_m(&mut self, [latitude_deg, longitude_deg]: [f64; 2]) -> [f64; 2] {
        let origin = self.origin.get_or_insert_with(|| Origin::new(latitude_deg, longitude_deg));
        origin.local_m(latitude_deg, longitude_deg)
    }

    /// Counts a message that is left out.
    pub(super) fn leave_out(&mut self, name: &str, reason: &'static str) {
        self.leave_out_so_many(name, 1, reason);
    }

    /// Counts messages that are left out.
    pub(super) fn leave_out_so_many(&mut self, name: &str, count: usize, reason: impl Into<Cow<'static, str>>) {
        *self.left_out.entry((reason.into(), name.to_owned())).or_default() += count;
    }

    /// The log, its first row at zero.
    pub(super) fn finish(mut self, path: &Path, mut notes: Vec<String>) -> Result<Log, DataError> {
        let mut reasons: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for ((reason, name), count) in &self.left_out {
            reasons.entry(reason).or_default().push(format!("{name} ({count})"));
        }
        for (reason, mut names) in reasons {
            if names.len() > MOST_NAMES {
                let more = names.split_off(MOST_NAMES).len();
                names.push(format!("{more} more"));
            }
            notes.push(format!("left out {}: {reason}", names.join(", ")));
        }
        self.rows.retain(|(_, row)| !row.is_empty());
        // messages of several sources may be out of order by some milliseconds
        self.rows.sort_by_key(|(time_us, _)| *time_us);
        hold_commands(&mut self.rows);
        let Some(start_us) =
            self.rows.first().map(|(time_us, _)| self.first_us.map_or(*time_us, |us| us.min(*time_us)))
        else {
            let message = format!("nothing in it that a vehicle log holds; {}", notes.join("; "));
            return Err(DataError::file(path, message));
        };
        let rows = self.rows.into_iter().map(|(time_us, mut row)| {
            row.time_us = (time_us - start_us).unsigned_abs();
            for column in [Column::Tol, Column::Toa] {
                if let Some(time_s) = row.get(column) {
                    row.set(column, ((time_s * 1e6).round() as i64 - start_us) as f64 / 1e6);
                }
            }
            row
        });
        Ok(Log {
            path: path.to_owned(),
            rows: rows.collect(),
            notes,
            start_unix_us: (start_us > LEAST_UNIX_US).then_some(start_us),
            origin_deg: self.origin.map(|origin| origin.degrees()),
            ..Log::default()
        })
    }
}

/// Propeller and fins come one by one; each holds until its next command, and a row has all five or none.
fn hold_commands(rows: &mut [(i64, LogRow)]) {
    const COMMANDS: [Column; 5] =
        [Column::PropRpm, Column::FinTop, Column::FinBottom, Column::FinPort, Column::FinStarboard];
    let mut held = [None; 5];
    for (_, row) in rows {
        let commanded = COMMANDS.map(|column| row.get(column));
        if commanded.iter().all(Option::is_none) {
            continue;
        }
        for (held, commanded) in held.iter_mut().zip(commanded) {
            *held = commanded.or(*held);
        }
        if held.iter().all(Option::is_some) {
            for (column, value) in COMMANDS.into_iter().zip(held) {
                row.set(column, value.unwrap_or_default());
            }
        }
    }
}
