//! What a run gave, for the eye.

use super::estimates;
use super::result::{Against, Estimate, NavigationResult};
use backseat_core::navigation::Sensor;
use backseat_core::state::{X, Y};
use backseat_estimation::filter::FilterRun;
use backseat_logs::stats::{median, nis_bounds95};
use std::fmt::Write as _;
use std::path::Path;

impl NavigationResult<'_> {
    /// The text of the command.
    pub fn text(&self, report: Option<&Path>, track: Option<&Path>) -> String {
        let mut out = String::new();
        let _ = writeln!(
            out,
            "{} ({}), {} rows, {}",
            self.log.path.display(),
            self.format,
            self.log.rows.len(),
            duration(self.log.duration_s())
        );
        let _ = writeln!(out, "{}", self.description);
        for note in &self.notes {
            let _ = writeln!(out, "note: {note}");
        }
        if let Estimate::Filter(run) = &self.estimate {
            sensors(&mut out, run);
            estimates::text(&mut out, run);
        }
        out.push('\n');
        if let Some((against, error)) = self.error_summary() {
            let what = match against {
                Against::Truth => "the truth",
                Against::Gnss => "GNSS fixes, none of which was used after the first",
            };
            let _ = writeln!(
                out,
                "horizontal error   median {:.2} m, 95 % {:.2} m, max {:.2} m   against {what} ({} times)",
                error.median_m, error.p95_m, error.max_m, error.count
            );
        }
        if let Some(error) = self.smoothed_summary() {
            let _ = writeln!(
                out,
                "smoothed           median {:.2} m, 95 % {:.2} m, max {:.2} m   against the truth ({} times)",
                error.median_m, error.p95_m, error.max_m, error.count
            );
        }
        if let Estimate::Filter(run) = &self.estimate {
            fixes_before_use(&mut out, run);
        }
        if let Some([x_m, y_m]) = self.estimate.last_m() {
            let sigma = match &self.estimate {
                Estimate::Filter(run) => run
                    .track
                    .last()
                    .map_or_else(String::new, |s| format!("   one sigma {:.2} m, {:.2} m", s.sigma[X], s.sigma[Y])),
                Estimate::DeadReckoning(_) => String::new(),
            };
            let _ = writeln!(out, "final position     x {x_m:.2} m, y {y_m:.2} m{sigma}");
        }
        if let Estimate::Filter(run) = &self.estimate {
            let _ = writeln!(out, "digest             {:016x}", run.digest);
        }
        let _ = writeln!(
            out,
            "time               {:.3} s ({:.3} s of it reading), {:.0} x real time",
            self.wall_s,
            self.read_s,
            self.rate()
        );
        for (name, path) in [("track", track), ("report", report)] {
            if let Some(path) = path {
                let _ = writeln!(out, "{name:<18} {}", path.display());
            }
        }
        for doubt in &self.health.doubts {
            let _ = writeln!(out, "DO NOT TRUST       {doubt}");
        }
        out
    }
}

fn sensors(out: &mut String, run: &FilterRun) {
    let _ = writeln!(out, "\n{:<10} {:>8} {:>9} {:>7}   95 % if consistent", "sensor", "fused", "rejected", "NIS");
    for sensor in &run.sensors {
        let nis = sensor.nis.map_or_else(|| "-".to_owned(), |nis| format!("{nis:.3}"));
        let bounds = nis_bounds95(sensor.fused).map_or_else(String::new, |(lo, hi)| format!("{lo:.3} to {hi:.3}"));
        let name = sensor.sensor.name();
        let _ = writeln!(out, "{name:<10} {:>8} {:>9} {nis:>7}   {bounds}", sensor.fused, sensor.rejected);
    }
}

/// Distances between fixes and the estimate before it knew them.
fn fixes_before_use(out: &mut String, run: &FilterRun) {
    let distances: Vec<f64> = gnss_distances(run).iter().map(|(_, distance)| *distance).collect();
    if let Some(median_m) = median(&distances) {
        let count = distances.len();
        let _ = writeln!(out, "GNSS fixes         median {median_m:.2} m from the estimate before their use ({count})");
    }
}

/// (time µs, m) of every fix of the vehicle from the estimate before its use, from both innovations.
pub fn gnss_distances(run: &FilterRun) -> Vec<(u64, f64)> {
    let of_gnss = || run.fusions.iter().filter(|record| record.sensor == Sensor::VehicleGnss);
    of_gnss()
        .zip(of_gnss().skip(1))
        .filter(|(x, y)| (x.axis, y.axis) == (0, 1) && x.time_us == y.time_us)
        .map(|(x, y)| (x.time_us, x.innovation.hypot(y.innovation)))
        .collect()
}

fn duration(seconds: f64) -> String {
    if seconds < 120.0 {
        format!("{seconds:.1} s")
    } else if seconds < 7200.0 {
        format!("{:.1} min", seconds / 60.0)
    } else {
        format!("{:.2} h", seconds / 3600.0)
    }
}
