//! A made-up mission: ten 1 km lines 100 m apart, a ship on a circle of 600 m, a range every 30 s.

use crate::random::Random;
use std::f64::consts::TAU;

use backseat_report::{Provenance, Report, Table, plots};
use plots::{
    Bar, BarPlot, BeforeAfter, Ellipse, ErrorPlot, Histogram, Innovation, InnovationPlot, Scale, TimePlot, TrackPlot,
};

/// Position along the lines after so many metres, turns as half circles.
fn lawnmower(metres: f64) -> (f64, f64) {
    let turn = 50.0 * std::f64::consts::PI;
    let line = (metres / (1000.0 + turn)).floor();
    let along = metres - line * (1000.0 + turn);
    let east = 100.0 * line;
    let (north, east) = if along <= 1000.0 {
        (along, east)
    } else {
        let angle = (along - 1000.0) / 50.0;
        (1000.0 + 50.0 * angle.sin(), east + 50.0 * (1.0 - angle.cos()))
    };
    (if line % 2.0 == 0.0 { north } else { 1000.0 - north }, east)
}

/// Wandering of a dead reckoning, in metres after so many hours.
fn drift(t_h: f64, metres: f64) -> (f64, f64) {
    (metres * t_h * (1.0 + 0.2 * (TAU * t_h).sin()), -0.6 * metres * t_h.powf(1.3))
}

pub fn report() -> Report {
    let mut noise = Random(7);
    let steps = 100_000;
    let times: Vec<f64> = (0..steps).map(|i| f64::from(i) * 3.19 / f64::from(steps)).collect();
    let truth: Vec<_> = times.iter().map(|t| lawnmower(t * 3600.0)).collect();
    let mut slow = (0.0, 0.0);
    let estimate: Vec<_> = truth
        .iter()
        .map(|(x, y)| {
            slow = (0.9995 * slow.0 + 0.02 * noise.normal(), 0.9995 * slow.1 + 0.02 * noise.normal());
            (x + slow.0, y + slow.1)
        })
        .collect();
    let reckoned: Vec<_> =
        truth.iter().zip(&times).map(|(p, t)| (p.0 + drift(*t, 22.0).0, p.1 + drift(*t, 22.0).1)).collect();
    let ship: Vec<_> = times
        .iter()
        .map(|t| (TAU * t * 7200.0 / (TAU * 600.0)).sin_cos())
        .map(|(s, c)| (500.0 + 600.0 * s, 450.0 + 600.0 * c))
        .collect();
    let error = |track: &[(f64, f64)]| -> Vec<(f64, f64)> {
        truth.iter().zip(track).zip(&times).map(|((a, b), t)| (*t, (a.0 - b.0).hypot(a.1 - b.1))).collect()
    };
    let (dynamic, dead) = (error(&estimate), error(&reckoned));
    let bound: Vec<_> = times.iter().map(|t| (*t, 1.1 + 0.5 * (t * 120.0).fract())).collect();
    let every = |n: usize| (0..truth.len()).step_by(n);
    let ellipses: Vec<_> = every(262)
        .map(|i| Ellipse {
            x_m: estimate[i].0,
            y_m: estimate[i].1,
            xx_m2: 0.3,
            xy_m2: 0.1 * (i as f64 / 9e3).sin(),
            yy_m2: 0.12,
        })
        .collect();
    let paths: Vec<_> = every(278).map(|i| (truth[i], ship[i])).collect();
    let waypoints: Vec<_> = (0..10)
        .flat_map(|i| {
            let e = 100.0 * f64::from(i);
            if i % 2 == 0 { [(0.0, e), (1000.0, e)] } else { [(1000.0, e), (0.0, e)] }
        })
        .collect();
    let ranges: Vec<_> = every(278)
        .map(|i| {
            let outlier = i % (278 * 37) == 278 * 5;
            Innovation {
                t_h: times[i],
                value: if outlier { 12.0 } else { 1.1 } * noise.normal(),
                sigma: 1.1 + 0.1 * (i as f64 / 4e3).sin(),
                fused: !outlier,
            }
        })
        .collect();
    let heading: Vec<_> =
        times.iter().map(|t| Innovation { t_h: *t, value: noise.normal(), sigma: 1.0, fused: true }).collect();
    let normalised: Vec<f64> = (0..20_000).map(|_| 1.05 * noise.normal()).collect();
    let depth: Vec<_> = times.iter().map(|t| (*t, 3.0 * (1.0 - (-t * 40.0).exp()) + 0.03 * noise.normal())).collect();
    let commanded: Vec<_> = times.iter().map(|t| (*t, 3.0)).collect();
    let band: Vec<_> = depth.iter().map(|(t, v)| (*t, v - 0.15, v + 0.15)).collect();

    Report::new("Ten lines without a DVL", "The dynamic filter held 0.46 m (median) and 0.98 m (95 %) over 3.2 h without a DVL, 60 times better than dead reckoning.")
        .table(
            Table::new("Horizontal error and consistency by configuration", &["configuration", "median [m]", "95 % [m]", "maximum [m]", "NIS range", "NIS depth", "real-time factor"])
                .row(["dynamic, no DVL", "0.46", "0.98", "1.61", "1.02", "0.99", "412"])
                .row(["kinematic, no DVL", "204", "728", "1034", "1.00", "1.01", "455"])
                .row(["kinematic + DVL", "0.34", "0.82", "1.20", "0.98", "1.00", "431"])
                .row(["compass + DVL dead reckoning", "27.4", "71.0", "80.2", "–", "–", "880"]),
        )
        .section("Track")
        .figure(
            "True and estimated tracks of the vehicle, covariance ellipses of the estimate, acoustic paths and waypoints. North is up.",
            plots::track(&TrackPlot {
                truth: Some(&truth),
                estimates: &[("dynamic, no DVL", &estimate), ("compass + DVL dead reckoning", &reckoned)],
                ellipses: &ellipses,
                acoustic_paths: &paths,
                ship: Some(&ship),
                waypoints: &waypoints,
            }),
        )
        .section("Error")
        .text("The shaded band is what the filter itself expects; an error that leaves it for long means that the model is wrong.")
        .figure(
            "Horizontal error of the dynamic filter against time.",
            plots::error_vs_time(&ErrorPlot { y_label: "horizontal error [m]", series: &[("dynamic, no DVL", &dynamic)], bound: Some(("95 % of the filter", &bound)), scale: Scale::Linear }),
        )
        .figure(
            "The same with dead reckoning, on a logarithmic axis.",
            plots::error_vs_time(&ErrorPlot {
                y_label: "horizontal error [m]",
                series: &[("dynamic, no DVL", &dynamic), ("compass + DVL dead reckoning", &dead)],
                bound: Some(("95 % of the filter", &bound)),
                scale: Scale::Log,
            }),
        )
        .figure("Depth.", plots::time_series(&TimePlot { y_label: "depth [m]", series: &[("true", &depth), ("commanded", &commanded)], band: Some(("±3 sigma", &band)) }))
        .section("Consistency")
        .figure("Range innovations.", plots::innovations(&InnovationPlot { y_label: "range innovation [m]", innovations: &ranges }))
        .figure("Heading innovations.", plots::innovations(&InnovationPlot { y_label: "heading innovation [deg]", innovations: &heading }))
        .figure("Normalised innovations.", plots::histogram(&Histogram { x_label: "innovation / sigma", values: &normalised, normal: Some((0.0, 1.0)) }))
        .section("Before and after")
        .figure(
            "Held-out data.",
            plots::before_after(&BeforeAfter {
                x_label: "horizontal error [m]",
                rows: &[("position, 10 min", 41.0, 1.2), ("position, 60 min", 210.0, 3.9), ("navigation, median", 93.0, 0.72), ("navigation, 95 %", 117.0, 2.25)],
                scale: Scale::Log,
            }),
        )
        .figure(
            "Identified parameters.",
            plots::bars(&BarPlot {
                x_label: "identified / true [-], 95 % interval",
                bars: &[
                    Bar { name: "m11", value: 1.02, interval: Some((0.97, 1.07)) },
                    Bar { name: "d11", value: 0.94, interval: Some((0.83, 1.05)) },
                    Bar { name: "water_current.north_mps", value: 1.13, interval: Some((0.7, 1.5)) },
                    Bar { name: "beta5", value: 0.99, interval: None },
                ],
                reference: Some(("true", 1.0)),
            }),
        )
        .provenance(Provenance { command: "hil-sim run --seed 7", seed: Some(7), version: "0.1.0" })
}
