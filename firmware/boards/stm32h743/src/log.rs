//! The board log on its way to the card: records into a bounded queue, whole or not at all.
//!
//! The app's level writes and never waits; thread mode reads and may take seconds.

use crate::memory::LogQueue;
use backseat_app::Recorder;
use backseat_wire::boardlog::LogRecord;
use backseat_wire::hostlink::{BoardLog, LogState, MAX_FRAME, encode};
use core::sync::atomic::{AtomicU8, Ordering};
use heapless::spsc::{Consumer, Producer};

/// What thread mode last said of the card, a [`LogState`].
static STATE: AtomicU8 = AtomicU8::new(LogState::Searching as u8);

/// Tells the app's level what becomes of the log.
pub fn tell(state: LogState) {
    STATE.store(state as u8, Ordering::Relaxed);
}

fn state() -> LogState {
    const WRITING: u8 = LogState::Writing as u8;
    const SEARCHING: u8 = LogState::Searching as u8;
    const FULL: u8 = LogState::Full as u8;
    match STATE.load(Ordering::Relaxed) {
        WRITING => LogState::Writing,
        SEARCHING => LogState::Searching,
        FULL => LogState::Full,
        _ => LogState::Failed,
    }
}

/// Where records go in.
pub struct Log {
    queue: Producer<'static, u8>,
    /// Records that found no room since the last that did.
    lost: u32,
    /// Since start.
    lost_records: u32,
}

impl Log {
    /// Writes to a queue.
    pub fn new(queue: &'static mut LogQueue) -> (Self, Consumer<'static, u8>) {
        let (producer, consumer) = queue.split();
        (Self { queue: producer, lost: 0, lost_records: 0 }, consumer)
    }

    /// For the host.
    pub fn report(&self) -> BoardLog {
        BoardLog { state: state(), lost_records: self.lost_records }
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

impl Recorder for Log {
    fn record(&mut self, record: &LogRecord<'_>) {
        if self.lost != 0 && self.put(&LogRecord::Lost { records: self.lost }) {
            self.lost = 0;
        }
        if self.lost != 0 || !self.put(record) {
            self.lost = self.lost.saturating_add(1);
            self.lost_records = self.lost_records.saturating_add(1);
        }
    }
}
