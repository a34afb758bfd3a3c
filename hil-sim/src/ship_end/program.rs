//! What runs on the ship: topside in this process, or any program at the other end of two serial lines.

use backseat_link::{Arrival, BackseatError, Pty};
use backseat_topside::{Port, Topside};
use backseat_wire::hostlink;

/// A program on the ship.
pub trait Program {
    /// Gives it what has arrived, takes what it sends to its modem; `step` every 0.1 s.
    ///
    /// # Errors
    /// It has ended.
    fn exchange(&mut self, now_us: u64, arrivals: &[(Port, Arrival)], step: bool) -> Result<Vec<u8>, BackseatError>;

    /// Its state, if it is in this process.
    fn topside(&self) -> Option<&Topside> {
        None
    }
}

/// Topside in this process, on the simulation's clock.
pub struct InProcess(Box<Topside>);

impl InProcess {
    /// As after power-up.
    #[must_use]
    pub fn new(topside: Topside) -> Self {
        Self(Box::new(topside))
    }
}

impl Program for InProcess {
    fn exchange(&mut self, now_us: u64, arrivals: &[(Port, Arrival)], step: bool) -> Result<Vec<u8>, BackseatError> {
        exchange(&mut self.0, now_us, arrivals, step)
    }

    fn topside(&self) -> Option<&Topside> {
        Some(&self.0)
    }
}

/// One exchange with topside in this process.
///
/// # Errors
/// None: as [`Program::exchange`].
pub fn exchange(
    topside: &mut Topside,
    now_us: u64,
    arrivals: &[(Port, Arrival)],
    step: bool,
) -> Result<Vec<u8>, BackseatError> {
    for (port, arrival) in arrivals {
        topside.receive(*port, arrival.time_us, &arrival.bytes);
    }
    if step {
        topside.step(now_us);
    }
    let mut sent = Vec::new();
    while !topside.transmit(Port::Modem).is_empty() {
        let bytes = topside.transmit(Port::Modem).to_vec();
        topside.transmitted(Port::Modem, bytes.len());
        sent.extend(bytes);
    }
    Ok(sent)
}

/// A program of its own on two pseudo-terminals, on its own clock.
pub struct OnPorts {
    gnss: Pty,
    modem: Pty,
}

impl OnPorts {
    /// Opens the two lines.
    ///
    /// # Errors
    /// What the operating system refuses.
    pub fn open() -> std::io::Result<Self> {
        Ok(Self { gnss: Pty::open()?, modem: Pty::open()? })
    }

    /// Paths of the program's ends: GNSS and modem.
    #[must_use]
    pub fn paths(&self) -> [&str; 2] {
        [self.gnss.path(), self.modem.path()]
    }
}

impl Program for OnPorts {
    fn exchange(&mut self, _: u64, arrivals: &[(Port, Arrival)], _: bool) -> Result<Vec<u8>, BackseatError> {
        let failed = |error| BackseatError::Port { port: hostlink::Port::Modem, error };
        for (port, arrival) in arrivals {
            let line = if *port == Port::Gnss { &self.gnss } else { &self.modem };
            line.write_all(&arrival.bytes).map_err(failed)?;
        }
        let mut buffer = [0; 4096];
        let count = self.modem.read(&mut buffer, 0).map_err(failed)?;
        Ok(buffer[..count].to_vec())
    }
}
