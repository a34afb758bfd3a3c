//! The restart record: written to memory that survives a reset, every step, and read at start.
//!
//! Two slots are written in turn, so that a reset in the middle of a write leaves the other one.
//! Times are *powered* time: board time, carried on across resets.

use backseat_wire::hostlink::{CRC, ResetCause, Restart};
use serde::{Deserialize, Serialize};

/// Bytes of a record, a multiple of the word of any backup memory.
pub const RECORD_BYTES: usize = 112;
/// So many resets ...
pub const SAFE_AFTER: usize = 3;
/// ... within this time, µs, and the board does nothing but keep still.
pub const SAFE_WITHIN_US: u64 = 600_000_000;

/// Layout of the record; a record of another firmware is not read.
const VERSION: u16 = 1;

/// Resets by a fault since the supply was switched on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ResetHistory {
    /// How many.
    pub count: u32,
    /// The last ones, newest first, powered time, µs.
    pub times_us: [Option<u64>; SAFE_AFTER],
}

/// Navigation state to continue from; attitude and depth come from the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Navigation {
    /// North and east, m.
    pub position_m: [f64; 2],
    /// One sigma, √(σx² + σy²), m.
    pub sigma_m: f64,
    /// Speed over ground, m/s.
    pub speed_mps: f64,
}

/// State that a board needs after a reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RestartRecord {
    /// Counts the records; the larger count is the newer slot.
    pub sequence: u32,
    /// Powered time of the record, µs.
    pub powered_us: u64,
    /// Resets so far.
    pub resets: ResetHistory,
    /// `None` while the position is not known.
    pub navigation: Option<Navigation>,
    /// UTC of the record, µs since 1970; `None` unless it rests on pulse edges.
    pub utc_us: Option<u64>,
}

/// How to start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Response {
    /// Begin as new.
    Fresh,
    /// Neutral fins and stop; navigation carries on from here as degraded.
    Resume {
        /// Position before the reset.
        navigation: Option<Navigation>,
        /// UTC of the board's new time 0, to less than half a second, µs since 1970.
        utc_us: Option<u64>,
    },
    /// Neutral fins and stop, until the operator allows more.
    Safe,
}

/// From a record's step to the board's new time 0 at the longest, µs: the watchdog and the start.
const DOWN_US: u64 = 1_000_000;
/// The same in the middle for a watchdog of 0.6 s that is fed up to 0.3 s after a step: 0.57 to
/// 0.93 s, its clock's tolerance included.
const WATCHDOG_DOWN_US: u64 = 750_000;

impl Navigation {
    /// Sigma of one axis after the board has run for `now_us` since its reset, m: the speed before
    /// the reset may have gone on in any direction.
    #[must_use]
    pub fn sigma_after(&self, now_us: u64) -> f64 {
        let drift_m = self.speed_mps * (DOWN_US.saturating_add(now_us)) as f64 * 1e-6;
        libm::sqrt(self.sigma_m * self.sigma_m + drift_m * drift_m)
    }
}

impl RestartRecord {
    /// The record as bytes, its CRC included.
    #[must_use]
    pub fn encode(&self) -> [u8; RECORD_BYTES] {
        let mut bytes = [0; RECORD_BYTES];
        // the longest record fits: see the test
        if postcard::to_slice_crc32(&(VERSION, self), &mut bytes, CRC.digest()).is_err() {
            bytes = [0; RECORD_BYTES];
        }
        bytes
    }

    /// The record, unless its bytes were cut off, corrupted, or never written.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let ((version, record), _) = postcard::take_from_bytes_crc32::<(u16, Self)>(bytes, CRC.digest()).ok()?;
        let finite = |n: &Navigation| {
            n.position_m.iter().all(|v| v.is_finite())
                && n.sigma_m.is_finite()
                && n.sigma_m >= 0.0
                && n.speed_mps.is_finite()
        };
        (version == VERSION && record.navigation.as_ref().is_none_or(finite)).then_some(record)
    }

    /// The slot of this record; the one before it is in the other.
    #[must_use]
    pub fn slot(&self) -> usize {
        usize::from(!self.sequence.is_multiple_of(2))
    }

    /// What to do after a start by `cause` when this is the record before it (or none was found);
    /// the record to carry on with, which is to be written at once, so that a board that never
    /// reaches its first step counts its resets too.
    #[must_use]
    pub fn respond(cause: ResetCause, last: Option<&Self>) -> (Response, Self) {
        let (true, Some(last)) = (is_fault(cause), last) else {
            // Whoever switches the supply, presses the button or programs begins anew; the sequence goes on,
            // so that an old record does not win later.
            let sequence = last.map_or(0, |last| last.sequence.wrapping_add(1));
            let mut new = Self { sequence, ..Self::default() };
            if is_fault(cause) {
                new.resets.note(0);
                return (Response::Resume { navigation: None, utc_us: None }, new);
            }
            return (Response::Fresh, new);
        };
        let mut new = Self { sequence: last.sequence.wrapping_add(1), ..*last };
        new.resets.note(last.powered_us);
        if new.resets.too_many() {
            return (Response::Safe, new);
        }
        // the duration of a brown-out is unknown
        let utc_us = last.utc_us.filter(|_| cause == ResetCause::Watchdog);
        let utc_us = utc_us.map(|us| us.saturating_add(WATCHDOG_DOWN_US));
        (Response::Resume { navigation: last.navigation, utc_us }, new)
    }

    /// As the host link reports it.
    #[must_use]
    pub fn report(&self, cause: ResetCause) -> Restart {
        Restart { cause, resets: self.resets.count, safe: self.resets.too_many() && is_fault(cause) }
    }
}

impl ResetHistory {
    fn note(&mut self, powered_us: u64) {
        self.count = self.count.saturating_add(1);
        self.times_us.rotate_right(1);
        self.times_us[0] = Some(powered_us);
    }

    /// [`SAFE_AFTER`] resets within [`SAFE_WITHIN_US`], the last one included.
    #[must_use]
    pub fn too_many(&self) -> bool {
        let [Some(newest_us), .., Some(oldest_us)] = self.times_us else { return false };
        newest_us.saturating_sub(oldest_us) <= SAFE_WITHIN_US
    }
}

/// Resets without a request.
fn is_fault(cause: ResetCause) -> bool {
    !matches!(cause, ResetCause::PowerOn | ResetCause::Pin | ResetCause::Software)
}

/// The newer of two slots' records.
#[must_use]
pub fn newest(slots: [&[u8]; 2]) -> Option<RestartRecord> {
    match slots.map(RestartRecord::decode) {
        [Some(a), Some(b)] => Some(if b.sequence.wrapping_sub(a.sequence).cast_signed() > 0 { b } else { a }),
        [a, b] => a.or(b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MINUTE_US: u64 = 60_000_000;

    fn record(sequence: u32, powered_us: u64) -> RestartRecord {
        let navigation = Some(Navigation { position_m: [12.5, -700.25], sigma_m: 4.0, speed_mps: 1.2 });
        RestartRecord { sequence, powered_us, navigation, ..RestartRecord::default() }
    }

    #[test]
    fn the_longest_record_fits_and_comes_back() {
        let longest = RestartRecord {
            sequence: u32::MAX,
            powered_us: u64::MAX,
            resets: ResetHistory { count: u32::MAX, times_us: [Some(u64::MAX); SAFE_AFTER] },
            navigation: record(0, 0).navigation,
            utc_us: Some(u64::MAX),
        };
        assert_eq!(RestartRecord::decode(&longest.encode()), Some(longest));
        assert_eq!(RestartRecord::decode(&RestartRecord::default().encode()), Some(RestartRecord::default()));
    }

    #[test]
    fn any_wrong_bit_or_missing_byte_is_noticed() {
        let bytes = record(7, MINUTE_US).encode();
        let length = RECORD_BYTES - bytes.iter().rev().take_while(|byte| **byte == 0).count();
        for bit in 0..8 * length {
            let mut bad = bytes;
            bad[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(RestartRecord::decode(&bad), None, "bit {bit}");
        }
        for cut in 0..length {
            assert_eq!(RestartRecord::decode(&bytes[..cut]), None, "{cut} bytes");
        }
        for fill in [0, 0xFF, 0xA5] {
            assert_eq!(RestartRecord::decode(&[fill; RECORD_BYTES]), None);
        }
    }

    #[test]
    fn numbers_that_are_none_are_refused() {
        let mut bad = record(1, 1);
        bad.navigation = Some(Navigation { position_m: [f64::NAN, 0.0], sigma_m: 1.0, speed_mps: 0.0 });
        assert_eq!(RestartRecord::decode(&bad.encode()), None);
    }

    /// 3-4-5: 3 m before, 1 m/s for 4 s.
    #[test]
    fn val_the_position_grows_old() {
        let navigation = Navigation { position_m: [0.0; 2], sigma_m: 3.0, speed_mps: 1.0 };
        assert_eq!(navigation.sigma_after(3_000_000), 5.0);
    }

    #[test]
    fn slots_take_turns_and_a_torn_one_leaves_the_other() {
        let mut slots = [[0; RECORD_BYTES]; 2];
        let mut last: Option<RestartRecord> = None;
        for step in 0..20 {
            let new = record(last.map_or(u32::MAX - 5, |l| l.sequence.wrapping_add(1)), step);
            let slot = new.slot();
            let bytes = new.encode();
            for torn in 0..RECORD_BYTES {
                let mut slots = slots;
                slots[slot][..torn].copy_from_slice(&bytes[..torn]);
                let found = newest([&slots[0], &slots[1]]);
                assert!(found == last || found == Some(new), "step {step}, {torn} bytes: {found:?}");
            }
            slots[slot] = bytes;
            assert_eq!(newest([&slots[0], &slots[1]]), Some(new));
            last = Some(new);
        }
    }

    #[test]
    fn power_and_button_begin_anew() {
        for cause in [ResetCause::PowerOn, ResetCause::Pin] {
            let (response, new) = RestartRecord::respond(cause, Some(&record(9, MINUTE_US)));
            assert_eq!(response, Response::Fresh);
            assert_eq!(new, RestartRecord { sequence: 10, ..RestartRecord::default() });
            assert_eq!(RestartRecord::respond(cause, None).0, Response::Fresh);
        }
    }

    #[test]
    fn utc_outlasts_the_watchdog_alone() {
        let last = RestartRecord { utc_us: Some(5_000_000), ..record(0, 0) };
        for (cause, expected_us) in [(ResetCause::Watchdog, Some(5_750_000)), (ResetCause::BrownOut, None)] {
            let (response, _) = RestartRecord::respond(cause, Some(&last));
            assert_eq!(response, Response::Resume { navigation: last.navigation, utc_us: expected_us });
        }
    }

    #[test]
    fn three_resets_in_ten_minutes_are_too_many() {
        let resets_at = |minutes: &[u64]| {
            let mut last = record(0, 0);
            let mut responses = std::vec::Vec::new();
            for minute in minutes {
                last.powered_us = minute * MINUTE_US;
                let (response, new) = RestartRecord::respond(ResetCause::Watchdog, Some(&last));
                responses.push(response);
                last = new;
            }
            (responses, last)
        };
        let resume = Response::Resume { navigation: record(0, 0).navigation, utc_us: None };
        assert_eq!(resets_at(&[1, 5, 11]).0, [resume, resume, Response::Safe]);
        assert_eq!(resets_at(&[1, 5, 12]).0, [resume; 3]);
        let (responses, last) = resets_at(&[1, 5, 12, 14]);
        assert_eq!(responses, [resume, resume, resume, Response::Safe]);
        assert_eq!(last.report(ResetCause::Watchdog), Restart { cause: ResetCause::Watchdog, resets: 4, safe: true });
    }

    /// A programmer resets by software, over and over.
    #[test]
    fn whoever_switches_on_resets_or_programs_begins_anew() {
        for cause in [ResetCause::PowerOn, ResetCause::Pin, ResetCause::Software] {
            let (response, new) = RestartRecord::respond(cause, Some(&record(7, MINUTE_US)));
            assert_eq!(
                (response, new.resets, new.sequence),
                (Response::Fresh, ResetHistory::default(), 8),
                "{cause:?}"
            );
        }
    }

    /// A board that resets before its first step has no powered time, only the history.
    #[test]
    fn a_board_that_never_steps_ends_in_safe_mode() {
        let (first, one) = RestartRecord::respond(ResetCause::Watchdog, None);
        let (second, two) = RestartRecord::respond(ResetCause::Watchdog, Some(&one));
        let (third, _) = RestartRecord::respond(ResetCause::BrownOut, Some(&two));
        let resume = Response::Resume { navigation: None, utc_us: None };
        assert_eq!([first, second, third], [resume, resume, Response::Safe]);
    }
}
