//! What is left of a residual, beside what the sensors can make.

/// One figure of what is left.
#[derive(Clone, Debug, PartialEq)]
pub struct Remaining {
    /// Of what, in words: "position error".
    pub what: String,
    /// Its unit.
    pub unit: &'static str,
    /// Root mean square on the data that judges.
    pub left: f64,
    /// The largest that the sensors can make.
    pub most: f64,
}

impl Remaining {
    /// Whether no sensor makes so much.
    #[must_use]
    pub fn is_beyond(&self) -> bool {
        self.left > self.most
    }

    /// In words: "position error of 87 m, where the sensors make at most 12 m".
    #[must_use]
    pub fn describe(&self) -> String {
        let number = |value: f64| {
            let digits = (1.0 - value.abs().max(1e-6).log10().floor()).clamp(0.0, 6.0) as usize;
            format!("{value:.digits$}")
        };
        let [left, most] = [self.left, self.most].map(number);
        format!("{} of {left} {unit}, where the sensors make at most {most} {unit}", self.what, unit = self.unit)
    }
}
