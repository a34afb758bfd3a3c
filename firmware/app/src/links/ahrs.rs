//! AHRS port: 3DM-GX3, MIP or OS5000.

use crate::held::Held;
use crate::inputs::{SensorSample, Stamp};
use crate::parameters::{AhrsProtocol, AppSettings, AttitudeSource};
use backseat_core::state::wrap_angle;
use backseat_wire::ahrs::{AhrsSample, gx3, mip, os5000::Os5000};
use backseat_wire::nmea::{Checksum, Framer};
use backseat_wire::{Counts, Error};

/// An AHRS that is silent for longer gets the command to send (again), µs.
const SILENCE_US: u64 = 2_000_000;
/// An AHRS that repeats one reading for longer has frozen, µs. Its floating-point numbers never stand still, not even on
/// a bench; a compass that rounds to a tenth of a degree may.
const FROZEN_US: u64 = 1_000_000;
/// MIP sensor packets are asked for at base rate (typically 500 Hz) / this.
const MIP_DECIMATION: u16 = 50;

/// A reading, and when it was last another one, µs.
struct Repeats {
    reading: Option<[f64; 3]>,
    since_us: u64,
}

impl Repeats {
    const NONE: Self = Self { reading: None, since_us: 0 };

    fn is_frozen(&mut self, time_us: u64, reading: Option<[f64; 3]>) -> bool {
        if reading.is_none() {
            return false;
        }
        if self.reading != reading {
            (self.reading, self.since_us) = (reading, time_us);
        }
        time_us.saturating_sub(self.since_us) > FROZEN_US
    }
}

/// Decoders of the AHRS port; the parameter says which one listens.
pub struct AhrsLink {
    gx3: gx3::Decoder,
    mip: mip::Decoder,
    os5000: Framer,
    /// Rejections beyond the framers'.
    counts: Counts,
    last_us: Option<u64>,
    asked_us: Option<u64>,
    /// Samples handed on, and the last of them.
    pub samples: u32,
    last: Held<AhrsSample>,
    attitude: Repeats,
    rates: Repeats,
}

impl AhrsLink {
    pub const fn new() -> Self {
        Self {
            gx3: gx3::Decoder::new(),
            mip: mip::Decoder::new(),
            os5000: Framer::new(Checksum::Required),
            counts: Counts::new(),
            last_us: None,
            asked_us: None,
            samples: 0,
            last: Held::none(),
            attitude: Repeats::NONE,
            rates: Repeats::NONE,
        }
    }

    /// Decodes what came in at `time_us`.
    pub fn receive(
        &mut self,
        time_us: u64,
        bytes: &[u8],
        settings: &AppSettings,
        sink: &mut impl FnMut(Stamp, SensorSample),
    ) {
        let mut rest = bytes;
        while let Some(outcome) = self.next(&mut rest, settings.ahrs_protocol) {
            if let Ok(Some(sample)) = outcome {
                self.samples = self.samples.saturating_add(1);
                self.last.set(sample);
                self.last_us = Some(time_us);
                let changing = match settings.ahrs_protocol {
                    AhrsProtocol::Gx3 | AhrsProtocol::Mip => self.without_frozen(time_us, sample),
                    AhrsProtocol::Os5000 => sample,
                };
                push(time_us, &changing, settings, sink);
            }
        }
    }

    /// The sample without what has frozen of it. A MIP device may send attitude and rates in packets of their own.
    fn without_frozen(&mut self, time_us: u64, mut sample: AhrsSample) -> AhrsSample {
        let frozen =
            [self.attitude.is_frozen(time_us, sample.euler_rad), self.rates.is_frozen(time_us, sample.rates_radps)];
        if frozen != [false; 2] {
            self.counts.note_error(Error::Repeated);
        }
        let [attitude, rates] = frozen;
        sample.euler_rad = sample.euler_rad.filter(|_| !attitude);
        sample.rates_radps = sample.rates_radps.filter(|_| !rates);
        sample
    }

    fn next(&mut self, rest: &mut &[u8], protocol: AhrsProtocol) -> Option<Result<Option<AhrsSample>, Error>> {
        Some(match protocol {
            AhrsProtocol::Gx3 => self.gx3.feed(rest)?.map(|frame| match frame {
                gx3::FromGx3::Data(sample, _) => Some(sample),
                gx3::FromGx3::Continuous(_) => None,
            }),
            AhrsProtocol::Mip => match self.mip.feed(rest)? {
                Ok(packet) => self.counts.note(packet.sample()),
                Err(cause) => Err(cause),
            },
            AhrsProtocol::Os5000 => match self.os5000.feed(rest)? {
                Ok(sentence) => self.counts.note(Os5000::parse(&sentence).map(|compass| Some(compass.sample()))),
                Err(cause) => Err(cause),
            },
        })
    }

    /// The command that makes a silent device send by itself, when it is time for it.
    pub fn ask(&mut self, now_us: u64, protocol: AhrsProtocol, mut send: impl FnMut(&[u8])) {
        let silent = |since_us: Option<u64>| since_us.is_none_or(|us| now_us.saturating_sub(us) > SILENCE_US);
        if !silent(self.last_us) || !silent(self.asked_us) {
            return;
        }
        self.asked_us = Some(now_us);
        let mut buffer = [0; 64];
        match protocol {
            AhrsProtocol::Gx3 => {
                if let Ok(bytes) = gx3::ToGx3::Continuous(gx3::Command::EulerRate).emit(&mut buffer) {
                    send(bytes);
                }
            }
            AhrsProtocol::Mip => {
                if let Ok(bytes) = mip::emit_format(MIP_DECIMATION, &mut buffer) {
                    send(bytes);
                }
                if let Ok(bytes) = mip::emit_stream(true, &mut buffer) {
                    send(bytes);
                }
            }
            // sends by itself as it is set up
            AhrsProtocol::Os5000 => {}
        }
    }

    /// Frames accepted and rejected by cause: the framer's of the protocol in use, and beyond it.
    pub fn counts(&self, protocol: AhrsProtocol) -> [&Counts; 2] {
        let framer = match protocol {
            AhrsProtocol::Gx3 => self.gx3.counts(),
            AhrsProtocol::Mip => self.mip.counts(),
            AhrsProtocol::Os5000 => self.os5000.counts(),
        };
        [framer, &self.counts]
    }

    /// The last of them.
    pub fn last(&self) -> Option<&AhrsSample> {
        self.last.get()
    }
}

fn push(time_us: u64, sample: &AhrsSample, settings: &AppSettings, sink: &mut impl FnMut(Stamp, SensorSample)) {
    if let (Some([roll, pitch, heading]), AttitudeSource::Ahrs) = (sample.euler_rad, settings.attitude_source) {
        let euler_rad = [roll, pitch, wrap_angle(heading + settings.declination_rad)];
        sink(Stamp::Arrival(time_us), SensorSample::Attitude { euler_rad });
    }
    if let Some(rates_radps) = sample.rates_radps {
        sink(Stamp::Arrival(time_us), SensorSample::Rates { rates_radps });
    }
}
