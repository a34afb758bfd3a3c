//! Modem port: packets as they begin and end, clock; and the modem's configuration.

use crate::held::Held;
use crate::inputs::{AcousticReport, Sample, Stamp};
use crate::parameters::AppSettings;
use crate::time::UtcClock;
use backseat_wire::abort::Abort;
use backseat_wire::modem::{FromModem, ReceptionStatistics, Setting, ToModem};
use backseat_wire::nmea::{Checksum, Framer};
use backseat_wire::ship_state::ShipState;
use backseat_wire::{Counts, Error};

/// Latency of a clock sentence after the second it names, µs.
const CLOCK_LATENCY_US: u64 = 300_000;
/// Settings not confirmed are sent again after this, µs.
const RETRY_US: u64 = 5_000_000;
/// After a reboot the modem is left alone for this long, µs.
const REBOOT_US: u64 = 2_000_000;
/// Largest frame of any rate, bytes.
const MAX_FRAME: usize = 256;

/// What the modem must be set to: address, packets on the pulse, statistics, packet starts.
const SETTINGS: [&str; 4] = ["SRC", "SNV", "CST", "RXP"];

/// State of the modem as received, and its configuration.
pub struct ModemLink {
    framer: Framer,
    counts: Counts,
    configuration: Configuration,
    /// The last authentic abort.
    abort: Held<Abort>,
}

/// Which settings the modem has confirmed.
struct Configuration {
    confirmed: [bool; SETTINGS.len()],
    /// The next setting to send, and when.
    next: usize,
    next_us: u64,
}

impl Default for ModemLink {
    fn default() -> Self {
        Self::new()
    }
}

impl ModemLink {
    pub const fn new() -> Self {
        Self {
            framer: Framer::new(Checksum::Required),
            counts: Counts::new(),
            configuration: Configuration { confirmed: [false; SETTINGS.len()], next: 0, next_us: 0 },
            abort: Held::none(),
        }
    }

    /// The last authentic abort, once.
    pub fn take_abort(&mut self) -> Option<Abort> {
        let abort = self.abort.get().copied();
        self.abort.clear();
        abort
    }

    /// Decodes what came in at `time_us`.
    pub fn receive(
        &mut self,
        time_us: u64,
        bytes: &[u8],
        settings: &AppSettings,
        clock: &mut UtcClock,
        sink: &mut impl FnMut(Stamp, Sample),
    ) {
        let mut rest = bytes;
        self.framer.set_checksum(Checksum::Optional);
        while let Some(outcome) = self.framer.feed(&mut rest) {
            let Ok(sentence) = outcome else { continue };
            let Ok(message) = self.counts.note(FromModem::parse(&sentence)) else { continue };
            let report = match message {
                FromModem::ReceiveBegins { .. } => Some(AcousticReport::Begins),
                FromModem::Cycle(_) => Some(AcousticReport::Cycle),
                // The ship's state, or its abort, stands in a packet's first frame.
                FromModem::Received(received) if received.frame == 1 => {
                    let mut frame = [0; MAX_FRAME];
                    let content = received.payload.copy_to(&mut frame).and_then(|frame| content(frame, settings));
                    match content {
                        Ok(Content::Ship(ship)) => Some(AcousticReport::Ship(ship)),
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
                FromModem::Statistics(statistics) => Some(from_statistics(&statistics, settings)),
                FromModem::Message { text: "BAD_CRC", .. } => Some(AcousticReport::BadData),
                FromModem::Setting(setting) => {
                    self.configuration.confirm(&setting, settings);
                    None
                }
                FromModem::Revision(revision) if revision.identifier == "INIT" => {
                    let next_us = time_us.saturating_add(REBOOT_US);
                    self.configuration = Configuration { confirmed: [false; SETTINGS.len()], next: 0, next_us };
                    None
                }
                FromModem::TimeReport(report) if report.is_synchronous() => {
                    clock.label(time_us, report.time.unix_us(), CLOCK_LATENCY_US);
                    None
                }
                _ => None,
            };
            if let Some(report) = report {
                sink(Stamp::Own(time_us), Sample::Acoustic(report));
            }
        }
    }

    /// The setting that is due, if any.
    pub fn configure<'b>(&mut self, now_us: u64, settings: &AppSettings, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        self.configuration.due(now_us, settings, buffer)
    }

    /// Frames accepted and rejected by cause: the framer's, and beyond it.
    pub fn counts(&self) -> [&Counts; 2] {
        [self.framer.counts(), &self.counts]
    }
}

impl Configuration {
    fn confirm(&mut self, setting: &Setting<'_>, settings: &AppSettings) {
        for (name, confirmed) in SETTINGS.iter().zip(&mut self.confirmed) {
            let mut digits = [0; 3];
            if *name == setting.name && value(name, settings, &mut digits) == setting.value {
                *confirmed = true;
            }
        }
    }

    /// The setting that is due, if any: one a step, unconfirmed ones again after a while.
    fn due<'b>(&mut self, now_us: u64, settings: &AppSettings, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        if now_us < self.next_us {
            return None;
        }
        while let (Some(name), Some(confirmed)) = (SETTINGS.get(self.next), self.confirmed.get(self.next)) {
            self.next += 1;
            if !confirmed {
                let mut digits = [0; 3];
                let value = value(name, settings, &mut digits);
                return ToModem::Configure(Setting { name, value }).emit(buffer).ok();
            }
        }
        self.next = 0;
        self.next_us = now_us.saturating_add(RETRY_US);
        None
    }
}

/// Value of a setting as text.
fn value<'d>(name: &str, settings: &AppSettings, digits: &'d mut [u8; 3]) -> &'d str {
    if name != "SRC" {
        return "1";
    }
    let address = settings.modem_address;
    *digits = [b'0' + address / 100, b'0' + address / 10 % 10, b'0' + address % 10];
    let leading = digits.iter().take(2).take_while(|digit| **digit == b'0').count();
    core::str::from_utf8(digits.get(leading..).unwrap_or_default()).unwrap_or_default()
}

/// What a frame may hold.
enum Content {
    Ship(ShipState),
    Abort(Abort),
}

fn content(frame: &[u8], settings: &AppSettings) -> Result<Content, Error> {
    let key = &settings.acoustic_key;
    if Abort::is_announced(frame) {
        Abort::parse_authentic(frame, key).map(Content::Abort)
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
