//! Moves bytes between the app and five ports, so that a board is only set-up and a clock.
//!
//! Two clocks. *Own*: bytes are stamped with the board's time when they are read, and a step is
//! taken every 0.1 s. *Lock-step*: from the first [`Step`](backseat_wire::hostlink::Step) message
//! on, time comes from the host: a step's chunks are read from the ports in the order announced,
//! then the app steps, its bytes are handed to the ports, and
//! [`StepDone`](backseat_wire::hostlink::StepDone) answers.
//!
//! A board that runs on its own clock lends it only at rest ([`App::lends_clock`]), and only for a `Step` that
//! announces lock-step: `time_us == 0`, no chunks. Any other is refused ([`Refusal::OwnClock`]). A host that sends no
//! step for [`SILENT_US`], or whose step is not done [`PARTIAL_US`] after it was announced, loses the clock: the app
//! restarts, commands neutral and stop, and steps by the board's time again. Bytes that trickle in do not prolong a step:
//! 65,535 announced bytes would keep a board waiting for minutes.
//!
//! For [`START_US`] after power-up (not after a reset by a fault) the pump leaves device bytes in their ports and takes
//! no step of its own, so that a simulator's first `Step` finds an untouched app. A `Step` with `time_us == 0` restarts
//! the app (parameters and mission are kept). A simulator that attaches to a board that already runs on its own clock
//! sends such a `Step` without chunks before it sends any device bytes, and discards what the device ports have carried
//! before its answer, except the counts that the answer itself names.

use crate::app::App;
use crate::lockstep::Lockstep;
use crate::time::STEP_US;
use backseat_wire::hostlink::{Port, Refusal, Step};
use embedded_io::{Read, ReadReady, Write, WriteReady};

/// How long after power-up the pump waits for a lock-step clock, µs.
pub const START_US: u64 = 2_000_000;
/// A lock-step clock that announces no step for this long is gone, µs.
pub const SILENT_US: u64 = 30_000_000;
/// A step that has not all of its announced bytes this long after it was announced, or whose answer no port takes, is
/// given up, µs. The bytes of 0.1 s take a line hardly longer than that.
pub const PARTIAL_US: u64 = 5_000_000;
/// Most bytes read from a port at once.
const READ_LENGTH: usize = 256;

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
    /// Nothing to do before a port becomes ready or (own clock) this board time, µs.
    IdleUntil(Option<u64>),
}

#[derive(Debug)]
enum Clock {
    /// Waits for either clock; until this time, which is known from the first poll on.
    Undecided { until_us: Option<u64> },
    /// The board's own clock, and its next step.
    Own { next_step_us: u64 },
    /// The host's clock: the last step's time, and the board's time when it was announced.
    Lockstep { time_us: u64, announced_us: u64 },
}

/// The pump; one per app.
#[derive(Debug)]
pub struct Pump {
    clock: Clock,
    lockstep: Lockstep,
}

impl Pump {
    /// Before the first byte.
    #[must_use]
    pub const fn new() -> Self {
        Self { clock: Clock::Undecided { until_us: None }, lockstep: Lockstep::new() }
    }

    /// Takes up the own clock with the next poll, unless a lock-step clock has come: a board that was reset under way
    /// has no two seconds to wait.
    pub fn start_at_once(&mut self, now_us: u64) {
        if let Clock::Undecided { until_us } = &mut self.clock {
            *until_us = Some(now_us);
        }
    }

    /// Whether time comes from the host.
    #[must_use]
    pub fn is_lockstep(&self) -> bool {
        matches!(self.clock, Clock::Lockstep { .. })
    }

    /// Whether it still waits for either clock and leaves the devices' bytes in their ports. A board whose ports cannot
    /// hold two seconds of bytes drops them meanwhile: no simulator has sent anything yet.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        matches!(self.clock, Clock::Undecided { .. })
    }

    /// Moves what can be moved without blocking. `ports` are in the order of [`Port::ALL`].
    ///
    /// One call reads at most 256 bytes a port and takes at most one step.
    ///
    /// # Errors
    /// The first port whose driver reports an error.
    pub fn poll<P>(&mut self, app: &mut App, ports: &mut [P; 5], now_us: u64) -> Result<Progress, PortFailure<P::Error>>
    where
        P: Read + ReadReady + Write + WriteReady,
    {
        let mut moved = self.take_back(app, now_us);
        moved |= self.host(app, ports, now_us)?;
        moved |= match self.clock {
            Clock::Undecided { .. } => self.wait(now_us),
            Clock::Own { .. } => self.own(app, ports, now_us)?,
            Clock::Lockstep { .. } => self.collect(app, ports)?,
        };
        moved |= flush(app, ports, &Port::DEVICES)?;
        self.lockstep.finish(app);
        moved |= flush(app, ports, &[Port::Host])?;
        Ok(match (moved, &self.clock) {
            (true, _) => Progress::Moved,
            (false, Clock::Undecided { until_us }) => Progress::IdleUntil(*until_us),
            (false, Clock::Own { next_step_us }) => Progress::IdleUntil(Some(*next_step_us)),
            (false, Clock::Lockstep { .. }) => Progress::IdleUntil(self.lockstep_ends_us()),
        })
    }

    /// When the host loses the clock if nothing more comes; `None` on another clock.
    fn lockstep_ends_us(&self) -> Option<u64> {
        let Clock::Lockstep { announced_us, .. } = self.clock else { return None };
        Some(announced_us.saturating_add(if self.lockstep.is_idle() { SILENT_US } else { PARTIAL_US }))
    }

    /// Returns to the own clock when the host's has stopped.
    #[inline(never)] // its memory is not to stay on the stack under a step
    fn take_back(&mut self, app: &mut App, now_us: u64) -> bool {
        let ends = self.lockstep_ends_us().is_some_and(|ends_us| now_us >= ends_us);
        if ends {
            self.lockstep = Lockstep::new();
            self.clock = Clock::Own { next_step_us: now_us };
            app.take_clock_back();
        }
        ends
    }

    /// Whether a step of the host's is taken.
    fn admits(&self, app: &App, step: &Step) -> bool {
        match self.clock {
            Clock::Undecided { .. } | Clock::Lockstep { .. } => true,
            Clock::Own { .. } => step.time_us == 0 && step.chunks.is_empty() && app.lends_clock(),
        }
    }

    /// Reads the host port, unless a step is under way: one message of the clock at a time.
    #[inline(never)] // as above
    fn host<P>(&mut self, app: &mut App, ports: &mut [P; 5], now_us: u64) -> Result<bool, PortFailure<P::Error>>
    where
        P: Read + ReadReady,
    {
        if !self.lockstep.is_idle() {
            return Ok(false);
        }
        let time_us = match self.clock {
            Clock::Lockstep { time_us, .. } => time_us,
            _ => now_us,
        };
        let mut buffer = [0; READ_LENGTH];
        let bytes = read(ports, Port::Host, &mut buffer)?;
        app.receive(Port::Host, time_us, bytes);
        let moved = !bytes.is_empty();
        if let Some(step) = app.take_announced() {
            if self.admits(app, &step) {
                self.clock = Clock::Lockstep { time_us: step.time_us, announced_us: now_us };
                self.lockstep.begin(app, step);
            } else {
                app.refuse(Refusal::OwnClock);
            }
        }
        Ok(moved)
    }

    /// Takes up the own clock when no other has come in time.
    fn wait(&mut self, now_us: u64) -> bool {
        match &mut self.clock {
            Clock::Undecided { until_us: Some(until_us) } if now_us >= *until_us => {
                self.clock = Clock::Own { next_step_us: now_us };
                true
            }
            Clock::Undecided { until_us: until_us @ None } => {
                *until_us = Some(now_us.saturating_add(START_US));
                true
            }
            _ => false,
        }
    }

    fn own<P>(&mut self, app: &mut App, ports: &mut [P; 5], now_us: u64) -> Result<bool, PortFailure<P::Error>>
    where
        P: Read + ReadReady,
    {
        let mut moved = false;
        let mut buffer = [0; READ_LENGTH];
        for port in Port::DEVICES {
            let bytes = read(ports, port, &mut buffer)?;
            if !bytes.is_empty() {
                app.receive(port, now_us, bytes);
                moved = true;
            }
        }
        if let Clock::Own { next_step_us } = &mut self.clock
            && now_us >= *next_step_us
        {
            app.step(now_us);
            // After a delay a board continues from here instead of catching up.
            let late_us = now_us - *next_step_us;
            *next_step_us = next_step_us.saturating_add(STEP_US * (1 + late_us / STEP_US));
            moved = true;
        }
        Ok(moved)
    }

    /// Reads the announced chunks as far as they have come.
    fn collect<P>(&mut self, app: &mut App, ports: &mut [P; 5]) -> Result<bool, PortFailure<P::Error>>
    where
        P: Read + ReadReady,
    {
        let mut moved = false;
        let mut buffer = [0; READ_LENGTH];
        while let Some((port, count)) = self.lockstep.wants() {
            let length = count.min(READ_LENGTH);
            let bytes = read(ports, port, buffer.get_mut(..length).unwrap_or_default())?;
            if bytes.is_empty() {
                break;
            }
            self.lockstep.supply(app, bytes);
            moved = true;
        }
        Ok(moved)
    }
}

/// Reads what `port` has, at most a buffer full; empty when it has nothing.
fn read<'b, P>(ports: &mut [P; 5], port: Port, buffer: &'b mut [u8]) -> Result<&'b [u8], PortFailure<P::Error>>
where
    P: Read + ReadReady,
{
    let driver = &mut ports[port as usize];
    let failed = |error| PortFailure { port, error };
    let count = if driver.read_ready().map_err(failed)? { driver.read(buffer).map_err(failed)? } else { 0 };
    Ok(buffer.get(..count).unwrap_or_default())
}

/// Hands waiting bytes to the ports that can take them.
fn flush<P>(app: &mut App, ports: &mut [P; 5], which: &[Port]) -> Result<bool, PortFailure<P::Error>>
where
    P: Write + WriteReady,
{
    let mut moved = false;
    for &port in which {
        let driver = &mut ports[port as usize];
        let failed = |error| PortFailure { port, error };
        while !app.transmit(port).is_empty() && driver.write_ready().map_err(failed)? {
            let count = driver.write(app.transmit(port)).map_err(failed)?;
            if count == 0 {
                break;
            }
            app.transmitted(port, count);
            moved = true;
        }
    }
    Ok(moved)
}
