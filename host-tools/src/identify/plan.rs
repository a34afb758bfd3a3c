//! `backseat identify --plan`: the mission with most information about the vehicle.

use super::Args;
use anyhow::bail;
use backseat_analysis::identify::plan::report;
use backseat_analysis::mission_file::{StoredMission, text_of};
use backseat_identify::plan::{self, Limits};
use backseat_logs::VehicleFile;
use backseat_logs::output;
use backseat_wire::hostlink::Waypoint;
use std::path::PathBuf;

/// Planning of a mission
#[derive(clap::Args)]
pub struct Planning {
    /// Instead of a log: write the mission with most information about the vehicle, TOML for `backseat mission put`
    #[arg(long, value_name = "MISSION.toml", conflicts_with = "log")]
    plan: Option<PathBuf>,
    /// Length of the planned mission, s
    #[arg(long, value_name = "S", default_value_t = 1800.0)]
    duration: f64,
    /// Shallowest and deepest of the planned mission, m
    #[arg(long, value_name = "MIN,MAX", value_delimiter = ',', default_value = "3,20")]
    depth: Vec<f64>,
    /// Slowest and fastest of the planned mission, m/s
    #[arg(long, value_name = "MIN,MAX", value_delimiter = ',', default_value = "0.7,1.5")]
    speed: Vec<f64>,
    /// Seed of the legs that are tried
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

impl Planning {
    /// Plans the mission and writes it.
    pub fn run(&self, args: &Args) -> anyhow::Result<()> {
        let Some(path) = &self.plan else { bail!("a log or --plan MISSION.toml is needed") };
        args.output.check(&[&self.plan])?;
        let declared = match &args.vehicle {
            Some(path) => VehicleFile::read(path)?,
            None => VehicleFile::reference(),
        };
        let (&[shallow, deep], &[slow, fast]) = (&self.depth[..], &self.speed[..]) else {
            bail!("--depth and --speed take two numbers each, smallest and largest");
        };
        let limits = Limits { depth_m: [shallow, deep], speed_mps: [slow, fast], ..Limits::DEFAULT };
        let plan = plan::plan(&declared.parameters, &limits, self.duration, self.seed)?;
        let waypoints: Vec<Waypoint> = plan
            .waypoints
            .iter()
            .map(|w| Waypoint { x_m: w.x_m, y_m: w.y_m, depth_m: w.depth_m, speed_mps: w.speed_mps })
            .collect();
        let text = text_of(&StoredMission { waypoints, ..StoredMission::default() });
        output::write(path, args.output.existing(), |file| file.write_all(text.as_bytes()))?;
        args.output.print(&report(&plan, path, 0.5 * self.depth.iter().sum::<f64>()))
    }
}
