//! Description of an effect.

use super::Hooks;

/// What an effect is, for the filter, the identification, the diagnosis and the report.
#[derive(Clone, Copy, Debug)]
pub struct EffectInfo {
    /// Name in commands, files and reports.
    pub name: &'static str,
    /// What quantifies it: one to four numbers.
    pub parameters: &'static [ParameterInfo],
    /// Which models it changes.
    pub enters: Enters,
    /// The equations by which it enters.
    pub equations: &'static str,
    /// What it leaves in the residual of a model that lacks it.
    pub signature: &'static str,
    /// Effects that can leave the same residual.
    pub confused_with: &'static [Confusion],
    /// The functions by which it enters.
    pub hooks: Hooks,
}

impl EffectInfo {
    pub(super) const fn without_text(self) -> Self {
        Self { equations: "", signature: "", confused_with: &[], ..self }
    }
}

/// What a parameter's number means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterKind {
    /// How large the effect is.
    Size,
    /// Which fin, 1 to 4 (top, bottom, port, starboard); 0 is none.
    Fin,
    /// When it begins, s since the epoch.
    Onset,
    /// When it ends, s since the epoch; 0 is never.
    End,
    /// Which fixed transponder, its number in the log.
    Transponder,
    /// A time without a meaning while the effect has no size (a period).
    Shape,
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
    /// What its number means.
    pub kind: ParameterKind,
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
    /// The statistics of the noise only.
    Noise,
}

/// Another effect that data may not separate from this one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Confusion {
    /// Name of the other effect.
    pub effect: &'static str,
    /// When the two are not separable.
    pub condition: &'static str,
    /// What to fly, or to log, to separate them.
    pub separating_manoeuvre: &'static str,
}

/// Not separable from `effect` under a condition, and what separates the two.
pub(super) const fn with(
    effect: &'static str,
    condition: &'static str,
    separating_manoeuvre: &'static str,
) -> Confusion {
    Confusion { effect, condition, separating_manoeuvre }
}

impl EffectInfo {
    /// Whether every value is finite and plausible; in the order of `parameters`.
    #[must_use]
    pub fn is_plausible(&self, values: &[f64]) -> bool {
        values.len() == self.parameters.len() && self.parameters.iter().zip(values).all(|(p, value)| p.admits(*value))
    }
}

impl ParameterInfo {
    pub(super) const fn size(name: &'static str, unit: &'static str, min: f64, max: f64) -> Self {
        Self { name, unit, min, max, kind: ParameterKind::Size }
    }

    /// A size whose sign either way is alike.
    pub(super) const fn symmetric(name: &'static str, unit: &'static str, max: f64) -> Self {
        Self::size(name, unit, -max, max)
    }

    pub(super) const FIN: Self = Self { name: "fin", unit: "1", min: 1.0, max: 4.0, kind: ParameterKind::Fin };

    pub(super) const ONSET: Self = Self { name: "time_s", unit: "s", min: 0.0, max: 1.0e6, kind: ParameterKind::Onset };

    pub(super) const END: Self = Self { name: "until_s", unit: "s", min: 0.0, max: 1.0e6, kind: ParameterKind::End };

    /// Whether a value is plausible; zero, which is no effect, always is.
    #[must_use]
    pub fn admits(&self, value: f64) -> bool {
        let whole = self.kind != ParameterKind::Fin || libm::trunc(value) == value;
        value == 0.0 || (whole && (self.min..=self.max).contains(&value))
    }
}
