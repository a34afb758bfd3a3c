//! Samples that wait to be fused, in the order of their time of validity.

use super::insert;
use heapless::Vec;

/// Samples that may wait: a step brings about ten, a declared delay makes those of two seconds wait, and a babbling
/// port adds some hundred at most.
pub const QUEUE_LENGTH: usize = 256;

/// Fixed queue sorted by time; samples of equal time keep their order of arrival.
#[derive(Clone, Debug)]
pub struct Queue<T> {
    /// Latest first, so that taking the earliest is cheap.
    samples: Vec<(u64, T), QUEUE_LENGTH>,
    /// Samples dropped because the queue was full.
    pub dropped: u32,
}

impl<T> Queue<T> {
    pub const fn new() -> Self {
        Self { samples: Vec::new(), dropped: 0 }
    }

    /// Adds a sample; when the queue is full the oldest is dropped and counted.
    pub fn push(&mut self, time_us: u64, sample: T) {
        if self.samples.is_full() {
            self.samples.pop();
            self.dropped = self.dropped.saturating_add(1);
        }
        let place = self.samples.partition_point(|(other_us, _)| *other_us > time_us);
        // Equal times: behind those that came before, which stand further towards the end.
        insert(&mut self.samples, place, (time_us, sample));
    }

    /// The earliest sample, if it is valid at `time_us` or before.
    pub fn pop_until(&mut self, time_us: u64) -> Option<(u64, T)> {
        if self.samples.last()?.0 <= time_us { self.samples.pop() } else { None }
    }

    pub fn clear(&mut self) {
        self.samples.clear();
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
        assert_eq!(queue.dropped, 3);
        assert_eq!(queue.pop_until(u64::MAX), Some((3, 3)));
    }
}
