//! `backseat params`: the board's parameters, over its host port.

mod learnt;
mod table;

use crate::board::{Common, KeySource};
use crate::console;
use anyhow::{anyhow, bail};
use backseat_link::board::{Board, Declared, Effect, number, reason};
use backseat_logs::output::{self, Existing};
use backseat_logs::{BoardFile, BoardParameter, parameters_page};
use backseat_wire::ship_state::Key;
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
  backseat params learnt /dev/ttyACM0                   what its dives have taught the board of its vehicle
  backseat params docs                                  what every parameter means, without a board

PORT is the board's host port, with :BAUD behind it where that is not 115200. The values of set and import become
active all together or not at all. The exported file is a vehicle file (backseat navigate --vehicle reads it) with what
belongs to the board itself in a section [app]; import takes such a file, a vehicle file, or a file with [app] alone.";

const SET: &str = "\
Examples:
  backseat params set /dev/ttyACM0 app.use_dvl=1 'drag.quadratic_diag[0]=3.4'
  backseat params set /dev/ttyACM0 installation.sound_speed_mps=1483 --unlock
  backseat params set /dev/ttyACM0 app.acoustic_key=@ship.key      from a file
  backseat params set /dev/ttyACM0 app.acoustic_key=-              asked for, or from a pipe
  backseat params set /dev/ttyACM0 app.acoustic_key=@new.key --key ship.key

The key (32 hexadecimal digits, `openssl rand -hex 16 > ship.key`; or none) is shared with the ship; it can be written,
not read. It is not taken from the command line, which every user of the computer can see. With a key the board uses
only packets that carry its authentication code, and takes from its host port nothing that changes a flight unless it
is signed: all commands that do so are then given --key FILE, this one the old key to set another. It cannot be set
during a mission; params store keeps it through power-off.";

const GET: &str = "\
Example:
  backseat params get /dev/ttyACM0 drag fins.cl app.use_dvl

A star marks values other than the default. Parameters that take effect at once
may be set during a mission; the others restart navigation and are refused while
a mission runs. Meaning and effect are shown if the board has the same parameter
list as this program.";

const LEARNT: &str = "\
Example:
  backseat params learnt /dev/ttyACM0

At the end of a dive of ten minutes or more the board keeps what its robust filter has learnt of vehicle and compass, with
sigma and correlations, and starts the next dive from there (parameters learnt.*). It forgets it when another vehicle is
set, and by backseat params forget. Vehicle files hold the same in a section [learnt]: params export writes it.";

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
    #[command(after_help = SET)]
    Set {
        #[command(flatten)]
        common: Common,
        /// What to set
        #[arg(value_name = "NAME=VALUE", required = true, value_parser = assignment)]
        values: Vec<Assignment>,
        /// Under way, too, what may change there: unlocks the board's parameters for a minute
        #[arg(long)]
        unlock: bool,
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
        /// Under way, too, what may change there: unlocks the board's parameters for a minute
        #[arg(long)]
        unlock: bool,
    },
    /// Keep the active parameters through power-off
    #[command(after_help = "Example:\n  backseat params store /dev/ttyACM0")]
    Store(Common),
    /// Show what the board has learnt of its vehicle in its dives
    #[command(after_help = LEARNT)]
    Learnt(Common),
    /// Have the board forget what its dives have taught: after a repair, new fins, other ballast
    #[command(after_help = "Example:\n  backseat params forget /dev/ttyACM0")]
    Forget(Common),
    /// Print the page docs/guide/parameters.md: every parameter with symbol, unit, default, range and meaning
    #[command(after_help = "Example:\n  backseat params docs > docs/guide/parameters.md")]
    Docs,
}

/// What the key is called; it is in no list, because a list is read.
const KEY: &str = "app.acoustic_key";
/// What a board's pins do, which it reads once.
const AT_START: [&str; 5] =
    ["app.abort_line", "app.drop_weight", "app.leak_detector", "app.supply_measured", "app.supply_ratio"];

/// `NAME=VALUE`.
#[derive(Clone, Debug, PartialEq)]
enum Assignment {
    Number(String, f64),
    Key(KeySource),
}

fn assignment(text: &str) -> Result<Assignment, String> {
    let (name, value) = text.split_once('=').ok_or("expected NAME=VALUE")?;
    let (name, value) = (name.trim(), value.trim());
    if name == KEY {
        return match (value, value.strip_prefix('@')) {
            ("none", _) => Ok(Assignment::Key(KeySource::None)),
            ("-", _) => Ok(Assignment::Key(KeySource::Asked)),
            (_, Some(path)) if !path.is_empty() => Ok(Assignment::Key(KeySource::File(path.into()))),
            _ => Err("a key on a command line can be seen by every user of this computer: expected @FILE, - (to be \
                      asked) or none"
                .to_owned()),
        };
    }
    let value = value.parse().map_err(|_| format!("{value}: not a number"))?;
    Ok(Assignment::Number(name.to_owned(), value))
}

/// Does what is asked.
pub fn run(args: &Args) -> anyhow::Result<()> {
    match &args.action {
        Action::Get { common, names } => get(common, names),
        Action::Set { common, values, unlock } => {
            let (mut numbers, mut key) = (Vec::new(), None);
            for value in values {
                match value {
                    Assignment::Number(name, value) => numbers.push((name.clone(), *value)),
                    Assignment::Key(source) => key = Some(source.read(KEY)?),
                }
            }
            set(common, &numbers, key, *unlock)
        }
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
            let done = format!("{} parameters to {}\n", list.len(), file.display());
            common.say(&json!({"parameters": list.len(), "file": file}), &done)
        }
        Action::Import { common, file, unlock } => set(common, &BoardFile::read(file)?.flatten(), None, *unlock),
        Action::Docs => console::print(parameters_page().as_bytes()),
        Action::Learnt(common) => learnt::show(common),
        Action::Forget(common) => learnt::forget(common),
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
    let key_wanted = names.is_empty() || names.iter().any(|name| name == KEY || name == "app");
    let unknown = |wanted: &&String| *wanted != KEY && !all.iter().any(|parameter| is(parameter, wanted));
    if let Some(unknown) = names.iter().find(unknown) {
        bail!("{unknown} is no parameter of this board, and no beginning of one");
    }
    let wanted = |parameter: &&Declared| names.is_empty() || names.iter().any(|name| is(parameter, name));
    let shown: Vec<&Declared> = all.iter().filter(wanted).collect();
    let key = if key_wanted { Some(board.has_key()?) } else { None };
    let mut json = json!({
        "firmware": board.identity.firmware,
        "parameter_schema": board.identity.schema,
        "parameters": shown.iter().map(|parameter| parameter.json()).collect::<Vec<_>>(),
    });
    let mut text = if shown.is_empty() { String::new() } else { table::text(&shown) };
    if let Some(has) = key {
        let state = if has { "set" } else { "not set" };
        json[KEY] = json!(state);
        text += &format!("{KEY}  {state}; a board never reveals it\n");
    }
    common.say(&json, &text)
}

fn set(common: &Common, values: &[(String, f64)], key: Option<Key>, unlock: bool) -> anyhow::Result<()> {
    let mut board = common.connect()?;
    let before = board.parameters()?;
    if !values.is_empty() {
        board.set_parameters(values, &before, unlock)?;
    }
    if let Some(key) = key {
        board.set_key(key)?;
    }
    let old = |name: &str| before.iter().find(|parameter| parameter.name == name).map(|parameter| parameter.value);
    let changed: Vec<_> = values
        .iter()
        .filter_map(|(name, to)| old(name).filter(|from| from != to).map(|from| (name, from, *to)))
        .collect();
    let restarts = |name: &str| {
        before.iter().any(|parameter| parameter.name == name && parameter.effect() == Some(Effect::Restart))
    };
    let restarting: Vec<&str> = changed.iter().map(|(name, ..)| name.as_str()).filter(|name| restarts(name)).collect();
    let at_start: Vec<&str> =
        changed.iter().map(|(name, ..)| name.as_str()).filter(|name| AT_START.contains(name)).collect();
    let mut json = json!({
        "set": values.len(),
        "restarts_navigation": !restarting.is_empty(),
        "at_start_of_the_board": at_start,
        "changed": changed.iter().map(|(name, from, to)| json!({"name": name, "from": from, "to": to})).collect::<Vec<_>>(),
    });
    let mut text = format!("{} parameters set, {} of them changed\n", values.len(), changed.len());
    for (name, from, to) in &changed {
        text += &format!("  {name}: {} -> {}\n", number(*from), number(*to));
    }
    if !restarting.is_empty() {
        text += &format!("navigation starts again, as it does for {}\n", restarting.join(", "));
    }
    if !at_start.is_empty() {
        text += &format!("a board reads {} when it starts: store them, and start it again\n", at_start.join(", "));
    }
    if let Some(key) = key {
        json[KEY] = json!(format!("{key:?}"));
        text += &format!("  {KEY}: {key:?}\n");
    }
    common.say(&json, &text)
}

fn for_file(parameter: &Declared) -> BoardParameter {
    let Declared { name, unit, value, .. } = parameter;
    let range = parameter.range();
    let parts = [unit, &range, parameter.description()].into_iter().filter(|part| !part.is_empty());
    let comment = parts.collect::<Vec<_>>().join("; ");
    BoardParameter { name: name.clone(), value: *value, comment }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn assignments() {
        assert_eq!(assignment("fins.cl[0]=-3.1e0"), Ok(Assignment::Number("fins.cl[0]".to_owned(), -3.1)));
        assert_eq!(assignment("app.acoustic_key=none"), Ok(Assignment::Key(KeySource::None)));
        assert_eq!(assignment("app.acoustic_key=-"), Ok(Assignment::Key(KeySource::Asked)));
        assert_eq!(assignment("app.acoustic_key=@k"), Ok(Assignment::Key(KeySource::File("k".into()))));
        let wrong = assignment("app.acoustic_key=0123456789abcdef").unwrap_err();
        assert!(!wrong.contains("0123"), "{wrong}");
        for text in ["fins.cl[0]", "fins.cl[0]=", "fins.cl[0]=big", "=1=2"] {
            assert!(assignment(text).is_err(), "{text}");
        }
    }
}
