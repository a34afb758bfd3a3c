//! The board log on its way to the card: records into a bounded queue, whole or not at all.
//!
//! The app's level writes and never waits; thread mode reads and may take seconds.

use crate::memory::LogQueue;
use backseat_app::Recorder;
use backseat_wire::boardlog::LogRecord;
use backseat_wire::hostlink::{MAX_FRAME, encode};
use core::sync::atomic::{AtomicBool, Ordering};
use heapless::spsc::{Consumer, Producer};

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
    pub fn new(queue: &'static mut LogQueue) -> (Self, Consumer<'static, u8>) {
        let (producer, consumer) = queue.split();
        (Self { queue: producer, lost: 0 }, consumer)
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
}
