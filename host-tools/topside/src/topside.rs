//! The ship's half from outside: bytes and time in, bytes out; and where its parts are put together.

use crate::config::{Config, ConfigError, MAX_VEHICLES};
use crate::event::Event;
use crate::gnss::{Fix, GnssLink, Traffic};
use crate::hold::Hold;
use crate::modem::{ClockHealth, ModemLink, Report};
use crate::ship::{ShipEstimate, ShipFilter};
use crate::slots::{Exchange, SlotTable};
use crate::track::Track;
use backseat_app::{LocalFrame, Ring, UtcClock};
use backseat_wire::calendar::DateTime;
use backseat_wire::modem::{Addresses, Cycle, Data, DataRequest, Payload, PingReply, ReceptionStatistics, ToModem};
use backseat_wire::ship_state::{AUTHENTIC_LENGTH, ShipState};
use backseat_wire::vehicle_state::VehicleState;
use heapless::{Deque, Vec};

const SECOND_US: u64 = 1_000_000;
/// A sentence to the modem: a cycle, or a frame of 32 bytes.
const SENTENCE: usize = 128;
/// Bytes that may wait for a port.
const RING: usize = 1024;
/// Events that may wait.
const EVENTS: usize = 64;
/// A GNSS receiver that was not heard for this long is silent, µs.
const GNSS_SILENT_US: u64 = 5_000_000;
/// So is a modem, which is asked for its clock every 5 s.
const MODEM_SILENT_US: u64 = 12_000_000;
/// A clock report older than this says nothing, µs.
const CLOCK_AGE_US: u64 = 16_000_000;
/// A reason is announced when it has lasted for this long, µs.
const ANNOUNCE_US: u64 = 3_000_000;
/// A slot is missed if its cycle could not begin within this of its time, µs.
const SLOT_LATE_US: u64 = 400_000;
/// A packet that left this long after its second did not leave on the pulse, µs: 7.5 m.
const OFF_PULSE_US: u64 = 5_000;
/// After a packet off the pulse nothing is sent for this long, µs.
const OFF_PULSE_HOLD_US: u64 = 60_000_000;
/// Data and statistics of one packet come within this time of each other, µs.
const PAIR_US: u64 = 10_000_000;
/// A ping is answered within this time, µs.
const PING_US: u64 = 10_000_000;
/// Modem's clock less GNSS time that whole seconds and late sentences explain, µs.
const CLOCK_AHEAD_US: i64 = 600_000;
const CLOCK_BEHIND_US: i64 = -1_600_000;

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
    #[must_use]
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

    /// What it was given.
    #[must_use]
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The cycle.
    #[must_use]
    pub fn slots(&self) -> &SlotTable {
        &self.config.slots
    }

    /// UTC at a time, µs since 1970; `None` while unknown.
    #[must_use]
    pub fn utc_us(&self, time_us: u64) -> Option<u64> {
        self.clock.utc_us(time_us)
    }

    /// The local frame, once there is an origin.
    #[must_use]
    pub fn frame(&self) -> Option<&LocalFrame> {
        self.frame.as_ref()
    }

    /// Satellites and quality of the last `$GPGGA`.
    #[must_use]
    pub fn satellites(&self) -> (u8, Option<u8>) {
        (self.gnss.satellites, self.gnss.quality)
    }

    /// What the modem's clock runs on, as it last said.
    #[must_use]
    pub fn modem_clock(&self) -> Option<&ClockHealth> {
        self.modem.clock.as_ref()
    }

    /// The modem has all its settings.
    #[must_use]
    pub fn modem_is_configured(&self) -> bool {
        self.modem.is_configured()
    }

    /// The vehicles.
    #[must_use]
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// The last packet that left.
    #[must_use]
    pub fn last_sent(&self) -> Option<&Sent> {
        self.last_sent.as_ref()
    }

    /// Packets that left.
    #[must_use]
    pub fn sent(&self) -> u32 {
        self.sent
    }

    /// Fixes that the ship's filter did not believe.
    #[must_use]
    pub fn refused_fixes(&self) -> u32 {
        self.ship.refused()
    }

    /// True heading, rad, while there is one.
    #[must_use]
    pub fn heading_rad(&self) -> Option<f64> {
        self.gnss.heading_rad(self.now_us)
    }

    /// The ship's transducer at a UTC time; `None` before the first fix.
    #[must_use]
    pub fn ship_at(&self, utc_us: u64) -> Option<ShipEstimate> {
        let mut ship = self.ship.at(utc_us)?;
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

    /// What keeps the ship from sending its state, the first thing to be mended first.
    #[must_use]
    pub fn hold(&self) -> Option<Hold> {
        let recent = |heard_us: Option<u64>, age_us: u64| {
            // a port that is just open has had no time
            let since = heard_us.or(self.first_us).unwrap_or(self.now_us);
            self.now_us.saturating_sub(since) <= age_us
        };
        let wrong = |traffic: &Traffic, age_us: u64, holds: [Hold; 3]| {
            let [silent, noise, stranger] = holds;
            match traffic {
                _ if !recent(traffic.byte_us, age_us) => Some(silent),
                _ if !recent(traffic.sentence_us, age_us) => Some(noise),
                Traffic { stranger_us: Some(us), .. } if recent(Some(*us), age_us) => Some(stranger),
                _ => None,
            }
        };
        let (gnss, modem) = (&self.gnss, &self.modem);
        wrong(&gnss.traffic, GNSS_SILENT_US, [Hold::GnssSilent, Hold::GnssNoise, Hold::GnssIsModem])
            .or_else(|| {
                wrong(&modem.traffic, MODEM_SILENT_US, [Hold::ModemSilent, Hold::ModemNoise, Hold::ModemIsGnss])
            })
            .or_else(|| (!recent(gnss.rmc_us, GNSS_SILENT_US)).then_some(Hold::GnssNoRmc))
            .or_else(|| (!modem.is_configured()).then_some(Hold::ModemUnconfigured))
            .or_else(|| self.hold_of_ship())
            .or_else(|| self.hold_of_clock())
    }

    fn hold_of_ship(&self) -> Option<Hold> {
        let Some(utc_us) = self.clock.utc_us(self.now_us) else { return Some(Hold::GnssNoFix) };
        match self.ship_at(utc_us) {
            None => Some(Hold::GnssNoFix),
            Some(ship) if ship.sigma_m() > self.config.ship_sigma_max_m => {
                Some(Hold::ShipUncertain { sigma_m: ship.sigma_m() })
            }
            Some(_) => None,
        }
    }

    fn hold_of_clock(&self) -> Option<Hold> {
        let fresh = |clock: &&ClockHealth| self.now_us.saturating_sub(clock.time_us) <= CLOCK_AGE_US;
        let Some(clock) = self.modem.clock.as_ref().filter(fresh) else { return Some(Hold::ModemClockUnknown) };
        if !clock.has_pulse() {
            return Some(Hold::NoPulse);
        }
        if !clock.is_set() {
            return Some(Hold::ModemClockUnset);
        }
        if let Some(utc_us) = self.clock.utc_us(clock.time_us) {
            let ahead_us = (clock.utc_s * SECOND_US) as i64 - utc_us as i64;
            if !(CLOCK_BEHIND_US..=CLOCK_AHEAD_US).contains(&ahead_us) {
                return Some(Hold::ClockDiffers { by_s: (ahead_us + 1_000_000).div_euclid(1_000_000) });
            }
        }
        self.off_pulse.map(|(by_s, _)| Hold::OffPulse { by_s })
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
        let used = self.ship.fix(fix.utc_us, frame.to_local(latitude, longitude), sigma_m);
        if let Some(velocity_mps) = fix.velocity_mps.filter(|_| used && self.config.velocity_sigma_mps > 0.0) {
            self.ship.velocity(velocity_mps, self.config.velocity_sigma_mps);
        }
    }

    /// Sets the modem's clock early in a second: its pulse has the rest.
    fn set_modem_clock(&mut self) {
        let unset = self.modem.clock.as_ref().is_some_and(|clock| !clock.is_set());
        if !unset || !self.config.set_modem_clock || !self.modem.is_configured() {
            self.set_clock = false;
            return;
        }
        let Some(utc_us) = self.clock.utc_us(self.now_us) else { return };
        let early = (50_000..300_000).contains(&(utc_us % SECOND_US));
        if early
            && !self.set_clock
            && let Ok(time) = DateTime::from_unix_us(utc_us - utc_us % SECOND_US)
        {
            self.set_clock = true;
            self.send(&ToModem::SetTime { time, mode: 0 });
        }
    }

    fn send(&mut self, sentence: &ToModem<'_>) {
        let mut buffer = [0; SENTENCE];
        if let Ok(bytes) = sentence.emit(&mut buffer) {
            self.out.push(bytes);
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

    fn announce(&mut self) {
        let hold = self.hold();
        let name = |hold: &Option<Hold>| hold.as_ref().map(Hold::name);
        if name(&hold) != name(&self.hold_since.0) {
            self.hold_since = (hold, self.now_us);
        }
        let lasts = hold.is_none() || self.now_us.saturating_sub(self.hold_since.1) >= ANNOUNCE_US;
        if lasts && name(&hold) != name(&self.announced) {
            self.announced = hold;
            self.note(Event::Hold(hold));
        }
    }

    /// Begins the next slot when its time has come.
    fn begin_slot(&mut self) {
        let Some(utc_us) = self.clock.utc_us(self.now_us) else { return };
        let lead_us = (self.config.slots.airtime().lead_s * 1.0e6) as u64;
        let earliest_s = (utc_us.saturating_sub(SLOT_LATE_US) / SECOND_US).max(self.begun_s + 1);
        let mut from_s = earliest_s;
        // the slots that could begin by now
        while let Some((launch_s, slot)) = self.config.slots.next(from_s) {
            let lead_us = if slot.exchange == Exchange::Downlink { lead_us } else { 0 };
            let begins_us = (launch_s * SECOND_US).saturating_sub(lead_us);
            if launch_s * SECOND_US > utc_us + lead_us.max(SECOND_US) {
                return;
            }
            from_s = launch_s + 1;
            if utc_us < begins_us {
                continue;
            }
            self.begun_s = launch_s;
            if utc_us <= begins_us + SLOT_LATE_US {
                self.begin(slot.exchange, launch_s);
            }
        }
    }

    fn begin(&mut self, exchange: Exchange, launch_s: u64) {
        let hold = self.hold();
        let source = self.config.address;
        match exchange {
            Exchange::Downlink if hold.is_none() => {
                let Ok(transmit_s) = u32::try_from(launch_s) else { return };
                self.sequence = self.sequence.wrapping_add(1);
                self.outgoing = Some(Outgoing { transmit_s, sequence: self.sequence, answered: false });
                let addresses = Addresses { source, destination: self.config.destination };
                let rate = self.config.rate;
                self.send(&ToModem::Cycle(Cycle { addresses, rate, acknowledge: false, frames: 1 }));
            }
            Exchange::Ping { vehicle } if hold.is_none_or(|hold| hold.permits_pings()) => {
                self.send(&ToModem::Ping(Addresses { source, destination: vehicle }));
                let utc_us = self.clock.utc_us(self.now_us).unwrap_or(launch_s * SECOND_US);
                self.ping = Some((vehicle, utc_us));
                self.note(Event::PingSent { vehicle });
            }
            _ => {}
        }
    }

    fn hear(&mut self, time_us: u64, report: &Report) {
        match report {
            Report::Asks(request) => self.answer(request),
            Report::Left(left_us) => self.left(*left_us),
            Report::Uplink(state) if self.config.vehicles.contains(&state.source) => {
                if self.uplink.is_some() {
                    self.take_uplink(None);
                }
                self.uplink = Some((time_us, *state));
                self.pair();
            }
            Report::Uplink(state) => self.note(Event::Refused { source: state.source, forged: false }),
            Report::Refused { source, forged } => self.note(Event::Refused { source: *source, forged: *forged }),
            Report::Arrived(statistics) => {
                self.arrival = Some((time_us, *statistics));
                self.pair();
            }
            Report::PingSent => {
                if let (Some((_, sent_us)), Some(utc_us)) = (&mut self.ping, self.clock.utc_us(time_us)) {
                    *sent_us = utc_us;
                }
            }
            Report::PingHeard { vehicle } => self.note(Event::PingHeard { vehicle: *vehicle }),
            Report::PingReply(reply) => self.ping_answered(reply),
            Report::Restarted => {
                self.outgoing = None;
                self.note(Event::ModemRestarted);
            }
        }
    }

    /// The modem asks for the frame that leaves on its next pulse.
    fn answer(&mut self, request: &DataRequest) {
        let Some(outgoing) = self.outgoing.filter(|outgoing| !outgoing.answered) else { return };
        if request.addresses.source != self.config.address {
            return;
        }
        let slot_us = u64::from(outgoing.transmit_s) * SECOND_US;
        let leaves_s = (request.time.nearest(slot_us) / SECOND_US + 1) as u32;
        if leaves_s != outgoing.transmit_s {
            self.outgoing = None;
            self.note(Event::AskedOffTime { transmit_s: outgoing.transmit_s, leaves_s });
            return;
        }
        // a pulse may have been lost since the cycle began
        let Some(state) = self.ship_state(&outgoing).filter(|_| self.hold().is_none()) else { return };
        let key = &self.config.key;
        let mut payload = [0; AUTHENTIC_LENGTH];
        let written = if key.is_set() {
            state.emit_authentic(key).map(|bytes| payload = bytes).is_ok().then_some(AUTHENTIC_LENGTH)
        } else {
            state.emit().ok().and_then(|bytes| {
                payload.get_mut(..bytes.len())?.copy_from_slice(&bytes);
                Some(bytes.len())
            })
        };
        let Some(payload) = written.and_then(|length| payload.get(..length)) else { return };
        let addresses = request.addresses;
        self.send(&ToModem::Data(Data { addresses, acknowledge: false, payload: Payload::new(payload) }));
        self.outgoing = Some(Outgoing { answered: true, ..outgoing });
        self.last_sent = Some(Sent { state, time_us: self.now_us });
        self.sent = self.sent.saturating_add(1);
        self.note(Event::Sent { transmit_s: outgoing.transmit_s, sequence: outgoing.sequence });
    }

    fn ship_state(&self, outgoing: &Outgoing) -> Option<ShipState> {
        let ship = self.ship_at(u64::from(outgoing.transmit_s) * SECOND_US)?;
        let (latitude, longitude) = self.frame?.to_geodetic(ship.position_m);
        Some(ShipState {
            source: self.config.address,
            sequence: outgoing.sequence,
            transmit_s: outgoing.transmit_s,
            position_deg: [latitude, longitude],
            velocity_mps: ship.velocity_mps,
            position_sigma_m: ship.sigma_m(),
            velocity_sigma_mps: ship.velocity_sigma_mps[0].max(ship.velocity_sigma_mps[1]),
            transducer_depth_m: self.config.transducer_depth_m,
        })
    }

    /// The modem says when the packet left.
    fn left(&mut self, left_us: u64) {
        let Some(outgoing) = self.outgoing.filter(|outgoing| outgoing.answered) else { return };
        self.outgoing = None;
        let named_us = u64::from(outgoing.transmit_s) * SECOND_US;
        let by_us = left_us as i64 - named_us as i64;
        if by_us.unsigned_abs() > OFF_PULSE_US {
            self.off_pulse = Some((by_us as f64 * 1.0e-6, self.now_us.saturating_add(OFF_PULSE_HOLD_US)));
            self.modem.configure_again(self.now_us);
        }
    }

    /// Joins a vehicle's frame with the time of its arrival.
    fn pair(&mut self) {
        let (Some((_, state)), Some((_, statistics))) = (&self.uplink, &self.arrival) else { return };
        let launch_us = u64::from(state.transmit_s) * SECOND_US;
        let flight_us = statistics.arrival.unix_us(launch_us) as i64 - launch_us as i64;
        let longest_us = (self.config.range_max_m / self.config.sound_speed_mps * 1.0e6) as i64;
        // the cycle before it arrived earlier: not its time
        if !(-50_000..=longest_us).contains(&flight_us) {
            return;
        }
        let good = statistics.mode == ReceptionStatistics::GOOD;
        let synchronous = statistics.clock.is_synchronous(self.config.clock_encoding);
        self.arrival = None;
        self.take_uplink(Some(flight_us).filter(|_| good && synchronous));
    }

    /// A vehicle's report, with its time of flight if that is a range.
    fn take_uplink(&mut self, flight_us: Option<i64>) {
        let (Some((_, state)), Some(frame)) = (self.uplink.take(), self.frame) else { return };
        let launch_us = u64::from(state.transmit_s) * SECOND_US;
        let [latitude, longitude] = state.position_deg;
        let position_m = frame.to_local(latitude, longitude);
        let delay_s = self.config.transducer_delay_s;
        let flight_us = flight_us.filter(|_| state.synchronous);
        let range_m = flight_us.map(|us| self.config.sound_speed_mps * (us as f64 * 1.0e-6 - delay_s));
        self.note(Event::Uplink { state, range_m });
        let ship = flight_us.and_then(|us| self.ship_at(launch_us.saturating_add_signed(us)));
        let Some(track) = self.tracks.iter_mut().find(|track| track.vehicle == state.source) else { return };
        track.report_heard(&state, position_m);
        if let (Some(range_m), Some(ship)) = (range_m, ship) {
            let (sigma_m, depth_m) = (self.config.range_sigma_m, self.config.transducer_depth_m);
            let ranging = track.range_measured(launch_us, range_m, sigma_m, &ship, depth_m, false);
            self.note(Event::Range(ranging));
        }
    }

    fn ping_answered(&mut self, reply: &PingReply) {
        let Some((vehicle, sent_us)) = self.ping.filter(|(vehicle, _)| *vehicle == reply.addresses.source) else {
            return;
        };
        self.ping = None;
        let Some(travel_s) = reply.travel_s.map(|travel| travel.to_f64()) else { return };
        let range_m = self.config.sound_speed_mps * (travel_s - self.config.transducer_delay_s);
        // The vehicle turned it round about now; the ship was at both ends of the round trip.
        let there_us = sent_us.saturating_add((travel_s * 1.0e6) as u64);
        let turnaround_us = (self.config.slots.airtime().turnaround_s * 0.5e6) as u64;
        let middle_us = there_us.saturating_add(turnaround_us);
        let Some(ship) = self.ship_at(middle_us) else { return };
        let (sigma_m, depth_m) = (self.config.range_sigma_m, self.config.transducer_depth_m);
        let Some(track) = self.tracks.iter_mut().find(|track| track.vehicle == vehicle) else { return };
        let ranging = track.range_measured(middle_us, range_m, sigma_m, &ship, depth_m, true);
        self.note(Event::Range(ranging));
    }
}
