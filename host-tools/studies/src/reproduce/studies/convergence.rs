//! Convergence of the adaptive identifier's parameters and predictions to those of the vehicle.

use super::identification::Case;
use super::{Measured, Study};
use crate::identification::experiment::declared;
use anyhow::anyhow;
use backseat_core::identification::Identifier;
use backseat_core::identification::theta::{BETA1, D11, M11, PARAMETERS, Theta, W, theta_of};
use backseat_identify::identifier::config;
use backseat_identify::validation::COLUMNS;
use backseat_identify::{Method, identify};
use std::ops::Range;

/// The board's identifier along an experiment.
pub const CONVERGENCE: Study = Study { name: "convergence", run };

/// Noise of linear velocity, m/s.
const NOISE: f64 = 0.013;
/// Time between points of a curve, s, and samples.
const CURVE_S: usize = 100;
const CURVE: usize = 10 * CURVE_S;
/// Predictions are judged as often as this many points.
const JUDGE: usize = 5;
/// B1 and B2 are zero in truth: their error is in units of B3.
const B3: usize = 15;

const GROUPS: [(&str, Range<usize>); 4] = [
    ("inertia", M11..D11),
    ("drag", D11..W),
    ("weight and righting", W..BETA1),
    ("fins and propeller", BETA1..PARAMETERS),
];

fn run(seed: u64) -> anyhow::Result<Measured> {
    let case = Case::new(seed, NOISE, 0.3, [0.0; 2])?;
    let truth = theta_of(&declared());
    let mut measured = Measured::default();
    let mut identifier = Box::new(Identifier::new());
    identifier.configure(&config(&case.options), &case.prior).map_err(|error| anyhow!("{error:?}"))?;

    let mut curves: [Vec<(f64, f64)>; GROUPS.len()] = Default::default();
    let mut predicted: Vec<(f64, [f64; 8])> = Vec::new();
    for (k, (sample, since)) in case.data.with_input_since().enumerate() {
        identifier.sample(sample.time_us, &sample.attitude, &sample.velocity, since);
        if (k + 1) % CURVE != 0 {
            continue;
        }
        let t_h = sample.time_us as f64 / 3.6e9;
        let theta = identifier.estimate().unwrap_or_else(|| theta_of(&case.prior));
        for (curve, (_, range)) in curves.iter_mut().zip(&GROUPS) {
            curve.push((t_h, error(&theta, &truth, range)));
        }
        if (k + 1) % (CURVE * JUDGE) == 0 {
            let vehicle = identifier.parameters().unwrap_or(case.prior);
            predicted.push((t_h, case.errors(&vehicle)));
        }
    }
    let (prior, before) = (theta_of(&case.prior), case.errors(&case.prior));
    let offline = identify(Method::Aid, &case.data, &case.prior, &case.options, &|_| {})?;
    let offline = theta_of(&offline.vehicle);
    for ((name, range), curve) in GROUPS.iter().zip(curves) {
        measured.set(name, "prior_percent", error(&prior, &truth, range));
        let at = |point: usize| curve.get(point).map_or(f64::NAN, |point| point.1);
        measured.set(name, "fifth_percent", at(1000 / CURVE_S - 1));
        measured.set(name, "online_percent", curve.last().map_or(f64::NAN, |point| point.1));
        measured.set(name, "aid_percent", error(&offline, &truth, range));
        measured.curve("parameters", name, curve.into_iter());
    }
    for (column, name) in COLUMNS.iter().enumerate() {
        let points: Vec<(f64, f64)> = predicted.iter().map(|(t_h, errors)| (*t_h, errors[column])).collect();
        let at = |point: usize| points.get(point).map_or(f64::NAN, |point| point.1);
        measured.set(name, "prior", before[column]);
        measured.set(name, "fifth", at(1000 / (CURVE_S * JUDGE) - 1));
        measured.set(name, "end", points.last().map_or(f64::NAN, |point| point.1));
        measured.curve("prediction", name, points.iter().map(|(t_h, error)| (*t_h, error / before[column])));
    }
    Ok(measured)
}

/// Root mean square of the relative errors of a group, per cent.
fn error(theta: &Theta, truth: &Theta, range: &Range<usize>) -> f64 {
    let squares = range.clone().filter(|j| *j != M11).map(|j| {
        let size = if truth[j] == 0.0 { truth[B3] } else { truth[j] };
        ((theta[j] - truth[j]) / size).powi(2)
    });
    let squares: Vec<f64> = squares.collect();
    100.0 * (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}
