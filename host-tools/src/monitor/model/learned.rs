//! What the board has learned of its vehicle: identified parameters, and the water current.

use super::trend::Thinned;
use backseat_core::identification::theta::{NAMES, PARAMETERS};
use backseat_wire::hostlink::{Identification, Visibility};

/// Values that a trend keeps: one in ten seconds, so ten minutes, and coarser from then on.
const TREND: usize = 64;

/// One identified parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Identified<'a> {
    pub name: &'static str,
    pub value: f64,
    /// Relative to the set in use; `None` where that is zero or not known yet.
    pub change: Option<f64>,
    pub visibility: Visibility,
    pub drifted: bool,
    pub trend: &'a [f64],
}

/// The identifier's records.
pub struct Learned {
    pub last: Option<Identification>,
    trends: [Thinned<f64>; PARAMETERS],
}

impl Default for Learned {
    fn default() -> Self {
        Self { last: None, trends: std::array::from_fn(|_| Thinned::new(TREND)) }
    }
}

impl Learned {
    /// Takes a record; names of the parameters that drift now and did not before.
    pub fn note(&mut self, record: &Identification) -> Vec<&'static str> {
        if record.adapted_s > 0.0 {
            for (trend, value) in self.trends.iter_mut().zip(record.theta) {
                trend.push(value);
            }
        }
        let news = record.drifted & !self.last.map_or(0, |last| last.drifted);
        self.last = Some(*record);
        NAMES.into_iter().enumerate().filter(|(j, _)| news >> j & 1 == 1).map(|(_, name)| name).collect()
    }

    /// All 21, beside `in_use`, the vehicle that the filter has.
    pub fn identified<'a>(&'a self, in_use: Option<&[f64; PARAMETERS]>) -> Vec<Identified<'a>> {
        // all zero before it has ever begun
        let Some(last) = self.last.as_ref().filter(|last| last.theta.iter().any(|value| *value != 0.0)) else {
            return Vec::new();
        };
        let of = |j: usize| Identified {
            name: NAMES[j],
            value: last.theta[j],
            change: in_use.map(|theta| theta[j]).filter(|used| *used != 0.0).map(|used| last.theta[j] / used - 1.0),
            visibility: last.visibility[j],
            drifted: last.drifted >> j & 1 == 1,
            trend: &self.trends[j].kept,
        };
        (0..PARAMETERS).map(of).collect()
    }

    pub fn forget(&mut self) {
        *self = Self::default();
    }
}
