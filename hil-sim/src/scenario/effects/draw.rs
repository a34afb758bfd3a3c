//! Plausible amplitudes.

use super::{Effect, EffectKind, FIN_NAMES};
use crate::rng::Stream;
use std::f64::consts::TAU;

/// Where the value of a parameter comes from when none is given. Sizes are log-uniform: as many small ones as
/// large ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Draw {
    /// A size, always positive.
    Size(f64, f64),
    /// A size of either sign.
    Signed(f64, f64),
    /// All parameters of the effect marked so are one vector of this size in any direction.
    Vector(f64, f64),
    /// Anywhere in between, evenly.
    Uniform(f64, f64),
    /// Any angle.
    Angle,
    /// Any fin.
    Fin,
    /// Any of a data set's four transponders, by its number.
    Transponder,
    /// Within 20 to 80 % of the duration.
    Event,
    /// Only if it is given: 0, which takes nothing from the stream.
    Never,
}

fn size(random: &mut Stream, low: f64, high: f64) -> f64 {
    low * libm::pow(high / low, random.uniform())
}

impl Draw {
    /// A value; a member of a vector comes unscaled.
    fn value(self, random: &mut Stream, duration_s: f64) -> f64 {
        match self {
            Self::Size(low, high) => size(random, low, high),
            Self::Signed(low, high) => random.sign() * size(random, low, high),
            Self::Vector(..) => random.normal(),
            Self::Uniform(low, high) => low + (high - low) * random.uniform(),
            Self::Angle => TAU * random.uniform(),
            Self::Fin => 1.0 + (FIN_NAMES.len() as f64 * random.uniform()).floor(),
            Self::Transponder => 1.0 + (4.0 * random.uniform()).floor(),
            Self::Never => 0.0,
            Self::Event => duration_s * (0.2 + 0.6 * random.uniform()),
        }
    }
}

impl Effect {
    /// An effect of plausible size; `given` overrides, by place.
    pub(super) fn drawn(
        kind: &'static EffectKind,
        given: &[Option<f64>],
        random: &mut Stream,
        duration_s: f64,
    ) -> Self {
        let mut values: Vec<f64> = kind.parameters.iter().map(|p| p.draw.value(random, duration_s)).collect();
        let vector = kind.parameters.iter().find_map(|p| match p.draw {
            Draw::Vector(low, high) => Some((low, high)),
            _ => None,
        });
        if let Some((low, high)) = vector {
            let amplitude = size(random, low, high);
            let member = |p: &super::ParameterKind| matches!(p.draw, Draw::Vector(..));
            let members = || kind.parameters.iter().map(member);
            let norm = values.iter().zip(members()).filter(|(_, m)| *m).map(|(v, _)| v * v).sum::<f64>().sqrt();
            for (value, _) in values.iter_mut().zip(members()).filter(|(_, m)| *m) {
                *value *= amplitude / norm;
            }
        }
        for (value, given) in values.iter_mut().zip(given) {
            if let Some(given) = given {
                *value = *given;
            }
        }
        Self { kind, values }
    }
}
