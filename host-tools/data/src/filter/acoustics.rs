//! Launches and arrivals of a log's packets, in order of time.

use crate::log::{Column, Log, LogRow};
use backseat_core::navigation::{CloneId, ShipReport};
use backseat_core::parameters::Installation;

/// Speed of sound assumed where a log gives no time of launch, m/s.
const SOUND_SPEED_MPS: f64 = Installation::DEFAULT.sound_speed_mps;

/// A row's time is its time of arrival, rounded, if they differ by less than this, µs.
const ROUNDING_US: u64 = 50_000;

/// Half of the window over which the ship's velocity at a launch is taken, µs: short against its
/// turns, long against the noise of its fixes.
const VELOCITY_WINDOW_US: u64 = 5_000_000;

/// One sigma of an unknown velocity: faster than any ship.
const UNKNOWN_SPEED_MPS: f64 = 100.0;

/// Half a packet's flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AcousticEvent {
    /// It reaches the vehicle. At one time arrivals come before launches, as a clone is taken after
    /// all updates of its time.
    Arrival,
    /// It leaves the ship.
    Launch,
}

/// A packet: when it flew, what was measured on it, and the ship's clone while it flies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packet {
    pub launch_us: u64,
    pub arrival_us: u64,
    pub range_m: Option<f64>,
    pub range_rate_mps: Option<f64>,
    /// North, east of the ship at launch as the packet would say, m.
    pub ship_m: Option<[f64; 2]>,
    pub clone: Option<CloneId>,
}

/// All packets of a log and the order of their events.
#[derive(Default)]
pub(super) struct Flights {
    pub packets: Vec<Packet>,
    /// (time, what, packet), in order.
    events: Vec<(u64, AcousticEvent, usize)>,
    next: usize,
}

impl Flights {
    pub fn of(log: &Log) -> Self {
        let packets: Vec<Packet> = log.rows.iter().filter_map(packet).collect();
        let mut events = Vec::with_capacity(2 * packets.len());
        for (index, packet) in packets.iter().enumerate() {
            events.push((packet.arrival_us, AcousticEvent::Arrival, index));
            events.push((packet.launch_us, AcousticEvent::Launch, index));
        }
        events.sort_by_key(|&(time_us, event, index)| (time_us, event as u8, index));
        Self { packets, events, next: 0 }
    }

    /// The next event at or before `until_us`.
    pub fn next_until(&mut self, until_us: u64) -> Option<(u64, AcousticEvent, usize)> {
        let event = *self.events.get(self.next).filter(|(time_us, ..)| *time_us <= until_us)?;
        self.next += 1;
        Some(event)
    }
}

fn packet(row: &LogRow) -> Option<Packet> {
    let (range_m, range_rate_mps) = (row.get(Column::Range), row.get(Column::RangeRate));
    if range_m.is_none() && range_rate_mps.is_none() {
        return None;
    }
    let arrival_us = match row.arrival_us() {
        Some(arrival_us) if arrival_us.abs_diff(row.time_us) >= ROUNDING_US => arrival_us,
        _ => row.time_us,
    };
    let flight_us = (range_m.unwrap_or(0.0).max(0.0) / SOUND_SPEED_MPS * 1e6) as u64;
    let launch_us = row.launch_us().unwrap_or(arrival_us.saturating_sub(flight_us)).min(arrival_us);
    Some(Packet { launch_us, arrival_us, range_m, range_rate_mps, ship_m: row.ship_at_launch_m(), clone: None })
}

/// The ship's track as its own computer knows it, for what a packet would say.
pub(super) struct ShipTrack {
    /// (time, north, east)
    fixes: Vec<(u64, [f64; 2])>,
    fix_sigma_m: f64,
}

impl ShipTrack {
    pub fn of(log: &Log, fix_sigma_m: f64) -> Self {
        let fixes = log.rows.iter().filter_map(|row| Some((row.time_us, row.ship_gnss_m()?))).collect();
        Self { fixes, fix_sigma_m }
    }

    /// What the packet launched at `launch_us` from `ship_m` would say, and whether its velocity is
    /// known: it is not without fixes to take it from.
    pub fn report(&self, launch_us: u64, ship_m: [f64; 2]) -> (ShipReport, bool) {
        let unknown = ShipReport {
            position_m: ship_m,
            velocity_mps: [0.0; 2],
            position_sigma_m: self.fix_sigma_m,
            velocity_sigma_mps: UNKNOWN_SPEED_MPS,
        };
        let first = self.fixes.partition_point(|fix| fix.0 + VELOCITY_WINDOW_US < launch_us);
        let last = self.fixes.partition_point(|fix| fix.0 <= launch_us + VELOCITY_WINDOW_US);
        let window = &self.fixes[first..last];
        if window.len() < 3 {
            return (unknown, false);
        }
        // Slope of a straight line through the fixes by least squares.
        let count = window.len() as f64;
        let seconds = |time_us: u64| (time_us as f64 - launch_us as f64) * 1e-6;
        let mean_s = window.iter().map(|fix| seconds(fix.0)).sum::<f64>() / count;
        let spread: f64 = window.iter().map(|fix| (seconds(fix.0) - mean_s).powi(2)).sum();
        let slope = |axis: usize| -> f64 {
            window.iter().map(|fix| (seconds(fix.0) - mean_s) * fix.1[axis]).sum::<f64>() / spread
        };
        if spread <= 0.0 {
            return (unknown, false);
        }
        let velocity_sigma_mps = self.fix_sigma_m / spread.sqrt();
        (ShipReport { velocity_mps: [slope(0), slope(1)], velocity_sigma_mps, ..unknown }, true)
    }
}
