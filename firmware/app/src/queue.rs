//! What waits to be fused, in the order of the time it is valid at.

use heapless::Vec;

/// Events that may wait: a step brings about ten, a babbling port at most some hundred.
pub const QUEUE_LENGTH: usize = 64;

/// Fixed queue sorted by time; events of equal time keep their order of arrival.
#[derive(Clone, Debug)]
pub struct Queue<T> {
    /// Latest first, so that taking the earliest is cheap.
    events: Vec<(u64, T), QUEUE_LENGTH>,
    dropped: u32,
}

impl<T> Queue<T> {
    pub const fn new() -> Self {
        Self { events: Vec::new(), dropped: 0 }
    }

    /// Adds an event; when the queue is full the oldest is dropped and counted.
    pub fn push(&mut self, time_us: u64, event: T) {
        if self.events.is_full() {
            self.events.pop();
            self.dropped = self.dropped.saturating_add(1);
        }
        let place = self.events.partition_point(|(other_us, _)| *other_us > time_us);
        // Equal times: behind those that came before, which stand further towards the end.
        let _ = self.events.insert(place, (time_us, event));
    }

    /// The earliest event, if it is valid at `time_us` or before.
    pub fn pop_until(&mut self, time_us: u64) -> Option<(u64, T)> {
        if self.events.last()?.0 <= time_us { self.events.pop() } else { None }
    }

    pub fn clear(&mut self) {
        self.events.clear();
    }

    /// Events dropped because the queue was full.
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comes_out_sorted_and_stable() {
        let mut queue = Queue::new();
        for (time_us, name) in [(30, 'c'), (10, 'a'), (20, 'b'), (20, 'B'), (5, '0')] {
            queue.push(time_us, name);
        }
        let mut out = std::vec::Vec::new();
        while let Some((_, name)) = queue.pop_until(20) {
            out.push(name);
        }
        assert_eq!(out, ['0', 'a', 'b', 'B']);
        assert_eq!(queue.pop_until(29), None);
        assert_eq!(queue.pop_until(30), Some((30, 'c')));
    }

    #[test]
    fn full_drops_the_oldest_and_counts() {
        let mut queue = Queue::new();
        for i in 0..QUEUE_LENGTH as u64 + 3 {
            queue.push(i, i);
        }
        assert_eq!(queue.dropped(), 3);
        assert_eq!(queue.pop_until(u64::MAX), Some((3, 3)));
    }
}
