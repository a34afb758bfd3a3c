//! The ship's Micro-Modem: its settings, its clock, packets that leave and packets that arrive.

use crate::gnss::{Traffic, is_receivers};
use backseat_wire::Error;
use backseat_wire::modem::{
    Configuration, DataRequest, FromModem, PingReply, ReceptionStatistics, TimeReport, ToModem, UserBits, Wanted,
};
use backseat_wire::nmea::{Checksum, Framer};
use backseat_wire::ship_state::Key;
use backseat_wire::vehicle_state::VehicleState;
use heapless::String;

/// Fastest data rate that is sent.
pub const MAX_RATE: u8 = 5;
/// How often the modem is asked for its clock, µs.
const QUERY_US: u64 = 5_000_000;
/// Largest frame of any rate, bytes.
const MAX_FRAME: usize = 256;
/// Number of settings.
const SETTINGS: usize = 6;

/// What the modem's clock runs on, as it last said.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClockHealth {
    /// When it said so, caller's time, µs.
    pub time_us: u64,
    /// `NONE`, `RTC`, `USER_CMD`, `GPS`.
    pub clock: String<12>,
    /// `NONE`, `RTC`, `EXT`, `EXT_SYNC`.
    pub pulse: String<12>,
    /// Its second, since 1970.
    pub utc_s: u64,
}

impl ClockHealth {
    fn of(time_us: u64, report: &TimeReport<'_>) -> Self {
        let short = |text: &str| {
            let mut short = String::new();
            for letter in text.chars() {
                // what does not fit is no name that is known
                let _ = short.push(letter);
            }
            short
        };
        let utc_s = report.time.unix_us() / 1_000_000;
        Self { time_us, clock: short(report.clock_source), pulse: short(report.pps_source), utc_s }
    }

    /// It was set from outside.
    pub fn is_set(&self) -> bool {
        !matches!(self.clock.as_str(), "" | "NONE" | "RTC")
    }

    /// It runs on an external pulse.
    pub fn has_pulse(&self) -> bool {
        matches!(self.pulse.as_str(), "EXT" | "EXT_SYNC")
    }
}

/// What a sentence of the modem means for the rest.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "handed over one by one, never kept")]
pub(crate) enum Report {
    /// Give me a frame.
    Asks(DataRequest),
    /// A packet began to leave, by the modem's clock, µs since 1970.
    Left(u64),
    /// The frame of a vehicle.
    Uplink(VehicleState),
    /// Another frame, or a broken or forged one, of this source.
    Refused {
        source: u8,
        forged: bool,
    },
    /// Reception statistics.
    Arrived(ReceptionStatistics),
    PingSent,
    PingHeard {
        vehicle: u8,
    },
    PingReply(PingReply),
    /// Thirteen bits of this source.
    Minipacket {
        source: u8,
        bits: u16,
    },
    Restarted,
}

/// The modem port.
pub(crate) struct ModemLink {
    framer: Framer,
    pub traffic: Traffic,
    configuration: Configuration<SETTINGS>,
    wanted: [Wanted; SETTINGS],
    pub clock: Option<ClockHealth>,
    query_us: u64,
}

impl ModemLink {
    pub fn new(address: u8) -> Self {
        Self {
            framer: Framer::new(Checksum::Optional),
            traffic: Traffic::default(),
            configuration: Configuration::new(),
            wanted: [("SRC", address), ("SNV", 1), ("CST", 1), ("RXP", 1), ("TXP", 1), ("XST", 1)],
            clock: None,
            query_us: 0,
        }
    }

    pub fn is_configured(&self) -> bool {
        self.configuration.is_complete()
    }

    /// All settings are sent again.
    pub fn configure_again(&mut self, now_us: u64) {
        self.configuration.restart(now_us);
    }

    /// Decodes what came in at `time_us`.
    pub fn receive(&mut self, time_us: u64, bytes: &[u8], key: &Key, sink: &mut impl FnMut(Report)) {
        if !bytes.is_empty() {
            self.traffic.byte_us = Some(time_us);
        }
        let mut rest = bytes;
        while let Some(outcome) = self.framer.feed(&mut rest) {
            let Ok(sentence) = outcome else { continue };
            if is_receivers(sentence.id()) {
                self.traffic.stranger_us = Some(time_us);
                self.traffic.sentence_us = Some(time_us);
                continue;
            }
            let message = match FromModem::parse(&sentence) {
                Err(Error::Unknown) => continue,
                message => message,
            };
            self.traffic.sentence_us = Some(time_us);
            let Ok(message) = message else { continue };
            let report = match message {
                FromModem::DataRequest(request) => Report::Asks(request),
                FromModem::TransmitStatistics(statistics) => Report::Left(statistics.time.unix_us()),
                FromModem::Received(received) if received.frame == 1 => {
                    let mut frame = [0; MAX_FRAME];
                    let state = received
                        .payload
                        .copy_to(&mut frame)
                        .and_then(|frame| VehicleState::parse_authentic(frame, key));
                    let source = received.addresses.source;
                    match state {
                        Ok(state) => Report::Uplink(state),
                        Err(cause) => Report::Refused { source, forged: cause == Error::Forged },
                    }
                }
                FromModem::Statistics(statistics) => Report::Arrived(statistics),
                FromModem::PingSent(_) => Report::PingSent,
                FromModem::PingArrived(addresses) => Report::PingHeard { vehicle: addresses.source },
                FromModem::UserBits(UserBits { addresses, bits }) => {
                    Report::Minipacket { source: addresses.source, bits }
                }
                FromModem::PingReply(reply) => Report::PingReply(reply),
                FromModem::PingReply2(reply) => {
                    Report::PingReply(PingReply { addresses: reply.addresses, travel_s: reply.travel_s })
                }
                FromModem::Setting(setting) => {
                    self.configuration.confirm(&setting, &self.wanted);
                    continue;
                }
                FromModem::Revision(revision) if revision.identifier == "INIT" => {
                    self.configuration.restart(time_us);
                    self.clock = None;
                    Report::Restarted
                }
                FromModem::TimeReport(report) => {
                    self.clock = Some(ClockHealth::of(time_us, &report));
                    continue;
                }
                FromModem::TimeSet { .. } => {
                    self.query_us = time_us;
                    continue;
                }
                _ => continue,
            };
            sink(report);
        }
    }

    /// The setting or the question that is due, if any.
    pub fn due<'b>(&mut self, now_us: u64, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        if self.configuration.is_complete() {
            if now_us < self.query_us {
                return None;
            }
            self.query_us = now_us.saturating_add(QUERY_US);
            return ToModem::QueryTime.emit(buffer).ok();
        }
        let Self { configuration, wanted, .. } = self;
        configuration.due(now_us, wanted, buffer)
    }
}
