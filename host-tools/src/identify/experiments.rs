//! What `backseat identify` does without a log: plan a mission, and the studies of plans and of faults.

use super::{Args, compensation, faults, plan};
use crate::console;
use crate::mission::file::text_of;
use anyhow::bail;
use backseat_data::VehicleFile;
use backseat_data::output::{self, Existing};
use backseat_wire::hostlink::Waypoint;
use plan::Limits;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Plans and studies
#[derive(clap::Args)]
pub struct Experiments {
    /// Instead of a log: write the mission that tells most about the vehicle, TOML for `backseat mission put`
    #[arg(long, value_name = "MISSION.toml", conflicts_with_all = ["log", "study"])]
    plan: Option<PathBuf>,
    /// Instead of a log: the planned mission against a lawnmower and open-loop inputs
    #[arg(long, group = "studies", conflicts_with_all = ["log", "study"])]
    plan_study: bool,
    /// Length of the planned mission, s
    #[arg(long, value_name = "S", default_value_t = 1800.0)]
    duration: f64,
    /// Shallowest and deepest of the planned mission, m
    #[arg(long, value_name = "MIN,MAX", value_delimiter = ',', default_value = "3,20")]
    depth: Vec<f64>,
    /// Slowest and fastest of the planned mission, m/s
    #[arg(long, value_name = "MIN,MAX", value_delimiter = ',', default_value = "0.7,1.5")]
    speed: Vec<f64>,
    /// Picks the legs that are tried, or the first seed of the fault study
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Instead of a log: vehicles that break under way, what the monitor says, and what compensation gains
    #[arg(long, group = "studies", conflicts_with_all = ["log", "study"])]
    fault_study: bool,
    /// Hours without fault in the fault study
    #[arg(long, value_name = "H", default_value_t = 204.0, requires = "fault_study")]
    hours: f64,
}

impl Experiments {
    fn limits(&self) -> anyhow::Result<Limits> {
        let (&[shallow, deep], &[slow, fast]) = (&self.depth[..], &self.speed[..]) else {
            bail!("--depth and --speed take two numbers each, smallest and largest");
        };
        Ok(Limits { depth_m: [shallow, deep], speed_mps: [slow, fast], ..Limits::DEFAULT })
    }

    /// Does what was asked for; `None` if a log is to be identified.
    pub fn run(&self, args: &Args) -> Option<anyhow::Result<()>> {
        if self.fault_study {
            return Some(self.faults(args));
        }
        if self.plan_study {
            return Some(self.limits().and_then(|limits| plan::run_study(args.runs, &limits, self.duration)));
        }
        self.plan.as_ref().map(|path| self.plan(args, path))
    }

    fn faults(&self, args: &Args) -> anyhow::Result<()> {
        if args.runs < 2 || self.hours.is_nan() || self.hours <= 0.0 {
            bail!("--runs takes 2 or more, --hours more than none");
        }
        faults::run(args.runs, self.hours, self.seed, args.json)?;
        if args.json {
            return Ok(());
        }
        let table = compensation::markdown(args.runs.div_ceil(10).max(2), self.seed)?;
        console::print(format!("\n{table}").as_bytes())
    }

    fn plan(&self, args: &Args, path: &Path) -> anyhow::Result<()> {
        let existing = if args.force { Existing::Replace } else { Existing::Keep };
        output::check(path, existing)?;
        let declared = match &args.vehicle {
            Some(path) => VehicleFile::read(path)?,
            None => VehicleFile::reference(),
        };
        let plan = plan::plan(&declared.parameters, &self.limits()?, self.duration, self.seed)?;
        let waypoints: Vec<Waypoint> = plan
            .waypoints
            .iter()
            .map(|w| Waypoint { x_m: w.x_m, y_m: w.y_m, depth_m: w.depth_m, speed_mps: w.speed_mps })
            .collect();
        let text = text_of(&waypoints);
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
