//! A WHOI Micro-Modem 2 that does what its host says: cycles, data frames and pings out, what arrives in.
//!
//! With SNV 1 a data packet leaves on the pulse after its frame was taken; a cycle-initialisation packet and a ping
//! leave at once. A modem that sends, or already receives, hears nothing else.

use super::agenda::Agenda;
use super::uart::Uart;
use backseat_wire::Decimal;
use backseat_wire::modem::{
    Addresses, ClockMode, Cycle, DataRequest, DataTaken, DopplerSign, ErrorReport, FromModem, ModemTime, Payload,
    PingReply, RATES, Received, ReceptionStatistics, Revision, Setting, TimeReport, ToModem, TransmitStatistics,
};
use backseat_wire::nmea::{Checksum, Framer};
use std::collections::VecDeque;

/// From a packet's first sound to its `$CARXP`.
const DETECTION_US: u64 = 60_000;
/// Duration of a cycle-initialisation packet, and of a ping.
const SHORT_US: u64 = 900_000;
/// From the end of its own cycle-initialisation packet to the request of the data.
const REQUEST_US: u64 = 50_000;
/// How long the modem waits for its data.
const DATA_TIMEOUT_US: u64 = 3_000_000;
/// A frame taken this shortly before a pulse waits for the next.
const PULSE_MARGIN_US: u64 = 20_000;
/// Launches are at this resolution: the world's step.
const STEP_US: u64 = 10_000;
const SECOND_US: u64 = 1_000_000;
/// GPS clock (3) and external synchronous pulse (4) or none (0), as firmware from 2.0.26038 encodes them.
const SYNCHRONOUS: ClockMode = ClockMode(3 | 4 << 2);
const NO_PULSE: ClockMode = ClockMode(3);

/// Something that leaves the modem.
#[derive(Clone, Debug, PartialEq)]
pub struct Launch {
    /// When, µs.
    pub time_us: u64,
    /// What.
    pub sound: Sound,
}

/// What leaves.
#[derive(Clone, Debug, PartialEq)]
pub enum Sound {
    /// A cycle-initialisation packet.
    Cycle(Cycle),
    /// A data packet.
    Data(Addresses, Vec<u8>),
    /// A ping.
    Ping(Addresses),
}

/// A data packet as it arrives.
#[derive(Clone, Debug, PartialEq)]
pub struct Heard {
    /// First sound, µs.
    pub arrival_us: u64,
    /// Measured time of arrival, µs.
    pub toa_us: u64,
    /// Last sound, µs.
    pub end_us: u64,
    /// Measured range rate, m/s.
    pub range_rate_mps: f64,
    /// From and to.
    pub addresses: Addresses,
    /// The frame.
    pub frame: Vec<u8>,
}

/// The emulated modem.
pub struct MicroModem {
    /// Towards its host.
    pub transmitter: Uart,
    framer: Framer,
    packet_us: u64,
    synchronised: bool,
    /// It has an external pulse.
    pulse: bool,
    agenda: Agenda,
    /// What has still to leave.
    launches: VecDeque<Launch>,
    /// The cycle that waits for its frame, and until when.
    cycle: Option<(Cycle, u64)>,
    /// It sends or receives until then.
    busy_until_us: u64,
    missed: u32,
}

impl MicroModem {
    /// On a line of `baud`, after power-up; `start_us` is UTC of time zero.
    pub fn new(baud: u32, start_unix_s: u32, packet_duration_s: f64, pulse: bool) -> Self {
        let mut modem = Self {
            transmitter: Uart::new(baud),
            framer: Framer::new(Checksum::Optional),
            packet_us: (packet_duration_s * 1e6) as u64,
            synchronised: false,
            pulse,
            agenda: Agenda::new(start_unix_s),
            launches: VecDeque::new(),
            cycle: None,
            busy_until_us: 0,
            missed: 0,
        };
        let time = modem.agenda.time_of_day(0);
        modem.agenda.say(0, &FromModem::Revision(Revision { time, identifier: "INIT", version: "2.0.35490" }));
        modem
    }

    /// Packets that were not heard because another one, or its own, was under way.
    pub fn missed(&self) -> u32 {
        self.missed
    }

    /// When the modem next acts by itself, µs.
    pub fn next_us(&self) -> Option<u64> {
        let launch = self.launches.front().map(|launch| launch.time_us);
        self.agenda.next_us().into_iter().chain(launch).min()
    }

    /// Says what is due up to `now_us`; what leaves by then.
    pub fn run(&mut self, now_us: u64) -> Vec<Launch> {
        if let Some((_, until_us)) = self.cycle.filter(|(_, until_us)| *until_us < now_us) {
            self.cycle = None;
            let time = self.agenda.time_of_day(until_us);
            self.agenda
                .say(now_us, &FromModem::Error(ErrorReport { time, module: "DATA_TIMEOUT", number: 1, text: "" }));
        }
        self.agenda.run(now_us, &mut self.transmitter);
        let due = self.launches.iter().take_while(|launch| launch.time_us <= now_us).count();
        let left: Vec<Launch> = self.launches.drain(..due).collect();
        for launch in &left {
            let duration_us = if matches!(launch.sound, Sound::Data(..)) { self.packet_us } else { SHORT_US };
            self.busy_until_us = self.busy_until_us.max(launch.time_us + duration_us);
        }
        left
    }

    /// Bytes of the host that arrived at `time_us`.
    pub fn receive(&mut self, time_us: u64, mut bytes: &[u8]) {
        let mut framer = std::mem::replace(&mut self.framer, Framer::new(Checksum::Optional));
        while let Some(outcome) = framer.feed(&mut bytes) {
            let Ok(sentence) = outcome else { continue };
            if let Ok(message) = ToModem::parse(&sentence) {
                self.obey(time_us, &message);
            }
        }
        self.framer = framer;
    }

    fn obey(&mut self, time_us: u64, message: &ToModem<'_>) {
        match *message {
            ToModem::Configure(Setting { name, value }) => {
                if name == "SNV" {
                    self.synchronised = value == "1";
                }
                self.agenda.say(time_us, &FromModem::Setting(Setting { name, value }));
            }
            ToModem::QueryTime => {
                let time = self.agenda.date_time(time_us);
                let pps_source = if self.pulse { "EXT_SYNC" } else { "NONE" };
                let report = TimeReport { time, clock_source: "GPS", pps_source };
                self.agenda.say(time_us, &FromModem::TimeReport(report));
            }
            ToModem::Cycle(cycle) => {
                let leaves_us = round_up(time_us, STEP_US);
                let end_us = leaves_us + SHORT_US;
                self.launch(leaves_us, Sound::Cycle(cycle));
                self.cycle = Some((cycle, end_us + DATA_TIMEOUT_US));
                self.agenda.say(time_us, &FromModem::Cycle(cycle));
                let asked_us = end_us + REQUEST_US;
                let request = DataRequest {
                    time: self.agenda.time_of_day(asked_us),
                    addresses: cycle.addresses,
                    acknowledge: false,
                    bytes: RATES.get(usize::from(cycle.rate)).map_or(32, |(_, bytes)| *bytes),
                    frame: 1,
                };
                self.agenda.say(asked_us, &FromModem::DataRequest(request));
            }
            ToModem::Data(data) => {
                let Some((cycle, _)) = self.cycle.take() else { return };
                let bytes = RATES.get(usize::from(cycle.rate)).map_or(32, |(_, bytes)| *bytes);
                let mut frame: Vec<u8> = data.payload.bytes().collect();
                let taken = DataTaken { addresses: data.addresses, acknowledge: false, bytes: frame.len() as u16 };
                frame.resize(usize::from(bytes), 0);
                let leaves_us = if self.synchronised {
                    round_up(time_us + PULSE_MARGIN_US, SECOND_US)
                } else {
                    round_up(time_us, STEP_US)
                };
                self.agenda.say(time_us, &FromModem::DataTaken(taken));
                self.launch(leaves_us, Sound::Data(data.addresses, frame));
                self.agenda.say(leaves_us, &FromModem::TransmitBegins { bytes });
                let left = TransmitStatistics {
                    version: Some(7),
                    time: self.agenda.date_time(leaves_us),
                    clock: self.clock_mode(),
                    mode: 0,
                };
                self.agenda.say(leaves_us + self.packet_us, &FromModem::TransmitStatistics(left));
                self.agenda.say(leaves_us + self.packet_us, &FromModem::TransmitEnded { bytes });
            }
            ToModem::Ping(addresses) => {
                self.agenda.say(time_us, &FromModem::PingSent(addresses));
                self.launch(round_up(time_us, STEP_US), Sound::Ping(addresses));
            }
            _ => {}
        }
    }

    fn launch(&mut self, time_us: u64, sound: Sound) {
        let place = self.launches.partition_point(|launch| launch.time_us <= time_us);
        self.launches.insert(place, Launch { time_us, sound });
    }

    /// Whether a sound from `arrival_us` to `end_us` is heard; nothing else is until its end.
    fn listens(&mut self, arrival_us: u64, end_us: u64) -> bool {
        let free = arrival_us >= self.busy_until_us;
        if free {
            self.busy_until_us = end_us;
        } else {
            self.missed += 1;
        }
        free
    }

    /// A cycle-initialisation packet arrives.
    pub fn hear_cycle(&mut self, arrival_us: u64, cycle: Cycle) {
        let end_us = arrival_us + SHORT_US;
        if !self.listens(arrival_us, end_us) {
            return;
        }
        self.agenda.say(arrival_us + DETECTION_US, &FromModem::ReceiveBegins { psk: false });
        self.agenda.say(end_us, &FromModem::Cycle(cycle));
        let statistics = self.statistics(arrival_us, cycle.addresses, 0.0);
        self.agenda.say(end_us, &FromModem::Statistics(statistics));
    }

    /// A data packet arrives.
    pub fn hear_data(&mut self, heard: &Heard) {
        let Heard { arrival_us, toa_us, end_us, addresses, .. } = *heard;
        if !self.listens(arrival_us, end_us) {
            return;
        }
        let received = Received { addresses, acknowledge: false, frame: 1, payload: Payload::new(&heard.frame) };
        self.agenda.say(arrival_us + DETECTION_US, &FromModem::ReceiveBegins { psk: false });
        self.agenda.say(end_us, &FromModem::Received(received));
        let statistics = self.statistics(toa_us, addresses, heard.range_rate_mps);
        self.agenda.say(end_us, &FromModem::Statistics(statistics));
    }

    /// A ping arrives, which the modem answers by itself.
    pub fn hear_ping(&mut self, arrival_us: u64, addresses: Addresses) {
        self.agenda.say(arrival_us + SHORT_US, &FromModem::PingArrived(addresses));
        self.busy_until_us = self.busy_until_us.max(arrival_us + SHORT_US);
    }

    /// The answer to its own ping arrives; half of the round trip less the turnaround.
    pub fn hear_reply(&mut self, arrival_us: u64, addresses: Addresses, one_way_time_s: f64) {
        let travel_s = Decimal::from_f64(one_way_time_s, 4).ok();
        self.agenda.say(arrival_us + SHORT_US, &FromModem::PingReply(PingReply { addresses, travel_s }));
    }

    fn statistics(&self, arrival_us: u64, addresses: Addresses, range_rate_mps: f64) -> ReceptionStatistics {
        let arrival = ModemTime::Full(self.agenda.date_time(arrival_us));
        let doppler = DopplerSign::ClosingPositive.range_rate_mps(range_rate_mps);
        ReceptionStatistics {
            source: Some(i32::from(addresses.source)),
            destination: Some(i32::from(addresses.destination)),
            doppler_mps: Decimal::from_f64(doppler, 2).ok(),
            ..ReceptionStatistics::complete(Some(8), ReceptionStatistics::GOOD, arrival, self.clock_mode())
        }
    }

    fn clock_mode(&self) -> ClockMode {
        if self.pulse { SYNCHRONOUS } else { NO_PULSE }
    }
}

fn round_up(time_us: u64, unit_us: u64) -> u64 {
    time_us.div_ceil(unit_us) * unit_us
}
