//! The mission with most information about the vehicle: `backseat identify --plan`.

use crate::provenance;
use backseat_identify::plan::Plan;
use backseat_report::Report;
use serde_json::json;
use std::path::Path;

/// What a planned mission, written to `path`, is expected to show; it starts at `depth_m`.
pub fn report(plan: &Plan, path: &Path, depth_m: f64) -> Report {
    let ([shallow, deep], steepest_deg) = (plan.depths_m, plan.steepest_rad.to_degrees());
    let (information, remaining) = (plan.collected.log_determinant(), plan.collected.remaining_percent());
    let answer = format!(
        "{}: {} waypoints, {:.0} s from where it is started, heading north at {depth_m:.1} m depth",
        path.display(),
        plan.waypoints.len(),
        plan.duration_s
    );
    let report = Report::new("Mission with most information", answer)
        .fact("depth", format!("{shallow:.1} to {deep:.1} m, steepest pitch {steepest_deg:.0} degrees"))
        .fact(
            "information gained",
            format!("{information:.0} (log of the determinant, in units of a prior wrong by 30 %)"),
        )
        .fact("expected error of the parameters", format!("{remaining:.1} % rms, sensors of Table 4.13"))
        .value("mission", path.display().to_string())
        .value("waypoints", plan.waypoints.len())
        .value("duration_s", plan.duration_s)
        .value("depth_m", json!([shallow, deep]))
        .value("pitch_deg", steepest_deg)
        .value("log_determinant", information)
        .value("remaining_percent", remaining);
    provenance::of(report, None)
}
