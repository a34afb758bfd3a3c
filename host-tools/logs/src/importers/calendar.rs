//! Dates and times of day as text.

use backseat_wire::calendar::Date;

/// `M/D/YYYY`, or `M/D/YY` of this century, as days since 1970-01-01.
pub(super) fn date_days(text: &str) -> Option<i64> {
    let mut parts = text.trim().split('/');
    let (month, day, year) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
    let date = Date::new(if year < 100 { 2000 + year } else { year }, month, day).ok()?;
    parts.next().is_none().then_some(date.days() as i64)
}

/// `HH:MM:SS[.ss]`, 24 h or with AM or PM, as µs since midnight.
pub(super) fn time_us(text: &str) -> Option<i64> {
    let text = text.trim();
    let (clock, noon_hours) = match text.len().checked_sub(2).and_then(|at| Some((text.get(..at)?, text.get(at..)?))) {
        Some((clock, half)) if half.eq_ignore_ascii_case("am") => (clock.trim_end(), Some(0)),
        Some((clock, half)) if half.eq_ignore_ascii_case("pm") => (clock.trim_end(), Some(12)),
        _ => (text, None),
    };
    let mut parts = clock.split(':');
    let (hours, minutes) = (parts.next()?.parse::<i64>().ok()?, parts.next()?.parse::<i64>().ok()?);
    let seconds = parts.next()?.parse::<f64>().ok()?;
    let hours = match noon_hours {
        Some(offset) if (1..=12).contains(&hours) => hours % 12 + offset,
        Some(_) => return None,
        None => hours,
    };
    let is_time = (0..24).contains(&hours) && (0..60).contains(&minutes) && (0.0..61.0).contains(&seconds);
    (is_time && parts.next().is_none()).then(|| (hours * 60 + minutes) * 60_000_000 + (seconds * 1e6).round() as i64)
}

/// `MM:SS[.s]`, as a spreadsheet shows a time of day, as µs since the hour.
pub(super) fn minutes_us(text: &str) -> Option<i64> {
    let (minutes, seconds) = text.trim().split_once(':')?;
    let (minutes, seconds) = (minutes.parse::<i64>().ok()?, seconds.parse::<f64>().ok()?);
    let is_time = (0..60).contains(&minutes) && (0.0..61.0).contains(&seconds);
    is_time.then(|| minutes * 60_000_000 + (seconds * 1e6).round() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_dates() {
        assert_eq!(date_days("1/1/1970"), Some(0));
        assert_eq!(date_days("10/7/2022"), Some(19_272)); // date -d 2022-10-07 +%s / 86400
        assert_eq!(date_days("2/29/2024"), Some(19_782));
        assert_eq!(date_days("10/7/22"), Some(19_272));
        assert_eq!(date_days("13/1/2022"), None);
        assert_eq!(date_days("2022-10-07"), None);
        assert_eq!(date_days(""), None);
    }

    #[test]
    fn times_of_day() {
        assert_eq!(time_us("00:00:01.25"), Some(1_250_000));
        assert_eq!(time_us("23:59:59"), Some(86_399_000_000));
        assert_eq!(time_us("12:00:00 AM"), Some(0));
        assert_eq!(time_us("12:30:00 PM"), Some(45_000_000_000));
        assert_eq!(time_us("1:00:00 pm"), Some(46_800_000_000));
        assert_eq!(minutes_us("17:37.3"), Some(1_057_300_000));
        assert_eq!((minutes_us("60:00.0"), minutes_us("1:17:37")), (None, None));
        for wrong in ["24:00:00", "12:60:00", "13:00:00 PM", "12:00", "x", "", "é"] {
            assert_eq!(time_us(wrong), None, "{wrong}");
        }
    }
}
