//! `backseat params`: the board's parameters, over its host port.

mod table;

use crate::board::{Board, Common, Declared, number, reason};
use anyhow::{anyhow, bail};
use backseat_data::output::{self, Existing};
use backseat_data::{BoardFile, BoardParameter, DataError};
use clap::Subcommand;
use serde_json::json;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  backseat params get /dev/ttyACM0                      all of them, as a table
  backseat params get /dev/ttyACM0 drag app.use_dvl     a section, and one
  backseat params set /dev/ttyACM0 app.use_dvl=1 'drag.quadratic_diag[0]=3.4'
  backseat params export /dev/ttyACM0 board.toml
  backseat params import /dev/ttyACM0 identified.toml   a vehicle file, or an exported set
  backseat params store /dev/ttyACM0                    keep them through power-off

PORT is the board's host port, with :BAUD behind it where that is not 115200. What set and import bring becomes active
as a whole or not at all. The exported file is a vehicle file (backseat navigate --vehicle reads it) with everything
else a board is told in a section [app]; import takes such a file, a vehicle file, or a file with [app] alone.";

const GET: &str = "\
Example:
  backseat params get /dev/ttyACM0 drag fins.cl app.use_dvl

A star: not the default. What takes effect at once may be set under way too; with the others navigation starts again,
so that they are refused while a mission runs. Meaning and effect are known of boards with this program's list.";

/// Get, set, export, import or store the board's parameters
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Args {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Show parameters with unit, range, default and meaning
    #[command(after_help = GET)]
    Get {
        #[command(flatten)]
        common: Common,
        /// Names, or their beginnings up to a dot or bracket [default: all]
        #[arg(value_name = "NAME")]
        names: Vec<String>,
    },
    /// Set parameters, all of them or none
    #[command(after_help = "Example:\n  backseat params set /dev/ttyACM0 app.use_dvl=1 'drag.quadratic_diag[0]=3.4'")]
    Set {
        #[command(flatten)]
        common: Common,
        /// What to set
        #[arg(value_name = "NAME=VALUE", required = true, value_parser = assignment)]
        values: Vec<(String, f64)>,
    },
    /// Write all parameters to a file
    #[command(after_help = "Example:\n  backseat params export /dev/ttyACM0 board.toml --name iver3-218")]
    Export {
        #[command(flatten)]
        common: Common,
        /// File to write, TOML
        #[arg(value_name = "V.toml")]
        file: PathBuf,
        /// Name of the vehicle, which the board does not know
        #[arg(long, default_value = "vehicle")]
        name: String,
        /// Replace a file that exists
        #[arg(long)]
        force: bool,
    },
    /// Set all parameters that a file has, all of them or none
    #[command(after_help = "Example:\n  backseat params import /dev/ttyACM0 identified.toml")]
    Import {
        #[command(flatten)]
        common: Common,
        /// Vehicle file, exported set, or one with an app section alone, TOML
        #[arg(value_name = "V.toml")]
        file: PathBuf,
    },
    /// Keep the active parameters through power-off
    #[command(after_help = "Example:\n  backseat params store /dev/ttyACM0")]
    Store(Common),
}

/// `NAME=VALUE`.
fn assignment(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let value = value.trim().parse().map_err(|_| format!("{value}: not a number"))?;
    Ok((name.trim().to_owned(), value))
}

/// Does what is asked.
pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.action {
        Action::Get { common, names } => get(common, names),
        Action::Set { common, values } => set(common, values),
        Action::Export { common, file, name, force } => {
            let existing = if *force { Existing::Replace } else { Existing::Keep };
            output::check(file, existing)?;
            let mut board = common.connect()?;
            let parameters = board.parameters()?;
            let list: Vec<BoardParameter> = parameters.iter().map(for_file).collect();
            let source =
                format!("Parameters of a board with {}, list version {}.", firmware(&board), board.identity.schema);
            let text = BoardFile::text_of(&list, name, &source).map_err(|message| anyhow!(message))?;
            output::write(file, existing, |file| file.write_all(text.as_bytes()))?;
            let told = format!("{} parameters to {}\n", list.len(), file.display());
            common.say(&json!({"parameters": list.len(), "file": file}), &told)
        }
        Action::Import { common, file } => {
            let values = BoardFile::read(file)?.flatten();
            if let Some((name, value)) = values.iter().find(|(_, value)| !value.is_finite()) {
                return Err(DataError::file(file, format!("{name}: {value} is no finite number")).into());
            }
            set(common, &values)
        }
        Action::Store(common) => {
            let mut board = common.connect()?;
            if let Err(refusal) = board.store_parameters()? {
                bail!("{}: the board stored nothing: {}", common.port, reason(refusal));
            }
            common.say(&json!({"stored": true}), "stored; they are active after the next start as well\n")
        }
    }
}

fn firmware(board: &Board) -> &str {
    &board.identity.firmware
}

fn get(common: &Common, names: &[String]) -> anyhow::Result<()> {
    let mut board = common.connect()?;
    let all = board.parameters()?;
    let is = |parameter: &Declared, wanted: &String| {
        parameter.name.strip_prefix(wanted.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    };
    if let Some(unknown) = names.iter().find(|wanted| !all.iter().any(|parameter| is(parameter, wanted))) {
        bail!("{unknown} is no parameter of this board, and no beginning of one");
    }
    let wanted = |parameter: &&Declared| names.is_empty() || names.iter().any(|name| is(parameter, name));
    let shown: Vec<&Declared> = all.iter().filter(wanted).collect();
    let json = json!({
        "firmware": board.identity.firmware,
        "parameter_schema": board.identity.schema,
        "parameters": shown.iter().map(|parameter| parameter.json()).collect::<Vec<_>>(),
    });
    common.say(&json, &table::text(&shown))
}

fn set(common: &Common, values: &[(String, f64)]) -> anyhow::Result<()> {
    let mut board = common.connect()?;
    let before = board.parameters()?;
    board.set_parameters(values, &before)?;
    let old = |name: &str| before.iter().find(|parameter| parameter.name == name).map(|parameter| parameter.value);
    let changed: Vec<_> = values
        .iter()
        .filter_map(|(name, to)| old(name).filter(|from| from != to).map(|from| (name, from, *to)))
        .collect();
    let json = json!({
        "set": values.len(),
        "changed": changed.iter().map(|(name, from, to)| json!({"name": name, "from": from, "to": to})).collect::<Vec<_>>(),
    });
    let mut text = format!("{} parameters set, {} of them changed\n", values.len(), changed.len());
    for (name, from, to) in &changed {
        text += &format!("  {name}: {} -> {}\n", number(*from), number(*to));
    }
    common.say(&json, &text)
}

fn for_file(parameter: &Declared) -> BoardParameter {
    let Declared { name, unit, value, .. } = parameter;
    let range = parameter.range();
    let parts = [unit, parameter.description(), &range].into_iter().filter(|part| !part.is_empty());
    let comment = parts.collect::<Vec<_>>().join("; ");
    BoardParameter { name: name.clone(), value: *value, comment }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn assignments() {
        assert_eq!(assignment("fins.cl[0]=-3.1e0"), Ok(("fins.cl[0]".to_owned(), -3.1)));
        for text in ["fins.cl[0]", "fins.cl[0]=", "fins.cl[0]=big", "=1=2"] {
            assert!(assignment(text).is_err(), "{text}");
        }
    }
}
