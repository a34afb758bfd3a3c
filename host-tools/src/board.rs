//! Arguments and output that all commands for a board share.

use backseat_link::board::{Board, PortName};
use backseat_report::console;
use serde_json::Value;

// Arguments of every command of the board. As a doc comment clap would print this as what the command does.
#[derive(clap::Args)]
pub struct Common {
    /// Serial device of the board's host port, PATH or PATH:BAUD
    pub port: PortName,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

impl Common {
    /// The board at the port.
    pub fn connect(&self) -> anyhow::Result<Board> {
        Board::connect(&self.port)
    }

    /// Prints the outcome, as `text` or as JSON.
    pub fn say(&self, json: &Value, text: &str) -> anyhow::Result<()> {
        if self.json { console::print(format!("{json}\n").as_bytes()) } else { console::print(text.as_bytes()) }
    }
}
