//! Local monotonic time to UTC.
//!
//! The board's clock counts microseconds since power-up. A pulse-per-second (PPS) edge says when a
//! UTC second begins but not which; a labelled sentence ($GPRMC, $CATMQ, $CACLK) says which, but
//! comes late. Together they give UTC to the microsecond; a label alone gives it coarsely.
//!
//! One odd label is ignored; [`CONSISTENT_LABELS`] in a row that agree with each other replace the
//! present time, forwards or backwards: so a leap second, a receiver that corrects its date (GPS
//! week roll-over) or a wrong first fix heal, and a single corrupt sentence does no harm. Differences of times of day
//! ([`day_difference_us`]) do not depend on the date at all.

use backseat_wire::calendar::DAY_US;
use backseat_wire::hostlink::Oscillator;

/// Time between two steps, µs.
pub const STEP_US: u64 = 100_000;
/// Labels in a row, agreeing with each other, that replace the present time.
const CONSISTENT_LABELS: u8 = 3;
/// How far an edge may lie from the second it is expected at, µs: twice what a 50 ppm crystal
/// drifts in [`EDGE_GAP_US`] ...
const EDGE_TOLERANCE_US: i64 = 100_000;
/// ... and after a longer gap without edges, when only half a second would be ambiguous.
const EDGE_TOLERANCE_GAP_US: i64 = 400_000;
const EDGE_GAP_US: u64 = 1_000_000_000;
/// How old an edge may be to be used with a label, µs.
const EDGE_AGE_US: i64 = 10_000_000;
/// A coarse label is uncertain by its latency; it may differ this much before it counts as odd, µs.
const COARSE_TOLERANCE_US: i64 = 600_000;
/// The internal oscillator, 1 %, drifts by 30 ms since an edge of this age, µs: at 2 m/s 6 cm of the way that bridges a
/// packet's start and its time of arrival.
const INTERNAL_EDGE_AGE_US: u64 = 3_000_000;
const SECOND_US: i64 = 1_000_000;

/// UTC against local time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UtcClock {
    /// UTC minus local time, µs.
    offset_us: Option<i64>,
    /// The offset rests on an edge.
    pub(crate) fine: bool,
    /// The last PPS edge, local time, µs.
    pub(crate) last_edge_us: Option<u64>,
    /// PPS edges seen.
    pub(crate) edges: u32,
    /// The last edge or label that the fine offset rests on, local µs.
    fine_us: u64,
    /// Offset proposed by labels that disagree with the present one, and how many in a row.
    proposal: Option<(i64, u8)>,
    /// UTC minus local time from before a reset, to less than half a second, until an edge makes
    /// it fine or a label replaces it.
    resumed_us: Option<i64>,
    /// Labels and edges that did not fit.
    pub(crate) odd: u32,
    /// What counts local time.
    pub(crate) oscillator: Oscillator,
}

impl UtcClock {
    /// Knows nothing of UTC.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            offset_us: None,
            fine: false,
            last_edge_us: None,
            edges: 0,
            fine_us: 0,
            proposal: None,
            resumed_us: None,
            odd: 0,
            oscillator: Oscillator::Crystal,
        }
    }

    /// Forgets UTC; local time is counted by what counted it before.
    pub fn restart(&mut self) {
        *self = Self { oscillator: self.oscillator, ..Self::new() };
    }

    /// Local time is counted by this from now on.
    pub fn set_oscillator(&mut self, oscillator: Oscillator) {
        self.oscillator = oscillator;
    }

    /// Whether local time is good enough for one-way ranges: it is counted by a crystal, or pulse edges discipline it.
    pub fn carries_ranges(&self, local_us: u64) -> bool {
        match self.oscillator {
            Oscillator::Crystal => true,
            Oscillator::Internal => self.fine && local_us.saturating_sub(self.fine_us) <= INTERNAL_EDGE_AGE_US,
        }
    }

    /// A clock that knows UTC at a local time from elsewhere, to the microsecond.
    #[must_use]
    pub fn synchronised(local_us: u64, utc_us: u64) -> Self {
        let offset_us = utc_us.checked_signed_diff(local_us);
        Self { offset_us, fine: offset_us.is_some(), fine_us: local_us, ..Self::new() }
    }

    /// UTC at a local time, µs since 1970; `None` while unknown.
    pub fn utc_us(&self, local_us: u64) -> Option<u64> {
        local_us.checked_add_signed(self.offset_us?)
    }

    /// Local time of a UTC time, µs; `None` while unknown or before power-up.
    pub fn local_us(&self, utc_us: u64) -> Option<u64> {
        utc_us.checked_add_signed(self.offset_us?.checked_neg()?)
    }

    /// Local time 0 was about `utc_us`, to less than half a second: the next edge says exactly.
    pub fn resume(&mut self, utc_us: u64) {
        self.resumed_us = i64::try_from(utc_us).ok();
    }

    /// A PPS edge. It refines a fine clock; a coarse one becomes fine with the next label.
    pub fn edge(&mut self, local_us: u64) {
        self.last_edge_us = Some(local_us);
        self.edges = self.edges.saturating_add(1);
        if let (None, Some(resumed_us), Ok(edge_us)) = (self.offset_us, self.resumed_us.take(), i64::try_from(local_us))
        {
            let utc_s = edge_us.saturating_add(resumed_us).saturating_add(SECOND_US / 2).div_euclid(SECOND_US);
            self.offset_us = utc_s.saturating_mul(SECOND_US).checked_sub(edge_us);
            self.fine = self.offset_us.is_some();
            self.fine_us = local_us;
            return;
        }
        let (true, Some(offset_us), Some(utc_us)) = (self.fine, self.offset_us, self.utc_us(local_us)) else { return };
        let past_us = (utc_us % 1_000_000) as i64;
        let error_us = if past_us > SECOND_US / 2 { past_us - SECOND_US } else { past_us };
        let gap = local_us.saturating_sub(self.fine_us) > EDGE_GAP_US;
        if error_us.abs() <= if gap { EDGE_TOLERANCE_GAP_US } else { EDGE_TOLERANCE_US } {
            self.offset_us = Some(offset_us.saturating_sub(error_us));
            self.fine_us = local_us;
        } else {
            self.odd = self.odd.saturating_add(1);
        }
    }

    /// A sentence that says `utc_us` was received at `local_us`, about `latency_us` after that time.
    pub fn label(&mut self, local_us: u64, utc_us: u64, latency_us: u64) {
        let Ok(utc_us) = i64::try_from(utc_us) else { return };
        let Ok(valid_us) = i64::try_from(local_us.saturating_sub(latency_us)) else { return };
        // The second of the label began at the edge nearest to where its latency puts it.
        let edge_us = self.last_edge_us.and_then(|edge_us| i64::try_from(edge_us).ok());
        let edge_us = edge_us.filter(|edge_us| (valid_us - edge_us).abs() < EDGE_AGE_US).map(|edge_us| {
            let seconds = (valid_us - edge_us + SECOND_US / 2).div_euclid(SECOND_US);
            edge_us.saturating_add(seconds * SECOND_US)
        });
        let (reference_us, second_us, fine) = match edge_us {
            Some(edge_us) => (edge_us, utc_us.div_euclid(SECOND_US).saturating_mul(SECOND_US), true),
            None => (valid_us, utc_us, false),
        };
        let Some(offset_us) = second_us.checked_sub(reference_us) else { return };
        let tolerance_us = if fine && self.fine { EDGE_TOLERANCE_US } else { COARSE_TOLERANCE_US };
        let fits = self.offset_us.is_none_or(|us| offset_us.saturating_sub(us).saturating_abs() <= tolerance_us);
        if fits {
            self.proposal = None;
            if fine || !self.fine {
                self.adopt(local_us, offset_us, fine);
            }
            return;
        }
        self.odd = self.odd.saturating_add(1);
        let count = match self.proposal {
            Some((us, count)) if offset_us.saturating_sub(us).saturating_abs() <= COARSE_TOLERANCE_US => count + 1,
            _ => 1,
        };
        self.proposal = Some((offset_us, count));
        if count >= CONSISTENT_LABELS {
            self.proposal = None;
            self.adopt(local_us, offset_us, fine);
        }
    }

    fn adopt(&mut self, local_us: u64, offset_us: i64, fine: bool) {
        self.offset_us = Some(offset_us);
        self.fine = fine;
        if fine {
            self.fine_us = local_us;
        }
    }
}

/// Seconds as whole microseconds; negative and NaN give 0.
pub fn micros(seconds: f64) -> u64 {
    libm::round(seconds * 1e6) as u64
}

/// a − b as times of day, in (−12 h, 12 h], µs: right whatever the dates say.
pub fn day_difference_us(a_us: u64, b_us: u64) -> i64 {
    // both remainders are below a day, so nothing overflows
    let difference_us = (a_us % DAY_US) as i64 - (b_us % DAY_US) as i64;
    let day_us = DAY_US as i64;
    if difference_us > day_us / 2 {
        difference_us - day_us
    } else if difference_us <= -day_us / 2 {
        difference_us + day_us
    } else {
        difference_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_US: u64 = 1_000_000;
    const NOON_US: u64 = 1_795_176_000 * SECOND_US; // 2026-11-20 12:00:00 UTC

    fn run(clock: &mut UtcClock, from_s: u64, seconds: u64, utc_us: u64) {
        for s in 0..seconds {
            let edge_us = (from_s + s) * 1_000_000 + 250_000;
            clock.edge(edge_us);
            clock.label(edge_us + 400_000, utc_us + s * SECOND_US, 400_000);
        }
    }

    #[test]
    fn edges_and_labels_give_utc_to_the_microsecond() {
        let mut clock = UtcClock::new();
        assert_eq!(clock.utc_us(0), None);
        run(&mut clock, 10, 3, NOON_US);
        assert!(clock.fine);
        assert_eq!(clock.utc_us(12_250_000), Some(NOON_US + 2 * SECOND_US));
        assert_eq!(clock.local_us(NOON_US + 5 * SECOND_US), Some(15_250_000));
    }

    #[test]
    fn without_edges_the_label_and_its_latency_count() {
        let mut clock = UtcClock::new();
        clock.label(5_300_000, NOON_US, 300_000);
        assert!(!clock.fine);
        assert_eq!(clock.utc_us(5_000_000), Some(NOON_US));
    }

    #[test]
    fn edges_alone_carry_on_through_a_dive_and_follow_the_crystal() {
        let mut clock = UtcClock::new();
        run(&mut clock, 10, 3, NOON_US);
        // a crystal 20 ppm slow: edges come 999 980 µs apart for an hour
        let mut edge_us = 12_250_000;
        for _ in 0..3600 {
            edge_us += 999_980;
            clock.edge(edge_us);
        }
        assert_eq!(clock.utc_us(edge_us), Some(NOON_US + 3602 * SECOND_US));
    }

    #[test]
    fn edges_that_come_back_after_an_hour_are_taken_up() {
        let mut clock = UtcClock::new();
        run(&mut clock, 10, 3, NOON_US);
        // a crystal 50 ppm fast is 180 ms ahead by now
        let edge_us = 12_250_000 + 3_600_180_000;
        clock.edge(edge_us);
        assert_eq!(clock.utc_us(edge_us), Some(NOON_US + 3602 * SECOND_US));
    }

    #[test]
    fn after_a_reset_an_edge_brings_utc_back() {
        // the truth: local time 0 was 0.2 s past noon; resumed 0.4 s early and late
        for error_us in [-400_000, 0, 400_000_i64] {
            let mut clock = UtcClock::new();
            clock.resume((NOON_US + 200_000).saturating_add_signed(error_us));
            assert_eq!(clock.utc_us(700_000), None);
            clock.edge(800_000);
            assert!(clock.fine);
            assert_eq!(clock.utc_us(800_000), Some(NOON_US + SECOND_US), "{error_us}");
        }
        // a label that comes first is worth more
        let mut clock = UtcClock::new();
        clock.resume(NOON_US + 5 * SECOND_US);
        clock.label(500_000, NOON_US, 400_000);
        clock.edge(1_100_000);
        assert_eq!(clock.utc_us(1_100_000), Some(NOON_US + SECOND_US));
    }

    #[test]
    fn one_odd_label_is_ignored_and_three_heal() {
        let mut clock = UtcClock::new();
        run(&mut clock, 10, 3, NOON_US);
        clock.label(12_600_000, NOON_US + 77 * SECOND_US, 400_000);
        assert_eq!(clock.utc_us(12_250_000), Some(NOON_US + 2 * SECOND_US));
        // leap second: labels repeat a second, so UTC falls back by one
        run(&mut clock, 13, 3, NOON_US + 2 * SECOND_US);
        assert_eq!(clock.utc_us(15_250_000), Some(NOON_US + 4 * SECOND_US));
        // receiver notices its week roll-over: 1024 weeks back
        let weeks_us = 1024 * 7 * DAY_US;
        run(&mut clock, 16, 3, NOON_US + 5 * SECOND_US - weeks_us);
        assert_eq!(clock.utc_us(18_250_000), Some(NOON_US + 7 * SECOND_US - weeks_us));
        assert!(clock.odd > 0);
    }

    #[test]
    fn the_internal_oscillator_carries_ranges_on_edges_alone() {
        let mut clock = UtcClock::new();
        assert!(clock.carries_ranges(0), "a crystal");
        clock.set_oscillator(Oscillator::Internal);
        assert!(!clock.carries_ranges(0));
        run(&mut clock, 10, 3, NOON_US);
        assert!(clock.carries_ranges(15_000_000) && !clock.carries_ranges(16_000_000));
        clock.restart();
        assert!(clock.oscillator == Oscillator::Internal && !clock.carries_ranges(15_000_000));
    }

    #[test]
    fn spurious_edges_do_not_move_a_fine_clock() {
        let mut clock = UtcClock::new();
        run(&mut clock, 10, 3, NOON_US);
        clock.edge(12_700_000);
        assert_eq!(clock.utc_us(12_250_000), Some(NOON_US + 2 * SECOND_US));
    }

    #[test]
    fn day_differences_cross_midnight_and_ignore_the_date() {
        let midnight_us = 1_795_219_200 * SECOND_US;
        assert_eq!(day_difference_us(midnight_us + 5, midnight_us - 7), 12);
        assert_eq!(day_difference_us(midnight_us - 7, midnight_us + 5), -12);
        assert_eq!(day_difference_us(midnight_us + 400 * DAY_US + 5, midnight_us), 5);
    }

    #[test]
    fn absurd_times_are_survived() {
        let mut clock = UtcClock::new();
        for (local_us, utc_us) in [(0, 0), (u64::MAX, u64::MAX), (1, u64::MAX / 2), (u64::MAX / 2, 1), (5, 0)] {
            clock.edge(local_us);
            clock.label(local_us, utc_us, u64::MAX);
            clock.label(local_us, utc_us, 0);
            let _ = (clock.utc_us(local_us), clock.local_us(utc_us), day_difference_us(utc_us, local_us));
        }
    }
}
