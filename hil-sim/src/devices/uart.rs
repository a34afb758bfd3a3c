//! One direction of a serial line: bytes leave one after the other at the line's speed.

use backseat_link::Arrival;
use std::collections::VecDeque;

/// A transmitter of 8N1 bytes.
#[derive(Clone, Debug)]
pub struct Uart {
    baud: u32,
    busy_until_us: u64,
    pending: VecDeque<Arrival>,
}

impl Uart {
    /// A line at `baud` bits per second.
    pub fn new(baud: u32) -> Self {
        Self { baud, busy_until_us: 0, pending: VecDeque::new() }
    }

    /// Time on the wire of `length` bytes, µs.
    pub fn duration_us(&self, length: usize) -> u64 {
        (length as u64 * 10 * 1_000_000).div_ceil(u64::from(self.baud))
    }

    /// Sends `bytes` at `time_us`, after what is still on the wire.
    pub fn send(&mut self, time_us: u64, bytes: &[u8]) {
        if bytes.is_empty() {
            return;
        }
        let time_us = self.busy_until_us.max(time_us) + self.duration_us(bytes.len());
        self.busy_until_us = time_us;
        self.pending.push_back(Arrival { time_us, bytes: bytes.to_vec() });
    }

    /// The next arrival up to and including `until_us`.
    pub fn pop(&mut self, until_us: u64) -> Option<Arrival> {
        if self.pending.front()?.time_us > until_us {
            return None;
        }
        self.pending.pop_front()
    }

    /// When the next bytes arrive, µs.
    pub fn next_us(&self) -> Option<u64> {
        self.pending.front().map(|arrival| arrival.time_us)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sentences_queue_behind_each_other() {
        let mut uart = Uart::new(10_000); // 1 ms a byte
        uart.send(0, &[0; 10]);
        uart.send(5_000, &[1; 10]);
        uart.send(100_000, &[2]);
        assert_eq!(uart.pop(9_999), None);
        assert_eq!(uart.pop(10_000).map(|a| a.time_us), Some(10_000));
        assert_eq!(uart.next_us(), Some(20_000));
        assert_eq!(uart.pop(u64::MAX).map(|a| a.time_us), Some(20_000));
        assert_eq!(uart.pop(u64::MAX).map(|a| a.time_us), Some(101_000));
    }
}
