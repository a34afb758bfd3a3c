//! Bytes that wait to be sent on one port.

use heapless::Deque;

/// A fixed ring; a frame that does not fit is dropped whole and counted.
#[derive(Debug)]
pub struct Ring<const N: usize> {
    bytes: Deque<u8, N>,
    dropped: u32,
}

impl<const N: usize> Ring<N> {
    /// Nothing waits.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: Deque::new(), dropped: 0 }
    }

    /// Queues a frame.
    pub fn push(&mut self, frame: &[u8]) {
        self.push_sparing(frame, 0);
    }

    /// Queues a frame if that leaves room for `spare` bytes.
    pub fn push_sparing(&mut self, frame: &[u8], spare: usize) {
        if self.bytes.len() + frame.len() + spare > N {
            self.dropped = self.dropped.saturating_add(1);
            return;
        }
        for &byte in frame {
            // there is room
            let _ = self.bytes.push_back(byte);
        }
    }

    /// The oldest bytes that lie in one piece.
    #[must_use]
    pub fn front(&self) -> &[u8] {
        self.bytes.as_slices().0
    }

    /// Forgets the oldest bytes.
    pub fn consume(&mut self, count: usize) {
        for _ in 0..count.min(self.bytes.len()) {
            self.bytes.pop_front();
        }
    }

    /// How many bytes wait.
    #[must_use]
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Whether none wait.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.bytes.clear();
    }

    /// Frames dropped because the ring was full.
    #[must_use]
    pub fn dropped(&self) -> u32 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_and_drops_whole_frames() {
        let mut ring = Ring::<8>::new();
        ring.push(b"12345");
        ring.consume(4);
        ring.push(b"abcdef");
        assert_eq!((ring.len(), ring.dropped()), (7, 0));
        ring.push(b"xy");
        assert_eq!((ring.len(), ring.dropped()), (7, 1));
        ring.push_sparing(b"x", 1);
        assert_eq!((ring.len(), ring.dropped()), (7, 2));
        let mut out = std::vec::Vec::new();
        while !ring.is_empty() {
            out.extend_from_slice(ring.front());
            ring.consume(ring.front().len());
        }
        assert_eq!(out, b"5abcdef");
    }
}
