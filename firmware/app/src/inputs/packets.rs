//! From the modem's sentences to ranges: one packet at a time.
//!
//! A packet is announced at its start (`$CARXP`), but its data (`$CARXD`) and its time of arrival
//! (`$CACST`) come seconds later, in either order. When both halves are there, range = sound speed · (time of arrival −
//! transmit second − delay of the modem). Packets that are lost, late, repeated, out of order or implausible are
//! counted by [`Loss`] and have no other effect.

use super::sample::AcousticReport;
use crate::geodesy::LocalFrame;
use crate::held::Held;
use crate::parameters::AppSettings;
use crate::time::{UtcClock, day_difference_us, micros};
use backseat_core::navigation::ShipReport;
use backseat_wire::ship_state::ShipState;

/// The start of a packet is reported within this of its time of arrival, µs; statistics further off belong to another.
const BRIDGE_MAX_US: i64 = 2_000_000;
/// A transmit second up to this much before the last one used is a repetition, s: more than the longest flight, 20 km
/// at 1300 m/s.
const REPLAY_S: u32 = 16;
/// Largest plausible distance of the ship, m: the local plane ends there.
const SHIP_MAX_M: f64 = 1.0e5;
/// Largest plausible speed of the ship, m/s.
const SHIP_MAX_MPS: f64 = 20.0;

/// Why a packet gave no range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
    /// The modem reports it as bad, or it holds no ship state.
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

#[derive(Clone, Copy, Debug)]
struct Pending {
    start_us: u64,
    ship: Option<ShipState>,
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

/// State of the packet under way after a report.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "handed over one by one, never kept")]
pub enum PacketProgress {
    /// Nothing yet.
    Waiting,
    /// A packet begins; an incomplete one before it is given up.
    Begins,
    /// The packet under way gives no range.
    Lost,
    /// It is complete.
    Complete(Packet),
}

/// The packet under way.
#[derive(Debug, Default)]
pub struct Packets {
    pending: Held<Pending>,
    last_transmit_s: Option<u32>,
    losses: [u32; Loss::COUNT],
}

impl Packets {
    /// None was ever heard.
    #[must_use]
    pub const fn new() -> Self {
        Self { pending: Held::none(), last_transmit_s: None, losses: [0; Loss::COUNT] }
    }

    /// Packets lost for one cause.
    #[must_use]
    pub fn losses(&self, loss: Loss) -> u32 {
        self.losses[loss as usize]
    }

    /// Forgets the packet under way and which were used.
    pub fn reset(&mut self) {
        self.pending.clear();
        self.last_transmit_s = None;
    }

    /// Gives up the packet under way.
    pub fn give_up(&mut self, loss: Loss) {
        self.pending.clear();
        let count = &mut self.losses[loss as usize];
        *count = count.saturating_add(1);
    }

    /// Gives up a packet that is not complete by `now_us`; true when there was one.
    pub fn expire(&mut self, now_us: u64, settings: &AppSettings) -> bool {
        let timeout_us = micros(settings.packet_timeout_s);
        let expired = self.pending.get().is_some_and(|pending| now_us.saturating_sub(pending.start_us) > timeout_us);
        if expired {
            self.give_up(Loss::TimedOut);
        }
        expired
    }

    /// When the packet under way began, µs.
    #[must_use]
    pub fn began_us(&self) -> Option<u64> {
        self.pending.get().map(|pending| pending.start_us)
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
            Err(loss) => {
                self.give_up(loss);
                PacketProgress::Lost
            }
        }
    }

    fn follow(
        &mut self,
        report: &AcousticReport,
        now_us: u64,
        clock: &UtcClock,
        settings: &AppSettings,
    ) -> Result<PacketProgress, Loss> {
        match *report {
            AcousticReport::Begins => {
                if self.pending.get().is_some() {
                    self.give_up(Loss::Replaced);
                }
                self.pending.set(Pending { start_us: now_us, ship: None, arrival: None });
                return Ok(PacketProgress::Begins);
            }
            AcousticReport::Cycle => return Err(Loss::Cycle),
            AcousticReport::BadData => return Err(Loss::Bad),
            AcousticReport::Ship(ship) if ship.source != settings.ship_address => return Err(Loss::Stranger),
            AcousticReport::Ship(ship) => {
                self.pending.get_mut().ok_or(Loss::Unannounced)?.ship = Some(ship);
            }
            AcousticReport::Statistics { good, synchronous, arrival, range_rate_mps } => {
                let pending = self.pending.get_mut().ok_or(Loss::Unannounced)?;
                let start_utc_us = clock.utc_us(pending.start_us).ok_or(Loss::NoTime)?;
                if !good {
                    return Err(Loss::Bad);
                }
                let toa_us = arrival.unix_us(start_utc_us);
                pending.arrival = Some(Arrival { toa_us, synchronous, range_rate_mps });
            }
        }
        let Some(&Pending { start_us, ship: Some(ship), arrival: Some(arrival) }) = self.pending.get() else {
            return Ok(PacketProgress::Waiting);
        };
        let packet = self.evaluate(start_us, &ship, &arrival, clock, settings)?;
        self.pending.clear();
        self.last_transmit_s = Some(ship.transmit_s);
        Ok(PacketProgress::Complete(packet))
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
        if !clock.carries_ranges(start_us) {
            return Err(Loss::Undisciplined);
        }
        let start_utc_us = clock.utc_us(start_us).ok_or(Loss::NoTime)?;
        let bridge_us = day_difference_us(arrival.toa_us, start_utc_us);
        if bridge_us.abs() > BRIDGE_MAX_US {
            return Err(Loss::Arrival);
        }
        let flight_us = day_difference_us(arrival.toa_us, u64::from(ship.transmit_s) * 1_000_000);
        let installation = &settings.installation;
        let range_m = installation.sound_speed_mps * (flight_us as f64 * 1e-6 - installation.transducer_delay_s);
        let position_m = LocalFrame::new(settings.origin_lat_deg, settings.origin_lon_deg)
            .to_local(ship.position_deg[0], ship.position_deg[1]);
        let plausible = (0.0..=settings.range_max_m).contains(&range_m)
            && position_m.iter().all(|x| x.abs() <= SHIP_MAX_M)
            && ship.velocity_mps.iter().all(|v| v.abs() <= SHIP_MAX_MPS);
        if !plausible {
            return Err(Loss::Absurd);
        }
        let report = ShipReport {
            position_m,
            velocity_mps: ship.velocity_mps,
            position_sigma_m: ship.position_sigma_m,
            velocity_sigma_mps: ship.velocity_sigma_mps,
        };
        Ok(Packet {
            start_us,
            bridge_us,
            flight_us,
            range_m,
            range_rate_mps: arrival.range_rate_mps,
            ship: report,
            ship_deg: ship.position_deg,
            transducer_depth_m: ship.transducer_depth_m,
        })
    }
}
