//! What was received, refused and dropped since start, and the last samples.

use crate::acoustics::Loss;
use crate::app::App;
use backseat_wire::Error;
use backseat_wire::ahrs::AhrsSample;
use backseat_wire::dvl::DvlSample;
use backseat_wire::hostlink::Port;

/// Counters of the app; all saturate.
#[derive(Clone, Copy)]
pub struct Health<'a> {
    app: &'a App,
}

impl<'a> Health<'a> {
    pub(crate) const fn new(app: &'a App) -> Self {
        Self { app }
    }

    /// Good sentences of frontseat and modem, samples of DVL and AHRS, good frames of the host.
    #[must_use]
    pub fn accepted(&self, port: Port) -> u32 {
        self.app.accepted(port)
    }

    /// Frames that a port's decoders refused.
    #[must_use]
    pub fn rejected(&self, port: Port) -> u32 {
        self.app.counts(port).iter().fold(0, |sum, counts| sum.saturating_add(counts.rejected()))
    }

    /// Frames that a port's decoders refused for one cause.
    #[must_use]
    pub fn rejected_for(&self, port: Port, cause: Error) -> u32 {
        self.app.counts(port).iter().fold(0, |sum, counts| sum.saturating_add(counts.of(cause)))
    }

    /// Frames not sent because a port did not take its bytes.
    #[must_use]
    pub fn unsent(&self, port: Port) -> u32 {
        self.app.unsent(port)
    }

    /// The last sample of the DVL.
    #[must_use]
    pub fn dvl(&self) -> Option<&'a DvlSample> {
        self.app.dvl().last()
    }

    /// The last sample of the AHRS.
    #[must_use]
    pub fn ahrs(&self) -> Option<&'a AhrsSample> {
        self.app.ahrs().last()
    }

    /// The last depth of the pressure sensor, m.
    #[must_use]
    pub fn depth_m(&self) -> Option<f64> {
        self.app.estimator().samples().depth_m.map(|(_, depth_m)| depth_m)
    }

    /// The last fix, north and east, m.
    #[must_use]
    pub fn fix_m(&self) -> Option<[f64; 2]> {
        self.app.estimator().samples().fix_m.map(|(_, fix_m)| fix_m)
    }

    /// Measurements and acoustic events dropped because too many came in one step.
    #[must_use]
    pub fn overflows(&self) -> u32 {
        self.app.estimator().overflows()
    }

    /// Measurements fused later than they were valid.
    #[must_use]
    pub fn late(&self) -> u32 {
        self.app.estimator().lateness().late
    }

    /// Measurements too old to be used.
    #[must_use]
    pub fn too_late(&self) -> u32 {
        self.app.estimator().lateness().too_late
    }

    /// Acoustic packets that gave no range, by cause.
    #[must_use]
    pub fn lost_packets(&self, loss: Loss) -> u32 {
        self.app.estimator().acoustics().losses(loss)
    }

    /// Time labels and pulse edges that did not fit.
    #[must_use]
    pub fn odd_times(&self) -> u32 {
        self.app.clock().odd()
    }
}

/// Losses of received bytes, as the board's drivers count them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Losses {
    /// In the order of [`Port::ALL`].
    since_start: [u32; 5],
    /// The host has not been told yet.
    news: bool,
}

impl Losses {
    pub(crate) const fn new() -> Self {
        Self { since_start: [0; 5], news: false }
    }

    pub(crate) const fn since_start(&self) -> [u32; 5] {
        self.since_start
    }

    /// Whether there were any since the last call.
    pub(crate) fn take_news(&mut self) -> bool {
        core::mem::take(&mut self.news)
    }
}

impl App {
    /// How often `port`'s driver has lost received bytes since power-up: overruns, full rings, what the UART calls an
    /// error. Boards say so whenever it grows; the host is told after the next step.
    pub fn receive_losses(&mut self, port: Port, since_start: u32) {
        let Losses { since_start: losses, news } = &mut self.backseat.losses;
        if let Some(losses) = losses.get_mut(port as usize)
            && *losses != since_start
        {
            *losses = since_start;
            *news = true;
        }
    }
}
