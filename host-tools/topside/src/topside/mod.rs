//! The ship's half from outside: bytes and time in, bytes out; and where its parts are put together.

mod hearing;
mod readiness;
mod sending;

pub use sending::{ABORT_PACKETS, AbortRefused};

use crate::config::{Config, ConfigError, MAX_VEHICLES};
use crate::event::Event;
use crate::gnss::{Fix, GnssLink};
use crate::hold::Hold;
use crate::modem::{ClockHealth, ModemLink, Report};
use crate::ship::{FixOutcome, ShipEstimate, ShipFilter};
use crate::track::Track;
use backseat_app::{LocalFrame, Ring, UtcClock};
use backseat_wire::modem::ReceptionStatistics;
use backseat_wire::ship_state::{Key, ShipState};
use backseat_wire::vehicle_state::VehicleState;
use heapless::{Deque, Vec};
use sending::{PendingAbort, SENTENCE};

const SECOND_US: u64 = 1_000_000;
/// Bytes that may wait for a port.
const RING: usize = 1024;
/// Events that may wait.
const EVENTS: usize = 64;
/// Data and statistics of one packet come within this time of each other, µs.
const PAIR_US: u64 = 10_000_000;
/// A ping is answered within this time, µs.
const PING_US: u64 = 10_000_000;
/// A port of the ship's half.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Port {
    /// GNSS receiver, and the heading if there is one.
    Gnss,
    /// Micro-Modem.
    Modem,
}

impl Port {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Gnss, Self::Modem];
}

/// The packet of a slot, on its way out.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Outgoing {
    transmit_s: u32,
    sequence: u8,
    /// It is the abort for this modem address, rather than the ship's state.
    abort: Option<u8>,
    answered: bool,
}

/// A packet that left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sent {
    /// What it says.
    pub state: ShipState,
    /// When the modem was given it, caller's time, µs.
    pub time_us: u64,
}

/// The ship's half.
pub struct Topside {
    config: Config,
    clock: UtcClock,
    frame: Option<LocalFrame>,
    gnss: GnssLink,
    ship: ShipFilter,
    modem: ModemLink,
    tracks: Vec<Track, MAX_VEHICLES>,
    /// To the modem; nothing is sent to the receiver.
    out: Ring<RING>,
    events: Deque<(u64, Event), EVENTS>,
    now_us: u64,
    /// The slot that was last begun or missed, s since 1970.
    begun_s: u64,
    sequence: u8,
    outgoing: Option<Outgoing>,
    last_sent: Option<Sent>,
    sent: u32,
    /// Late by, s, and until when nothing is sent.
    off_pulse: Option<(f64, u64)>,
    /// A vehicle's frame, and when it came.
    uplink: Option<(u64, VehicleState)>,
    /// Statistics that no frame has taken yet.
    arrival: Option<(u64, ReceptionStatistics)>,
    /// To whom, and when, UTC.
    ping: Option<(u8, u64)>,
    set_clock: bool,
    abort: Option<PendingAbort>,
    hold_since: (Option<Hold>, u64),
    announced: Option<Hold>,
    first_us: Option<u64>,
}

impl Topside {
    /// As after power-up.
    ///
    /// # Errors
    /// A configuration that cannot be used.
    pub fn new(config: Config) -> Result<Self, ConfigError> {
        config.check()?;
        let track = |vehicle: &u8| Track::new(*vehicle, config.vehicle_acceleration_mps2_per_sqrt_hz);
        Ok(Self {
            clock: UtcClock::new(),
            frame: config.origin_deg.map(|[latitude, longitude]| LocalFrame::new(latitude, longitude)),
            gnss: GnssLink::new(),
            ship: ShipFilter::new(config.ship_acceleration_mps2_per_sqrt_hz),
            modem: ModemLink::new(config.address),
            tracks: config.vehicles.iter().map(track).collect(),
            out: Ring::new(),
            events: Deque::new(),
            now_us: 0,
            begun_s: 0,
            sequence: 0,
            outgoing: None,
            last_sent: None,
            sent: 0,
            off_pulse: None,
            uplink: None,
            arrival: None,
            ping: None,
            set_clock: false,
            abort: None,
            hold_since: (None, 0),
            announced: None,
            first_us: None,
            config,
        })
    }

    /// Bytes that came in on `port`; `time_us` is the arrival of the last of them.
    pub fn receive(&mut self, port: Port, time_us: u64, bytes: &[u8]) {
        self.now_us = self.now_us.max(time_us);
        match port {
            Port::Gnss => {
                let mut fixes: Vec<Fix, 8> = Vec::new();
                // more fixes at once than that are late anyway
                self.gnss.receive(time_us, bytes, &mut |fix| {
                    let _ = fixes.push(fix);
                });
                fixes.iter().for_each(|fix| self.fix(time_us, fix));
            }
            Port::Modem => {
                // a step's worth of sentences at 19200 baud is three or four
                let mut reports: Vec<Report, 16> = Vec::new();
                let Self { modem, config, .. } = self;
                modem.receive(time_us, bytes, &config.key, &mut |report| {
                    let _ = reports.push(report);
                });
                reports.iter().for_each(|report| self.hear(time_us, report));
            }
        }
    }

    /// An edge of a pulse per second.
    pub fn pps(&mut self, time_us: u64) {
        self.clock.edge(time_us);
    }

    /// Begins what is due; every 0.1 s or faster.
    pub fn step(&mut self, time_us: u64) {
        self.now_us = self.now_us.max(time_us);
        self.first_us.get_or_insert(time_us);
        let mut buffer = [0; SENTENCE];
        if let Some(sentence) = self.modem.due(self.now_us, &mut buffer) {
            self.out.push(sentence);
        }
        self.set_modem_clock();
        self.expire();
        self.announce();
        self.begin_slot();
    }

    /// Bytes that wait to be sent on `port`, oldest first (a part of them where the ring wraps).
    pub fn transmit(&self, port: Port) -> &[u8] {
        match port {
            Port::Gnss => &[],
            Port::Modem => self.out.front(),
        }
    }

    /// The first `count` bytes of [`Self::transmit`] were handed to the port.
    pub fn transmitted(&mut self, port: Port, count: usize) {
        if port == Port::Modem {
            self.out.consume(count);
        }
    }

    /// The oldest event that was not taken yet, and its time, µs.
    pub fn next_event(&mut self) -> Option<(u64, Event)> {
        self.events.pop_front()
    }

    /// Packets carry, and uplinks need, the authentication code of this key from now on; none switches that off.
    pub fn set_key(&mut self, key: Key) {
        self.config.key = key;
    }

    /// What it was given.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// UTC at a time, µs since 1970; `None` while unknown.
    pub fn utc_us(&self, time_us: u64) -> Option<u64> {
        self.clock.utc_us(time_us)
    }

    /// The local frame, once there is an origin.
    pub fn frame(&self) -> Option<&LocalFrame> {
        self.frame.as_ref()
    }

    /// Satellites and quality of the last `$GPGGA`.
    pub fn satellites(&self) -> (u8, Option<u8>) {
        (self.gnss.satellites, self.gnss.quality)
    }

    /// What the modem's clock runs on, as it last said.
    pub fn modem_clock(&self) -> Option<&ClockHealth> {
        self.modem.clock.as_ref()
    }

    /// The modem has all its settings.
    pub fn modem_is_configured(&self) -> bool {
        self.modem.is_configured()
    }

    /// The vehicles.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// The last packet that left.
    pub fn last_sent(&self) -> Option<&Sent> {
        self.last_sent.as_ref()
    }

    /// Packets that left.
    pub fn sent(&self) -> u32 {
        self.sent
    }

    /// Fixes that the ship's filter did not believe.
    pub fn refused_fixes(&self) -> u32 {
        self.ship.refused()
    }

    /// True heading, rad, while there is one.
    pub fn heading_rad(&self) -> Option<f64> {
        self.gnss.heading_rad(self.now_us)
    }

    /// The ship's transducer at a UTC time; `None` before the first fix.
    pub fn ship_at(&self, utc_us: u64) -> Option<ShipEstimate> {
        let mut ship = self.ship.at(utc_us)?;
        let declared = libm::hypot(self.config.arm_sigma_m, self.config.datum_sigma_m);
        ship.position_sigma_m = ship.position_sigma_m.map(|sigma| libm::hypot(sigma, declared));
        let [ahead, aside] = self.config.antenna_to_transducer_m;
        match self.heading_rad() {
            Some(heading) => {
                let (sin, cos) = (libm::sin(heading), libm::cos(heading));
                ship.position_m[0] += cos * ahead - sin * aside;
                ship.position_m[1] += sin * ahead + cos * aside;
            }
            // anywhere on a circle about the antenna: half the square of its radius per axis
            None => {
                let arm = 0.5 * (ahead * ahead + aside * aside);
                ship.position_sigma_m = ship.position_sigma_m.map(|sigma| libm::sqrt(sigma * sigma + arm));
            }
        }
        Some(ship)
    }

    fn note(&mut self, event: Event) {
        if self.events.is_full() {
            self.events.pop_front();
        }
        // there is room
        let _ = self.events.push_back((self.now_us, event));
    }

    fn fix(&mut self, time_us: u64, fix: &Fix) {
        let latency_us = (self.config.gnss_latency_s * 1.0e6) as u64;
        self.clock.label(time_us, fix.utc_us, latency_us);
        let Some([latitude, longitude]) = fix.position_deg else { return };
        let frame = *self.frame.get_or_insert(LocalFrame::new(latitude, longitude));
        let sigma_m = fix.sigma_m.unwrap_or([self.config.fix_sigma_m; 2]).map(|sigma| sigma.max(0.01));
        match self.ship.fix(fix.utc_us, frame.to_local(latitude, longitude), sigma_m) {
            FixOutcome::Refused => return,
            FixOutcome::Used => {}
            FixOutcome::Jumped(by_m) => self.note(Event::ShipJumped { by_m }),
        }
        if let Some(velocity_mps) = fix.velocity_mps.filter(|_| self.config.velocity_sigma_mps > 0.0) {
            let walked_m = self.ship.velocity(velocity_mps, self.config.velocity_sigma_mps);
            if let Some(by_m) = walked_m {
                self.note(Event::ShipWalked { by_m });
            }
        }
    }

    /// Gives up what has waited for too long.
    fn expire(&mut self) {
        let utc_us = self.clock.utc_us(self.now_us);
        if let (Some(outgoing), Some(utc_us)) = (self.outgoing, utc_us)
            && utc_us > (u64::from(outgoing.transmit_s) + 2) * SECOND_US
        {
            self.outgoing = None;
            if !outgoing.answered {
                self.note(Event::NotSent { transmit_s: outgoing.transmit_s });
            }
        }
        if self.ping.zip(utc_us).is_some_and(|((_, sent_us), utc_us)| utc_us > sent_us + PING_US) {
            self.ping = None;
        }
        self.off_pulse = self.off_pulse.filter(|(_, until_us)| self.now_us < *until_us);
        let old = |time_us: u64| self.now_us.saturating_sub(time_us) > PAIR_US;
        if self.uplink.is_some_and(|(time_us, _)| old(time_us)) {
            // no time of arrival: a position all the same
            self.take_uplink(None);
        }
        if self.arrival.as_ref().is_some_and(|(time_us, _)| self.now_us.saturating_sub(*time_us) > PAIR_US) {
            self.arrival = None;
        }
    }
}
