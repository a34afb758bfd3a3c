//! Diagnosis by a log model: noise, hypotheses one by one, what remains, scores.

use super::describe;
use super::fit::{self, Noise, free};
use super::model::{LogModel, Measures, Unexplained};
use crate::alternatives::Alternative;
use crate::candidates::{self, Candidate, Hypothesis, Scope};
use crate::diagnosis::{Diagnosis, FoundEffect};
use crate::linear;
use crate::log_effects::Effects;
use crate::prepared_log::{DataPart, PreparedLog, Split};
use crate::samples::{ResidualChannel, Samples};
use crate::scores::{HORIZONS_S, PREDICTED, Scores, whiteness};
use crate::search::{self, FAMILY_ERROR, MOST_EFFECTS, Round};
use crate::structure::{NamedTerm, Structure};
use crate::verdict::{self, Conditions};
use crate::whitener::{Pass, Setup};
use backseat_core::navigation::SurfaceNoise;
use backseat_estimation::commands::InputTiming;
use backseat_logs::stats::{Z_95, rms};
use backseat_logs::{Log, VehicleFile};

/// Probability of the remaining residuals under whiteness below which they have structure.
const STRUCTURE: f64 = 1e-4;
/// Blocks that a log must have for each number of an effect: with fewer, anything fits.
const BLOCKS_A_NUMBER: usize = 8;

/// A diagnosis by a log model.
pub struct LogModelDiagnosis {
    /// The log made ready.
    pub log_data: PreparedLog,
    /// What was found.
    pub diagnosis: Diagnosis,
    /// θ of the plain model and with the effects.
    pub theta: [Vec<f64>; 2],
    /// One sigma of every column of θ with the effects; 0 where it was not fitted.
    pub sigmas: Vec<f64>,
    /// Noise taken, by channel.
    pub noise: Vec<Noise>,
    /// Before and after, on the held-out blocks.
    pub scores: [Scores; 2],
    /// With the terms outside the catalogue as well, where any stands.
    pub with_terms: Option<Scores>,
}

/// Diagnoses a log by a log model; `None` where θ cannot be fitted at all.
#[must_use]
pub fn run(model: &impl LogModel, log: &Log, vehicle: &VehicleFile) -> Option<LogModelDiagnosis> {
    let mut log_data = empty(log, vehicle, model);
    let calibrated = model.calibrated();
    let zero = vec![0.0; model.columns()];
    let (noise, all_fitted) = fit::noise(model, &log_data, &calibrated)?;
    let plain = fit::solve(model, &log_data, &noise, &calibrated, &zero, DataPart::Train)?;
    log_data.declared = fit::pass(model, &noise, &plain);
    for residual in &log_data.declared.residuals {
        log_data.scope.present[residual.channel as usize] = true;
    }
    let mut hypotheses: Vec<Hypothesis> =
        model.entries().into_iter().map(|(effect, free)| hypothesis(effect, free)).collect();
    candidates::set_lower(&mut hypotheses);
    let mut rounds: Vec<Round> = Vec::new();
    let (mut chosen, mut theta) =
        if model.is_coupled() { together(model, &log_data, &noise, all_fitted)? } else { (Vec::new(), plain.clone()) };
    let blocks = log_data.declared.normal.blocks.iter().filter(|block| block.count > 0).count();
    while chosen.len() < MOST_EFFECTS {
        let left: Vec<Hypothesis> = hypotheses.iter().filter(|h| !chosen.contains(h)).cloned().collect();
        let round = search::judge(&log_data, &fit::pass(model, &noise, &theta), &left, &free(&calibrated, &chosen));
        let fitted: usize = chosen.iter().map(|h| h.free.len()).sum();
        let most = (blocks / BLOCKS_A_NUMBER).saturating_sub(fitted);
        let stands = |e: &&search::Evidence| round.is_significant(e) && e.degrees <= most;
        let best = round.ladder.iter().find(stands).map(|e| e.instance.candidate);
        rounds.push(round);
        let Some(hypothesis) = best.and_then(|best| left.into_iter().find(|h| h.candidate == best)) else { break };
        chosen.push(hypothesis);
        match fit::solve(model, &log_data, &noise, &free(&calibrated, &chosen), &theta, DataPart::Train) {
            Some(fitted) => theta = fitted,
            None => {
                chosen.pop();
                break;
            }
        }
    }
    let mut after = fit::pass(model, &noise, &theta);
    let tried = rounds.first().map_or(1, |round| round.tried) as f64;
    let (effects, sigmas) = loop {
        let described = describe::Described { model, log_data: &log_data, noise: &noise, theta: &theta, after: &after };
        let (effects, sigmas) = described.effects(&calibrated, &chosen, &hypotheses, tried)?;
        // Those fitted together were not asked yet whether they are worth anything on data that they were not fitted
        // to.
        let held = |effect: &FoundEffect| effect.held_gain.map_or(0.0, |(mean, _)| mean);
        let worst = effects.iter().enumerate().min_by(|a, b| held(a.1).total_cmp(&held(b.1)));
        match worst {
            Some((place, effect)) if model.is_coupled() && held(effect) <= 0.0 => {
                for column in chosen.remove(place).free {
                    theta[column] = 0.0;
                }
                theta = fit::solve(model, &log_data, &noise, &free(&calibrated, &chosen), &theta, DataPart::Train)?;
                after = fit::pass(model, &noise, &theta);
            }
            _ => break (effects, sigmas),
        }
    };
    let described = describe::Described { model, log_data: &log_data, noise: &noise, theta: &theta, after: &after };
    let mut named = described.nameless(&free(&calibrated, &chosen));
    let with_terms = with_terms(&described, &free(&calibrated, &chosen), &mut named);
    let is_ambiguous = effects.iter().any(|found| found.alternatives.iter().any(Alternative::is_possible));
    let tests = whiteness(&log_data, &after, DataPart::Judge);
    let is_coloured = tests.iter().any(|w| w.p * (tests.len() as f64) < STRUCTURE);
    let conditions = Conditions {
        structure_remains: is_coloured || !named.is_empty(),
        has_effects: !effects.is_empty(),
        has_alternatives: is_ambiguous,
        ..Conditions::default()
    };
    let rule = verdict::decide(&conditions);
    let open = described.open(&free(&calibrated, &chosen), hypotheses.iter().filter(|h| !chosen.contains(h)));
    let forecast = if model.forecast_share() > 0.0 { ", and the last fifth of the log" } else { "" };
    let held = format!("held out: nine of every 27 blocks of {:.0} s{forecast}", model.block_s());
    let notes = open.into_iter().chain(search::undetermined(&rounds)).chain(noise.iter().map(Noise::describe));
    let notes = notes.chain([held]).collect();
    let structure = Structure { named, ..Structure::default() };
    let before = log_data.declared.clone();
    let diagnosis = Diagnosis {
        verdict: rule.verdict,
        reason: rule.condition,
        conditions,
        remaining: Vec::new(),
        effects,
        rounds,
        structure,
        proposed: Vec::new(),
        with_terms: None,
        before,
        after,
        notes,
    };
    let scores = [(&diagnosis.before, &plain), (&diagnosis.after, &theta)]
        .map(|(pass, theta)| scores(&log_data, pass, model.measures(theta)));
    let with_terms = with_terms.map(|(theta, pass)| self::scores(&log_data, &pass, model.measures(&theta)));
    Some(LogModelDiagnosis { log_data, diagnosis, theta: [plain, theta], sigmas, noise, scores, with_terms })
}

/// The terms outside the catalogue fitted on the training blocks with everything found: θ and its pass.
fn with_terms<M: LogModel>(
    described: &describe::Described<'_, M>,
    free: &[usize],
    named: &mut [NamedTerm],
) -> Option<(Vec<f64>, Pass)> {
    if named.is_empty() {
        return None;
    }
    let all = described.model.nameless();
    let own: Vec<Vec<usize>> = named
        .iter()
        .map(|term| all.iter().find(|(name, _)| *name == term.name).map_or_else(Vec::new, |(_, own)| own.clone()))
        .collect();
    let columns: Vec<usize> = free.iter().copied().chain(own.iter().flatten().copied()).collect();
    let (model, log_data, noise) = (described.model, described.log_data, described.noise);
    let theta = fit::solve(model, log_data, noise, &columns, described.theta, DataPart::Train)?;
    if own.iter().flatten().all(|column| theta[*column] == 0.0) {
        // Significant to first order, and no step from the values found makes the training blocks better.
        return None;
    }
    let after = fit::pass(model, noise, &theta);
    let sigmas = describe::Described { theta: &theta, after: &after, ..*described }.sigmas(&columns)?;
    let mut at = free.len();
    for (term, own) in named.iter_mut().zip(&own) {
        term.values = own.iter().map(|column| theta[*column]).collect();
        term.ci95 = term
            .values
            .iter()
            .zip(&sigmas[at..])
            .map(|(value, sigma)| [value - Z_95 * sigma, value + Z_95 * sigma])
            .collect();
        at += own.len();
    }
    Some((theta, after))
}

/// All separable entries fitted together on the training blocks, less those that are not significant beside the others.
fn together(
    model: &impl LogModel,
    log_data: &PreparedLog,
    noise: &[Noise],
    mut start: Vec<f64>,
) -> Option<(Vec<Hypothesis>, Vec<f64>)> {
    let calibrated = model.calibrated();
    let mut chosen: Vec<Hypothesis> =
        fit::separable(model, noise, &calibrated).into_iter().map(|(effect, free)| hypothesis(effect, free)).collect();
    let tried = model.entries().len() as f64;
    loop {
        // Twice, because an early step far from the answer may end the first.
        let free = free(&calibrated, &chosen);
        let first = fit::solve(model, log_data, noise, &free, &start, DataPart::Train)?;
        let theta = fit::solve(model, log_data, noise, &free, &first, DataPart::Train)?;
        if chosen.is_empty() {
            return Some((chosen, theta));
        }
        let is_outside = |h: &Hypothesis| {
            let bounds = h.candidate.bounds();
            h.free.iter().zip(bounds).any(|(column, [low, high])| !(low..=high).contains(&theta[*column]))
        };
        if let Some(place) = chosen.iter().position(is_outside) {
            // A delay into the future stands for something else.
            for column in chosen.remove(place).free {
                start[column] = 0.0;
            }
            continue;
        }
        let pass = fit::pass(model, noise, &theta);
        let whole = pass.normal.sum(|_| true);
        let all = linear::fit(&whole, &free, &[])?;
        let (inflation, count) = linear::inflation(&pass.normal, |_| true, &free, &all, &[]);
        let p = |h: &Hypothesis| {
            let others: Vec<usize> = free.iter().copied().filter(|column| !h.free.contains(column)).collect();
            let away: Vec<(usize, f64)> = h.free.iter().map(|column| (*column, -theta[*column])).collect();
            let without = linear::fit(&whole, &others, &away).map_or(0.0, |fit| fit.gain);
            search::tail(all.gain - without, inflation, count, h.free.len()) * tried
        };
        let weakest = chosen.iter().map(p).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        if weakest.1 < FAMILY_ERROR {
            return Some((chosen, theta));
        }
        for column in chosen.remove(weakest.0).free {
            start[column] = 0.0;
        }
    }
}

fn hypothesis(effect: &'static str, free: Vec<usize>) -> Hypothesis {
    Hypothesis {
        candidate: Candidate { effect, fin: None, span: None },
        free,
        ends: Vec::new(),
        fixed: Vec::new(),
        lower: Vec::new(),
    }
}

/// A prepared log without samples of a vehicle's dynamics.
fn empty(log: &Log, vehicle: &VehicleFile, model: &impl LogModel) -> PreparedLog {
    let samples = Samples { duration_s: log.duration_s(), ..Samples::default() };
    let present = [false; ResidualChannel::COUNT];
    let scope = Scope { present, has_density: false, duration_s: samples.duration_s, declared: Effects::default() };
    let setup = Setup {
        parameters: vehicle.parameters,
        noise: vehicle.noise,
        surface: SurfaceNoise::DYNAMIC,
        sensors: vehicle.sensors,
        installation: vehicle.installation,
        scale: [1.0; ResidualChannel::COUNT],
        colours: Vec::new(),
        outliers: Vec::new(),
        block_s: model.block_s(),
        proposed: Vec::new(),
    };
    PreparedLog {
        timing: InputTiming::default(),
        setup,
        samples,
        scope,
        own_scale: [1.0; ResidualChannel::COUNT],
        declared: crate::whitener::Pass::default(),
        split: Split::of_one_run(log.duration_s(), model.block_s(), model.forecast_share()),
        is_noise_estimated: false,
    }
}

/// Scores of one pass with its errors, on the held-out blocks.
#[must_use]
pub fn scores(log_data: &PreparedLog, pass: &crate::whitener::Pass, measures: Measures) -> Scores {
    let held = |errors: &[(f64, f64)]| {
        let of: Vec<f64> = errors.iter().filter(|(t_s, _)| log_data.is_judged(*t_s)).map(|(_, error)| *error).collect();
        rms(&of)
    };
    // Share of the variance about the mean.
    let share = |of: &Unexplained| {
        let held: Vec<_> = of.values.iter().filter(|(t_s, ..)| log_data.is_judged(*t_s)).collect();
        let mean = held.iter().map(|(.., measured)| measured).sum::<f64>() / held.len().max(1) as f64;
        let all: f64 = held.iter().map(|(.., measured)| (measured - mean).powi(2)).sum();
        let left: f64 = held.iter().map(|(_, residual, _)| residual.powi(2)).sum();
        (all > 0.0).then_some((of.name, left / all))
    };
    let unexplained_variance = measures.unexplained.iter().filter_map(share).collect();
    let whiteness = whiteness(log_data, pass, DataPart::Judge);
    let tested = whiteness.len().max(1) as f64;
    let position_rmse_m = held(&measures.position);
    Scores {
        velocity_rmse_mps: held(&measures.velocity),
        position_rmse_m,
        position_against: measures.against.filter(|_| position_rmse_m.is_some()),
        innovation_whiteness_p: (whiteness.iter().map(|w| w.p).fold(1.0, f64::min) * tested).min(1.0),
        max_autocorrelation: whiteness.iter().flat_map(|w| &w.correlation).fold(0.0, |largest, r| r.abs().max(largest)),
        whiteness,
        prediction: vec![[None; HORIZONS_S.len()]; PREDICTED.len()],
        position_errors: measures.position,
        track: Vec::new(),
        unexplained_variance,
    }
}
