//! Arguments and output that all commands for a board share.

use crate::output;
use anyhow::anyhow;
use backseat_link::board::{Board, PortName};
use backseat_report::{Report, console};
use backseat_wire::ship_state::Key;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::crossterm::terminal::{disable_raw_mode, enable_raw_mode};
use serde_json::Value;
use std::io::{BufRead as _, IsTerminal as _};
use std::path::{Path, PathBuf};

// Arguments of every command of the board. As a doc comment clap would print this as what the command does.
#[derive(clap::Args)]
pub struct Common {
    /// Serial device of the board's host port, PATH or PATH:BAUD
    pub port: PortName,
    /// The board's key, for what changes a flight; `-`: asked for
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl Common {
    /// The board at the port.
    pub fn connect(&self) -> anyhow::Result<Board> {
        Board::connect(&self.port, KeySource::of(self.key.as_deref()).read("the board's key")?)
    }

    /// Prints a report.
    pub fn show(&self, report: &Report) -> anyhow::Result<()> {
        output::print(report, self.json)
    }

    /// Prints the outcome, as `text` or as JSON.
    pub fn say(&self, json: &Value, text: &str) -> anyhow::Result<()> {
        if self.json { console::print(format!("{json}\n").as_bytes()) } else { console::print(text.as_bytes()) }
    }
}

/// Where a key comes from; never from the command line.
#[derive(Clone, Debug, PartialEq)]
pub enum KeySource {
    /// No key.
    None,
    /// A file of 32 hexadecimal digits.
    File(PathBuf),
    /// Whoever sits here, or a pipe.
    Asked,
}

impl KeySource {
    /// What `--key` names.
    pub fn of(path: Option<&Path>) -> Self {
        match path {
            None => Self::None,
            Some(path) if path.as_os_str() == "-" => Self::Asked,
            Some(path) => Self::File(path.to_owned()),
        }
    }

    /// The key; `what` it is for whoever is asked.
    pub fn read(&self, what: &str) -> anyhow::Result<Key> {
        let (text, place) = match self {
            Self::None => return Ok(Key::NONE),
            Self::File(path) => (backseat_logs::settings::read(path)?, path.display().to_string()),
            Self::Asked => (ask(what)?, "what was given as the key".to_owned()),
        };
        // an error does not show it
        text.trim().parse().map_err(|_| anyhow!("{place}: neither 32 hexadecimal digits nor none"))
    }
}

/// A line of standard input; at a terminal it is not shown.
fn ask(what: &str) -> anyhow::Result<String> {
    let mut text = String::new();
    if !std::io::stdin().is_terminal() {
        std::io::stdin().lock().read_line(&mut text)?;
        return Ok(text);
    }
    console::say(&format!("{what}, 32 hexadecimal digits (not shown):"));
    enable_raw_mode()?;
    let read = loop {
        match event::read() {
            Ok(Event::Key(KeyEvent { code, modifiers, kind: KeyEventKind::Press, .. })) => match code {
                KeyCode::Enter => break Ok(()),
                KeyCode::Char('c') if modifiers.contains(KeyModifiers::CONTROL) => break Err(anyhow!("interrupted")),
                KeyCode::Char(c) => text.push(c),
                KeyCode::Backspace => {
                    text.pop();
                }
                _ => {}
            },
            Ok(_) => {}
            Err(error) => break Err(error.into()),
        }
    };
    disable_raw_mode()?;
    read.map(|()| text)
}
