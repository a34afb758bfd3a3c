//! The name of a serial device of this machine.

use backseat_wire::hostlink::Port;
use serialport::TTYPort;
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use std::time::Duration;

/// A serial device, as `PATH` or `PATH:BAUD`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortName {
    path: String,
    baud: u32,
}

impl PortName {
    /// `PATH`, at this rate, or `PATH:BAUD`.
    ///
    /// # Errors
    /// If what stands behind the colon is no baud rate.
    pub fn parse(text: &str, default_baud: u32) -> Result<Self, String> {
        // A device may have colons in its own name.
        match text.rsplit_once(':').filter(|_| !Path::new(text).exists()) {
            Some((path, baud)) => match baud.parse() {
                Ok(baud) if baud > 0 => Ok(Self { path: path.to_owned(), baud }),
                _ => Err(format!("{baud}: not a baud rate; expected a whole number such as 115200")),
            },
            None => Ok(Self { path: text.to_owned(), baud: default_baud }),
        }
    }

    /// Opens the device; a read or a write waits no longer than this.
    ///
    /// # Errors
    /// If it cannot be opened as a serial port.
    pub fn open(&self, timeout: Duration) -> serialport::Result<TTYPort> {
        serialport::new(&self.path, self.baud).timeout(timeout).preserve_dtr_on_open().open_native()
    }

    /// Path of the device.
    pub fn path(&self) -> &str {
        &self.path
    }
}

impl FromStr for PortName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Self::parse(text, Port::DEFAULT_BAUD[Port::Host as usize])
    }
}

impl fmt::Display for PortName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_and_without_a_rate() {
        let name = |path: &str, baud| PortName { path: path.to_owned(), baud };
        assert_eq!("/dev/ttyACM0".parse(), Ok(name("/dev/ttyACM0", 115_200)));
        assert_eq!("/dev/ttyACM0:921600".parse(), Ok(name("/dev/ttyACM0", 921_600)));
        for wrong in ["fast", "0"] {
            let refused = format!("/dev/x:{wrong}").parse::<PortName>().unwrap_err();
            assert!(refused.starts_with(&format!("{wrong}: not a baud rate")), "{refused}");
        }
    }
}
