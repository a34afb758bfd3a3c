//! The board log on its way to the card: records into a bounded queue, whole or not at all.
//!
//! The app's level writes and never waits; thread mode reads and may take seconds.

use crate::memory::LogQueue;
use crate::uart::SerialPort;
use backseat_app::parameters::{PARAMETERS, Settings};
use backseat_wire::boardlog::LogRecord;
use backseat_wire::hostlink::{MAX_FRAME, Port, encode};
use core::cell::RefCell;
use core::convert::Infallible;
use core::sync::atomic::{AtomicBool, Ordering};
use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use heapless::spsc::Producer;

/// There is a card, as far as anybody knows yet.
static WANTED: AtomicBool = AtomicBool::new(true);

/// No card, or it failed: records are not made any more.
pub fn stop() {
    WANTED.store(false, Ordering::Relaxed);
}

/// Where records go in.
pub struct Log {
    queue: Producer<'static, u8>,
    /// Records that found no room since the last that did.
    lost: u32,
}

impl Log {
    /// Writes to a queue.
    pub fn new(queue: &'static mut LogQueue) -> (Self, heapless::spsc::Consumer<'static, u8>) {
        let (producer, consumer) = queue.split();
        (Self { queue: producer, lost: 0 }, consumer)
    }

    /// One record.
    pub fn record(&mut self, record: &LogRecord<'_>) {
        if !WANTED.load(Ordering::Relaxed) {
            return;
        }
        if self.lost != 0 && self.put(&LogRecord::Lost { records: self.lost }) {
            self.lost = 0;
        }
        if self.lost != 0 || !self.put(record) {
            self.lost = self.lost.saturating_add(1);
        }
    }

    /// The set that the app starts with.
    pub fn parameters(&mut self, settings: &Settings) {
        let chunks = PARAMETERS.chunks(backseat_wire::boardlog::VALUES);
        for (first, parameters) in (0..).step_by(backseat_wire::boardlog::VALUES).zip(chunks) {
            let values = parameters.iter().map(|parameter| (parameter.get)(settings)).collect();
            self.record(&LogRecord::Parameters { first, values });
        }
    }

    fn put(&mut self, record: &LogRecord<'_>) -> bool {
        let mut buffer = [0; MAX_FRAME];
        let Ok(frame) = encode(record, &mut buffer) else { return false };
        if self.queue.capacity() - self.queue.len() < frame.len() {
            return false;
        }
        // there is room for all of them
        frame.iter().all(|byte| self.queue.enqueue(*byte).is_ok())
    }
}

/// A port whose bytes are recorded.
pub struct Recorded<'a> {
    /// The port, ...
    pub serial: &'a mut SerialPort,
    /// ... which one it is, ...
    pub port: Port,
    /// ... where its bytes are recorded, unless under the host's clock, ...
    pub log: Option<&'a RefCell<Log>>,
    /// ... and with what time.
    pub time_us: u64,
}

impl ErrorType for Recorded<'_> {
    type Error = Infallible;
}

impl ReadReady for Recorded<'_> {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        self.serial.read_ready()
    }
}

impl Read for Recorded<'_> {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        let count = self.serial.read(bytes)?;
        if let (Some(log), 1.., Some(bytes)) = (self.log, count, bytes.get(..count)) {
            let (port, time_us) = (self.port, self.time_us);
            log.borrow_mut().record(&LogRecord::Received { port, time_us, bytes });
        }
        Ok(count)
    }
}

impl WriteReady for Recorded<'_> {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        self.serial.write_ready()
    }
}

impl Write for Recorded<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let count = self.serial.write(bytes)?;
        if let (Some(log), 1.., Some(bytes)) = (self.log, count, bytes.get(..count)) {
            let (port, time_us) = (self.port, self.time_us);
            log.borrow_mut().record(&LogRecord::Sent { port, time_us, bytes });
        }
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        self.serial.flush()
    }
}
