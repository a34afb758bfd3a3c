//! What was received, refused and dropped since start, and the last samples.

use crate::backseat::Backseat;
use crate::inputs::Loss;
use crate::ring::Ring;
use backseat_wire::ahrs::AhrsSample;
use backseat_wire::dvl::DvlSample;
use backseat_wire::hostlink::Port;
use backseat_wire::{Counts, Error};

/// Counters of the app; all saturate.
#[derive(Clone, Copy)]
pub struct Health<'a> {
    pub(crate) backseat: &'a Backseat,
    /// Of the host link's decoder: frames, and errors inside good frames.
    pub(crate) host: [&'a Counts; 2],
    pub(crate) unsent_to_host: u32,
}

impl<'a> Health<'a> {
    fn counts(&self, port: Port) -> [&'a Counts; 2] {
        match port {
            Port::Host => self.host,
            _ => self.backseat.links.counts(port, &self.backseat.parameters.active().app),
        }
    }

    /// Good sentences of frontseat and modem, samples of DVL and AHRS, good frames of the host.
    #[must_use]
    pub fn accepted(&self, port: Port) -> u32 {
        let [_, host] = self.host;
        if port == Port::Host { host.accepted() } else { self.backseat.links.accepted(port) }
    }

    /// Frames that a port's decoders refused.
    #[must_use]
    pub fn rejected(&self, port: Port) -> u32 {
        self.counts(port).iter().fold(0, |sum, counts| sum.saturating_add(counts.rejected()))
    }

    /// Frames that a port's decoders refused for one cause.
    #[must_use]
    pub fn rejected_for(&self, port: Port, cause: Error) -> u32 {
        self.counts(port).iter().fold(0, |sum, counts| sum.saturating_add(counts.of(cause)))
    }

    /// Frames not sent because a port did not take its bytes.
    #[must_use]
    pub fn unsent(&self, port: Port) -> u32 {
        self.backseat.ring(port).map_or(self.unsent_to_host, Ring::dropped)
    }

    /// The last sample of the DVL.
    #[must_use]
    pub fn dvl(&self) -> Option<&'a DvlSample> {
        self.backseat.links.dvl_sample()
    }

    /// The last sample of the AHRS.
    #[must_use]
    pub fn ahrs(&self) -> Option<&'a AhrsSample> {
        self.backseat.links.ahrs_sample()
    }

    /// The last depth of the pressure sensor, m.
    #[must_use]
    pub fn depth_m(&self) -> Option<f64> {
        self.backseat.inputs.latest.depth_m.map(|(_, depth_m)| depth_m)
    }

    /// The last fix, north and east, m.
    #[must_use]
    pub fn fix_m(&self) -> Option<[f64; 2]> {
        self.backseat.inputs.latest.fix_m.map(|(_, fix_m)| fix_m)
    }

    /// Measurements and acoustic events dropped because too many came in one step.
    #[must_use]
    pub fn overflows(&self) -> u32 {
        self.backseat.inputs.overflows()
    }

    /// Measurements fused later than they were valid.
    #[must_use]
    pub fn late(&self) -> u32 {
        self.backseat.estimator.lateness.late
    }

    /// Measurements too old to be used.
    #[must_use]
    pub fn too_late(&self) -> u32 {
        self.backseat.estimator.lateness.too_late
    }

    /// Acoustic packets that gave no range, by cause.
    #[must_use]
    pub fn lost_packets(&self, loss: Loss) -> u32 {
        self.backseat.estimator.packets.losses(loss)
    }

    /// Requests of the host that were not signed, or not by the board's key.
    #[must_use]
    pub fn refused_requests(&self) -> u32 {
        self.backseat.host.refused
    }

    /// Time labels and pulse edges that did not fit.
    #[must_use]
    pub fn odd_times(&self) -> u32 {
        self.backseat.clock.odd
    }
}
