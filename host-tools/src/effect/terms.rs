//! Files of proposed terms: written by `diagnose`, read by `navigate` and `effect new`.

use anyhow::{Context, anyhow, bail};
use backseat_data::output::{self, Existing};
use backseat_diagnose::proposal::ProposedTerm;
use backseat_diagnose::regressors::{GenericTerm, Proposed};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A file of proposed terms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Terms {
    /// In the order in which they explain most.
    pub term: Vec<Term>,
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
    /// Of a diagnosis.
    pub fn of(proposed: &[ProposedTerm]) -> Self {
        let one = |term: &ProposedTerm| Term {
            adds_to: term.term.target.symbol().to_owned(),
            times: term.term.factor.symbol().to_owned(),
            value: term.value,
            ci95: term.ci95,
            unit: term.unit(),
            physical_reading: term.physical_reading(),
        };
        Self { term: proposed.iter().map(one).collect() }
    }

    /// Writes the file.
    pub fn write(&self, path: &Path, log: &str, existing: Existing) -> anyhow::Result<()> {
        let head = format!(
            "# Terms that `backseat diagnose` proposes for {log}: no entry of the catalogue accounts for its residual.\n\
             # `backseat navigate LOG --terms THIS` takes them out of the readings; `backseat effect new NAME --from THIS`\n\
             # drafts an entry of the catalogue.\n\n"
        );
        let text = head + &toml::to_string(self).context("the terms cannot be written as TOML")?;
        Ok(output::write(path, existing, |file| file.write_all(text.as_bytes()))?)
    }

    /// Reads a file.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        let terms: Self = toml::from_str(&text).with_context(|| path.display().to_string())?;
        if terms.term.is_empty() {
            bail!("{}: no [[term]]; expected a file that `backseat diagnose --report DIR` wrote", path.display());
        }
        terms.known().with_context(|| path.display().to_string())?;
        Ok(terms)
    }

    /// As the models take them.
    pub fn known(&self) -> anyhow::Result<Vec<Proposed>> {
        self.term
            .iter()
            .map(|term| {
                let found = GenericTerm::find(&term.adds_to, &term.times).ok_or_else(|| {
                    anyhow!(
                        "term {} times {}: no such term; expected one that `diagnose` wrote",
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
