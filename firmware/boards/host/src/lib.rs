//! The backseat app as a Linux process on pseudo-terminals or serial ports.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// A serial port to open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortSettings {
    /// Device, e.g. `/dev/ttyUSB0` or `/dev/pts/3`.
    pub path: PathBuf,
    /// Baud rate; a pseudo-terminal ignores it.
    pub baud: u32,
}

/// The five ports of the backseat.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HostPorts {
    /// In the order of [`backseat_wire::hostlink::Port::ALL`]: frontseat, DVL, AHRS, modem, host.
    pub ports: [PortSettings; 5],
}

/// Default baud rates, in the order of [`backseat_wire::hostlink::Port::ALL`].
pub const DEFAULT_BAUD: [u32; 5] = [19_200, 115_200, 115_200, 19_200, 115_200];

impl HostPorts {
    /// These devices, in the order of [`backseat_wire::hostlink::Port::ALL`], at [`DEFAULT_BAUD`].
    #[must_use]
    pub fn new(paths: [PathBuf; 5]) -> Self {
        let mut baud = DEFAULT_BAUD.into_iter();
        Self { ports: paths.map(|path| PortSettings { path, baud: baud.next().unwrap_or(115_200) }) }
    }
}

/// Runs the backseat on these ports until `stop` is set (looked at every 0.1 s).
///
/// # Errors
/// A port that cannot be opened, or that vanished.
pub fn run(_ports: &HostPorts, _stop: &AtomicBool) -> anyhow::Result<()> {
    anyhow::bail!("not yet written")
}
