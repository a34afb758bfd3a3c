//! DVL port: PD0, PD4/PD5 or PD6.

use crate::held::Held;
use crate::inputs::{Latest, SensorSample, Stamp};
use crate::parameters::{AppSettings, DvlSource};
use backseat_wire::dvl::{DvlSample, pd0, pd4, pd6};
use backseat_wire::{Counts, Error};

/// Decoders of the DVL port; the parameter says which one listens.
pub struct DvlLink {
    pd0: pd0::Decoder,
    pd4: pd4::Decoder,
    pd6: pd6::Decoder,
    /// Samples handed on, and the last of them.
    pub samples: u32,
    last: Held<DvlSample>,
    /// The last altitude, and its arrival, µs.
    pub altitude_m: Latest<f64>,
}

impl DvlLink {
    pub const fn new() -> Self {
        Self {
            pd0: pd0::Decoder::new(),
            pd4: pd4::Decoder::new(),
            pd6: pd6::Decoder::new(0.0),
            samples: 0,
            last: Held::none(),
            altitude_m: None,
        }
    }

    /// Starts afresh with the mounting angle of these settings.
    pub fn configure(&mut self, settings: &AppSettings) {
        *self = Self::new();
        self.pd6 = pd6::Decoder::new(settings.dvl_mounting_rad);
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
        let mounting_rad = settings.dvl_mounting_rad;
        while let Some(outcome) = self.next(&mut rest, settings.dvl_source, mounting_rad) {
            if let Ok(sample) = outcome {
                self.samples = self.samples.saturating_add(1);
                self.last.set(sample);
                self.altitude_m = sample.altitude_m.map(|altitude_m| (time_us, altitude_m)).or(self.altitude_m);
                push(time_us, &sample, sink);
            }
        }
    }

    fn next(&mut self, rest: &mut &[u8], source: DvlSource, mounting_rad: f64) -> Option<Result<DvlSample, Error>> {
        match source {
            DvlSource::Pd0 => Some(self.pd0.feed(rest)?.map(|ensemble| ensemble.sample(mounting_rad))),
            DvlSource::Pd4 => Some(self.pd4.feed(rest)?.map(|record| record.sample(mounting_rad))),
            DvlSource::Pd6 => self.pd6.feed(rest),
            DvlSource::Frontseat => None,
        }
    }

    /// Frames accepted and rejected by cause, of the protocol in use.
    pub fn counts(&self, source: DvlSource) -> &Counts {
        match source {
            DvlSource::Pd0 => self.pd0.counts(),
            DvlSource::Pd4 => self.pd4.counts(),
            // PD6 stands unused when the frontseat relays its own DVL
            DvlSource::Pd6 | DvlSource::Frontseat => self.pd6.counts(),
        }
    }

    /// The last of them.
    pub fn last(&self) -> Option<&DvlSample> {
        self.last.get()
    }
}

fn push(time_us: u64, sample: &DvlSample, sink: &mut impl FnMut(Stamp, SensorSample)) {
    if let Some(velocity_mps) = sample.bottom_mps {
        sink(Stamp::Arrival(time_us), SensorSample::BottomTrack { velocity_mps });
    }
    if let Some(velocity_mps) = sample.water_mps {
        sink(Stamp::Arrival(time_us), SensorSample::WaterTrack { velocity_mps });
    }
}
