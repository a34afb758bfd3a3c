//! The vehicle's WHOI Micro-Modem 2, locked to PPS, hearing the ship's FSK packets.
//!
//! A packet is announced when it begins (`$CARXP`) and its data follow when it has ended, seconds later
//! (`$CARXD`, then `$CACST` with time of arrival and Doppler). Each data packet is preceded by its
//! cycle-initialisation packet.

use super::agenda::Agenda;
use super::geodesy::LocalFrame;
use super::uart::Uart;
use crate::faults::PacketFaults;
use crate::observation::{Observation, ObservationKind, OneWay, TwoWay};
use crate::scenario::{Exchange, Settings};
use backseat_wire::Decimal;
use backseat_wire::abort::Abort;
use backseat_wire::modem::{
    Addresses, ClockMode, Cycle, DopplerSign, FromModem, ModemTime, Payload, PingReply, Received, ReceptionStatistics,
    Revision, Setting, ToModem,
};
use backseat_wire::nmea::{Checksum, Framer};
use backseat_wire::ship_state::{Key, ShipState};

/// Modem address of the ship.
const SHIP: u8 = 1;
/// Modem address of the vehicle.
const VEHICLE: u8 = 2;
/// From a packet's first sound to its `$CARXP`.
const DETECTION_US: u64 = 60_000;
/// From the launch of the cycle-initialisation packet to that of the data packet.
const CYCLE_LEAD_US: u64 = 5_000_000;
/// Duration of a cycle-initialisation packet.
const CYCLE_DURATION_US: u64 = 900_000;
/// Bytes of a rate-0 FSK frame.
const FRAME_BYTES: usize = 32;
/// The key of a transmitter that does not have the ship's.
const FOREIGN_KEY: Key = Key::new([0xA5; 16]);
/// GPS clock (3) and external synchronous pulse (4), as firmware from 2.0.26038 encodes them.
const SYNCHRONOUS: ClockMode = ClockMode(3 | 4 << 2);

/// The emulated modem.
pub struct Modem {
    /// Towards the backseat.
    pub transmitter: Uart,
    framer: Framer,
    frame: LocalFrame,
    transducer_depth_m: f64,
    key: Key,
    sequence: u8,
    agenda: Agenda,
    /// Launch of the next cycle-initialisation packets, endless.
    cycles: Box<dyn Iterator<Item = u64> + Send>,
    next_cycle_us: Option<u64>,
    faults: PacketFaults,
    /// Payload of the last packet.
    last: [u8; FRAME_BYTES],
}

impl Modem {
    /// On a line of `baud`, after power-up.
    pub fn new(baud: u32, frame: LocalFrame, start_unix_s: u32, settings: &Settings, faults: PacketFaults) -> Self {
        let acoustics = settings.acoustics.clone();
        let mut cycles = (0_u64..).flat_map(move |cycle| {
            let start_s = u64::from(acoustics.first_s) + cycle * u64::from(acoustics.period_s.get());
            let downlinks = acoustics.slots.clone().into_iter().filter(|slot| slot.exchange == Exchange::Downlink);
            downlinks.map(move |slot| ((start_s + u64::from(slot.offset_s)) * 1_000_000).saturating_sub(CYCLE_LEAD_US))
        });
        let any = settings.acoustics.slots.iter().any(|slot| slot.exchange == Exchange::Downlink);
        let next_cycle_us = if any { cycles.next() } else { None };
        let mut modem = Self {
            transmitter: Uart::new(baud),
            framer: Framer::new(Checksum::Optional),
            frame,
            transducer_depth_m: settings.ship.transducer_depth_m,
            key: settings.acoustics.key,
            sequence: 0,
            agenda: Agenda::new(start_unix_s),
            cycles: Box::new(cycles),
            next_cycle_us,
            faults,
            last: [0; FRAME_BYTES],
        };
        let time = modem.agenda.time_of_day(0);
        modem.agenda.say(0, &FromModem::Revision(Revision { time, identifier: "INIT", version: "2.0.35490" }));
        modem
    }

    /// When the modem next speaks by itself, µs.
    pub fn next_us(&self) -> Option<u64> {
        self.agenda.next_us().into_iter().chain(self.next_cycle_us).min()
    }

    /// Says what is due up to `now_us`.
    pub fn run(&mut self, now_us: u64) {
        while let Some(launch_us) = self.next_cycle_us.filter(|launch_us| *launch_us <= now_us) {
            self.next_cycle_us = self.cycles.next();
            self.hear_cycle(launch_us);
        }
        self.agenda.run(now_us, &mut self.transmitter);
    }

    /// Bytes of the backseat that arrived at `time_us`: settings are echoed.
    pub fn receive(&mut self, time_us: u64, mut bytes: &[u8]) {
        let mut framer = std::mem::replace(&mut self.framer, Framer::new(Checksum::Optional));
        while let Some(outcome) = framer.feed(&mut bytes) {
            let Ok(sentence) = outcome else { continue };
            if let Ok(ToModem::Configure(Setting { name, value })) = ToModem::parse(&sentence) {
                self.agenda.say(time_us, &FromModem::Setting(Setting { name, value }));
            }
        }
        self.framer = framer;
    }

    /// Sound arrived.
    pub fn observe(&mut self, observation: &Observation) {
        match &observation.kind {
            ObservationKind::Downlink(packet) => self.hear_packet(observation.time_us, packet),
            ObservationKind::TwoWay(ping) => self.hear_reply(observation.time_us, ping),
            _ => {}
        }
    }

    fn hear_cycle(&mut self, launch_us: u64) {
        // A time of flight of the order of the mission's ranges, which must not be used as a range.
        let arrival_us = launch_us + 400_000;
        let end_us = arrival_us + CYCLE_DURATION_US;
        let addresses = Addresses { source: SHIP, destination: VEHICLE };
        self.agenda.say(arrival_us + DETECTION_US, &FromModem::ReceiveBegins { psk: false });
        self.agenda.say(end_us, &FromModem::Cycle(Cycle { addresses, rate: 0, acknowledge: false, frames: 1 }));
        self.agenda.say(end_us, &FromModem::Statistics(self.statistics(arrival_us, 0.0)));
    }

    fn hear_packet(&mut self, arrival_us: u64, packet: &OneWay) {
        let report = &packet.ship;
        let delivery = self.faults.delivery(arrival_us);
        let source = delivery.source.unwrap_or(SHIP);
        self.sequence = self.sequence.wrapping_add(1);
        let state = ShipState {
            source,
            sequence: self.sequence,
            transmit_s: (((self.agenda.start_us + packet.tol_us) / 1_000_000) as u32)
                .wrapping_add_signed(delivery.second_offset_s),
            position_deg: self.frame.to_degrees(report.position_m),
            velocity_mps: report.velocity_mps,
            position_sigma_m: report.position_sigma_m,
            velocity_sigma_mps: report.velocity_sigma_mps,
            transducer_depth_m: self.transducer_depth_m,
        };
        let mut frame = [0; FRAME_BYTES];
        let key = if delivery.forged { FOREIGN_KEY } else { self.key };
        let transmit_s = state.transmit_s;
        let payload = if let Some(destination) = delivery.abort {
            Abort { destination, transmit_s }.emit_authentic(&key).map(|payload| payload.to_vec())
        } else if key.is_set() {
            state.emit_authentic(&key).map(|payload| payload.to_vec())
        } else {
            state.emit().map(|payload| payload.to_vec())
        };
        let Ok(payload) = payload else { return };
        frame[..payload.len()].copy_from_slice(&payload);
        let last = std::mem::replace(&mut self.last, frame);
        if delivery.replayed {
            frame = last;
        }
        let addresses = Addresses { source, destination: VEHICLE };
        let received = Received { addresses, acknowledge: false, frame: 1, payload: Payload::new(&frame) };
        let statistics = ReceptionStatistics {
            source: Some(i32::from(source)),
            ..self.statistics(packet.toa_us, packet.range_rate_mps)
        };
        for after_us in std::iter::once(0).chain(delivery.again_us) {
            let end_us = packet.end_us + delivery.delay_us + after_us;
            self.agenda.say(arrival_us + DETECTION_US + after_us, &FromModem::ReceiveBegins { psk: false });
            self.agenda.say(end_us, &FromModem::Received(received));
            self.agenda.say(end_us, &FromModem::Statistics(statistics));
        }
    }

    fn hear_reply(&mut self, arrival_us: u64, ping: &TwoWay) {
        let addresses = Addresses { source: SHIP, destination: VEHICLE };
        let travel_s = Decimal::from_f64(ping.one_way_time_s, 4).ok();
        self.agenda.say(arrival_us + CYCLE_DURATION_US, &FromModem::PingReply(PingReply { addresses, travel_s }));
    }

    fn statistics(&self, arrival_us: u64, range_rate_mps: f64) -> ReceptionStatistics {
        let arrival = ModemTime::Full(self.agenda.date_time(arrival_us));
        let doppler = DopplerSign::ClosingPositive.range_rate_mps(range_rate_mps);
        ReceptionStatistics {
            source: Some(i32::from(SHIP)),
            destination: Some(i32::from(VEHICLE)),
            doppler_mps: Decimal::from_f64(doppler, 2).ok(),
            ..ReceptionStatistics::complete(Some(8), ReceptionStatistics::GOOD, arrival, SYNCHRONOUS)
        }
    }
}
