//! The lock-step clock: a step is taken when exactly the announced bytes have come.
//!
//! A [`Step`] lists the chunks that reach the device ports, in order of arrival. Nothing is
//! buffered here: the next chunk's bytes are asked for by port and count, and go straight to the
//! app, in as many pieces as they come (the app's decoders do not see where pieces end).

use crate::App;
use backseat_wire::hostlink::{Port, Step, StepDone};

/// Where a step stands.
#[derive(Debug)]
enum State {
    /// No step announced.
    Idle,
    /// Waiting for chunk `chunk`, of which `taken` bytes have come; `edges` were delivered.
    Collecting { step: Step, chunk: usize, taken: u16, edges: usize },
    /// The app has stepped; its bytes are on their way to the ports.
    Flushing(StepDone),
}

/// The lock-step clock.
#[derive(Debug)]
pub(crate) struct Lockstep {
    state: State,
}

impl Lockstep {
    pub(crate) const fn new() -> Self {
        Self { state: State::Idle }
    }

    /// No step is under way.
    pub(crate) fn is_idle(&self) -> bool {
        matches!(self.state, State::Idle)
    }

    /// Begins a step, and takes it if it brings no bytes.
    pub(crate) fn begin(&mut self, app: &mut App, step: Step) {
        if step.time_us == 0 {
            app.restart();
        }
        self.state = State::Collecting { step, chunk: 0, taken: 0, edges: 0 };
        self.advance(app);
    }

    /// Which port's bytes are next, and how many of them at most.
    pub(crate) fn wants(&self) -> Option<(Port, usize)> {
        let State::Collecting { step, chunk, taken, .. } = &self.state else { return None };
        let next = step.chunks.get(*chunk)?;
        Some((next.port, usize::from(next.length.saturating_sub(*taken))))
    }

    /// The next bytes of the port that [`Self::wants`] named, no more than it asked for.
    pub(crate) fn supply(&mut self, app: &mut App, bytes: &[u8]) {
        if let State::Collecting { step, chunk, taken, edges } = &mut self.state {
            let Some(next) = step.chunks.get(*chunk) else { return };
            deliver_edges(app, &step.pps_us, edges, next.time_us);
            app.receive(next.port, next.time_us, bytes);
            *taken = taken.saturating_add(u16::try_from(bytes.len()).unwrap_or(u16::MAX));
        }
        self.advance(app);
    }

    /// Passes over chunks that are complete, and steps the app after the last.
    fn advance(&mut self, app: &mut App) {
        let State::Collecting { step, chunk, taken, edges } = &mut self.state else { return };
        while let Some(next) = step.chunks.get(*chunk) {
            // The host port carries the clock itself; its bytes cannot be announced.
            if *taken < next.length && next.port != Port::Host {
                return;
            }
            *chunk += 1;
            *taken = 0;
        }
        deliver_edges(app, &step.pps_us, edges, step.time_us);
        app.step(step.time_us);
        let mut sent = [0; 4];
        for (count, port) in sent.iter_mut().zip(Port::DEVICES) {
            *count = u16::try_from(app.waiting(port)).unwrap_or(u16::MAX);
        }
        self.state = State::Flushing(StepDone { time_us: step.time_us, sent, digest: app.digest() });
    }

    /// The step's answer, once no byte waits for a device port any more.
    pub(crate) fn finish(&mut self, app: &mut App) {
        if let State::Flushing(done) = self.state
            && Port::DEVICES.iter().all(|&port| app.waiting(port) == 0)
        {
            app.answer_step(done);
            self.state = State::Idle;
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
