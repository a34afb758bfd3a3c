//! `backseat identify --plan`: the mission with most information about the vehicle.

use super::Args;
use crate::mission::file::text_of;
use anyhow::bail;
use backseat_identify::plan::{self, Limits};
use backseat_logs::VehicleFile;
use backseat_logs::output::{self, Existing};
use backseat_report::console;
use backseat_wire::hostlink::Waypoint;
use serde_json::json;
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
        let existing = if args.force { Existing::Replace } else { Existing::Keep };
        output::check(path, existing)?;
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
        let text = text_of(&waypoints, &[]);
        output::write(path, existing, |file| file.write_all(text.as_bytes()))?;
        let ([shallow, deep], steepest) = (plan.depths_m, plan.steepest_rad.to_degrees());
        let (information, remaining) = (plan.collected.log_determinant(), plan.collected.remaining_percent());
        let text = if args.json {
            let object = json!({
                "mission": path, "waypoints": waypoints.len(), "duration_s": plan.duration_s,
                "depth_m": [shallow, deep], "pitch_deg": steepest,
                "log_determinant": information, "remaining_percent": remaining,
            });
            format!("{object}\n")
        } else {
            format!(
                "{}: {} waypoints, {:.0} s from where it is started, heading north at {:.1} m depth\n\
                 {shallow:.1} to {deep:.1} m deep, steepest pitch {steepest:.0} degrees\n\
                 information gained: {information:.0} (log of the determinant, in units of a prior wrong by 30 %)\n\
                 expected error of the parameters, sensors of Table 4.13: {remaining:.1} % rms\n",
                path.display(),
                waypoints.len(),
                plan.duration_s,
                0.5 * (self.depth.iter().sum::<f64>()),
            )
        };
        console::print(text.as_bytes())
    }
}
