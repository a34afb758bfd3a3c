//! Launches and arrivals of a log's packets and pings, in order of time.

use backseat_core::navigation::{CloneId, ShipReport};
use backseat_core::parameters::Installation;
use backseat_logs::log::{Column, Log, LogRow, Usbl};
use std::collections::BTreeMap;

/// Speed of sound assumed where a log gives no time of launch, m/s.
const SOUND_SPEED_MPS: f64 = Installation::DEFAULT.sound_speed_mps;

/// A row's time is its time of arrival, rounded, if they differ by less than this, µs.
const ROUNDING_US: u64 = 50_000;

/// Half of the window over which the ship's velocity at a launch is taken, µs: short against its
/// turns, long against the noise of its fixes.
const VELOCITY_WINDOW_US: u64 = 5_000_000;

/// Events ahead among which the arrivals of what is in flight are looked for.
const NEXT_EVENTS: usize = 64;

/// One sigma of an unknown velocity: faster than any ship.
const UNKNOWN_SPEED_MPS: f64 = 100.0;

/// One end of a flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AcousticEvent {
    /// The sound arrives. At one time arrivals come before launches, as a clone is taken after all updates of its time.
    Arrival,
    /// A packet, a ping or an answer leaves the ship.
    LeavesShip,
    /// A packet or a ping leaves the vehicle.
    LeavesVehicle,
}

/// Who sent, and where the travel time was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    /// From the ship, at the vehicle.
    Downlink,
    /// From the vehicle, at the ship.
    Uplink,
    /// From the vehicle and back to it.
    TwoWay,
}

/// A packet or a ping: when it flew, what was measured on it, and the clones of its ends while it flies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Packet {
    pub direction: Direction,
    /// When the sound left its sender.
    launch_us: u64,
    /// When the packet, or the ship's answer to a ping, left the ship; an uplink arrives there.
    pub ship_us: u64,
    pub arrival_us: u64,
    pub range_m: Option<f64>,
    pub range_rate_mps: Option<f64>,
    /// The range is in it.
    pub usbl: Option<Usbl>,
    /// The fixed transponder in the ship's place.
    pub station: Option<u32>,
    /// North, east of the ship at its end of the path as the packet would say, m.
    pub ship_m: Option<[f64; 2]>,
    pub ship: Option<CloneId>,
    pub vehicle: Option<CloneId>,
}

/// All packets of a log and the order of their events.
#[derive(Default)]
pub(super) struct Flights {
    pub packets: Vec<Packet>,
    /// Places of the fixed transponders, m.
    pub stations_m: BTreeMap<u32, [f64; 3]>,
    /// (time, what, packet), in order.
    events: Vec<(u64, AcousticEvent, usize)>,
    next: usize,
}

impl Flights {
    pub fn of(log: &Log) -> Self {
        let mut packets = Vec::new();
        let mut events = Vec::new();
        for packet in log.rows.iter().flat_map(flown) {
            let (index, Packet { direction, ship_us, arrival_us, station, .. }) = (packets.len(), packet);
            packets.push(packet);
            events.push((arrival_us, AcousticEvent::Arrival, index));
            if direction != Direction::Downlink {
                events.push((packet.launch_us, AcousticEvent::LeavesVehicle, index));
            }
            if direction != Direction::Uplink && station.is_none() {
                events.push((ship_us, AcousticEvent::LeavesShip, index));
            }
        }
        events.sort_by_key(|&(time_us, event, index)| (time_us, event as u8, index));
        Self { packets, stations_m: log.stations_m(), events, next: 0 }
    }

    /// The vehicle's clone at the launch of a packet, if another packet in flight that left at the same time has it:
    /// transponders answer one and the same ping.
    pub fn clone_of_launch(&self, index: usize) -> Option<CloneId> {
        let launch_us = self.packets[index].launch_us;
        let others = self.in_flight().filter(|packet| packet.launch_us == launch_us);
        others.filter(|packet| packet.direction != Direction::Downlink).find_map(|packet| packet.vehicle)
    }

    /// Whether a clone is an end of another packet in flight.
    pub fn is_shared(&self, clone: CloneId) -> bool {
        self.in_flight().any(|packet| packet.vehicle == Some(clone))
    }

    /// Packets that have been launched and have not arrived.
    fn in_flight(&self) -> impl Iterator<Item = &Packet> {
        // what is in flight has its arrival among the next events
        let next = self.events.iter().skip(self.next).take(NEXT_EVENTS);
        let arrivals = next.filter(|(_, event, _)| *event == AcousticEvent::Arrival);
        arrivals.map(|&(_, _, index)| &self.packets[index])
    }

    /// The next event at or before `until_us`.
    pub fn next_until(&mut self, until_us: u64) -> Option<(u64, AcousticEvent, usize)> {
        let event = *self.events.get(self.next).filter(|(time_us, ..)| *time_us <= until_us)?;
        self.next += 1;
        Some(event)
    }
}

/// What flew by a row.
fn flown(row: &LogRow) -> impl Iterator<Item = Packet> {
    let downlink = (row.get(Column::Range), row.get(Column::RangeRate));
    let one_way = (downlink != (None, None)).then_some((Direction::Downlink, downlink.0, downlink.1));
    let measured = |direction, column| row.get(column).map(|range_m| (direction, Some(range_m), None));
    let uplink = measured(Direction::Uplink, Column::UplinkRange);
    let two_way = measured(Direction::TwoWay, Column::TwoWayRange);
    let ranged = one_way.into_iter().chain(uplink).chain(two_way);
    let ranged = ranged.map(|(direction, range_m, range_rate_mps)| (direction, range_m, range_rate_mps, None));
    // an array on the ship hears the vehicle, one on the vehicle hears the ship or a transponder
    let heard = |usbl: &Usbl| if usbl.on_vehicle { Direction::Downlink } else { Direction::Uplink };
    let usbl = row.usbl().map(|usbl| (heard(&usbl), None, None, Some(usbl)));
    ranged.chain(usbl).map(|(direction, range_m, range_rate_mps, usbl)| {
        let arrival_us = match row.arrival_us() {
            Some(arrival_us) if arrival_us.abs_diff(row.time_us) >= ROUNDING_US => arrival_us,
            _ => row.time_us,
        };
        let distance_m = range_m.or(usbl.map(|usbl: Usbl| usbl.range_m));
        let flight_us = (distance_m.unwrap_or(0.0).max(0.0) / SOUND_SPEED_MPS * 1e6) as u64;
        let one_flight_before_us = arrival_us.saturating_sub(flight_us);
        // a ping without its time was sent two flights before its answer came, as if that had been at once
        let flights_us = if direction == Direction::TwoWay { 2 * flight_us } else { flight_us };
        let launch_us = row.launch_us().unwrap_or(arrival_us.saturating_sub(flights_us)).min(arrival_us);
        let ship_us = match direction {
            Direction::Downlink => launch_us,
            Direction::Uplink => arrival_us,
            Direction::TwoWay => one_flight_before_us.max(launch_us),
        };
        let ship_m = row.ship_at_launch_m();
        // the array on a ship has the ship at its other end
        let station = row.station().filter(|_| usbl.is_none_or(|usbl| usbl.on_vehicle));
        Packet {
            direction,
            launch_us,
            ship_us,
            arrival_us,
            range_m,
            range_rate_mps,
            usbl,
            station,
            ship_m,
            ship: None,
            vehicle: None,
        }
    })
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

    /// What a packet that left at `launch_us` from `ship_m` would say, and whether its velocity is
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
