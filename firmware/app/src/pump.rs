//! Moves bytes between the app and five ports, so that a board is only set-up and a clock.
//!
//! Two clocks. *Own*: bytes are stamped with the board's time when they are read, and a step is
//! taken every 0.1 s. *Lock-step*: from the first [`Step`](backseat_wire::hostlink::Step) message
//! on, time comes from the host: a step's chunks are read from the ports in the order announced,
//! then the app steps, its bytes are handed to the ports, and
//! [`StepDone`](backseat_wire::hostlink::StepDone) answers.
//!
//! For [`START_US`] after power-up the pump leaves device bytes in their ports and takes no step
//! of its own, so that a simulator's first `Step` finds an untouched app. A `Step` with
//! `time_us == 0` restarts the app at any time (parameters and mission are kept) and does nothing
//! else; after its answer the simulator discards what the device ports have carried before.

use crate::App;
use backseat_wire::hostlink::Port;
use embedded_io::{Read, ReadReady, Write, WriteReady};

/// How long after power-up the pump waits for a lock-step clock, µs.
pub const START_US: u64 = 2_000_000;

/// A port that failed, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PortFailure<E> {
    /// Which port.
    pub port: Port,
    /// Its error.
    pub error: E,
}

/// What the board may do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Call again: bytes moved or a step was taken.
    Moved,
    /// Nothing to do before a port becomes ready or (with the own clock) this board time, µs.
    IdleUntil(Option<u64>),
}

/// The pump; one per app.
#[derive(Debug)]
pub struct Pump {}

impl Default for Pump {
    fn default() -> Self {
        Self::new()
    }
}

impl Pump {
    /// Before the first byte.
    #[must_use]
    pub const fn new() -> Self {
        Self {}
    }

    /// Moves what can be moved without blocking. `ports` are in the order of [`Port::ALL`].
    ///
    /// # Errors
    /// The first port whose driver reports an error.
    pub fn poll<P>(
        &mut self,
        _app: &mut App,
        _ports: &mut [P; 5],
        _now_us: u64,
    ) -> Result<Progress, PortFailure<P::Error>>
    where
        P: Read + ReadReady + Write + WriteReady,
    {
        Ok(Progress::IdleUntil(None))
    }
}
