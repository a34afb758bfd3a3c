//! The lock-step clock: a step is taken when exactly the announced bytes have come.
//!
//! A [`Step`] lists the chunks that reach the device ports, in order of arrival. Nothing is
//! buffered here: the next chunk's bytes are asked for by port and count, and go straight to the
//! app, in as many pieces as they come (the app's decoders do not see where pieces end).

use crate::App;
use backseat_wire::hostlink::{FittingReadings, Port, Step, StepDone};

/// The lock-step clock.
#[derive(Debug)]
pub(crate) struct Lockstep {
    /// The step whose bytes are awaited.
    step: Option<Step>,
    /// Its chunk that is next, and how many bytes of it have come.
    chunk: usize,
    taken: u16,
    /// Its edges that were delivered.
    edges: usize,
    /// The answer to the last step, while the app's bytes are on their way to the ports.
    done: Option<StepDone>,
}

impl Lockstep {
    pub(crate) const fn new() -> Self {
        Self { step: None, chunk: 0, taken: 0, edges: 0, done: None }
    }

    /// No step is under way.
    pub(crate) fn is_idle(&self) -> bool {
        self.step.is_none() && self.done.is_none()
    }

    /// Begins a step, and takes it if it brings no bytes.
    pub(crate) fn begin(&mut self, app: &mut App, step: Step) {
        if step.time_us == 0 {
            app.restart();
        }
        *self = Self { step: Some(step), ..Self::new() };
        self.advance(app);
    }

    /// Which port's bytes are next, and how many of them at most.
    pub(crate) fn wants(&self) -> Option<(Port, usize)> {
        let next = self.step.as_ref()?.chunks.get(self.chunk)?;
        Some((next.port, usize::from(next.length.saturating_sub(self.taken))))
    }

    /// The next bytes of the port that [`Self::wants`] named, no more than it asked for.
    pub(crate) fn supply(&mut self, app: &mut App, bytes: &[u8]) {
        let Some(step) = &self.step else { return };
        let Some(next) = step.chunks.get(self.chunk) else { return };
        deliver_edges(app, &step.pps_us, &mut self.edges, next.time_us);
        app.receive(next.port, next.time_us, bytes);
        self.taken = self.taken.saturating_add(u16::try_from(bytes.len()).unwrap_or(u16::MAX));
        self.advance(app);
    }

    /// Passes over chunks that are complete, and steps the app after the last.
    fn advance(&mut self, app: &mut App) {
        let Some(step) = &self.step else { return };
        while let Some(next) = step.chunks.get(self.chunk) {
            // The host port carries the clock itself; its bytes cannot be announced.
            if self.taken < next.length && next.port != Port::Host {
                return;
            }
            self.chunk += 1;
            self.taken = 0;
        }
        deliver_edges(app, &step.pps_us, &mut self.edges, step.time_us);
        if step.fittings != FittingReadings::default() {
            app.fittings(step.fittings);
        }
        app.step(step.time_us);
        let sent = Port::DEVICES.map(|port| u16::try_from(app.waiting(port)).unwrap_or(u16::MAX));
        self.done = Some(StepDone { time_us: step.time_us, sent, digest: app.digest() });
        self.step = None;
    }

    /// The step's answer, once no byte waits for a device port any more.
    pub(crate) fn finish(&mut self, app: &mut App) {
        if Port::DEVICES.iter().all(|&port| app.waiting(port) == 0)
            && let Some(done) = self.done.take()
        {
            app.answer_step(done);
        }
    }
}

/// Delivers the edges up to and including `until_us` that have not been delivered yet.
fn deliver_edges(app: &mut App, pps_us: &[u64], delivered: &mut usize, until_us: u64) {
    while let Some(&edge_us) = pps_us.get(*delivered)
        && edge_us <= until_us
    {
        app.pps(edge_us);
        *delivered += 1;
    }
}
