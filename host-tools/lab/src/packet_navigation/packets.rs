//! The packets of a simulated log, and the same log with fewer packets or fixes.

use backseat_logs::{Column, Log, LogRow};

/// A packet that arrived: its row in the log and its times. Only the log of a simulator is that plain: the row
/// stands at the time of arrival.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packet {
    /// Index of its row.
    pub row: usize,
    /// Time of launch, µs.
    pub launch_us: u64,
}

/// The packets of a log that were launched after its start.
#[must_use]
pub fn packets(log: &Log) -> Vec<Packet> {
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let packet = |(row, at): (usize, &LogRow)| {
        let launch_us = at.launch_us().filter(|launch_us| *launch_us >= start_us)?;
        at.get(Column::Range).map(|_| Packet { row, launch_us })
    };
    log.rows.iter().enumerate().filter_map(packet).collect()
}

/// The same log with these packets not received.
#[must_use]
pub fn lose(log: &Log, lost: &[Packet]) -> Log {
    let mut log = log.clone();
    for packet in lost {
        let row = &mut log.rows[packet.row];
        for column in [Column::Range, Column::RangeRate, Column::Tol, Column::Toa, Column::ShipX, Column::ShipY] {
            row.set(column, f64::NAN);
        }
    }
    log
}

/// The same log with the ship's fixes at least `period_us` apart.
#[must_use]
pub fn thin_fixes(log: &Log, period_us: u64) -> Log {
    let mut log = log.clone();
    let mut due_us = 0;
    for row in log.rows.iter_mut().filter(|row| row.ship_gnss_m().is_some()) {
        if row.time_us >= due_us {
            due_us = row.time_us + period_us;
        } else {
            row.set(Column::ShipGpsX, f64::NAN).set(Column::ShipGpsY, f64::NAN);
        }
    }
    log
}
