//! Modem port: packets as they begin and end, clock; and the modem's configuration.

use crate::held::Held;
use crate::inputs::{AcousticReport, HeardVehicle, SensorSample, Stamp};
use crate::parameters::AppSettings;
use crate::time::UtcClock;
use backseat_wire::abort::Abort;
use backseat_wire::modem::{Configuration, DataRequest, FromModem, PingReply, ReceptionStatistics, Wanted};
use backseat_wire::nmea::{Checksum, Framer};
use backseat_wire::ship_state::ShipState;
use backseat_wire::vehicle_state::VehicleState;
use backseat_wire::{Counts, Error};

/// Latency of a clock sentence after the second it names, µs.
const CLOCK_LATENCY_US: u64 = 300_000;
/// Largest frame of any rate, bytes.
const MAX_FRAME: usize = 256;

/// Number of settings.
const SETTINGS: usize = 4;

/// State of the modem as received, and its configuration.
pub struct ModemLink {
    framer: Framer,
    counts: Counts,
    configuration: Configuration<SETTINGS>,
    /// The last authentic abort.
    abort: Held<Abort>,
    /// The frame that the modem asks for.
    request: Held<DataRequest>,
    /// Clock and pulse were good when the last packet arrived.
    pub synchronous: bool,
}

impl ModemLink {
    pub const fn new() -> Self {
        Self {
            framer: Framer::new(Checksum::Required),
            counts: Counts::new(),
            configuration: Configuration::new(),
            abort: Held::none(),
            request: Held::none(),
            synchronous: false,
        }
    }

    /// The last authentic abort, once.
    pub fn take_abort(&mut self) -> Option<Abort> {
        let abort = self.abort.get().copied();
        self.abort.clear();
        abort
    }

    /// The frame that the modem asks for, once.
    pub fn take_request(&mut self) -> Option<DataRequest> {
        let request = self.request.get().copied();
        self.request.clear();
        request
    }

    /// Decodes what came in at `time_us`.
    pub fn receive(
        &mut self,
        time_us: u64,
        bytes: &[u8],
        settings: &AppSettings,
        clock: &mut UtcClock,
        sink: &mut impl FnMut(Stamp, SensorSample),
    ) {
        let mut rest = bytes;
        self.framer.set_checksum(Checksum::Optional);
        while let Some(outcome) = self.framer.feed(&mut rest) {
            let Ok(sentence) = outcome else { continue };
            let Ok(message) = self.counts.note(FromModem::parse(&sentence)) else { continue };
            let report = match message {
                FromModem::ReceiveBegins { .. } => Some(AcousticReport::Begins),
                // the modem repeats what it was told to begin
                FromModem::Cycle(cycle) if cycle.addresses.source == settings.modem_address => None,
                FromModem::Cycle(_) => Some(AcousticReport::Cycle),
                // The ship's state, or its abort, or another vehicle's state, stands in a packet's first frame.
                FromModem::Received(received) if received.frame == 1 => {
                    let mut frame = [0; MAX_FRAME];
                    let content = received.payload.copy_to(&mut frame).and_then(|frame| content(frame, settings));
                    match content {
                        Ok(Content::Ship(ship)) => Some(AcousticReport::Ship(ship)),
                        Ok(Content::Vehicle(vehicle)) => Some(AcousticReport::Vehicle(vehicle)),
                        Ok(Content::Abort(abort)) => {
                            self.abort.set(abort);
                            // it gives no range
                            Some(AcousticReport::BadData)
                        }
                        Err(cause) => {
                            self.counts.note_error(cause);
                            Some(AcousticReport::BadData)
                        }
                    }
                }
                FromModem::Statistics(statistics) => {
                    self.synchronous = statistics.clock.is_synchronous(settings.clock_encoding);
                    Some(from_statistics(&statistics, settings))
                }
                FromModem::DataRequest(request) => {
                    self.request.set(request);
                    None
                }
                FromModem::PingSent(addresses) if addresses.source == settings.modem_address => {
                    Some(AcousticReport::PingSent)
                }
                // the ship's answer to another vehicle is none to this one
                FromModem::PingReply(PingReply { addresses, .. })
                    if addresses.source == settings.ship_address && addresses.destination != settings.modem_address =>
                {
                    None
                }
                FromModem::PingReply(reply) if reply.addresses.source == settings.ship_address => {
                    Some(AcousticReport::PingReply { travel_s: reply.travel_s.map(|travel| travel.to_f64()) })
                }
                FromModem::Message { text: "BAD_CRC", .. } => Some(AcousticReport::BadData),
                FromModem::Setting(setting) => {
                    self.configuration.confirm(&setting, &wanted(settings));
                    None
                }
                FromModem::Revision(revision) if revision.identifier == "INIT" => {
                    self.configuration.restart(time_us);
                    None
                }
                FromModem::TimeReport(report) if report.is_synchronous() => {
                    clock.label(time_us, report.time.unix_us(), CLOCK_LATENCY_US);
                    None
                }
                _ => None,
            };
            if let Some(report) = report {
                sink(Stamp::Own(time_us), SensorSample::Acoustic(report));
            }
        }
    }

    /// The setting that is due, if any.
    pub fn configure<'b>(&mut self, now_us: u64, settings: &AppSettings, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        self.configuration.due(now_us, &wanted(settings), buffer)
    }

    /// Frames accepted and rejected by cause: the framer's, and beyond it.
    pub fn counts(&self) -> [&Counts; 2] {
        [self.framer.counts(), &self.counts]
    }
}

/// What the modem must be set to: address, packets on the pulse, statistics, packet starts.
fn wanted(settings: &AppSettings) -> [Wanted; SETTINGS] {
    [("SRC", settings.modem_address), ("SNV", 1), ("CST", 1), ("RXP", 1)]
}

/// What a frame may hold.
enum Content {
    Ship(ShipState),
    Vehicle(HeardVehicle),
    Abort(Abort),
}

fn content(frame: &[u8], settings: &AppSettings) -> Result<Content, Error> {
    let key = &settings.acoustic_key;
    if Abort::is_announced(frame) {
        Abort::parse_authentic(frame, key).map(Content::Abort)
    } else if settings.use_peers && VehicleState::is_announced(frame) {
        VehicleState::parse_authentic(frame, key).map(|state| {
            let covariance_m2 = state.position_covariance_m2();
            let VehicleState { source, transmit_s, synchronous, position_deg, depth_m, leans, .. } = state;
            Content::Vehicle(HeardVehicle {
                source,
                transmit_s,
                synchronous,
                position_deg,
                depth_m,
                covariance_m2,
                leans,
            })
        })
    } else {
        ShipState::parse_authentic(frame, key).map(Content::Ship)
    }
}

fn from_statistics(statistics: &ReceptionStatistics, settings: &AppSettings) -> AcousticReport {
    AcousticReport::Statistics {
        good: statistics.mode == ReceptionStatistics::GOOD,
        synchronous: statistics.clock.is_synchronous(settings.clock_encoding),
        arrival: statistics.arrival,
        range_rate_mps: statistics.doppler_mps.map(|doppler| settings.doppler_sign.range_rate_mps(doppler.to_f64())),
    }
}
