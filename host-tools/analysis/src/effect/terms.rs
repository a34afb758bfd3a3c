//! Files of proposed terms, and of effects that a vehicle file cannot hold: written by `diagnose`, read by `navigate` and
//! `effect new`.

use anyhow::{Context, anyhow, bail};
use backseat_diagnose::diagnosis::FoundEffect;
use backseat_diagnose::log_effects::{Effects, is_of_readings};
use backseat_diagnose::proposal::ProposedTerm;
use backseat_diagnose::regressors::{GenericTerm, Proposed};
use backseat_logs::output::{self, Existing};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A file of terms and effects.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Terms {
    /// In the order in which they explain most.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub term: Vec<Term>,
    /// Of the catalogue, but no parameters of a board.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub effect: Vec<NamedEffect>,
}

/// An effect with its values, in the order of the catalogue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedEffect {
    /// The entry.
    pub name: String,
    /// All of its values.
    pub values: Vec<f64>,
}

/// One term: what it adds to, the monomial, and its number.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    /// A derivative (`dp/dt`), a velocity of the water (`current_north`) or a channel (`heading`).
    pub adds_to: String,
    /// The monomial, such as `r`, `u|u|`, `sin(2 psi)`.
    pub times: String,
    /// Its factor.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Unit of the value; the length of the log is T.
    pub unit: String,
    /// What it could be physically.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub physical_reading: Option<String>,
}

impl Terms {
    /// Of a diagnosis: its terms, and the effects of readings that `[installation]` has no place for.
    pub fn of(proposed: &[ProposedTerm], effects: &[FoundEffect]) -> Self {
        let one = |term: &ProposedTerm| Term {
            adds_to: term.term.target.symbol().to_owned(),
            times: term.term.factor.symbol().to_owned(),
            value: term.value,
            ci95: term.ci95,
            unit: term.unit(),
            physical_reading: term.physical_reading(),
        };
        let of_readings = effects.iter().filter(|found| is_of_readings(found.instance.candidate.effect));
        let effect = of_readings.map(|found| {
            let values = found.instance.candidate.values(&found.instance.sizes);
            NamedEffect { name: found.instance.candidate.effect.to_owned(), values }
        });
        Self { term: proposed.iter().map(one).collect(), effect: effect.collect() }
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.term.is_empty() && self.effect.is_empty()
    }

    /// Writes the file.
    pub fn write(&self, path: &Path, log: &str, existing: Existing) -> anyhow::Result<()> {
        let head = format!(
            "# What `backseat diagnose` found in {log} that a vehicle file cannot hold: effects of its sensors, and proposed\n\
             # terms where no entry of the catalogue accounts for the residual. `backseat navigate LOG --terms THIS` takes\n\
             # both out of the readings; `backseat effect new NAME --from THIS` drafts an entry from the terms.\n\n"
        );
        let text = head + &toml::to_string(self).context("the terms cannot be written as TOML")?;
        Ok(output::write(path, existing, |file| file.write_all(text.as_bytes()))?)
    }

    /// Reads a file.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let text = backseat_logs::settings::read(path)?;
        let terms: Self = toml::from_str(&text).with_context(|| path.display().to_string())?;
        if terms.is_empty() {
            bail!("{}: no [[term]] and no [[effect]]; expected a file of terms that a diagnosis wrote", path.display());
        }
        terms.known().with_context(|| path.display().to_string())?;
        terms.effects().with_context(|| path.display().to_string())?;
        Ok(terms)
    }

    /// The effects, as they are taken out of a log.
    pub fn effects(&self) -> anyhow::Result<Effects> {
        self.effect.iter().try_fold(Effects::default(), |effects, found| {
            let is_known = is_of_readings(&found.name) && found.values.iter().all(|value| value.is_finite());
            let with = effects.with(&found.name, &found.values).ok().filter(|_| is_known);
            with.ok_or_else(|| {
                anyhow!(
                    "effect {}: no such effect of readings with {} numbers; expected one that a diagnosis wrote",
                    found.name,
                    found.values.len()
                )
            })
        })
    }

    /// The terms, as the models take them.
    pub fn known(&self) -> anyhow::Result<Vec<Proposed>> {
        self.term
            .iter()
            .map(|term| {
                let found = GenericTerm::find(&term.adds_to, &term.times).ok_or_else(|| {
                    anyhow!(
                        "term {} times {}: no such term; expected one that a diagnosis wrote",
                        term.adds_to,
                        term.times
                    )
                })?;
                if !term.value.is_finite() {
                    bail!("term {} times {}: value is not a finite number", term.adds_to, term.times);
                }
                Ok((found, term.value))
            })
            .collect()
    }
}
