//! One serial line, read by a thread of its own: opened, lost, opened again.

use backseat_host::DEFAULT_BAUD;
use backseat_logs::session::{port_name, port_named};
use backseat_wire::hostlink::Port;
use serialport::TTYPort;
use std::io::{ErrorKind, Read};
use std::path::Path;
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
pub struct Source {
    pub port: Port,
    pub path: String,
    baud: u32,
}

impl FromStr for Source {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = || Port::ALL.map(port_name).join(", ");
        let (name, path) =
            text.split_once('=').ok_or_else(|| format!("expected NAME=PATH with one of the names {}", names()))?;
        let port = port_named(name).ok_or_else(|| format!("{name}: expected one of {}", names()))?;
        // A device may have colons in its own name.
        let (path, baud) = match path.rsplit_once(':').filter(|_| !Path::new(path).exists()) {
            Some((path, baud)) => {
                let rate = baud.parse().ok().filter(|rate| *rate > 0);
                (path, rate.ok_or_else(|| format!("{baud}: not a baud rate; expected a whole number such as 115200"))?)
            }
            None => (path, DEFAULT_BAUD[port as usize]),
        };
        Ok(Self { port, path: path.to_owned(), baud })
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

impl Source {
    pub fn open(&self) -> serialport::Result<TTYPort> {
        serialport::new(&self.path, self.baud).timeout(PATIENCE).preserve_dtr_on_open().open_native()
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
        let source = |port, path: &str, baud| Ok(Source { port, path: path.to_owned(), baud });
        assert_eq!("modem=/dev/ttyUSB2".parse(), source(Port::Modem, "/dev/ttyUSB2", 19_200));
        assert_eq!("host=/dev/ttyACM0:921600".parse(), source(Port::Host, "/dev/ttyACM0", 921_600));
        assert!("/dev/ttyUSB0".parse::<Source>().unwrap_err().contains("frontseat, dvl, ahrs, modem, host"));
        assert!("sonar=/dev/ttyUSB0".parse::<Source>().unwrap_err().contains("sonar: expected one of"));
        assert!("dvl=/dev/x:fast".parse::<Source>().unwrap_err().contains("fast: not a baud rate"));
    }
}
