//! Sound between ship and vehicle: who pings when, how long it travels, what the receiver measures.
//!
//! Travel times are solved with both ends moving: a packet sent at t₀ from a place s arrives at the
//! t₁ at which c (t₁ − t₀) = |p(t₁) − s|, p(t) the receiver's own motion.

use crate::devices::LocalFrame;
use crate::noise::{Colour, Colouring, SensorClass};
use crate::observation::{Observation, ObservationKind, OneWay, ShipReport, ShipTwoWay, TwoWay};
use crate::rng::{Source, Stream};
use crate::scenario::effects::AcousticChannel;
use crate::scenario::{self, Exchange, Scenario};
use crate::ship::{ShipEstimator, ShipMotion};
use backseat_wire::vehicle_state::{AUTHENTIC_LENGTH, VehicleState};

/// Fixed-point iterations for a time of arrival. Each gains a factor of c over the receiver's
/// speed, more than 100: six reach the last bit of a double.
const ITERATIONS: usize = 6;

/// The vehicle's motion over one integration step, close to a straight line (within |a| dt² / 8,
/// some micrometres).
#[derive(Clone, Copy, Debug)]
pub struct Passage {
    /// Start, s.
    pub from_s: f64,
    /// Position at the start, m.
    pub from_m: [f64; 3],
    /// End, s.
    pub to_s: f64,
    /// Position at the end, m.
    pub to_m: [f64; 3],
    /// Velocity over ground at the end, north, east, down, m/s.
    pub velocity_mps: [f64; 3],
}

impl Passage {
    fn position(&self, time_s: f64) -> [f64; 3] {
        let share = (time_s - self.from_s) / (self.to_s - self.from_s);
        core::array::from_fn(|i| self.from_m[i] + share * (self.to_m[i] - self.from_m[i]))
    }
}

/// The vehicle as it sends.
#[derive(Clone, Copy, Debug)]
pub struct Sender {
    /// North, east, down, m.
    pub position_m: [f64; 3],
    /// Velocity over ground, north, east, down, m/s.
    pub velocity_mps: [f64; 3],
}

/// A vehicle that sends, for another.
#[derive(Clone, Copy, Debug)]
pub struct SoundSource {
    time_us: u64,
    sender: Sender,
    clock_s: f64,
}

/// A packet of one vehicle at another.
#[derive(Clone, Copy, Debug)]
pub struct HeardSound {
    /// When it arrives, µs.
    pub arrival_us: u64,
    /// Measured time of arrival, µs.
    pub toa_us: u64,
    /// Measured range rate, m/s.
    pub range_rate_mps: f64,
}

/// A packet on its way.
#[derive(Clone, Copy, Debug)]
struct PacketFlight {
    /// When it left, s.
    left_s: f64,
    /// From where, m.
    from_m: [f64; 3],
    /// Standard normal errors of range and range rate.
    errors: [f64; 2],
    /// What another path or ping adds to the range, m.
    outlier_m: f64,
    kind: FlightKind,
}

#[derive(Clone, Copy, Debug)]
enum FlightKind {
    /// To the vehicle, with the ship's true velocity and its report at launch.
    Downlink { tol_us: u64, ship_velocity_mps: [f64; 2], report: ShipReport },
    /// Back to the vehicle; the way out took so many metres.
    Return { tol_us: u64, outward_m: f64 },
    /// To the ship, whose motion is known ahead; so are arrival and true range rate.
    Uplink { tol_us: u64, arrival_s: f64, range_rate_mps: f64 },
    /// The ship's ping, on its way to the vehicle.
    ShipPing { tol_us: u64 },
}

/// The acoustic channel and its schedule.
#[derive(Clone, Debug)]
pub struct Acoustics {
    settings: scenario::Acoustics,
    transducer_depth_m: f64,
    /// What modem and hardware add to a time of flight, s.
    delay_s: f64,
    /// What everybody declares, m/s.
    declared_speed_mps: f64,
    /// What it is, m/s.
    true_speed_mps: f64,
    channel: AcousticChannel,
    range_sigma_m: f64,
    range_rate_sigma_mps: f64,
    noise: Stream,
    /// Of the ranges.
    colouring: Option<Colouring<1>>,
    loss: Stream,
    outliers: Stream,
    flights: Vec<PacketFlight>,
}

impl Acoustics {
    /// The channel of a scenario.
    pub fn new(scenario: &Scenario, channel: &AcousticChannel, delay_s: f64) -> Self {
        let (settings, declared) = (&scenario.settings, &scenario.vehicle.sensors);
        let speed = settings.environment.sound_speed_mps;
        let mixture = settings.noise.mixture(SensorClass::Acoustic, Colour::ACOUSTIC, settings.seed);
        Self {
            transducer_depth_m: settings.ship.transducer_depth_m,
            delay_s,
            declared_speed_mps: speed,
            true_speed_mps: speed / (1.0 + channel.sound_speed_ratio),
            channel: *channel,
            range_sigma_m: mixture.size * settings.acoustics.range_sigma_m.unwrap_or(declared.range_m),
            range_rate_sigma_mps: settings.noise.factor()
                * settings.acoustics.range_rate_sigma_mps.unwrap_or(declared.range_rate_mps),
            noise: Stream::new(settings.seed, Source::Acoustics),
            colouring: mixture.colouring(settings.seed, Source::AcousticsColour),
            loss: Stream::new(settings.seed, Source::PacketLoss),
            outliers: Stream::new(settings.seed, Source::Outliers),
            flights: Vec::new(),
            settings: settings.acoustics.clone(),
        }
    }

    /// Whether anything is on its way.
    pub fn busy(&self) -> bool {
        !self.flights.is_empty()
    }

    /// Whether packets leave at this instant at all: they leave on whole seconds.
    pub fn may_launch(&self, time_us: u64) -> bool {
        time_us.is_multiple_of(1_000_000)
    }

    /// Sends what the schedule has for this whole second.
    pub fn launch(&mut self, time_us: u64, vehicle: &Sender, ship: &ShipMotion, estimator: &ShipEstimator) {
        let second = time_us / 1_000_000;
        for index in 0..self.settings.slots.len() {
            let slot = self.settings.slots[index];
            let first = u64::from(self.settings.first_s) + u64::from(slot.offset_s);
            if second < first || !(second - first).is_multiple_of(u64::from(self.settings.period_s.get())) {
                continue;
            }
            let errors = self.errors(time_us);
            let outlier_m = self.outlier();
            let lost = self.is_lost(seconds(time_us));
            let flight = self.flight(slot.exchange, time_us, errors, vehicle, ship, estimator);
            if let Some(flight) = flight.filter(|_| !lost) {
                self.flights.push(PacketFlight { outlier_m, ..flight });
            }
        }
    }

    /// From now on nothing leaves by the schedule: modems at both ends send.
    pub fn hand_over(&mut self) {
        self.settings.slots.clear();
    }

    /// How long sound takes between ship and vehicle, s.
    pub fn flight_s(&self, time_us: u64, vehicle_m: [f64; 3], ship: &ShipMotion) -> f64 {
        distance(vehicle_m, self.transducer(ship, seconds(time_us))) / self.true_speed_mps
    }

    /// The vehicle as it sends at this time, for those that hear it.
    pub fn source(&self, time_us: u64, sender: Sender) -> SoundSource {
        SoundSource { time_us, sender, clock_s: self.clock_s(seconds(time_us)) }
    }

    /// How a vehicle in straight motion hears another; `None` if the packet is lost or has come too far.
    pub fn hear_vehicle(&mut self, source: &SoundSource, listener: &Sender) -> Option<HeardSound> {
        let [range_error, rate_error] = self.errors(source.time_us);
        let outlier_m = self.outlier();
        let is_missed = self.loss.uniform() < self.settings.loss_share;
        let SoundSource { time_us, sender, clock_s } = source;
        let (mut flight_s, mut range_m, mut place_m) = (0.0, 0.0, listener.position_m);
        for _ in 0..ITERATIONS {
            place_m = core::array::from_fn(|i| listener.position_m[i] + flight_s * listener.velocity_mps[i]);
            range_m = distance(place_m, sender.position_m);
            flight_s = range_m / self.true_speed_mps;
        }
        let measured_m = self.declared_speed_mps
            * (flight_s + self.clock_s(seconds(*time_us)) - clock_s + self.delay_s)
            + self.range_sigma_m * range_error
            + outlier_m;
        let rate_mps =
            opening(difference(place_m, sender.position_m), difference(listener.velocity_mps, sender.velocity_mps));
        (range_m <= self.settings.max_range_m && !is_missed).then(|| HeardSound {
            arrival_us: time_us + micros(flight_s),
            toa_us: time_us.saturating_add_signed((measured_m / self.declared_speed_mps * 1.0e6).round() as i64),
            range_rate_mps: rate_mps + self.range_rate_sigma_mps * rate_error,
        })
    }

    /// What the vehicle's clock shows too much, s.
    fn clock_s(&self, time_s: f64) -> f64 {
        self.channel.clock_offset_s + self.channel.clock_drift * time_s + self.channel.clock_change.at(time_s)
    }

    /// An uplink's frame, in which the place may be misstated.
    pub fn misstated(&self, frame: &[u8], local: LocalFrame) -> Vec<u8> {
        let scenario::Acoustics { misstated_m: [north_m, east_m], key, .. } = self.settings;
        let mut stated = frame.to_vec();
        if [north_m, east_m] != [0.0; 2]
            && let Ok(mut state) = VehicleState::parse(frame)
        {
            let [x_m, y_m] = local.to_metres(state.position_deg);
            state.position_deg = local.to_degrees([x_m + north_m, y_m + east_m]);
            if let Ok(payload) = state.emit(&key, &mut [0; AUTHENTIC_LENGTH]) {
                stated[..payload.len()].copy_from_slice(payload);
            }
        }
        stated
    }

    /// A modem sends at `tol_us`; a downlink says what `report` says.
    pub fn transmit(
        &mut self,
        exchange: Exchange,
        tol_us: u64,
        vehicle: &Sender,
        ship: &ShipMotion,
        report: ShipReport,
    ) {
        let errors = self.errors(tol_us);
        let outlier_m = self.outlier();
        let left_s = seconds(tol_us);
        let lost = self.is_lost(left_s);
        let flight = match exchange {
            Exchange::Downlink => {
                let kind = FlightKind::Downlink { tol_us, ship_velocity_mps: ship.at(left_s).velocity_mps, report };
                Some(PacketFlight { left_s, from_m: self.transducer(ship, left_s), errors, outlier_m, kind })
            }
            Exchange::Uplink => Some(self.uplink(tol_us, errors, vehicle, ship)),
            Exchange::TwoWay => self.ping(tol_us, errors, vehicle, ship),
            Exchange::ShipPing => {
                let kind = FlightKind::ShipPing { tol_us };
                Some(PacketFlight { left_s, from_m: self.transducer(ship, left_s), errors, outlier_m, kind })
            }
        };
        if let Some(flight) = flight.filter(|_| !lost) {
            self.flights.push(PacketFlight { outlier_m, ..flight });
        }
    }

    /// Standard normal errors of range and range rate. Drawn for every packet, lost or not, so that one loss does not change
    /// the next error.
    fn errors(&mut self, time_us: u64) -> [f64; 2] {
        let [range, rate] = self.noise.normals(1.0);
        let [range] = self.colouring.as_mut().map_or([range], |colouring| colouring.mix([range], 1.0, time_us));
        [range, rate]
    }

    /// Whether a packet that leaves then is never heard; drawn for each.
    fn is_lost(&mut self, left_s: f64) -> bool {
        let is_missed = self.loss.uniform() < self.settings.loss_share;
        is_missed || self.settings.until_s.is_some_and(|until_s| left_s >= until_s)
    }

    /// What is detected instead of the direct path, for a share of the packets, m: mostly a later path, sometimes an
    /// earlier noise.
    fn outlier(&mut self) -> f64 {
        /// Share of the outliers that are late.
        const LATE: f64 = 0.75;
        /// Mean of the exponential distribution of their size, m.
        const MEAN_M: f64 = 40.0;
        let [hit, side, size] = core::array::from_fn(|_| self.outliers.uniform());
        if hit >= self.channel.outlier_share {
            return 0.0;
        }
        let sign = if side < LATE { 1.0 } else { -1.0 };
        sign * (5.0 - MEAN_M * libm::log1p(-size))
    }

    fn flight(
        &self,
        exchange: Exchange,
        tol_us: u64,
        errors: [f64; 2],
        vehicle: &Sender,
        ship: &ShipMotion,
        estimator: &ShipEstimator,
    ) -> Option<PacketFlight> {
        let left_s = seconds(tol_us);
        Some(match exchange {
            Exchange::Downlink => {
                let report = estimator.report(left_s)?;
                let kind = FlightKind::Downlink { tol_us, ship_velocity_mps: ship.at(left_s).velocity_mps, report };
                PacketFlight { left_s, from_m: self.transducer(ship, left_s), errors, outlier_m: 0.0, kind }
            }
            Exchange::Uplink => self.uplink(tol_us, errors, vehicle, ship),
            Exchange::TwoWay => self.ping(tol_us, errors, vehicle, ship)?,
            // only a modem that is told to sends it
            Exchange::ShipPing => return None,
        })
    }

    fn uplink(&self, tol_us: u64, errors: [f64; 2], vehicle: &Sender, ship: &ShipMotion) -> PacketFlight {
        let left_s = seconds(tol_us);
        let (arrival_s, _) = self.arrival_at_ship(left_s, vehicle.position_m, ship);
        let [north, east] = ship.at(arrival_s).velocity_mps;
        let range_rate_mps = opening(
            difference(self.transducer(ship, arrival_s), vehicle.position_m),
            difference([north, east, 0.0], vehicle.velocity_mps),
        );
        let kind = FlightKind::Uplink { tol_us, arrival_s, range_rate_mps };
        PacketFlight { left_s, from_m: vehicle.position_m, errors, outlier_m: 0.0, kind }
    }

    fn ping(&self, tol_us: u64, errors: [f64; 2], vehicle: &Sender, ship: &ShipMotion) -> Option<PacketFlight> {
        let (arrival_s, outward_m) = self.arrival_at_ship(seconds(tol_us), vehicle.position_m, ship);
        if outward_m > self.settings.max_range_m {
            return None;
        }
        let left_s = arrival_s + self.settings.turnaround_s;
        let kind = FlightKind::Return { tol_us, outward_m };
        Some(PacketFlight { left_s, from_m: self.transducer(ship, left_s), errors, outlier_m: 0.0, kind })
    }

    fn transducer(&self, ship: &ShipMotion, time_s: f64) -> [f64; 3] {
        let [x, y] = ship.at(time_s).position_m;
        [x, y, self.transducer_depth_m]
    }

    fn arrival_at_ship(&self, left_s: f64, vehicle_m: [f64; 3], ship: &ShipMotion) -> (f64, f64) {
        let mut arrival_s = left_s;
        let mut range_m = 0.0;
        for _ in 0..ITERATIONS {
            range_m = distance(vehicle_m, self.transducer(ship, arrival_s));
            arrival_s = left_s + range_m / self.true_speed_mps;
        }
        (arrival_s, range_m)
    }

    /// Hands out what arrives during one step of the vehicle, in order of arrival.
    pub fn arrivals(
        &mut self,
        passage: &Passage,
        ship: &ShipMotion,
        estimator: &ShipEstimator,
        sink: &mut impl FnMut(&Observation),
    ) {
        // Nearly always empty or one: a packet flies for a second in thirty.
        while let Some((index, arrival_s)) = self.earliest(passage) {
            let flight = self.flights.swap_remove(index);
            if let Some(kind) = self.received(&flight, arrival_s, passage, ship, estimator) {
                sink(&Observation { time_us: micros(arrival_s), kind });
            }
        }
    }

    /// The flight that arrives first within the step.
    fn earliest(&self, passage: &Passage) -> Option<(usize, f64)> {
        self.flights
            .iter()
            .enumerate()
            .filter_map(|(index, flight)| self.arrival(flight, passage).map(|arrival_s| (index, arrival_s)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn arrival(&self, flight: &PacketFlight, passage: &Passage) -> Option<f64> {
        if let FlightKind::Uplink { arrival_s, .. } = flight.kind {
            return (arrival_s <= passage.to_s).then_some(arrival_s);
        }
        let travelled = self.true_speed_mps * (passage.to_s - flight.left_s);
        if travelled < distance(passage.to_m, flight.from_m) {
            return None;
        }
        let mut arrival_s = passage.to_s;
        for _ in 0..ITERATIONS {
            arrival_s = flight.left_s + distance(passage.position(arrival_s), flight.from_m) / self.true_speed_mps;
        }
        Some(arrival_s)
    }

    fn received(
        &self,
        flight: &PacketFlight,
        arrival_s: f64,
        passage: &Passage,
        ship: &ShipMotion,
        estimator: &ShipEstimator,
    ) -> Option<ObservationKind> {
        let true_range_m = self.true_speed_mps * (arrival_s - flight.left_s);
        if true_range_m > self.settings.max_range_m {
            return None;
        }
        let end_us = micros(arrival_s + self.settings.packet_duration_s);
        let bending_m = self.channel.bending_per_m * true_range_m.powi(2);
        let range_error_m = self.range_sigma_m * flight.errors[0] + flight.outlier_m + bending_m;
        let range_rate_error_mps = self.range_rate_sigma_mps * flight.errors[1];
        // A one-way time is read off the receiver's clock, in units of the declared sound speed.
        let one_way = |tol_us: u64, range_rate_mps: f64, ship: ShipReport| {
            let clock_s = self.clock_s(arrival_s);
            let range_m =
                self.declared_speed_mps * (arrival_s - seconds(tol_us) + clock_s + self.delay_s) + range_error_m;
            let toa_us = tol_us.saturating_add_signed((range_m / self.declared_speed_mps * 1.0e6).round() as i64);
            OneWay { tol_us, toa_us, end_us, range_m, range_rate_mps: range_rate_mps + range_rate_error_mps, ship }
        };
        Some(match flight.kind {
            FlightKind::Downlink { tol_us, ship_velocity_mps: [north, east], report } => {
                let offset = difference(passage.position(arrival_s), flight.from_m);
                let range_rate_mps = opening(offset, difference(passage.velocity_mps, [north, east, 0.0]));
                ObservationKind::Downlink(one_way(tol_us, range_rate_mps, report))
            }
            FlightKind::Uplink { tol_us, range_rate_mps, .. } => {
                ObservationKind::Uplink(one_way(tol_us, range_rate_mps, estimator.report(arrival_s)?))
            }
            FlightKind::ShipPing { tol_us } => {
                let turnaround_s = self.settings.turnaround_s;
                let reply_s = arrival_s + turnaround_s;
                let (p, v) = (passage.position(arrival_s), passage.velocity_mps);
                let (reply_arrival_s, back_m) =
                    self.arrival_at_ship(reply_s, core::array::from_fn(|i| p[i] + turnaround_s * v[i]), ship);
                let true_s = 0.5 * (true_range_m + back_m) / self.true_speed_mps;
                let one_way_time_s = true_s + self.delay_s + range_error_m / self.declared_speed_mps;
                ObservationKind::ShipTwoWay(ShipTwoWay { tol_us, reply_us: micros(reply_arrival_s), one_way_time_s })
            }
            FlightKind::Return { tol_us, outward_m } => {
                let true_s = 0.5 * (outward_m + true_range_m) / self.true_speed_mps;
                let one_way_time_s = true_s + self.delay_s + range_error_m / self.declared_speed_mps;
                ObservationKind::TwoWay(TwoWay {
                    tol_us,
                    reply_us: micros(flight.left_s),
                    one_way_time_s,
                    range_m: self.declared_speed_mps * one_way_time_s,
                })
            }
        })
    }
}

fn seconds(time_us: u64) -> f64 {
    time_us as f64 * 1.0e-6
}

fn micros(time_s: f64) -> u64 {
    (time_s * 1.0e6).round() as u64
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    core::array::from_fn(|i| a[i] - b[i])
}

fn norm(a: [f64; 3]) -> f64 {
    (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    norm(difference(a, b))
}

/// Rate of the distance between two points, positive opening; zero where they coincide.
fn opening(offset: [f64; 3], velocity: [f64; 3]) -> f64 {
    let range = norm(offset);
    if range > 0.0 { (0..3).map(|i| offset[i] * velocity[i]).sum::<f64>() / range } else { 0.0 }
}
