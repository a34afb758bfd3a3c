//! The app from outside: ports in, steps, ports out.

use crate::backseat::Backseat;
#[cfg(feature = "static-filter")]
use crate::estimator::Estimator;
use crate::estimator::FilterPlace;
use crate::health::Health;
use crate::held::Held;
use crate::host::{HOST_RING, send};
use crate::parameters::Settings;
use crate::requests;
use crate::ring::Ring;
use backseat_core::navigation::naming::Naming;
use backseat_wire::Counts;
use backseat_wire::hostlink::{
    self, BoardLog, FittingReadings, FromBoard, Hardware, ImageId, KeptCrash, Mode, ModeReason, Oscillator, Port,
    Refusal, Step, StepDone, ToBoard,
};
#[cfg(feature = "static-filter")]
use core::mem::offset_of;

/// The backseat: lives in a static, never moves, never blocks, never reads a clock.
pub struct App {
    decoder: hostlink::Decoder,
    host_counts: Counts,
    pub(crate) host_out: Ring<HOST_RING>,
    announced: Held<Step>,
    pub(crate) backseat: Backseat,
}

impl App {
    /// Default parameters, no mission, nothing received.
    #[cfg(not(feature = "static-filter"))]
    #[must_use]
    pub const fn new() -> Self {
        Self::with(FilterPlace::new())
    }

    /// Default parameters, no mission, nothing received; the filter, a new one, lives where the board has put it.
    #[cfg(feature = "static-filter")]
    #[must_use]
    pub const fn new(filter: FilterPlace) -> Self {
        Self::with(filter)
    }

    /// Offset of the reference to the filter, bytes; all others of a new app are zero. So a board makes its app in place:
    /// by value it would pass over the stack, and a copy to start from takes 100 kB of flash.
    #[cfg(feature = "static-filter")]
    pub const FILTER_PLACE: usize =
        offset_of!(Self, backseat) + offset_of!(Backseat, estimator) + Estimator::FILTER_PLACE;

    const fn with(filter: FilterPlace) -> Self {
        Self {
            decoder: hostlink::Decoder::new(),
            host_counts: Counts::new(),
            host_out: Ring::new(),
            announced: Held::none(),
            backseat: Backseat::new(filter),
        }
    }

    /// This image has a build ID that begins so, and this CRC-32.
    pub fn set_image(&mut self, build: u32, crc: u32) {
        (self.backseat.host.build, self.backseat.host.crc) = (build, crc);
    }

    /// See [`Self::set_image`]; zeros without.
    #[must_use]
    pub fn image(&self) -> ImageId {
        self.backseat.host.image()
    }

    /// See [`Self::earlier_crashes`].
    pub(crate) fn earlier(&self) -> &[KeptCrash] {
        &self.backseat.host.earlier_crashes
    }

    /// Forgets everything but parameters and mission, as a power-up would.
    pub fn restart(&mut self) {
        self.backseat.restart();
    }

    /// Bytes that came in on `port`; `time_us` is the arrival of the last of them. How a stream is
    /// cut into pieces makes no difference.
    pub fn receive(&mut self, port: Port, time_us: u64, bytes: &[u8]) {
        if port != Port::Host {
            self.backseat.receive(port, time_us, bytes);
            return;
        }
        let mut rest = bytes;
        while let Some(outcome) = self.decoder.feed(&mut rest) {
            let Ok(frame) = outcome else { continue };
            let Ok(message) = self.host_counts.note(frame.message::<ToBoard<'_>>()) else { continue };
            let Backseat { host, parameters, drivers, .. } = &mut self.backseat;
            match host.admit(message, &parameters.active().app.acoustic_key) {
                Ok((ToBoard::Step(step), _)) => self.announced.set(step),
                Ok((request, trusted)) => {
                    requests::answer(&mut self.backseat, &request, trusted, &mut self.host_out);
                }
                Err(refusal) => {
                    drivers.news = true;
                    send(&mut self.host_out, &FromBoard::Refused(refusal));
                }
            }
        }
    }

    /// A number that no earlier start of this board had: signed requests are for this start alone. Without it, zero,
    /// what was signed in one start is taken again in another.
    pub fn set_challenge(&mut self, challenge: u64) {
        self.backseat.host.challenge = challenge;
    }

    /// An edge of the pulse-per-second input.
    pub fn pps(&mut self, time_us: u64) {
        self.backseat.clock.edge(time_us);
    }

    /// The board's clock counts this oscillator from now on; before, a crystal. One-way ranges need one, or pulse
    /// edges.
    pub fn set_oscillator(&mut self, oscillator: Oscillator) {
        self.backseat.clock.set_oscillator(oscillator);
    }

    /// Navigates, steers and reports; every 0.1 s. A step that is not after the last does nothing.
    #[inline(never)] // its parts are calls, so that their bytes take turns on the stack
    pub fn step(&mut self, time_us: u64) {
        if self.backseat.step(time_us) {
            self.backseat.report(time_us, &mut self.host_out);
        }
    }

    /// Bytes that wait to be sent on `port`, oldest first (a part of them where the ring wraps).
    #[must_use]
    pub fn transmit(&self, port: Port) -> &[u8] {
        self.backseat.ring(port).map_or(self.host_out.front(), Ring::front)
    }

    /// The first `count` bytes of [`Self::transmit`] were handed to the port.
    pub fn transmitted(&mut self, port: Port, count: usize) {
        match self.backseat.ring_mut(port) {
            Some(ring) => ring.consume(count),
            None => self.host_out.consume(count),
        }
    }

    /// How many bytes wait to be sent on `port`.
    #[must_use]
    pub fn waiting(&self, port: Port) -> usize {
        self.backseat.ring(port).map_or(self.host_out.len(), Ring::len)
    }

    /// The lock-step clock message that came in on the host port, once.
    pub fn take_announced(&mut self) -> Option<Step> {
        self.announced.take()
    }

    /// Queues the answer to a lock-step clock message.
    pub fn answer_step(&mut self, done: StepDone) {
        send(&mut self.host_out, &FromBoard::StepDone(done));
    }

    /// A message of the clock is refused.
    pub(crate) fn refuse(&mut self, refusal: Refusal) {
        send(&mut self.host_out, &FromBoard::Refused(refusal));
    }

    /// Whether a host may take the clock over: nothing is armed, under way, being stopped, tested or stored, and no
    /// series of resets waits for the operator.
    #[must_use]
    pub fn lends_clock(&self) -> bool {
        self.backseat.is_at_rest()
    }

    /// Ends a mission, and gives the frontseat control with the next step: neutral fins and stop. For a board that is
    /// about to end, or whose frontseat did not hear it.
    pub fn hand_back(&mut self) {
        self.backseat.steering.stop();
    }

    /// The host's clock has stopped: starts again on the board's own, with neutral fins and stop.
    pub(crate) fn take_clock_back(&mut self) {
        self.restart();
        self.backseat.steering.release();
    }

    /// For a study.
    pub fn naming(&mut self) -> &mut Naming {
        self.backseat.estimator.naming_mut()
    }

    /// Running digest of filter state and covariance.
    #[must_use]
    pub fn digest(&self) -> u64 {
        self.backseat.digest()
    }

    /// The active parameters.
    #[must_use]
    pub fn parameters(&self) -> &Settings {
        self.backseat.parameters.active()
    }

    /// Mode and its reason, as the last step's telemetry has them.
    #[must_use]
    pub fn mode(&self) -> (Mode, ModeReason) {
        self.backseat.modes.present()
    }

    /// Counters of what was received, refused and dropped.
    #[must_use]
    pub fn health(&self) -> Health<'_> {
        Health {
            backseat: &self.backseat,
            host: [self.decoder.counts(), &self.host_counts],
            unsent_to_host: self.host_out.dropped(),
        }
    }

    /// How often `port`'s driver has lost received bytes since power-up: overruns, full rings, what the UART calls an
    /// error. Boards report it whenever it grows; the host hears of it after the next step.
    pub fn receive_losses(&mut self, port: Port, since_start: u32) {
        self.backseat.drivers.receive_losses(port, since_start);
    }

    /// What becomes of the log that the board keeps, as its driver knows it after each step.
    pub fn board_log(&mut self, log: BoardLog) {
        self.backseat.drivers.log(log);
    }

    /// What the board's hardware has come to, after each step.
    pub fn hardware(&mut self, hardware: Hardware) {
        self.backseat.drivers.hardware(hardware);
    }

    /// Last-resort hardware was read, its outputs set as [`Self::fitting_outputs`] has them; before each step.
    pub fn fittings(&mut self, readings: FittingReadings) {
        let Backseat { last_resort, parameters, .. } = &mut self.backseat;
        last_resort.read(readings, &parameters.active().app.fittings);
    }

    /// What its outputs are to be after a step: the abort line is active; the drop weight falls.
    #[must_use]
    pub fn fitting_outputs(&self) -> [bool; 2] {
        self.backseat.last_resort.outputs()
    }

    /// The host may be sending the key: bytes of the host port must not be logged now.
    pub(crate) fn expects_key(&self) -> bool {
        self.backseat.host.expects_key(self.backseat.now_us())
    }

    /// Time of the last step, µs; a board feeds its watchdog as it advances.
    #[must_use]
    pub fn stepped_us(&self) -> Option<u64> {
        self.backseat.last_step_us()
    }

    /// Whether a mission is being flown.
    #[must_use]
    pub fn is_under_way(&self) -> bool {
        self.backseat.steering.under_way()
    }
}
