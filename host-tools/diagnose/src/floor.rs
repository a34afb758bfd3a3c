//! The floor under a verdict: what is left on data that judges, beside what the sensors can make.

use crate::samples::ResidualChannel;
use backseat_logs::plausible_noise::SensorKind;

/// Blocks that judge, below which nothing is said.
pub const FEWEST_JUDGED: usize = 3;

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

impl ResidualChannel {
    /// The kind of sensor that reads it.
    #[must_use]
    pub const fn sensor(self) -> SensorKind {
        match self {
            Self::Depth => SensorKind::Depth,
            Self::Roll | Self::Pitch => SensorKind::RollPitch,
            Self::Heading => SensorKind::Heading,
            Self::P | Self::Q | Self::R => SensorKind::Rates,
            Self::DvlU | Self::DvlV | Self::DvlW => SensorKind::Dvl,
            Self::GnssX | Self::GnssY => SensorKind::Gnss,
            Self::Range => SensorKind::Range,
            Self::RangeRate => SensorKind::RangeRate,
            Self::DepthRate => SensorKind::DepthRate,
            Self::WaterSpeed => SensorKind::WaterSpeed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_in_words() {
        let remaining = Remaining { what: "position error".to_owned(), unit: "m", left: 87.0, most: 12.0 };
        assert!(remaining.is_beyond());
        assert_eq!(remaining.describe(), "position error of 87 m, where the sensors make at most 12 m");
    }
}
