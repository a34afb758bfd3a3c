//! A number with its interval, as the pages print it.

use backseat_logs::stats::{mean, mean_ci95, wilson_ci95};

/// Mean and its 95 % interval to this number of digits, `1.20 (1.00 to 1.40)`.
pub fn with_interval(samples: &[f64], digits: usize) -> String {
    match (mean(samples), mean_ci95(samples)) {
        (Some(mean), Some((low, high))) => format!("{mean:.digits$} ({low:.digits$} to {high:.digits$})"),
        (Some(mean), None) => format!("{mean:.digits$}"),
        _ => String::new(),
    }
}

/// Two significant digits.
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = (1.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

/// A count out of a total.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    pub hits: usize,
    pub of: usize,
}

impl Share {
    pub fn of<T>(items: &[T], is_hit: impl Fn(&T) -> bool) -> Self {
        Self { hits: items.iter().filter(|item| is_hit(item)).count(), of: items.len() }
    }

    pub fn value(self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// `12 of 30, 40.0 % (24.6 to 57.7)` with Wilson's 95 % interval.
    pub fn text(self) -> String {
        match wilson_ci95(self.hits as u64, self.of as u64) {
            None => "–".to_owned(),
            Some((low, high)) => {
                let [value, low, high] = [self.value(), low, high].map(|share| 100.0 * share);
                format!("{} of {}, {value:.1} % ({low:.1} to {high:.1})", self.hits, self.of)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_shares_by_hand() {
        // Wilson for 8 of 10: 0.490 to 0.943 (Agresti and Coull 1998 print 0.49 to 0.94).
        assert_eq!(Share { hits: 8, of: 10 }.text(), "8 of 10, 80.0 % (49.0 to 94.3)");
        assert_eq!(Share { hits: 0, of: 0 }.text(), "–");
    }
}
