//! `backseat effect`: the catalogue of effects, and drafts of new entries.

use crate::output;
use anyhow::{anyhow, bail};
use backseat_analysis::effect::{self, draft, terms::Terms};
use backseat_core::effects;
use backseat_logs::output::{Existing, write};
use backseat_report::console;
use std::path::PathBuf;

/// The catalogue of effects, and drafts of new entries
#[derive(clap::Subcommand)]
pub enum Effect {
    /// List the entries of the catalogue
    #[command(after_help = "Example:\n  backseat effect list")]
    List {
        /// Print one JSON object instead of the table
        #[arg(long)]
        json: bool,
    },
    /// Show an entry: equations, signature, what it can be confused with
    #[command(after_help = "Example:\n  backseat effect show heading_bias")]
    Show {
        /// Name of the entry
        name: String,
        /// Print one JSON object instead of the text
        #[arg(long)]
        json: bool,
    },
    New(New),
}

/// Draft a new entry from the terms that `diagnose` proposes
#[derive(clap::Args)]
#[command(after_help = "Example:
  backseat diagnose log.csv --vehicle v.toml --report out
  backseat effect new weed_drag --from out/proposed_terms.toml --out weed_drag.rs

The draft is a Rust file for firmware/core/src/effects; what only a developer can say stands there as TODO.")]
pub struct New {
    /// Name of the new entry: small letters, digits and underscores
    name: String,
    /// Terms, as `diagnose --report DIR` writes them
    #[arg(long, value_name = "TERMS.toml")]
    from: PathBuf,
    /// Write the draft here [default: print it]
    #[arg(long, value_name = "NAME.rs")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the draft
    #[arg(long)]
    json: bool,
    /// Replace a draft that exists
    #[arg(long)]
    force: bool,
}

impl Effect {
    pub fn run(&self) -> anyhow::Result<()> {
        match self {
            Self::List { json } => output::print(&effect::list(), *json),
            Self::Show { name, json } => {
                let info = effects::find_of_log(name).ok_or_else(|| unknown(name))?;
                output::print(&effect::show(info), *json)
            }
            Self::New(new) => new.run(),
        }
    }
}

impl New {
    fn run(&self) -> anyhow::Result<()> {
        let is_name = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        if !self.name.starts_with(|c: char| c.is_ascii_lowercase()) || !self.name.chars().all(is_name) {
            bail!("{}: a name has small letters, digits and underscores, and begins with a letter", self.name);
        }
        if effects::find_of_log(&self.name).is_some() {
            bail!("{}: the catalogue has this entry already; `backseat effect show {0}`", self.name);
        }
        let existing = if self.force { Existing::Replace } else { Existing::Keep };
        let terms = Terms::read(&self.from)?;
        if terms.term.is_empty() {
            bail!("{}: no [[term]]: its effects are entries of the catalogue already", self.from.display());
        }
        let draft = draft::text(&self.name, &terms);
        if let Some(path) = &self.out {
            write(path, existing, |file| file.write_all(draft.as_bytes()))?;
        }
        if self.out.is_none() && !self.json {
            return console::print(draft.as_bytes());
        }
        output::print(&draft::report(&self.name, &terms, draft, self.out.as_deref())?, self.json)
    }
}

fn unknown(name: &str) -> anyhow::Error {
    let names: Vec<&str> = effect::all().map(|info| info.name).collect();
    anyhow!("no effect {name}; the catalogue has {}", names.join(", "))
}
