//! How good the link to the board is.

use std::collections::VecDeque;

/// Rates are over this time, µs.
const WINDOW_US: u64 = 3_000_000;
/// How often they are counted.
const TICK_US: u64 = 500_000;

/// A count's rate over the last seconds.
#[derive(Clone, Debug, Default)]
pub struct Meter(VecDeque<(u64, u64)>);

impl Meter {
    pub fn update(&mut self, now_us: u64, count: u64) {
        if self.0.back().is_some_and(|(us, _)| now_us < us + TICK_US) {
            return;
        }
        while self.0.len() > 1 && self.0[1].0 + WINDOW_US <= now_us {
            self.0.pop_front();
        }
        self.0.push_back((now_us, count));
    }

    /// Per second; `None` before there are two counts.
    pub fn per_s(&self) -> Option<f64> {
        let ((from_us, first), (to_us, last)) = (*self.0.front()?, *self.0.back()?);
        (to_us > from_us).then(|| last.saturating_sub(first) as f64 * 1e6 / (to_us - from_us) as f64)
    }
}

/// Counters of the link, through losses of the port.
#[derive(Default)]
pub struct Link {
    /// A frame of this connection was good: what an earlier program left on the line is no error.
    synchronised: bool,
    pub bytes: u64,
    pub frames: u64,
    /// Frames whose bytes were changed or lost on the way.
    pub broken: u64,
    /// Good frames that hold no message known here.
    pub unknown: u64,
    /// Telemetry.
    pub records: u64,
    /// Telemetry records that never came, and in how many gaps.
    pub missing: u64,
    pub gaps: u64,
    pub byte_rate: Meter,
    pub record_rate: Meter,
    pub broken_rate: Meter,
}

/// How a frame ended.
#[derive(Clone, Copy, Debug)]
pub enum Frame {
    Good,
    Broken,
    Unknown,
}

impl Link {
    /// A new connection.
    pub fn connected(&mut self) {
        self.synchronised = false;
    }

    pub fn note(&mut self, frame: Frame) {
        self.synchronised |= matches!(frame, Frame::Good);
        let count = match frame {
            Frame::Good => &mut self.frames,
            Frame::Broken => &mut self.broken,
            Frame::Unknown => &mut self.unknown,
        };
        *count += u64::from(self.synchronised);
    }

    /// Records that should have come between two others.
    pub fn gap(&mut self, missing: u64) {
        self.missing += missing;
        self.gaps += 1;
    }

    pub fn tick(&mut self, now_us: u64) {
        self.byte_rate.update(now_us, self.bytes);
        self.record_rate.update(now_us, self.records);
        self.broken_rate.update(now_us, self.broken);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_meter_looks_back_three_seconds() {
        let mut meter = Meter::default();
        assert_eq!(meter.per_s(), None);
        for second in 0..=10 {
            meter.update(second * 1_000_000, second * 10);
        }
        assert_eq!(meter.per_s(), Some(10.0));
        for second in 11..=20 {
            meter.update(second * 1_000_000, 100);
        }
        assert_eq!(meter.per_s(), Some(0.0));
    }

    #[test]
    fn what_was_on_the_line_before_is_no_error() {
        let mut link = Link::default();
        for frame in [Frame::Broken, Frame::Unknown, Frame::Good, Frame::Broken] {
            link.note(frame);
        }
        assert_eq!((link.frames, link.broken, link.unknown), (1, 1, 0));
        link.connected();
        link.note(Frame::Broken);
        link.note(Frame::Good);
        assert_eq!((link.frames, link.broken), (2, 1));
    }
}
