//! Which effects the runs show: the selection begins with all; those that stay are added again in the order of what each
//! gains, with predictions of each run by a fit to the others.

use super::entries::{ENTRIES, Entry};
use super::fitted::{Fitted, LENGTHS_S, fitted, fitted_over, needed};
use super::numbers::{Numbers, Parameter, alike, difference, t_quantile};
use super::timing::{self, Timing};
use super::torque::{DELAY, EFFECT as TORQUE, Torque};
use super::{configurations, textbook};
use backseat_identify::short_runs::predict::{Squares, open_loop};
use backseat_identify::short_runs::recording::{Wanted, windows};
use backseat_identify::short_runs::unknowns::{coefficients, into_vehicle, of_effect};
use backseat_identify::short_runs::{self, Draft, Problem, Run, Starts};
use backseat_logs::short_runs::{COMMON, Configuration, OF_CONFIGURATION};
use backseat_logs::{Log, VehicleFile};
use rayon::prelude::*;

/// Horizons of the predictions, s.
pub const HORIZONS_S: [f64; 3] = [5.0, 10.0, 20.0];
/// Fewer runs say nothing of how far a value differs from run to run.
const FEWEST_RUNS: usize = 4;
/// Prior's share of the information from which a value is the prior's.
const PRIORS: f64 = 0.5;

/// An effect that the runs show.
#[derive(Clone, Debug)]
pub struct Found {
    /// What it is.
    pub entry: &'static Entry,
    /// Its numbers.
    pub parameters: Vec<Parameter>,
    /// Least probability by chance of its numbers, over all that were asked.
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
    /// Squares of each run at each horizon, predicted by a fit without it; before the whole model by one step of Gauss-Newton
    /// from the fit to all.
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
    let of_these = |effects: &[&'static str], starts: Starts| {
        let mut unknowns = coefficients();
        effects.iter().for_each(|effect| unknowns.extend(of_effect(effect, configurations.len())));
        Problem { runs: &runs, base: base.clone(), unknowns, starts }
    };

    let mut kept: Vec<&'static str> = ENTRIES.iter().map(|entry| entry.name).collect();
    let asked = kept.iter().map(|effect| of_effect(effect, configurations.len()).len()).sum();
    progress("all effects");
    // with open starts alone the scale of the moments can end far off; from a fit that is held to its starts it does not
    let held = fitted(of_these(&kept, Starts::Held), None)?;
    let within_rows: Vec<&'static str> =
        kept.iter().copied().filter(|effect| !timing::NOT_TOLD.contains(effect)).collect();
    let mut of_rows = of_these(&within_rows, Starts::Rows);
    of_rows.base.dvl.delay_s = held.draft().dvl.delay_s;
    let rows = fitted_over(&[timing::LENGTH_S], of_rows, held.start())?;
    let timing = Timing::of(&rows);
    let problem = |effects: &[&'static str], torque: Option<&Torque>, starts: Starts| {
        let mut problem = of_these(effects, starts);
        for unknown in &mut problem.unknowns {
            timing.inform(unknown);
            torque.iter().for_each(|torque| torque.inform(unknown, &base));
        }
        problem
    };
    let mut selected = fitted(problem(&kept, None, Starts::Open), held.start())?;
    let used = selected.fit.runs();
    if used.len() < FEWEST_RUNS {
        return Err(format!(
            "{} run{} with 3 s deeper than 0.5 m at speed: what is common to runs shows in {FEWEST_RUNS} and more",
            used.len(),
            if used.len() == 1 { "" } else { "s" }
        ));
    }
    let torque_by = |selected: &Fitted<'_>| Torque::of(&runs, &selected.draft());
    // what the stops say is judged by a model that the runs need; it then stays, with the delay that it shows if that is needed
    let mut torque: Option<Torque> = None;
    for has_asked_stops in [false, true] {
        let shown = torque.as_ref().filter(|torque| torque.is_shown());
        let mut asked = kept.clone();
        if has_asked_stops {
            if shown.is_none() {
                break;
            }
            kept.retain(|effect| *effect != TORQUE && *effect != DELAY);
            kept.extend([TORQUE, DELAY]);
            progress("the propeller's torque by stops of the motor");
            selected = fitted(problem(&kept, shown, Starts::Open), selected.start())?;
            // once the stops have been asked only the delay is in question
            asked = vec![DELAY];
        }
        let open = |effects: &[&'static str]| problem(effects, shown, Starts::Open);
        (kept, selected) = needed(&asked, &kept, selected, open, progress)?;
        torque = torque_by(&selected).or(torque);
    }
    let shown = torque.as_ref().filter(|torque| torque.is_shown() && kept.contains(&TORQUE));
    if shown.is_some() {
        // the stops by the model that was chosen
        selected = fitted(problem(&kept, shown, Starts::Open), selected.start())?;
    }

    // what each of those kept gains beside all others
    let gaussian = selected.fit.gaussian();
    let gain = |effect: &str| gaussian.gain(&selected.places(effect));
    let mut gains: Vec<(f64, &'static str)> = kept.iter().map(|effect| (gain(effect), *effect)).collect();
    gains.sort_by(|a, b| b.0.total_cmp(&a.0));
    let order: Vec<&'static str> = gains.iter().map(|(_, effect)| *effect).collect();

    let predicted = HORIZONS_S.map(|horizon_s| open_loop(&runs, &textbook_models, horizon_s));
    let of_run = |run: usize| std::array::from_fn(|place| predicted[place].get(run).copied().unwrap_or_default());
    let by_textbook = (0..runs.len()).map(of_run).collect();
    let mut steps = vec![Step { name: "textbook".to_owned(), cost: None, held_out: by_textbook }];
    // what is there has been found with starts as open as rows leave them; the file is to predict from a start that is measured
    progress("held to the starts that are measured");
    let mut flown = order.clone();
    if predictions == Predictions::HeldOut {
        flown.extend(ENTRIES.iter().map(|entry| entry.name).filter(|name| !order.contains(name)));
    }
    let mut flying = fitted(problem(&flown, shown, Starts::Held), None)?;
    // what is found stays; of the rest what a prediction needs
    let rest: Vec<&'static str> = flown.iter().copied().filter(|effect| !order.contains(effect)).collect();
    let held = |effects: &[&'static str]| problem(effects, shown, Starts::Held);
    (flown, flying) = needed(&rest, &flown, flying, held, progress)?;
    let counts = if predictions == Predictions::HeldOut { 0..flown.len() + 1 } else { 0..0 };
    for count in counts {
        let name = if count == 0 { "its coefficients fitted".to_owned() } else { format!("+ {}", flown[count - 1]) };
        progress(&name);
        let of_step = if count == flown.len() {
            None
        } else {
            Some(fitted(problem(&flown[..count], shown, Starts::Held), flying.start())?)
        };
        steps.push(held_out(name, &runs, of_step.as_ref().unwrap_or(&flying), of_step.is_none()));
    }

    let numbers = Numbers::new(&selected, &configurations, asked, &timing);
    let found: Vec<Found> = order
        .iter()
        .filter_map(|effect| {
            let entry = super::entries::of(effect)?;
            let of_effect = selected.places(effect);
            let mut parameters: Vec<Parameter> = of_effect.iter().map(|&place| numbers.of(place)).collect();
            if let (Some(torque), TORQUE, [arm]) = (shown, *effect, &mut parameters[..]) {
                let quantile = t_quantile(used.len() - 1);
                arm.ci95 = torque.interval(arm.value, &selected.fit, &selected.problem.unknowns, quantile);
                arm.p_value = torque.p_value;
            }
            parameters.extend(numbers.differences(&of_effect));
            let p_value = parameters.iter().map(|one| one.p_value).fold(1.0, f64::min);
            // one that improves the predictions and is not certain stays in the model without being named
            let is_certain = parameters.iter().any(Parameter::is_shown);
            let alike = alike(&selected, entry, shown.is_some());
            is_certain.then_some(Found { entry, parameters, p_value, alike })
        })
        .collect();
    let draft = flying.draft();
    if let Some(name) = draft.outside() {
        return Err(format!("{name} ends on the limit of its range: no answer; give a closer vehicle"));
    }
    let of_others = |run: usize| base.with(&flying.problem.unknowns, &flying.fit.without(run));
    let without = (0..runs.len()).map(of_others).collect();
    let mut vehicle = into_vehicle(&vehicle, &draft, &configurations);
    textbook::set_noise(&mut vehicle, &runs, &draft.models().map_err(|error| error.to_string())?);
    vehicle.app = textbook::of_board(&runs, &vehicle, draft.dvl.scale);
    vehicle.name = format!("{}-runs", declared.name);
    set_intervals(&mut vehicle, &found);
    let coefficients: Vec<Parameter> = selected.places("").into_iter().map(|place| numbers.of(place)).collect();
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
    let uncertain: Vec<&str> = flown.iter().copied().filter(|name| !is_found(name)).collect();
    if !uncertain.is_empty() {
        notes.push(format!(
            "in the model, though inside what the textbook leaves open or not certain over all that was asked: {}",
            uncertain.join(", ")
        ));
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

/// Intervals into the vehicle file: of delays, and of what configurations differ by, where they hold its value.
fn set_intervals(vehicle: &mut VehicleFile, found: &[Found]) {
    let Some(runs) = &mut vehicle.short_runs else { return };
    let ci95 = |name: &str, value: f64| {
        let mut all = found.iter().flat_map(|found| &found.parameters);
        let own = all.find(|parameter| parameter.name == name).map(|parameter| parameter.ci95);
        own.filter(|[low, high]| (*low..=*high).contains(&value))
    };
    for (term, value) in COMMON.iter().zip(&mut runs.common) {
        value.ci95 = ci95(term.name, value.value);
    }
    let Some((first, others)) = runs.configurations.split_first_mut() else { return };
    for configuration in others {
        for (term, value) in OF_CONFIGURATION.iter().zip(&mut configuration.values) {
            value.ci95 = ci95(&difference(term.name, &configuration.name, &first.name), value.value);
        }
    }
}

/// Predictions of each run by a fit to the others; or by one step of Gauss-Newton from the fit to all.
fn held_out(name: String, runs: &[Run], selected: &Fitted<'_>, is_fitted: bool) -> Step {
    let wanted = Wanted { depth_m: 0.5, powered: true, speed_mps: 0.0 };
    let mut used: Vec<usize> =
        windows(runs, wanted, HORIZONS_S[0], HORIZONS_S[0]).iter().map(|window| window.run).collect();
    used.dedup();
    let each: Vec<(usize, [Squares; HORIZONS_S.len()])> = used
        .par_iter()
        .map(|&run| {
            let others = |other: usize| other != run;
            let fit = || selected.problem.fit(&others, &selected.fit.values, &LENGTHS_S[2..]);
            let values = is_fitted.then(fit).flatten().map_or_else(|| selected.fit.without(run), |fit| fit.values);
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
