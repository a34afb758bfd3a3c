//! `backseat effect`: the catalogue of effects, and drafts of new entries.

mod draft;
pub mod terms;

use anyhow::{anyhow, bail};
use backseat_core::effects::{self, CATALOGUE, EffectInfo, LOG_CATALOGUE};
use backseat_logs::output::{self, Existing};
use backseat_report::console;
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;
use terms::Terms;

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
            Self::List { json: true } => {
                let all: Vec<Value> = all().map(entry).collect();
                print(&format!("{}\n", json!({ "effects": all })))
            }
            Self::List { .. } => {
                let lines = all().map(|info| format!("{:<18} {}\n", info.name, info.equations));
                print(&lines.collect::<String>())
            }
            Self::Show { name, json } => {
                let info = effects::find_of_log(name).ok_or_else(|| unknown(name))?;
                print(&if *json { format!("{}\n", entry(info)) } else { described(info) })
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
        let text = draft::text(&self.name, &terms);
        if let Some(path) = &self.out {
            output::write(path, existing, |file| file.write_all(text.as_bytes()))?;
        }
        match (&self.out, self.json) {
            (out, true) => {
                let terms = serde_json::to_value(&terms)?;
                let file = out.as_ref().map(|path| path.display().to_string());
                print(&format!(
                    "{}\n",
                    json!({ "name": self.name, "terms": terms["term"], "draft": text, "file": file })
                ))
            }
            (Some(path), false) => print(&format!("draft         {}\n", path.display())),
            (None, false) => print(&text),
        }
    }
}

/// Those that a board knows, then those that only the analysis of a log knows.
fn all() -> impl Iterator<Item = &'static EffectInfo> {
    CATALOGUE.iter().chain(LOG_CATALOGUE)
}

fn print(text: &str) -> anyhow::Result<()> {
    console::print(text.as_bytes())
}

fn unknown(name: &str) -> anyhow::Error {
    let names: Vec<&str> = all().map(|info| info.name).collect();
    anyhow!("no effect {name}; the catalogue has {}", names.join(", "))
}

fn entry(info: &EffectInfo) -> Value {
    let parameters =
        info.parameters.iter().map(|p| json!({"name": p.name, "unit": p.unit, "min": p.min, "max": p.max}));
    let confusions = info.confused_with.iter().map(|confusion| {
        json!({"effect": confusion.effect, "condition": confusion.condition,
            "separating_manoeuvre": confusion.separating_manoeuvre})
    });
    json!({"name": info.name, "parameters": parameters.collect::<Vec<_>>(), "equations": info.equations,
        "signature": info.signature, "confused_with": confusions.collect::<Vec<_>>()})
}

fn described(info: &EffectInfo) -> String {
    let mut out = format!("{}\n  equations  {}\n", info.name, info.equations);
    for p in info.parameters {
        let _ = writeln!(out, "  {:<10} {} ({} to {})", p.name, p.unit, p.min, p.max);
    }
    let _ = writeln!(out, "  signature  {}", info.signature);
    for confusion in info.confused_with {
        let _ = writeln!(out, "  or {}: {}. {}", confusion.effect, confusion.condition, confusion.separating_manoeuvre);
    }
    out
}
