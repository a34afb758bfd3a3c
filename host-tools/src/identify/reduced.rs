//! Surge and yaw of a log that has servo counts in place of propeller speed and fin angles.

use super::Args;
use anyhow::bail;
use backseat_data::Log;
use backseat_data::importers::Imported;
use backseat_data::output::Existing;
use std::path::Path;

pub fn is_for(_log: &Log) -> bool {
    false
}

pub fn run(_args: &Args, _imported: &Imported, _page: Option<&Path>, _existing: Existing) -> anyhow::Result<()> {
    bail!("to come")
}
