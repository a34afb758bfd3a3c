//! A serial device that may be unplugged and comes back.

use anyhow::{Context, anyhow, bail};
use backseat_link::board::PortName;
use serialport::{SerialPort, TTYPort};
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

/// Time between two attempts to open a lost device.
const RETRY: Duration = Duration::from_millis(300);
/// Longest wait of a read or a write.
const PATIENCE: Duration = Duration::from_millis(20);

/// The device, open or lost.
pub struct SerialLine {
    pub name: PortName,
    device: Option<TTYPort>,
    tried: Instant,
}

impl SerialLine {
    /// Opens `PATH` or `PATH:BAUD`; it has to be there.
    pub fn open(what: &str, text: &str, default_baud: u32) -> anyhow::Result<Self> {
        let name = PortName::parse(text, default_baud).map_err(|why| anyhow!("ports.{what}: {text}: {why}"))?;
        let device =
            name.open(PATIENCE).with_context(|| format!("ports.{what}: {name} cannot be opened as a serial port"))?;
        Ok(Self { name, device: Some(device), tried: Instant::now() })
    }

    /// Whether it is there.
    pub fn is_open(&self) -> bool {
        self.device.is_some()
    }

    /// What has come; the reason when the device was lost just now.
    pub fn poll(&mut self) -> Result<Vec<u8>, String> {
        let Some(device) = &mut self.device else {
            if self.tried.elapsed() >= RETRY {
                self.tried = Instant::now();
                self.device = self.name.open(PATIENCE).ok();
            }
            return Ok(Vec::new());
        };
        let mut buffer = [0; 4096];
        let read = match device.bytes_to_read() {
            Ok(0) => return Ok(Vec::new()),
            Ok(_) => device.read(&mut buffer),
            Err(error) => Err(error.into()),
        };
        match read {
            Ok(count) if count > 0 => Ok(buffer[..count].to_vec()),
            Ok(_) => Err(self.lose("hung up")),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(Vec::new()),
            Err(error) => Err(self.lose(&error.to_string())),
        }
    }

    /// The next bytes, as many as there is room for, when at least one has come.
    ///
    /// # Errors
    /// A device that is lost.
    pub fn wait(&mut self, buffer: &mut [u8]) -> anyhow::Result<usize> {
        loop {
            let device = self.device.as_mut().with_context(|| format!("{}: lost", self.name))?;
            match device.read(buffer) {
                Ok(count) if count > 0 => return Ok(count),
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                Ok(_) => bail!("{}: hung up", self.name),
                Err(error) => bail!("{}: {error}", self.name),
            }
        }
    }

    /// Sends; what a lost device does not take is lost.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), String> {
        let Some(device) = &mut self.device else { return Ok(()) };
        match device.write_all(bytes) {
            Err(error) if !matches!(error.kind(), ErrorKind::TimedOut) => Err(self.lose(&error.to_string())),
            _ => Ok(()),
        }
    }

    fn lose(&mut self, why: &str) -> String {
        self.device = None;
        self.tried = Instant::now();
        format!("{}: lost ({why}); waiting for it", self.name)
    }
}
