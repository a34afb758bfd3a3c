//! The restart record: written to memory that survives a reset, every step, and read at start.
//!
//! Two slots are written in turn, so that a reset in the middle of a write leaves the other one.
//! Times are *powered* time: board time, carried on across resets.

use backseat_core::dynamics::VehicleParameters;
use backseat_wire::hostlink::{CRC, Crash, ResetCause, Restart};
use serde::{Deserialize, Serialize};

/// Bytes of a record, a multiple of the word of any backup memory.
pub const RECORD_BYTES: usize = 120;
/// So many resets ...
pub const SAFE_AFTER: usize = 3;
/// ... within this time, µs, and the board does nothing but keep still.
pub const SAFE_WITHIN_US: u64 = 600_000_000;

/// Layout of the record; a record of another firmware is not read.
const VERSION: u16 = 3;

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
    #[serde(with = "pair")]
    pub position_m: [f64; 2],
    /// One sigma, √(σx² + σy²), m.
    pub sigma_m: f64,
    /// North and east, over ground, m/s.
    #[serde(with = "pair")]
    pub velocity_mps: [f64; 2],
    /// Time from here to the board's new time 0, µs.
    pub down_us: u64,
}

/// The same bytes as an array's. Where the compiler builds for size it does not see that reading them cannot panic, of an
/// array never, of these when they are read in place.
mod pair {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>([a, b]: &[f64; 2], serializer: S) -> Result<S::Ok, S::Error> {
        (a, b).serialize(serializer)
    }

    #[inline(always)]
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f64; 2], D::Error> {
        <(f64, f64)>::deserialize(deserializer).map(|(a, b)| [a, b])
    }
}

/// The same after the vehicle has coasted without a propeller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coasted {
    /// North and east, m.
    pub position_m: [f64; 2],
    /// One sigma, √(σx² + σy²), m.
    pub sigma_m: f64,
    /// North and east, over ground, m/s.
    pub velocity_mps: [f64; 2],
    /// One sigma of the speed, m/s: what it has lost by now.
    pub speed_sigma_mps: f64,
}

/// State that a board needs after a reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RestartRecord {
    /// Counts the records; the larger count is the newer slot.
    pub sequence: u32,
    /// Powered time of the record, µs.
    pub powered_us: u64,
    /// A mission is under way, or the frontseat has not acknowledged its end.
    pub under_way: bool,
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

/// From a record's step to the board's new time 0, µs: in the middle for a watchdog of 0.6 s that is fed up to 0.3 s
/// after a step, 0.57 to 0.93 s, its clock's tolerance included.
const WATCHDOG_DOWN_US: u64 = 750_000;
/// The same for a fault, which resets the board at once, µs: half a step and the start.
const FAULT_DOWN_US: u64 = 100_000;
/// The same where nobody knows how long the board was off, µs: drag halves the speed of a torpedo in some ten seconds.
const UNKNOWN_DOWN_US: u64 = 10_000_000;

/// Way in which quadratic drag slows a coasting vehicle by the factor e, m: m₁₁ / X_uu, without the fins' share of the
/// drag (a tenth).
#[must_use]
pub fn coast_m(vehicle: &VehicleParameters) -> f64 {
    vehicle.m_diag[0] / vehicle.quadratic_diag[0]
}

impl Navigation {
    /// After the board has run for `now_us` since its reset, of a vehicle that coasts `coast_m`. By drag that grows with
    /// u², u = u₀ / (1 + u₀ t / L).
    #[must_use]
    pub fn coasted(&self, now_us: u64, coast_m: f64) -> Coasted {
        let time_s = 1e-6 * self.down_us.saturating_add(now_us) as f64;
        let [north_mps, east_mps] = self.velocity_mps;
        let speed_mps = libm::hypot(north_mps, east_mps);
        let share = speed_mps * time_s / coast_m;
        // the time in which it would have come as far without drag; a vehicle at rest stays
        let way_s = if share > 1e-9 { time_s * libm::log1p(share) / share } else { time_s };
        let slower = 1.0 + share;
        let [north_m, east_m] = self.position_m;
        Coasted {
            position_m: [north_m + north_mps * way_s, east_m + east_mps * way_s],
            // the speed before the reset may have gone on in any direction
            sigma_m: libm::hypot(self.sigma_m, speed_mps * time_s),
            velocity_mps: [north_mps / slower, east_mps / slower],
            speed_sigma_mps: speed_mps * (1.0 - 1.0 / slower),
        }
    }
}

impl RestartRecord {
    /// All that is known where the supply was lost under way.
    #[must_use]
    pub fn lost_under_way() -> Self {
        Self { under_way: true, ..Self::default() }
    }

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
        // by hand: in postcard's own the compiler does not always see that eight bytes of a number are eight
        let ((version, record), rest) = postcard::take_from_bytes::<(u16, Self)>(bytes).ok()?;
        let covered = bytes.get(..bytes.len().saturating_sub(rest.len()))?;
        if u32::from_le_bytes(*rest.first_chunk()?) != CRC.checksum(covered) {
            return None;
        }
        let finite = |n: &Navigation| {
            n.position_m.iter().chain(&n.velocity_mps).all(|v| v.is_finite())
                && n.sigma_m.is_finite()
                && n.sigma_m >= 0.0
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
        // nobody presses the button or programs under way: the pin has caught a disturbance
        let is_fault = is_fault(cause) || last.is_some_and(|last| last.under_way);
        let (true, Some(last)) = (is_fault, last) else {
            // Whoever switches the supply, presses the button or programs begins anew; the sequence goes on,
            // so that an old record does not win later.
            let sequence = last.map_or(0, |last| last.sequence.wrapping_add(1));
            let mut new = Self { sequence, under_way: is_fault, ..Self::default() };
            if is_fault {
                new.resets.note(0);
                return (Response::Resume { navigation: None, utc_us: None }, new);
            }
            return (Response::Fresh, new);
        };
        // until the frontseat has acknowledged the stop: the next reset may come before it
        let mut new = Self { sequence: last.sequence.wrapping_add(1), under_way: true, ..*last };
        new.resets.note(last.powered_us);
        if new.resets.too_many() {
            return (Response::Safe, new);
        }
        let down_us = match cause {
            ResetCause::Watchdog => Some(WATCHDOG_DOWN_US),
            ResetCause::Fault => Some(FAULT_DOWN_US),
            _ => None,
        };
        let utc_us = last.utc_us.zip(down_us).map(|(us, down_us)| us.saturating_add(down_us));
        let down_us = down_us.unwrap_or(UNKNOWN_DOWN_US);
        let navigation = last.navigation.map(|before| Navigation { down_us, ..before });
        (Response::Resume { navigation, utc_us }, new)
    }

    /// As the host link reports it.
    #[must_use]
    pub fn report(&self, cause: ResetCause, crash: Option<Crash>) -> Restart {
        Restart { cause, resets: self.resets.count, safe: self.resets.too_many(), crash }
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
        let navigation =
            Navigation { position_m: [12.5, -700.25], sigma_m: 4.0, velocity_mps: [1.2, -0.5], down_us: 0 };
        let navigation = Some(navigation);
        RestartRecord { sequence, powered_us, navigation, ..RestartRecord::default() }
    }

    #[test]
    fn the_longest_record_fits_and_comes_back() {
        let longest = RestartRecord {
            sequence: u32::MAX,
            powered_us: u64::MAX,
            under_way: true,
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
        bad.navigation = bad.navigation.map(|good| Navigation { position_m: [f64::NAN, 0.0], ..good });
        assert_eq!(RestartRecord::decode(&bad.encode()), None);
    }

    /// Sigma: 3-4-5, 3 m before, 1 m/s for 4 s. The way is the integral of the speed, here by the trapezoidal rule.
    #[test]
    fn val_the_vehicle_coasts() {
        const L: f64 = 8.0;
        let before = Navigation { position_m: [7.0, 0.0], sigma_m: 3.0, velocity_mps: [0.6, 0.8], down_us: 1_000_000 };
        let after = before.coasted(3_000_000, L);
        assert!((after.sigma_m - 5.0).abs() < 1e-12);
        let speed_mps = |at: &Coasted| libm::hypot(at.velocity_mps[0], at.velocity_mps[1]);
        let at = |ms: u64| before.coasted(1_000 * ms, L);
        let way_m: f64 = (0..3_000).map(|ms| 0.5e-3 * (speed_mps(&at(ms)) + speed_mps(&at(ms + 1)))).sum();
        let first = at(0);
        let [north_m, east_m] = [0, 1].map(|i| after.position_m[i] - first.position_m[i]);
        assert!((libm::hypot(north_m, east_m) - way_m).abs() < 1e-6, "{way_m} m");
        // du/dt = -u² / L
        let slope = (speed_mps(&at(1_001)) - speed_mps(&at(999))) / 2e-3;
        let speed = speed_mps(&at(1_000));
        assert!((slope + speed * speed / L).abs() < 1e-6, "{slope} m/s²");
        // half of its speed is left after L / u₀
        let half = Navigation { down_us: 8_000_000, ..before }.coasted(0, L);
        assert!((half.speed_sigma_mps - 0.5).abs() < 1e-12 && (speed_mps(&half) - 0.5).abs() < 1e-12);
        let rest = Navigation { velocity_mps: [0.0; 2], ..before }.coasted(0, L);
        assert_eq!((rest.position_m, rest.sigma_m, rest.speed_sigma_mps), ([7.0, 0.0], 3.0, 0.0));
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
    fn utc_outlasts_a_reset_of_known_length() {
        let last = RestartRecord { utc_us: Some(5_000_000), ..record(0, 0) };
        let causes = [
            (ResetCause::Watchdog, Some(5_750_000)),
            (ResetCause::Fault, Some(5_100_000)),
            (ResetCause::BrownOut, None),
        ];
        for (cause, expected_us) in causes {
            let (response, _) = RestartRecord::respond(cause, Some(&last));
            let Response::Resume { navigation, utc_us } = response else { panic!("{response:?}") };
            assert_eq!((utc_us, navigation.map(|n| n.sigma_m)), (expected_us, Some(4.0)));
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
        let navigation = record(0, 0).navigation.map(|n| Navigation { down_us: WATCHDOG_DOWN_US, ..n });
        let resume = Response::Resume { navigation, utc_us: None };
        assert_eq!(resets_at(&[1, 5, 11]).0, [resume, resume, Response::Safe]);
        assert_eq!(resets_at(&[1, 5, 12]).0, [resume; 3]);
        let (responses, last) = resets_at(&[1, 5, 12, 14]);
        assert_eq!(responses, [resume, resume, resume, Response::Safe]);
        let crash = Some(Crash::at("src/board/main.rs", 7));
        let reported = last.report(ResetCause::Watchdog, crash);
        assert_eq!(reported, Restart { cause: ResetCause::Watchdog, resets: 4, safe: true, crash });
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

    /// Under way neither the pin nor a programmer begins anew.
    #[test]
    fn any_reset_under_way_stops_and_carries_on() {
        let last = RestartRecord { under_way: true, ..record(7, MINUTE_US) };
        for cause in [ResetCause::PowerOn, ResetCause::Pin, ResetCause::Software] {
            let (response, new) = RestartRecord::respond(cause, Some(&last));
            let navigation = last.navigation.map(|n| Navigation { down_us: UNKNOWN_DOWN_US, ..n });
            assert_eq!(response, Response::Resume { navigation, utc_us: None }, "{cause:?}");
            assert_eq!((new.resets.count, new.under_way), (1, true));
            // it bounces: the second comes before the frontseat has heard of the first
            let (again, _) = RestartRecord::respond(cause, Some(&new));
            assert!(matches!(again, Response::Resume { .. }), "{cause:?}: {again:?}");
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
