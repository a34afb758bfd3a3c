//! One serial line, read by a thread of its own: opened, lost, opened again.

use anyhow::Context;
use backseat_link::board::PortName;
use backseat_logs::session::port_named;
use backseat_wire::hostlink::Port;
use serialport::TTYPort;
use std::io::{ErrorKind, Read};
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::thread::{JoinHandle, sleep, spawn};
use std::time::{Duration, Instant};

/// Longest wait of a read, and so the longest time until a line stops.
const PATIENCE: Duration = Duration::from_millis(100);
/// Time between two attempts to open a lost device.
const RETRY: Duration = Duration::from_millis(200);

/// A port of the board and the device on which this machine listens to it: `NAME=PATH` or `NAME=PATH:BAUD`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedDevice {
    pub port: Port,
    pub device: PortName,
}

impl FromStr for NamedDevice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = || Port::NAMES.join(", ");
        let (name, path) =
            text.split_once('=').ok_or_else(|| format!("expected NAME=PATH with one of the names {}", names()))?;
        let port = port_named(name).ok_or_else(|| format!("{name}: expected one of {}", names()))?;
        Ok(Self { port, device: PortName::parse(path, Port::DEFAULT_BAUD[port as usize])? })
    }
}

/// An event on a line.
pub enum LineEvent {
    /// It is open (again); with a second handle of it, to ask the board.
    Opened(TTYPort),
    /// Bytes came.
    Bytes(Vec<u8>),
    /// The device is gone.
    Lost(String),
}

/// From which line, and when.
pub struct LineReport {
    pub line: usize,
    pub at: Instant,
    pub event: LineEvent,
}

impl NamedDevice {
    pub fn open(&self) -> anyhow::Result<TTYPort> {
        let device = &self.device;
        device.open(PATIENCE).with_context(|| format!("{device}: cannot be opened as a serial port"))
    }

    /// Reads the device until asked to stop; reopens it when it is lost.
    pub fn listen(self, line: usize, device: TTYPort, to: Sender<LineReport>, stop: Arc<AtomicBool>) -> JoinHandle<()> {
        spawn(move || {
            let send = |event| to.send(LineReport { line, at: Instant::now(), event }).is_ok();
            let mut next = Some(device);
            while !stop.load(Ordering::Relaxed) {
                let Some(mut device) = next.take().or_else(|| self.open().ok()) else {
                    sleep(RETRY);
                    continue;
                };
                let lost = match device.try_clone_native() {
                    Ok(second) => {
                        if !send(LineEvent::Opened(second)) {
                            return;
                        }
                        read(&mut device, &stop, |bytes| send(LineEvent::Bytes(bytes)))
                    }
                    Err(error) => error.to_string(),
                };
                if !stop.load(Ordering::Relaxed) && !send(LineEvent::Lost(lost)) {
                    return;
                }
            }
        })
    }
}

/// Reads until the device is gone, the receiver is closed, or it is time to stop; returns the reason.
fn read(device: &mut TTYPort, stop: &AtomicBool, mut take: impl FnMut(Vec<u8>) -> bool) -> String {
    let mut buffer = [0; 4096];
    while !stop.load(Ordering::Relaxed) {
        match device.read(&mut buffer) {
            Ok(0) => return "hung up".to_owned(),
            Ok(count) => {
                if !take(buffer[..count].to_vec()) {
                    break;
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => return error.to_string(),
        }
    }
    String::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_devices_and_rates() {
        let named = |port, path: &str, baud| Ok(NamedDevice { port, device: PortName::parse(path, baud)? });
        assert_eq!("modem=/dev/ttyUSB2".parse(), named(Port::Modem, "/dev/ttyUSB2", 19_200));
        assert_eq!("host=/dev/ttyACM0:921600".parse(), named(Port::Host, "/dev/ttyACM0", 921_600));
        assert!("/dev/ttyUSB0".parse::<NamedDevice>().unwrap_err().contains("frontseat, dvl, ahrs, modem, host"));
        assert!("sonar=/dev/ttyUSB0".parse::<NamedDevice>().unwrap_err().contains("sonar: expected one of"));
        assert!("dvl=/dev/x:fast".parse::<NamedDevice>().unwrap_err().contains("fast: not a baud rate"));
    }
}
