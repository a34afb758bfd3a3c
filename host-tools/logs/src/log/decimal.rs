//! Seconds as text and whole microseconds.

/// Latest time a log may carry: later than that a double no longer resolves 1 µs.
pub(crate) const MAX_SECONDS: f64 = 4.0e9;

/// Seconds to whole microseconds. Exact for decimals of up to six places below [`MAX_SECONDS`]: the
/// double nearest to such a decimal is less than 0.5 µs away from it.
pub(super) fn seconds_to_us(seconds: f64) -> u64 {
    (seconds * 1e6).round() as u64
}

/// Appends seconds with as many decimals as needed (none to six).
pub(super) fn push_seconds(line: &mut Vec<u8>, time_us: u64) {
    use std::io::Write;
    let (seconds, fraction) = (time_us / 1_000_000, time_us % 1_000_000);
    // Writing to a Vec does not fail.
    let _ = write!(line, "{seconds}");
    if fraction > 0 {
        let _ = write!(line, ".{fraction:06}");
        while line.last() == Some(&b'0') {
            line.pop();
        }
    }
}

/// Appends a number rounded to `decimals` places, without trailing zeros.
pub(super) fn push_number(line: &mut Vec<u8>, value: f64, decimals: usize) {
    use std::io::Write;
    let start = line.len();
    let _ = write!(line, "{value:.decimals$}");
    if decimals > 0 {
        while line.last() == Some(&b'0') {
            line.pop();
        }
        if line.last() == Some(&b'.') {
            line.pop();
        }
    }
    if &line[start..] == b"-0" {
        line.truncate(start);
        line.push(b'0');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn microseconds_are_exact() {
        for time_us in [0, 1, 100_000, 290_000, 10_900_000_000, 1_700_000_000_123_457, 3_999_999_999_999_999] {
            let mut text = Vec::new();
            push_seconds(&mut text, time_us);
            let seconds: f64 = std::str::from_utf8(&text).unwrap().parse().unwrap();
            assert_eq!(seconds_to_us(seconds), time_us);
        }
    }

    #[test]
    fn numbers_without_needless_digits() {
        let text = |value, decimals| {
            let mut line = Vec::new();
            push_number(&mut line, value, decimals);
            String::from_utf8(line).unwrap()
        };
        assert_eq!(text(1.5, 4), "1.5");
        assert_eq!(text(-0.000_01, 4), "0");
        assert_eq!(text(1200.0, 3), "1200");
        assert_eq!(text(100.0, 0), "100");
        assert_eq!(text(-81.08312, 4), "-81.0831");
    }
}
