//! How well the numbers of all effects could be told in runs of which the effects are known: by simulation.

use super::entries::ENTRIES;
use super::fitted::{LENGTHS_S, fitted};
use super::numbers::open_of;
use super::{configurations, textbook};
use backseat_identify::short_runs::unknowns::{Unknown, coefficients, of_effect};
use backseat_identify::short_runs::{self, Draft, Problem, Starts};
use backseat_logs::{Log, VehicleFile};

/// How well one number could be known.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// Name of the number; one of each configuration stands as `buoyancy_kg[1]`.
    pub name: String,
    /// One sigma, in its unit.
    pub sigma: f64,
    /// What the textbook leaves open of it around none: inside, it is no finding.
    pub open: [f64; 2],
}

/// Every number of every entry, all of them and all coefficients being free, by the information of the runs. Taken at the
/// fit that has the effects that are there and no other.
///
/// # Errors
/// In one line: too few runs, or a fit that does not converge.
pub fn known(log: &Log, declared: &VehicleFile, effects: &[&'static str]) -> Result<Vec<Known>, String> {
    let mut runs = short_runs::runs(log);
    let configurations = configurations::group(&mut runs).len();
    let (vehicle, _) = textbook::calibrated(declared, &runs);
    let problem = |effects: &mut dyn Iterator<Item = &'static str>, starts: Starts| {
        let unknowns = coefficients().into_iter().chain(effects.flat_map(|effect| of_effect(effect, configurations)));
        Problem { runs: &runs, base: Draft::of(&vehicle, configurations), unknowns: unknowns.collect(), starts }
    };
    let held = fitted(problem(&mut effects.iter().copied(), Starts::Held), None)?;
    let there = fitted(problem(&mut effects.iter().copied(), Starts::Open), held.start())?;
    let asked = problem(&mut ENTRIES.iter().map(|entry| entry.name), Starts::Open);
    let value = |name: &str| {
        let place = there.problem.unknowns.iter().position(|unknown| unknown.name == name);
        place.map_or(0.0, |place| there.fit.values[place])
    };
    let values: Vec<f64> = asked.unknowns.iter().map(|unknown| value(&unknown.name)).collect();
    let covariance = asked.covariance_at(&|_| true, &values, LENGTHS_S[LENGTHS_S.len() - 1]);
    let covariance = covariance.ok_or("no information at the fit")?;
    let plant = there.draft().parameters;
    let of_effects = asked.unknowns.into_iter().enumerate().filter(|(_, unknown)| !unknown.effect.is_empty());
    let known = |(place, unknown): (usize, Unknown)| {
        let (sigma, open) = (covariance[(place, place)].sqrt(), open_of(&unknown, &plant));
        Known { name: unknown.name, sigma, open }
    };
    Ok(of_effects.map(known).collect())
}
