//! Which effects the runs show: all are fitted, those that no run needs are taken out one by one, and those that stay are
//! added again in the order of what each gains, with predictions of each run by a fit to the others.

use super::entries::{ENTRIES, Entry, MOTOR_STOP};
use super::torque::{DELAY, EFFECT as TORQUE, Torque};
use super::{configurations, textbook};
use backseat_identify::short_runs::predict::{Squares, open_loop};
use backseat_identify::short_runs::recording::{Wanted, windows};
use backseat_identify::short_runs::unknowns::{Place, coefficients, into_vehicle, of_effect};
use backseat_identify::short_runs::{self, Draft, Fit, Problem, Run, Unknown};
use backseat_logs::short_runs::{COMMON, Configuration, OF_CONFIGURATION};
use backseat_logs::stats::f_tail;
use backseat_logs::{Log, VehicleFile};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Horizons of the predictions, s.
pub const HORIZONS_S: [f64; 3] = [5.0, 10.0, 20.0];
/// Lengths of the windows as the fit proceeds: short ones converge from afar.
const LENGTHS_S: [f64; 3] = [5.0, 10.0, 20.0];
/// Cost that an effect has to take away, beside 2 for each of its numbers (Akaike).
const LEAST_GAIN: f64 = 8.0;
/// Fewer runs say nothing of how far a value differs from run to run.
const FEWEST_RUNS: usize = 4;
/// Prior's share of the information from which a value is the prior's.
const PRIORS: f64 = 0.5;
/// Correlation from which two values are told apart badly.
const ALIKE: f64 = 0.9;

/// One number of an effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Value.
    pub value: f64,
    /// 95 % interval.
    pub ci95: [f64; 2],
    /// Value without the effect.
    pub none: f64,
    /// Share of the information that is the prior's.
    pub prior_share: f64,
}

impl Parameter {
    /// Whether the interval excludes that there is no effect.
    #[must_use]
    pub fn is_shown(&self) -> bool {
        self.none < self.ci95[0] || self.none > self.ci95[1]
    }
}

/// An effect that the runs show.
#[derive(Clone, Debug)]
pub struct Found {
    /// What it is.
    pub entry: &'static Entry,
    /// Its numbers.
    pub parameters: Vec<Parameter>,
    /// Probability of values so far from none by chance.
    pub p_value: f64,
    /// Other entries whose values these runs do not tell from it, with the manoeuvre.
    pub alike: Vec<(&'static str, &'static str)>,
}

/// The model after an effect was added.
#[derive(Clone, Debug)]
pub struct Step {
    /// What was added.
    pub name: String,
    /// Cost of the fit.
    pub cost: Option<f64>,
    /// Squares of each run at each horizon, predicted by a fit without it.
    pub held_out: Vec<[Squares; HORIZONS_S.len()]>,
}

/// The result.
#[derive(Clone, Debug)]
pub struct TorpedoDiagnosis {
    /// Runs, with their configurations.
    pub runs: Vec<Run>,
    /// Configurations with their values.
    pub configurations: Vec<Configuration>,
    /// Effects, the one that gains most first.
    pub found: Vec<Found>,
    /// The textbook's coefficients as fitted.
    pub coefficients: Vec<Parameter>,
    /// The propeller's torque by stops of the motor, if there are some.
    pub torque: Option<Torque>,
    /// Entries that these runs do not show.
    pub not_shown: Vec<&'static str>,
    /// From the textbook to the whole model.
    pub steps: Vec<Step>,
    /// Before anything was fitted.
    pub textbook: Draft,
    /// For each run what the other runs give.
    pub without: Vec<Draft>,
    /// The vehicle file.
    pub vehicle: VehicleFile,
    /// What was assumed.
    pub notes: Vec<String>,
}

struct Selected<'a> {
    problem: Problem<'a>,
    fit: Fit,
}

/// Whether predictions of runs that a fit had not are wanted: they take most of the time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Predictions {
    /// Of each run by a fit to the others, before and after each effect.
    HeldOut,
    /// None: what the runs show is all that is asked.
    LeftOut,
}

/// Diagnoses the runs of a log; `progress` receives what is done.
///
/// # Errors
/// In one line: too few runs, or a fit that does not converge.
pub fn diagnose(
    log: &Log,
    declared: &VehicleFile,
    predictions: Predictions,
    progress: &mut dyn FnMut(&str),
) -> Result<TorpedoDiagnosis, String> {
    let mut runs = short_runs::runs(log);
    let configurations = configurations::group(&mut runs);
    let (vehicle, mut notes) = textbook::calibrated(declared, &runs);
    let base = Draft::of(&vehicle, configurations.len());
    let textbook_models = base.models().map_err(|error| error.to_string())?;
    let problem = |effects: &[&'static str], torque: Option<&Torque>| {
        let mut unknowns = coefficients();
        effects.iter().for_each(|effect| unknowns.extend(of_effect(effect, configurations.len())));
        torque.iter().for_each(|torque| unknowns.iter_mut().for_each(|unknown| torque.inform(unknown, &base)));
        Problem { runs: &runs, base: base.clone(), unknowns }
    };
    let all = |_: usize| true;

    let mut kept: Vec<&'static str> = ENTRIES.iter().map(|entry| entry.name).collect();
    progress("all effects");
    let mut selected = fitted(problem(&kept, None), None, &all)?;
    let used = selected.fit.runs();
    if used.len() < FEWEST_RUNS {
        return Err(format!(
            "{} run{} with 3 s deeper than 0.5 m at speed: what is common to runs shows in {FEWEST_RUNS} and more; `--predict` \
             judges a vehicle file on any number",
            used.len(),
            if used.len() == 1 { "" } else { "s" }
        ));
    }
    let needed = t_quantile(used.len() - 1);
    let torque_by =
        |selected: &Selected<'_>| Torque::of(&runs, &base.with(&selected.problem.unknowns, &selected.fit.values));
    // what the stops say is judged by a model that the runs need; it then stays, with the delay that it shows if that is needed
    let mut torque: Option<Torque> = None;
    for has_asked_stops in [false, true] {
        let shown = torque.as_ref().filter(|torque| torque.is_shown());
        if has_asked_stops {
            if shown.is_none() {
                break;
            }
            kept.retain(|effect| *effect != TORQUE && *effect != DELAY);
            kept.extend([TORQUE, DELAY]);
            progress("the propeller's torque by stops of the motor");
            let start = Some((&selected.problem.unknowns[..], &selected.fit.values[..]));
            selected = fitted(problem(&kept, shown), start, &all)?;
        }
        // first those that the information does not ask for, then those that differ from run to run by as much as they are
        for is_by_runs in [false, true] {
            loop {
                let excess = |effect: &&'static str| {
                    if is_on_limit(&selected, effect) {
                        f64::NEG_INFINITY // it stands for something else
                    } else if has_asked_stops && *effect != DELAY {
                        f64::INFINITY // the runs have been asked
                    } else if is_by_runs {
                        evidence(&selected, effect) - needed
                    } else {
                        let count = of_effect(effect, configurations.len()).len() as f64;
                        gain(&selected, effect) - LEAST_GAIN - 2.0 * count
                    }
                };
                let scored = kept.iter().map(excess).enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
                let Some((weakest, _)) = scored.filter(|(_, excess)| *excess < 0.0) else { break };
                let effect = kept.remove(weakest);
                progress(&format!("without {effect}"));
                let start = Some((&selected.problem.unknowns[..], &selected.fit.values[..]));
                selected = fitted(problem(&kept, shown), start, &all)?;
            }
        }
        torque = torque_by(&selected).or(torque);
    }
    let shown = torque.as_ref().filter(|torque| torque.is_shown() && kept.contains(&TORQUE));
    if shown.is_some() {
        // the stops by the model that was chosen
        let start = Some((&selected.problem.unknowns[..], &selected.fit.values[..]));
        selected = fitted(problem(&kept, shown), start, &all)?;
    }

    // what each of those kept gains beside all others
    let mut gains: Vec<(f64, &'static str)> = kept.iter().map(|effect| (gain(&selected, effect), *effect)).collect();
    gains.sort_by(|a, b| b.0.total_cmp(&a.0));
    let order: Vec<&'static str> = gains.iter().map(|(_, effect)| *effect).collect();

    let mut steps = vec![Step {
        name: "textbook".to_owned(),
        cost: None,
        held_out: per_run(&runs, |_, horizon_s| Some(open_loop(&runs, &textbook_models, horizon_s))),
    }];
    let counts = if predictions == Predictions::HeldOut { 0..order.len() + 1 } else { 0..0 };
    for count in counts {
        let name = if count == 0 { "its coefficients fitted".to_owned() } else { format!("+ {}", order[count - 1]) };
        progress(&name);
        let of_step = if count == order.len() {
            None
        } else {
            let start = Some((&selected.problem.unknowns[..], &selected.fit.values[..]));
            Some(fitted(problem(&order[..count], shown), start, &all)?)
        };
        steps.push(held_out(name, &runs, of_step.as_ref().unwrap_or(&selected)));
    }

    let sigmas = selected.fit.sigmas();
    let quantile = t_quantile(used.len() - 1);
    let parameter = |place: usize| parameter(&selected, place, sigmas[place], quantile);
    let places = |effect: &str| -> Vec<usize> {
        let unknowns = selected.problem.unknowns.iter().enumerate();
        unknowns.filter(|(_, unknown)| unknown.effect == effect).map(|(place, _)| place).collect()
    };
    let found: Vec<Found> = order
        .iter()
        .filter_map(|effect| {
            let entry = super::entries::of(effect)?;
            let of_effect = places(effect);
            let largest = evidence(&selected, effect);
            let mut p = f_tail(largest * largest, 1.0, (used.len() - 1) as f64) * of_effect.len() as f64;
            let mut parameters: Vec<Parameter> = of_effect.iter().map(|&place| parameter(place)).collect();
            if let (Some(torque), TORQUE, [arm]) = (shown, *effect, &mut parameters[..]) {
                arm.ci95 = torque.interval(arm.value, &selected.fit, &selected.problem.unknowns, quantile);
                p = torque.p_value;
            }
            parameters.extend(differences(&selected, &of_effect, &configurations, quantile));
            // one that improves the predictions and is not certain stays in the model without being named
            let is_certain = parameters.iter().any(Parameter::is_shown);
            let alike = alike(&selected, entry, shown.is_some());
            is_certain.then_some(Found { entry, parameters, p_value: p.min(1.0), alike })
        })
        .collect();
    let draft = base.with(&selected.problem.unknowns, &selected.fit.values);
    if let Some(name) = draft.outside() {
        return Err(format!("{name} ends on the limit of its range: no answer; give a closer --vehicle"));
    }
    let of_others = |run: usize| base.with(&selected.problem.unknowns, &selected.fit.without(run));
    let without = (0..runs.len()).map(of_others).collect();
    let mut vehicle = into_vehicle(&vehicle, &draft, &configurations);
    textbook::set_noise(&mut vehicle, &runs, &draft.models().map_err(|error| error.to_string())?);
    vehicle.app = textbook::of_board(&runs, &vehicle, draft.dvl.scale);
    vehicle.name = format!("{}-runs", declared.name);
    set_intervals(&mut vehicle, &found);
    let coefficients: Vec<Parameter> = places("").into_iter().map(parameter).collect();
    let weak: Vec<&str> =
        coefficients.iter().filter(|one| one.prior_share > PRIORS).map(|one| one.name.as_str()).collect();
    if !weak.is_empty() {
        notes.push(format!(
            "these runs do not tell {}: more than half of what is known of them is the textbook's prior",
            weak.join(", ")
        ));
    }
    let is_found = |name: &&str| found.iter().any(|found| found.entry.name == *name);
    let not_shown: Vec<&'static str> = ENTRIES.iter().map(|entry| entry.name).filter(|name| !is_found(name)).collect();
    let uncertain: Vec<&str> = order.iter().copied().filter(|name| !is_found(name)).collect();
    if !uncertain.is_empty() {
        notes.push(format!("in the model, though no interval excludes none: {}", uncertain.join(", ")));
    }
    let configurations = vehicle.short_runs.clone().map(|runs| runs.configurations).unwrap_or_default();
    Ok(TorpedoDiagnosis {
        runs,
        configurations,
        found,
        coefficients,
        torque,
        not_shown,
        steps,
        textbook: base,
        without,
        vehicle,
        notes,
    })
}

/// Fits from the values of the same unknowns in another fit, or from the prior.
fn fitted<'a>(
    problem: Problem<'a>,
    start: Option<(&[Unknown], &[f64])>,
    is_used: &(dyn Fn(usize) -> bool + Sync),
) -> Result<Selected<'a>, String> {
    let from = |unknown: &Unknown| {
        let (known, values) = start?;
        known.iter().position(|other| other.name == unknown.name).map(|place| values[place])
    };
    let values: Vec<f64> = problem.unknowns.iter().map(|unknown| from(unknown).unwrap_or(unknown.prior)).collect();
    let lengths_s = if start.is_some() { &LENGTHS_S[2..] } else { &LENGTHS_S[..] };
    let fit = problem.fit(is_used, &values, lengths_s);
    let fit = fit.ok_or("no run is deeper than 0.5 m at speed for 3 s, or the fit does not converge")?;
    Ok(Selected { problem, fit })
}

/// Sigmas by which the largest value of an effect differs from none.
fn evidence(selected: &Selected<'_>, effect: &str) -> f64 {
    let sigmas = selected.fit.sigmas();
    let unknowns = selected.problem.unknowns.iter().enumerate();
    unknowns
        .filter(|(_, unknown)| unknown.effect == effect)
        .map(|(place, _)| selected.fit.values[place].abs() / sigmas[place])
        .fold(0.0, f64::max)
}

/// Whether a number of an effect has run to the end of its range.
fn is_on_limit(selected: &Selected<'_>, effect: &str) -> bool {
    let (unknowns, values) = (&selected.problem.unknowns, &selected.fit.values);
    let draft = selected.problem.base.with(unknowns, values);
    unknowns.iter().any(|unknown| unknown.effect == effect && draft.is_on_limit(unknown.place))
}

/// Cost that an effect takes away beside all others, to second order: its values over their covariance.
fn gain(selected: &Selected<'_>, effect: &str) -> f64 {
    let unknowns = selected.problem.unknowns.iter().enumerate();
    let places: Vec<usize> = unknowns.filter(|(_, u)| u.effect == effect).map(|(place, _)| place).collect();
    let (covariance, all) = (&selected.fit.covariance, &selected.fit.values);
    let own = DMatrix::from_fn(places.len(), places.len(), |i, j| covariance[(places[i], places[j])]);
    let values = DVector::from_fn(places.len(), |i, _| all[places[i]]);
    own.cholesky().map_or(0.0, |factor| values.dot(&factor.solve(&values)))
}

/// Two-sided 95 % quantile of Student's distribution.
#[must_use]
pub fn t_quantile(degrees: usize) -> f64 {
    let degrees = degrees.max(1) as f64;
    let (mut low, mut high) = (1.9, 13.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f_tail(middle * middle, 1.0, degrees) > 0.05 { low = middle } else { high = middle }
    }
    high
}

fn parameter(selected: &Selected<'_>, place: usize, sigma: f64, quantile: f64) -> Parameter {
    let unknown = &selected.problem.unknowns[place];
    let base = &selected.problem.base;
    let (unit, none, declared) = match unknown.place {
        Place::FinGain(fin) => ("1", 1.0, base.parameters.fins[fin].gain),
        Place::HullLift => ("kg/m", 0.0, base.parameters.z_uw),
        Place::TorqueArm => ("m", 0.0, base.parameters.torque_arm_m),
        Place::Common(term) => (COMMON[term].unit, COMMON[term].default, base.common[term]),
        Place::Of(term, of) => {
            (OF_CONFIGURATION[term].unit, 0.0, base.configurations.get(of).map_or(0.0, |all| all[term]))
        }
        Place::DvlDelay => ("s", 0.0, base.dvl.delay_s),
        Place::DvlYaw => ("rad", 0.0, base.dvl.yaw_rad),
        Place::DvlScale => ("1", 0.0, base.dvl.scale),
        _ => ("1", 0.0, 0.0),
    };
    let value = declared + selected.fit.values[place];
    Parameter {
        name: unknown.name.clone(),
        unit,
        value,
        ci95: [value - quantile * sigma, value + quantile * sigma],
        none,
        prior_share: selected.fit.prior_share[place],
    }
}

/// What a term of an effect differs by between the first configuration and each other one.
fn differences(
    selected: &Selected<'_>,
    of_effect: &[usize],
    configurations: &[Configuration],
    quantile: f64,
) -> Vec<Parameter> {
    let unknowns = &selected.problem.unknowns;
    let place_of = |term: usize, configuration: usize| {
        of_effect.iter().copied().find(|&place| unknowns[place].place == Place::Of(term, configuration))
    };
    let mut differences = Vec::new();
    for (term, of_term) in OF_CONFIGURATION.iter().enumerate() {
        for configuration in 1..configurations.len() {
            let (Some(first), Some(other)) = (place_of(term, 0), place_of(term, configuration)) else { continue };
            let value = selected.fit.values[other] - selected.fit.values[first];
            let half = quantile * selected.fit.sigma_of(&[(other, 1.0), (first, -1.0)]);
            let [name, first_name] = [configuration, 0].map(|place| &configurations[place].name);
            differences.push(Parameter {
                name: difference(of_term.name, name, first_name),
                unit: of_term.unit,
                value,
                ci95: [value - half, value + half],
                none: 0.0,
                prior_share: selected.fit.prior_share[other],
            });
        }
    }
    differences
}

/// Entries named as alike that are in the model too and whose values go together with the effect's, or that no fit of runs
/// can hold beside it; what stops of the motor separate is not alike in a log that has them.
fn alike(selected: &Selected<'_>, entry: &'static Entry, has_stops: bool) -> Vec<(&'static str, &'static str)> {
    let covariance = &selected.fit.covariance;
    let of = |name: &str| -> Vec<usize> {
        let unknowns = selected.problem.unknowns.iter().enumerate();
        unknowns.filter(|(_, u)| u.effect == name || u.name == name).map(|(place, _)| place).collect()
    };
    let go_together = |other: &str| {
        of(entry.name).iter().any(|&i| {
            of(other)
                .iter()
                .any(|&j| (covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()).abs() > ALIKE)
        })
    };
    let is_never_fitted =
        |other: &str| super::entries::of(other).is_none() && !selected.problem.unknowns.iter().any(|u| u.name == other);
    let is_alike = |(other, manoeuvre): &&(&str, &str)| {
        !(has_stops && *manoeuvre == MOTOR_STOP) && (is_never_fitted(other) || go_together(other))
    };
    entry.confused_with.iter().filter(is_alike).copied().collect()
}

/// What a term differs by between two configurations, in words.
fn difference(term: &str, name: &str, first: &str) -> String {
    format!("{term}, {name} less {first}")
}

/// Intervals into the vehicle file: of delays, and of what configurations differ by.
fn set_intervals(vehicle: &mut VehicleFile, found: &[Found]) {
    let Some(runs) = &mut vehicle.short_runs else { return };
    let ci95 = |name: &str| {
        let mut all = found.iter().flat_map(|found| &found.parameters);
        all.find(|parameter| parameter.name == name).map(|parameter| parameter.ci95)
    };
    for (term, value) in COMMON.iter().zip(&mut runs.common) {
        value.ci95 = ci95(term.name);
    }
    let Some((first, others)) = runs.configurations.split_first_mut() else { return };
    for configuration in others {
        for (term, value) in OF_CONFIGURATION.iter().zip(&mut configuration.values) {
            value.ci95 = ci95(&difference(term.name, &configuration.name, &first.name));
        }
    }
}

/// Squares of each run at each horizon.
fn per_run(runs: &[Run], mut of: impl FnMut(usize, f64) -> Option<Vec<Squares>>) -> Vec<[Squares; HORIZONS_S.len()]> {
    let mut all = vec![[Squares::default(); HORIZONS_S.len()]; runs.len()];
    for (place, horizon_s) in HORIZONS_S.into_iter().enumerate() {
        for (run, squares) in of(place, horizon_s).unwrap_or_default().into_iter().enumerate() {
            all[run][place] = squares;
        }
    }
    all
}

/// Predictions of each run by a fit without it.
fn held_out(name: String, runs: &[Run], selected: &Selected<'_>) -> Step {
    let wanted = Wanted { depth_m: 0.5, powered: true, speed_mps: 0.0 };
    let mut used: Vec<usize> =
        windows(runs, wanted, HORIZONS_S[0], HORIZONS_S[0]).iter().map(|window| window.run).collect();
    used.dedup();
    let each: Vec<(usize, [Squares; HORIZONS_S.len()])> = used
        .par_iter()
        .map(|&run| {
            let fit = selected.problem.fit(&|other| other != run, &selected.fit.values, &LENGTHS_S[2..]);
            let values = fit.map_or_else(|| selected.fit.without(run), |fit| fit.values);
            let draft = selected.problem.base.with(&selected.problem.unknowns, &values);
            let squares = HORIZONS_S.map(|horizon_s| {
                let models = draft.models().unwrap_or_default();
                open_loop(&runs[run..=run], &models, horizon_s).first().copied().unwrap_or_default()
            });
            (run, squares)
        })
        .collect();
    let mut held_out = vec![[Squares::default(); HORIZONS_S.len()]; runs.len()];
    each.into_iter().for_each(|(run, squares)| held_out[run] = squares);
    Step { name, cost: Some(selected.fit.cost), held_out }
}

impl Step {
    /// Root mean square over the runs of a configuration (`None`: all), of a channel at a horizon.
    #[must_use]
    pub fn rms(&self, runs: &[Run], configuration: Option<usize>, horizon: usize, channel: usize) -> Option<f64> {
        let of = runs.iter().zip(&self.held_out);
        let of = of.filter(|(run, _)| configuration.is_none_or(|wanted| run.configuration == wanted));
        of.fold(Squares::default(), |sum, (_, squares)| sum.plus(&squares[horizon])).rms(channel)
    }
}
