//! The state machine.

use backseat_wire::hostlink::{Port, Step};

/// Time between two steps, µs.
pub const STEP_US: u64 = 100_000;

/// The backseat: lives in a static, never moves, never blocks, never reads a clock.
#[derive(Debug)]
pub struct App {
    digest: u64,
}

impl Default for App {
    fn default() -> Self {
        Self::new()
    }
}

impl App {
    /// Default parameters, no mission, nothing received.
    #[must_use]
    pub const fn new() -> Self {
        Self { digest: 0 }
    }

    /// Forgets everything but parameters and mission, as a power-up would.
    pub fn restart(&mut self) {}

    /// Bytes that came in on `port`; `time_us` is the arrival of the last of them.
    pub fn receive(&mut self, _port: Port, _time_us: u64, _bytes: &[u8]) {}

    /// An edge of the pulse-per-second input.
    pub fn pps(&mut self, _time_us: u64) {}

    /// Navigates, steers and reports; every 0.1 s.
    pub fn step(&mut self, _time_us: u64) {}

    /// Bytes that wait to be sent on `port`, oldest first (a part of them where the ring wraps).
    #[must_use]
    pub fn transmit(&self, _port: Port) -> &[u8] {
        &[]
    }

    /// The first `count` bytes of [`Self::transmit`] were handed to the port.
    pub fn transmitted(&mut self, _port: Port, _count: usize) {}

    /// The lock-step clock message that came in on the host port, once.
    pub fn take_announced(&mut self) -> Option<Step> {
        None
    }

    /// Running digest of filter state and covariance.
    #[must_use]
    pub fn digest(&self) -> u64 {
        self.digest
    }
}
