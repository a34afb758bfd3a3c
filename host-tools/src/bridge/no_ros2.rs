//! What stands for ROS 2 in a build without it: nothing that could be opened.

use super::commands::Commands;
use super::counts::Counts;
use super::{Domain, Place};
use anyhow::bail;
use backseat_wire::hostlink::Telemetry;
use std::time::Instant;

pub const fn limit_memory() -> anyhow::Result<()> {
    Ok(())
}

pub enum Node {}

impl Node {
    pub fn open(domain: Domain, _name: &str, _accepts: bool) -> anyhow::Result<Self> {
        bail!("--ros2 {domain}: not in this build; take a release's archive, or build with --features ros2")
    }

    pub const fn send(&self, _place: &Place<'_>) {
        match *self {}
    }

    pub const fn name_causes(&mut self, _statement: &str) {
        match *self {}
    }

    pub const fn diagnose(&mut self, _telemetry: &Telemetry, _utc_us: u64, _arrived: Instant) {
        match *self {}
    }

    pub const fn attend(&mut self, _commands: &Commands) {
        match *self {}
    }

    pub fn answer(&self, _data: String) {
        match *self {}
    }

    pub const fn counts(&self) -> &Counts {
        match *self {}
    }
}
