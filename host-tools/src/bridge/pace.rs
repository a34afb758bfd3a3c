//! How many telemetry records a second are published.

use backseat_wire::hostlink::{Mode, Telemetry};
use std::str::FromStr;

/// Records per second that are let through at most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    period_us: u64,
}

impl FromStr for Rate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let hz: f64 = text.parse().ok().filter(|hz| (0.01..=10.0).contains(hz)).ok_or("expected 0.01 to 10, Hz")?;
        Ok(Self { period_us: (1e6 / hz) as u64 })
    }
}

/// Lets records through by the board's time: the first one that is due, and each in which the mode changes.
pub struct Pace {
    rate: Option<Rate>,
    due_us: u64,
    last: Option<(u64, Mode)>,
}

impl Pace {
    /// Without a rate, everything.
    pub fn new(rate: Option<Rate>) -> Self {
        Self { rate, due_us: 0, last: None }
    }

    /// Whether a record is published.
    pub fn lets(&mut self, telemetry: &Telemetry) -> bool {
        let Some(Rate { period_us }) = self.rate else { return true };
        let now = (telemetry.time_us, telemetry.mode);
        let is_news = self.last.is_none_or(|(time_us, mode)| now.0 < time_us || now.1 != mode);
        self.last = Some(now);
        if !is_news && now.0 < self.due_us {
            return false;
        }
        // the mean rate is kept where records come at no multiple of the period
        let next_us = self.due_us.min(now.0).saturating_add(period_us);
        self.due_us = if next_us > now.0 { next_us } else { now.0.saturating_add(period_us) };
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bridge::tests::telemetry;

    /// How many of `count` records at 10 Hz pass.
    fn passed(pace: &mut Pace, from_us: u64, count: u64, mode: Mode) -> usize {
        let record = |i| Telemetry { time_us: from_us + i * 100_000, mode, ..telemetry() };
        (0..count).filter(|i| pace.lets(&record(*i))).count()
    }

    #[test]
    fn a_rate_is_kept_in_the_mean() {
        for (hz, expected) in [("10", 600), ("3", 180), ("1", 60), ("0.1", 6)] {
            let mut pace = Pace::new(Some(hz.parse().unwrap()));
            assert_eq!(passed(&mut pace, 0, 600, Mode::Navigating), expected, "{hz}");
        }
        assert_eq!(passed(&mut Pace::new(None), 0, 600, Mode::Navigating), 600);
    }

    #[test]
    fn a_change_of_mode_and_a_restart_pass_at_once() {
        let mut pace = Pace::new(Some("0.1".parse().unwrap()));
        assert_eq!(passed(&mut pace, 50_000_000, 20, Mode::Navigating), 1);
        assert_eq!(passed(&mut pace, 52_000_000, 20, Mode::Lost), 1);
        assert_eq!(passed(&mut pace, 0, 20, Mode::Lost), 1);
    }

    #[test]
    fn a_rate_is_a_number_of_hertz() {
        for wrong in ["", "0", "-1", "11", "nan", "1 Hz"] {
            assert!(wrong.parse::<Rate>().is_err(), "{wrong}");
        }
    }
}
