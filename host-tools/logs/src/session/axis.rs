//! One time axis for a log in which the board's clock began again: a reset, by whatever cause.
//!
//! Where both parts have UTC the second stands where UTC has it. Otherwise it goes on a step behind the first: how long
//! the board was away, its log does not know.

use super::{Event, Reader};
use crate::DataError;
use backseat_wire::hostlink::{Decoder, FromBoard, Port};
use std::path::Path;

/// Time that goes back by more has begun again; what arrives and what is sent differ by less, µs.
const AGAIN_US: u64 = 1_000_000;
/// A step, µs.
const STEP_US: u64 = 100_000;

/// A part of a log whose times go on.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Part {
    first_us: u64,
    last_us: u64,
    /// UTC less the clock, µs.
    utc_us: Option<i64>,
}

/// What is added to the times of each part.
#[derive(Debug, Default)]
pub struct Axis {
    shifts_us: Vec<i64>,
    part: usize,
    last_us: u64,
}

impl Axis {
    /// Of a log.
    ///
    /// # Errors
    /// Those of reading it.
    pub fn of(path: &Path) -> Result<Self, DataError> {
        let mut parts: Vec<Part> = Vec::new();
        let mut decoder = Decoder::new();
        for entry in Reader::open(path)? {
            let entry = entry?;
            let time_us = entry.time_us;
            let begins = parts.last().is_none_or(|part| time_us + AGAIN_US < part.last_us);
            if begins {
                parts.push(Part { first_us: time_us, last_us: time_us, utc_us: None });
            }
            let Some(part) = parts.last_mut() else { continue };
            part.last_us = part.last_us.max(time_us);
            let Event::Sent { port: Port::Host, bytes } = &entry.event else { continue };
            let mut bytes = &bytes[..];
            while let Some(frame) = decoder.feed(&mut bytes) {
                if let Ok(FromBoard::Telemetry(telemetry)) = frame.and_then(|frame| frame.message())
                    && telemetry.utc_us != 0
                {
                    part.utc_us = Some(telemetry.utc_us as i64 - time_us as i64);
                }
            }
        }
        Ok(Self { shifts_us: shifts(&parts), ..Self::default() })
    }

    /// A time of the log, in its order, on the axis.
    pub fn place(&mut self, time_us: u64) -> u64 {
        if time_us + AGAIN_US < self.last_us {
            (self.part, self.last_us) = (self.part + 1, 0);
        }
        self.last_us = self.last_us.max(time_us);
        time_us.saturating_add_signed(self.shifts_us.get(self.part).copied().unwrap_or(0))
    }
}

fn shifts(parts: &[Part]) -> Vec<i64> {
    let mut shifts_us: Vec<i64> = Vec::with_capacity(parts.len());
    for (part, before) in parts.iter().zip(std::iter::once(None).chain(parts.iter().map(Some))) {
        let shift_us = before.zip(shifts_us.last().copied()).map_or(0, |(before, shift_us)| {
            let goes_on = before.last_us as i64 + shift_us + STEP_US as i64 - part.first_us as i64;
            let by_utc = part.utc_us.zip(before.utc_us).map(|(now, then)| now - then + shift_us);
            by_utc.map_or(goes_on, |by_utc| by_utc.max(goes_on))
        });
        shifts_us.push(shift_us);
    }
    shifts_us
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 1_000_000;

    /// 150 s, then 12 s, then 20 s of a clock that began again; UTC says that the board was away for 3 s, then nothing.
    #[test]
    fn val_parts_stand_where_utc_has_them_or_go_on() {
        let utc = 1_795_176_000_000_000_i64;
        let part = |last_us, utc_us| Part { first_us: 0, last_us, utc_us };
        let parts = [
            part(150 * SECOND, Some(utc)),
            part(12 * SECOND, Some(utc + 153 * SECOND as i64)),
            part(20 * SECOND, None),
        ];
        assert_eq!(shifts(&parts), [0, 153_000_000, 165_100_000]);
        assert_eq!(shifts(&parts[..1]), [0]);
        // a clock that was set back between the parts does not turn the axis round
        let back = [parts[0], part(12 * SECOND, Some(utc))];
        assert_eq!(shifts(&back), [0, 150_100_000]);
        let mut axis = Axis { shifts_us: shifts(&parts), ..Axis::default() };
        let placed = [0, 150 * SECOND, 149_900_000, 0, 12 * SECOND, SECOND / 2].map(|time_us| axis.place(time_us));
        assert_eq!(placed, [0, 150_000_000, 149_900_000, 153_000_000, 165_000_000, 165_600_000]);
    }
}
