//! Simulated studies: all values of the tables and figures come from runs of these, one per seed.

mod allocation;
mod conditions;
mod first_nbls;
mod gains;
mod identification;
mod least_squares;
mod navigation;
mod riccati;
mod steering;

use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;

pub use allocation::ALLOCATION;
pub use first_nbls::FIRST_NBLS;
pub use gains::GAINS;
pub use identification::{AID_COARSE_RATES, AID_FINE_RATES, NBLS, NBLS_CUT_OFFS};
pub use least_squares::LEAST_SQUARES;
pub use navigation::{D_SEA, D_SURVEY, K_COMPASS, K_DVL, K_FOG, N_NAV};
pub use riccati::RICCATI;
pub use steering::STEERING;

/// A study: one run a seed.
#[derive(Debug)]
pub struct Study {
    /// Name in the file of finished runs.
    pub name: &'static str,
    /// What is run.
    pub kind: Kind,
}

/// Kinds of study.
#[derive(Debug)]
pub enum Kind {
    /// Identification and cross-validation over a grid of noise.
    Identification(identification::NoiseGrid),
    /// A flight and its measurements through several filters.
    Navigation(navigation::Navigation),
    /// One of its own.
    Own(fn(u64) -> anyhow::Result<Measured>),
}

impl Study {
    /// One run.
    pub fn run(&self, seed: u64) -> anyhow::Result<Measured> {
        match &self.kind {
            Kind::Identification(conditions) => conditions.run(seed),
            Kind::Navigation(navigation) => navigation.run(seed),
            Kind::Own(run) => run(seed),
        }
    }
}

/// Results of one run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Measured {
    /// Row, column, value.
    #[serde(deserialize_with = "with_nan")]
    pub rows: BTreeMap<String, BTreeMap<String, f64>>,
    /// `prefix/row` to points of time (h) and value.
    pub curves: BTreeMap<String, Vec<(f64, f64)>>,
}

impl Measured {
    pub fn set(&mut self, row: &str, column: &str, value: f64) {
        self.rows.entry(row.to_owned()).or_default().insert(column.to_owned(), value);
    }

    /// A curve to four digits: it is drawn.
    pub fn curve(&mut self, prefix: &str, row: &str, points: impl Iterator<Item = (f64, f64)>) {
        let points =
            points.filter(|(_, value)| value.is_finite()).map(|(t, value)| (t, crate::draw::rounded(value))).collect();
        self.curves.insert(format!("{prefix}/{row}"), points);
    }
}

/// JSON has no NaN: null.
fn with_nan<'de, D: Deserializer<'de>>(from: D) -> Result<BTreeMap<String, BTreeMap<String, f64>>, D::Error> {
    let rows = BTreeMap::<String, BTreeMap<String, Option<f64>>>::deserialize(from)?;
    let number = |(column, value): (String, Option<f64>)| (column, value.unwrap_or(f64::NAN));
    Ok(rows.into_iter().map(|(name, row)| (name, row.into_iter().map(number).collect())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_number_comes_back_as_none() {
        let mut measured = Measured::default();
        measured.set("row", "column", f64::NAN);
        let text = serde_json::to_string(&measured).unwrap();
        let back: Measured = serde_json::from_str(&text).unwrap();
        assert!(back.rows["row"]["column"].is_nan(), "{text}");
    }
}
