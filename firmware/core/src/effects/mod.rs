//! The catalogue of physical effects a declared model may lack, one file an entry.
//!
//! An entry is a constant [`EffectInfo`] and the functions by which the effect enters the models. To add one:
//! write its file, declare the module and add its `INFO` to [`CATALOGUE`].

pub mod water_current;

/// What an effect is, for the filter's set-up, the identification and the report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EffectInfo {
    /// Name in commands, files and reports.
    pub name: &'static str,
    /// What quantifies it.
    pub parameters: &'static [ParameterInfo],
    /// Which models it changes.
    pub enters: Enters,
    /// The equations by which it enters.
    pub equations: &'static str,
    /// What it leaves in the residual of a model that lacks it.
    pub signature: &'static str,
    /// Effects that can leave the same residual.
    pub confused_with: &'static [Confusion],
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Name in files and reports.
    pub name: &'static str,
    /// SI unit as written in reports.
    pub unit: &'static str,
    /// Smallest plausible value.
    pub min: f64,
    /// Largest plausible value.
    pub max: f64,
}

/// Which models an effect changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Enters {
    /// The process model only.
    Process,
    /// Measurement models only.
    Measurement,
    /// Both.
    Both,
}

/// Another effect that data may not tell apart from this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Confusion {
    /// Name of the other effect.
    pub effect: &'static str,
    /// When the two cannot be told apart.
    pub condition: &'static str,
    /// What to fly, or to log, to tell them apart.
    pub separating_manoeuvre: &'static str,
}

/// Every effect known.
pub const CATALOGUE: &[EffectInfo] = &[water_current::INFO];

/// The entry of that name.
#[must_use]
pub fn find(name: &str) -> Option<&'static EffectInfo> {
    CATALOGUE.iter().find(|effect| effect.name == name)
}

impl EffectInfo {
    /// Whether every value is finite and plausible; in the order of `parameters`.
    #[must_use]
    pub fn is_plausible(&self, values: &[f64]) -> bool {
        values.len() == self.parameters.len()
            && self.parameters.iter().zip(values).all(|(p, value)| (p.min..=p.max).contains(value))
    }
}
