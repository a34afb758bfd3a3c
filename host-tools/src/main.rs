//! `backseat`: the lab's one command-line tool.

use std::process::ExitCode;

fn main() -> ExitCode {
    host_tools::command_line(std::env::args_os())
}
