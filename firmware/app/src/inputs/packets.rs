//! From the modem's sentences to ranges: one packet at a time, or two where one begins before the last sentence of
//! another.
//!
//! A packet is announced at its start (`$CARXP`), but its data (`$CARXD`) and its time of arrival
//! (`$CACST`) come seconds later, in either order. When both halves are there, range = sound speed · (time of arrival −
//! transmit second − delay of the modem). Packets that are lost, late, repeated, out of order or implausible are
//! counted by [`Loss`] and have no other effect.

use super::sample::{AcousticReport, HeardVehicle};
use crate::geodesy::LocalFrame;
use crate::held::Held;
use crate::parameters::AppSettings;
use crate::time::{UtcClock, day_difference_us, micros};
use backseat_core::navigation::{PeerReport, ShipReport};
use backseat_wire::ship_state::ShipState;
use heapless::Vec;

/// From a ping's arrival at the ship to its reply, s. What the modem reports is without it; here it only says where the
/// vehicle was when the reply came: a second wrong is half a metre at 1 m/s.
pub const TURNAROUND_S: f64 = 1.0;
/// A ship that was heard longer ago than this gives no two-way range, µs.
const SHIP_AGE_US: u64 = 90_000_000;
/// Acceleration of a ship that its last velocity does not tell, m/s²/√Hz.
const SHIP_ACCELERATION: f64 = 0.02;
/// Packets under way at once.
const MOST: usize = 2;
/// The start of a packet is reported within this of its time of arrival, µs; statistics further off belong to another.
const BRIDGE_MAX_US: i64 = 2_000_000;
/// Two clocks that name the same second differ by less, µs.
const CLOCKS_APART_US: i64 = 500_000;
/// A transmit second up to this much before the last one used is a repetition, s: more than the longest flight, 20 km
/// at 1300 m/s.
const REPLAY_S: u32 = 16;
/// Largest plausible distance of the ship, m: the local plane ends there.
const SHIP_MAX_M: f64 = 1.0e5;
/// Largest plausible speed of the ship, m/s.
const SHIP_MAX_MPS: f64 = 20.0;

/// Why a packet gave no range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Its start came while the filter was not initialised.
    NotReady,
    /// It was a cycle initialisation, without data.
    Cycle,
    /// Another packet began before its data and statistics were complete.
    Replaced,
    /// Data or statistics did not come in time.
    TimedOut,
    /// Data or statistics without a start.
    Unannounced,
    /// The modem reports it as bad, or it holds no state of a ship, nor one of another vehicle that is used.
    Bad,
    /// From another ship.
    Stranger,
    /// The modem's clock was not on an external pulse.
    NotSynchronous,
    /// The board does not know UTC.
    NoTime,
    /// The board's clock counts its internal oscillator, and no pulse edges discipline it.
    Undisciplined,
    /// Its time of arrival does not belong to its start.
    Arrival,
    /// Its transmit second, or a later one, was already used.
    Repeated,
    /// Range, or the ship's position or velocity, is impossible.
    Absurd,
}

impl Loss {
    const COUNT: usize = Self::Absurd as usize + 1;
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Arrival {
    toa_us: u64,
    synchronous: bool,
    range_rate_mps: Option<f64>,
}

/// Whose state a packet carries.
#[derive(Clone, Copy, Debug)]
enum Sender {
    Ship(ShipState),
    Vehicle(HeardVehicle),
}

#[derive(Clone, Copy, Debug)]
struct Pending {
    /// Of the packet.
    id: u8,
    start_us: u64,
    sender: Option<Sender>,
    arrival: Option<Arrival>,
}

/// A complete packet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packet {
    /// When the modem reported its start, µs of the board's clock.
    pub start_us: u64,
    /// Time of arrival less the start, µs.
    pub bridge_us: i64,
    /// Time of arrival less the transmit second, µs.
    pub flight_us: i64,
    /// Distance from the ship's transducer to the vehicle's, m.
    pub range_m: f64,
    /// Range rate from the Doppler, positive opening, m/s.
    pub range_rate_mps: Option<f64>,
    /// The ship's state that it carries.
    pub ship: ShipReport,
    /// The ship's latitude and longitude, degrees.
    pub ship_deg: [f64; 2],
    /// Depth of the ship's transducer, m.
    pub transducer_depth_m: f64,
}

/// A complete packet of another vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeerPacket {
    /// Time of arrival less the start, µs.
    pub bridge_us: i64,
    /// Distance between the transducers, m.
    pub range_m: f64,
    /// Where it says it was.
    pub peer: PeerReport,
}

impl HeardShip {
    /// The ship at `time_us`, moved on with its velocity; `None` if it was heard too long ago.
    #[must_use]
    pub fn moved_on(&self, time_us: u64) -> Option<ShipReport> {
        let age_us = time_us.checked_sub(self.time_us).filter(|age_us| *age_us <= SHIP_AGE_US)?;
        let age_s = age_us as f64 * 1e-6;
        let mut ship = self.report;
        for (position, velocity) in ship.position_m.iter_mut().zip(ship.velocity_mps) {
            *position += velocity * age_s;
        }
        let walk = SHIP_ACCELERATION * SHIP_ACCELERATION;
        let drift_m = ship.velocity_sigma_mps * age_s;
        let variance = ship.position_sigma_m * ship.position_sigma_m + drift_m * drift_m;
        ship.position_sigma_m = libm::sqrt(variance + walk * age_s * age_s * age_s / 3.0);
        ship.velocity_sigma_mps = libm::sqrt(ship.velocity_sigma_mps * ship.velocity_sigma_mps + walk * age_s);
        Some(ship)
    }
}

/// State of the packet under way after a report.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "handed over one by one, never kept")]
pub enum PacketProgress {
    /// Nothing yet.
    Waiting,
    /// A packet of this number begins.
    Begins(u8),
    /// A packet under way gives no range.
    Lost,
    /// The one of this number is complete.
    Complete(u8, Packet),
    /// The one of this number is complete, and another vehicle's.
    Peer(u8, PeerPacket),
}

/// The ship as its last packet said, whether that gave a range or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeardShip {
    /// When the ship was there, µs of the board's clock.
    pub time_us: u64,
    /// Position and velocity.
    pub report: ShipReport,
    /// Depth of its transducer, m.
    pub transducer_depth_m: f64,
}

/// The packets under way, the oldest first.
#[derive(Debug, Default)]
pub struct Packets {
    pending: Vec<Pending, MOST>,
    next_id: u8,
    heard: Held<HeardShip>,
    last_transmit_s: Option<u32>,
    losses: [u32; Loss::COUNT],
}

impl Packets {
    /// None was ever heard.
    #[must_use]
    pub const fn new() -> Self {
        Self { pending: Vec::new(), next_id: 0, heard: Held::none(), last_transmit_s: None, losses: [0; Loss::COUNT] }
    }

    /// Packets lost for one cause.
    #[must_use]
    pub fn losses(&self, loss: Loss) -> u32 {
        self.losses[loss as usize]
    }

    /// Forgets the packets under way and which were used.
    pub fn reset(&mut self) {
        self.pending.clear();
        self.heard.clear();
        self.last_transmit_s = None;
    }

    /// Gives up the packet that began last.
    pub fn give_up(&mut self, loss: Loss) {
        self.pending.pop();
        self.count(loss);
    }

    fn count(&mut self, loss: Loss) {
        let count = &mut self.losses[loss as usize];
        *count = count.saturating_add(1);
    }

    /// Drops the packet at this place, if there is one: `remove` panics where there is none.
    fn forget(&mut self, place: usize) {
        let mut at = 0;
        self.pending.retain(|_| {
            at += 1;
            at != place + 1
        });
    }

    /// Gives up packets that are not complete by `now_us`; true when there was one.
    pub fn expire(&mut self, now_us: u64, settings: &AppSettings) -> bool {
        let timeout_us = micros(settings.packet_timeout_s);
        let expired = |pending: &Pending| now_us.saturating_sub(pending.start_us) > timeout_us;
        let any = self.pending.iter().any(expired);
        while self.pending.first().is_some_and(expired) {
            self.forget(0);
            self.count(Loss::TimedOut);
        }
        any
    }

    /// When the oldest packet under way began, µs.
    #[must_use]
    pub fn began_us(&self) -> Option<u64> {
        self.pending.first().map(|pending| pending.start_us)
    }

    /// Whether the packet of this number is under way.
    #[must_use]
    pub fn is_under_way(&self, id: u8) -> bool {
        self.pending.iter().any(|pending| pending.id == id)
    }

    /// The ship as its last packet said.
    #[must_use]
    pub fn heard_ship(&self) -> Option<&HeardShip> {
        self.heard.get()
    }

    /// Takes one report of `now_us`; the last one of a packet completes it.
    pub fn take(
        &mut self,
        report: &AcousticReport,
        now_us: u64,
        clock: &UtcClock,
        settings: &AppSettings,
    ) -> PacketProgress {
        match self.follow(report, now_us, clock, settings) {
            Ok(progress) => progress,
            Err((place, loss)) => {
                self.forget(place);
                self.count(loss);
                PacketProgress::Lost
            }
        }
    }

    /// The place of the packet that data without a time are about: the last that lacks them.
    fn last_without_ship(&self) -> usize {
        self.pending.iter().rposition(|pending| pending.sender.is_none()).unwrap_or(self.pending.len())
    }

    /// The place of the packet that left at `launch_us`: the first that began after that; without UTC the last.
    fn place_of_launch(&self, launch_us: u64, clock: &UtcClock) -> usize {
        let follows = |pending: &Pending| {
            let start_us = clock.utc_us(pending.start_us);
            pending.sender.is_none() && start_us.is_some_and(|us| day_difference_us(us, launch_us) >= -CLOCKS_APART_US)
        };
        self.pending.iter().position(follows).unwrap_or_else(|| self.last_without_ship())
    }

    /// The place of the packet that arrived at `toa_us`: the one that began nearest to it.
    fn place_of(&self, toa_us: u64, clock: &UtcClock) -> usize {
        let off = |pending: &Pending| match clock.utc_us(pending.start_us) {
            Some(utc_us) => day_difference_us(toa_us, utc_us).unsigned_abs(),
            None => u64::MAX,
        };
        let lacking = self.pending.iter().enumerate().filter(|(_, pending)| pending.arrival.is_none());
        lacking.min_by_key(|(_, pending)| off(pending)).map_or(self.pending.len(), |(place, _)| place)
    }

    /// The packet that is lost has the place that comes with the cause; there may be none there.
    fn follow(
        &mut self,
        report: &AcousticReport,
        now_us: u64,
        clock: &UtcClock,
        settings: &AppSettings,
    ) -> Result<PacketProgress, (usize, Loss)> {
        let place = match *report {
            AcousticReport::Begins => {
                if self.pending.is_full() {
                    self.forget(0);
                    self.count(Loss::Replaced);
                }
                self.next_id = self.next_id.wrapping_add(1);
                let id = self.next_id;
                // there is room
                let _ = self.pending.push(Pending { id, start_us: now_us, sender: None, arrival: None });
                return Ok(PacketProgress::Begins(id));
            }
            // it is the one that began last: its data packet has not begun yet
            AcousticReport::Cycle => return Err((self.pending.len().saturating_sub(1), Loss::Cycle)),
            AcousticReport::BadData => return Err((self.last_without_ship(), Loss::Bad)),
            AcousticReport::Ship(ship) if ship.source != settings.ship_address => {
                return Err((self.last_without_ship(), Loss::Stranger));
            }
            AcousticReport::Ship(ship) => {
                let place = self.place_of_launch(u64::from(ship.transmit_s) * 1_000_000, clock);
                let start_us = self.pending.get(place).map_or(now_us, |pending| pending.start_us);
                self.hear(&ship, start_us, clock, settings);
                self.pending.get_mut(place).ok_or((place, Loss::Unannounced))?.sender = Some(Sender::Ship(ship));
                place
            }
            AcousticReport::Vehicle(vehicle) => {
                let place = self.place_of_launch(u64::from(vehicle.transmit_s) * 1_000_000, clock);
                self.pending.get_mut(place).ok_or((place, Loss::Unannounced))?.sender = Some(Sender::Vehicle(vehicle));
                place
            }
            AcousticReport::Statistics { good, synchronous, arrival, range_rate_mps } => {
                let oldest = self.pending.first().ok_or((0, Loss::Unannounced))?;
                let start_utc_us = clock.utc_us(oldest.start_us).ok_or((0, Loss::NoTime))?;
                let toa_us = arrival.unix_us(start_utc_us);
                let place = self.place_of(toa_us, clock);
                if !good {
                    return Err((place, Loss::Bad));
                }
                let pending = self.pending.get_mut(place).ok_or((place, Loss::Unannounced))?;
                pending.arrival = Some(Arrival { toa_us, synchronous, range_rate_mps });
                place
            }
            // of pings
            AcousticReport::PingSent | AcousticReport::PingReply { .. } => return Ok(PacketProgress::Waiting),
        };
        let Some(&Pending { id, start_us, sender: Some(sender), arrival: Some(arrival) }) = self.pending.get(place)
        else {
            return Ok(PacketProgress::Waiting);
        };
        let complete = match sender {
            Sender::Ship(ship) => self.evaluate(start_us, &ship, &arrival, clock, settings).map(|packet| {
                self.last_transmit_s = Some(ship.transmit_s);
                PacketProgress::Complete(id, packet)
            }),
            Sender::Vehicle(vehicle) => evaluate_peer(start_us, &vehicle, &arrival, clock, settings)
                .map(|packet| PacketProgress::Peer(id, packet)),
        };
        let complete = complete.map_err(|loss| (place, loss))?;
        self.forget(place);
        Ok(complete)
    }

    /// Keeps where the ship says it is, for ranges that need no common clock.
    fn hear(&mut self, ship: &ShipState, start_us: u64, clock: &UtcClock, settings: &AppSettings) {
        let launch_us = clock.local_us(u64::from(ship.transmit_s) * 1_000_000);
        // a board that does not know the time takes the packet's start: a flight later
        let time_us = launch_us.unwrap_or(start_us);
        let late_us = start_us.saturating_sub(time_us).max(time_us.saturating_sub(start_us));
        let position_m = local(ship.position_deg, settings);
        if late_us <= u64::from(REPLAY_S) * 1_000_000 && is_plausible(&position_m, ship) {
            let (report, transducer_depth_m) = (report_of(ship, position_m), ship.transducer_depth_m);
            self.heard.set(HeardShip { time_us, report, transducer_depth_m });
        }
    }

    fn evaluate(
        &self,
        start_us: u64,
        ship: &ShipState,
        arrival: &Arrival,
        clock: &UtcClock,
        settings: &AppSettings,
    ) -> Result<Packet, Loss> {
        if !arrival.synchronous {
            return Err(Loss::NotSynchronous);
        }
        // A packet that fits the board's own clock was sent within the longest flight: an older one is a repetition of
        // what was used, one ahead of which many seconds were used was sent by a clock that has been set back.
        if self.last_transmit_s.is_some_and(|last_s| last_s.wrapping_sub(ship.transmit_s) < REPLAY_S) {
            return Err(Loss::Repeated);
        }
        let PacketTravel { bridge_us, flight_us, range_m } =
            PacketTravel::new(start_us, ship.transmit_s, arrival, clock, settings)?;
        let position_m = local(ship.position_deg, settings);
        if !is_plausible(&position_m, ship) {
            return Err(Loss::Absurd);
        }
        Ok(Packet {
            start_us,
            bridge_us,
            flight_us,
            range_m,
            range_rate_mps: arrival.range_rate_mps,
            ship: report_of(ship, position_m),
            ship_deg: ship.position_deg,
            transducer_depth_m: ship.transducer_depth_m,
        })
    }
}

/// How far a packet has come.
struct PacketTravel {
    bridge_us: i64,
    flight_us: i64,
    range_m: f64,
}

impl PacketTravel {
    fn new(
        start_us: u64,
        transmit_s: u32,
        arrival: &Arrival,
        clock: &UtcClock,
        settings: &AppSettings,
    ) -> Result<Self, Loss> {
        if !clock.carries_ranges(start_us) {
            return Err(Loss::Undisciplined);
        }
        let start_utc_us = clock.utc_us(start_us).ok_or(Loss::NoTime)?;
        let bridge_us = day_difference_us(arrival.toa_us, start_utc_us);
        if bridge_us.abs() > BRIDGE_MAX_US {
            return Err(Loss::Arrival);
        }
        let flight_us = day_difference_us(arrival.toa_us, u64::from(transmit_s) * 1_000_000);
        let installation = &settings.installation;
        let range_m = installation.sound_speed_mps * (flight_us as f64 * 1e-6 - installation.transducer_delay_s);
        let is_plausible = (0.0..=settings.range_max_m).contains(&range_m);
        if is_plausible { Ok(Self { bridge_us, flight_us, range_m }) } else { Err(Loss::Absurd) }
    }
}

/// A packet that comes twice has travelled further the second time: the filter's gate is enough.
fn evaluate_peer(
    start_us: u64,
    vehicle: &HeardVehicle,
    arrival: &Arrival,
    clock: &UtcClock,
    settings: &AppSettings,
) -> Result<PeerPacket, Loss> {
    if vehicle.source == settings.modem_address || vehicle.source == settings.ship_address {
        return Err(Loss::Stranger);
    }
    if !(arrival.synchronous && vehicle.synchronous) {
        return Err(Loss::NotSynchronous);
    }
    let PacketTravel { bridge_us, range_m, .. } =
        PacketTravel::new(start_us, vehicle.transmit_s, arrival, clock, settings)?;
    let [north_m, east_m] = local(vehicle.position_deg, settings);
    if north_m.abs().max(east_m.abs()) > SHIP_MAX_M {
        return Err(Loss::Absurd);
    }
    let position_m = [north_m, east_m, vehicle.depth_m];
    let HeardVehicle { source: address, covariance_m2, leans, .. } = *vehicle;
    let peer = PeerReport { address, position_m, covariance_m2, leans };
    Ok(PeerPacket { bridge_us, range_m, peer })
}

/// North and east of a latitude and longitude, degrees, in m.
fn local([latitude, longitude]: [f64; 2], settings: &AppSettings) -> [f64; 2] {
    LocalFrame::new(settings.origin_lat_deg, settings.origin_lon_deg).to_local(latitude, longitude)
}

fn is_plausible(position_m: &[f64; 2], ship: &ShipState) -> bool {
    position_m.iter().all(|x| x.abs() <= SHIP_MAX_M) && ship.velocity_mps.iter().all(|v| v.abs() <= SHIP_MAX_MPS)
}

fn report_of(ship: &ShipState, position_m: [f64; 2]) -> ShipReport {
    ShipReport {
        position_m,
        velocity_mps: ship.velocity_mps,
        position_sigma_m: ship.position_sigma_m,
        velocity_sigma_mps: ship.velocity_sigma_mps,
    }
}
