//! Diagnosis by a log model: everything enters jointly, and what is not needed is pruned.
//!
//! All entries are fitted together on the data that fit and choose, so that none hides another; the weakest is dropped
//! until each that is left is significant beside the others. An entry must gain on the data that choose with the sizes
//! of the data that fit, and lie within what this vehicle may have. The data that judge take part in none of this.

use super::chosen::{Chosen, Refused, free, refit};
use super::describe::{self, JudgedEffect, NotNamed};
use super::events;
use super::evidence::{Linearised, columns};
use super::fit::Fitting;
use super::layout::Layout;
use super::model::{LogModel, catalogue_range};
use super::noise::Noise;
use super::scoring;
use crate::candidates::{self, Candidate, Hypothesis, Instance};
use crate::diagnosis::{Diagnosis, FoundEffect};
use crate::floor::FEWEST_JUDGED;
use crate::normal_equations::Column;
use crate::scores::Scores;
use crate::search::{Evidence, FAMILY_ERROR, Round};
use crate::split::DataPart;
use crate::structure::Structure;
use crate::verdict::{self, Conditions};
use backseat_logs::{Log, VehicleFile};

/// Probability of the remaining residuals under whiteness below which they have structure. Whitened fixes of every second
/// show a receiver's own filter, which no position depends on.
const STRUCTURE: f64 = 1e-6;
/// Blocks that a log must have for each number of an effect: with fewer, anything fits.
const BLOCKS_A_NUMBER: usize = 4;
/// Cost of a fitted number where gains are compared.
const COST: f64 = 2.0;
/// Rounds of adding and pruning.
const ROUNDS: usize = 6;

/// A diagnosis by a log model.
pub struct LogModelDiagnosis {
    /// What was found.
    pub diagnosis: Diagnosis,
    /// θ of the plain model and with the effects.
    pub theta: [Vec<f64>; 2],
    /// One sigma of every column of θ with the effects; 0 where it was not fitted.
    pub sigmas: Vec<f64>,
    /// Entries that were tested and are not among them.
    pub not_named: Vec<NotNamed>,
    /// Of every entry one sigma of its sizes with all others fitted beside it.
    pub sigmas_beside_all: Vec<(&'static str, Vec<f64>)>,
    /// Noise taken, by channel.
    pub noise: Vec<Noise>,
    /// Before and after, on the data that judge.
    pub scores: [Scores; 2],
    /// With the terms outside the catalogue as well, where any stands.
    pub with_terms: Option<Scores>,
}

/// Diagnoses a log by a log model; `None` where θ cannot be fitted at all.
#[must_use]
pub fn run(model: &impl LogModel, log: &Log, vehicle: &VehicleFile) -> Option<LogModelDiagnosis> {
    let mut runs = model.runs();
    if runs.is_empty() {
        runs.push([0.0, log.duration_s()]);
    }
    let layout = Layout::new(&runs, model.block_s(), model.forecast_share());
    let (mut fitting, joint) = Fitting::new(model, layout)?;
    let calibrated = model.calibrated();
    let mut start = vec![0.0; model.columns()];
    for column in &calibrated {
        start[*column] = joint[*column];
    }
    let plain = fitting.solve(&calibrated, &start, DataPart::Seen)?;
    let before_rows = model.rows(&plain);
    let before = fitting.pass(&before_rows, &[]);
    let mut all: Vec<Hypothesis> = model.entries().into_iter().map(|(effect, free)| hypothesis(effect, free)).collect();
    candidates::set_lower(&mut all);
    let blocks = before.normal.blocks.iter().enumerate();
    let [seen, judged] = [DataPart::Seen, DataPart::Judge].map(|part| {
        blocks.clone().filter(|(place, block)| block.count > 0 && fitting.layout.is_in(part, *place)).count()
    });
    let (chosen, round) = choose(&fitting, &joint, &all, seen)?;
    let mut chosen = chosen;
    let events =
        if runs.len() == 1 { events::find(&fitting, &mut chosen, &all, log.duration_s())? } else { Vec::new() };
    fitting.layout.except(events.iter().flat_map(events::Event::intervals).collect());
    let theta = &chosen.theta;
    let mut after_rows = model.rows(theta);
    events::apply(&mut after_rows, model, &events);
    let after = fitting.pass(&after_rows, &[]);
    let described = describe::Described { fitting: &fitting, chosen: &chosen, all: &all, tried: round.tried as f64 };
    let (mut found, sigmas) = described.effects(&after)?;
    let not_named = described.not_named(&after);
    let sigmas_beside_all = described.sigmas_beside_all(&after);
    let at_odds = model.at_odds(&chosen.theta, &sigmas);
    let mut notes: Vec<String> = at_odds.iter().cloned().chain(described.notes(&not_named)).collect();
    found.extend(events.iter().map(|event| event.described(&fitting, theta, &after)));
    let refuted = found.iter().filter(|(_, of)| of.is_refuted());
    let of_refuted = |(found, of): &JudgedEffect| {
        let name = found.instance.candidate.label();
        format!("{name} is significant where it was fitted, and the data that judge do not bear it out ({of})")
    };
    let refuted: Vec<String> = refuted.map(of_refuted).collect();
    let is_refuted = !refuted.is_empty();
    notes.extend(refuted);
    let mut effects: Vec<FoundEffect> = found.into_iter().map(|(found, _)| found).collect();
    effects.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut named = described.outside_catalogue(&after);
    let with_terms = described.with_terms(&mut named);
    let is_ambiguous = effects.iter().any(|found| found.possible_alternatives().next().is_some());
    let scores = [(&before, &before_rows), (&after, &after_rows)]
        .map(|(pass, rows)| scoring::scores(model, &fitting.layout, pass, rows));
    let with_terms = with_terms.map(|(rows, pass)| scoring::scores(model, &fitting.layout, &pass, &rows));
    let tests = &scores[1].whiteness;
    let is_coloured = tests.iter().any(|w| w.p * (tests.len() as f64) < STRUCTURE);
    let has_more_than_all = scores[1].unexplained_variance.iter().any(|(_, share)| *share > 1.0);
    let conditions = Conditions {
        is_refuted,
        structure_remains: is_coloured || !named.is_empty() || !chosen.refused.is_empty() || at_odds.is_some(),
        has_effects: !effects.is_empty(),
        has_alternatives: is_ambiguous,
        ..Conditions::default()
    };
    let rule = verdict::decide(&conditions);
    let forecast = if model.forecast_share() > 0.0 { ", and the end of each run as a forecast" } else { "" };
    notes.extend(fitting.noise.iter().map(Noise::describe));
    notes.push(format!(
        "of every 27 blocks of {:.0} s in each run 15 fit, 6 choose and 6 judge{forecast}: the figures before and after are of \
         those that judge",
        fitting.layout.block_s()
    ));
    notes.extend(scoring::forecast_note(model, &fitting.layout, [&before_rows, &after_rows]));
    let remaining = model.remaining(&after_rows, &fitting.layout, &vehicle.sensors);
    let diagnosis = Diagnosis {
        verdict: rule.verdict,
        reason: rule.condition,
        conditions,
        remaining: Vec::new(),
        effects,
        rounds: vec![round],
        structure: Structure { named, ..Structure::default() },
        proposed: Vec::new(),
        with_terms: None,
        before,
        after,
        notes,
    };
    let diagnosis = diagnosis.held_to(remaining, judged < FEWEST_JUDGED || has_more_than_all);
    let theta = [plain, chosen.theta];
    let noise = fitting.noise;
    Some(LogModelDiagnosis { diagnosis, theta, sigmas, not_named, sigmas_beside_all, noise, scores, with_terms })
}

/// Enters everything, prunes, adds what is missed, and asks what chooses.
fn choose<M: LogModel>(
    fitting: &Fitting<'_, M>,
    joint: &[f64],
    all: &[Hypothesis],
    seen_blocks: usize,
) -> Option<(Chosen, Round)> {
    let model = fitting.model;
    let calibrated = columns(&model.calibrated());
    let tried = all.len().max(1) as f64;
    let rows = model.rows(joint);
    let linear = Linearised::new(fitting, joint, fitting.pass(&rows, &[]));
    let most = seen_blocks / BLOCKS_A_NUMBER;
    let mut chosen: Vec<Hypothesis> = all.to_vec();
    let round = Round { ladder: ladder(&linear, all, &calibrated), events: Vec::new(), tried: all.len() };
    prune(&linear, &mut chosen, &calibrated, tried);
    let (mut refused, mut barred): (Vec<Refused>, Vec<&'static str>) = (Vec::new(), Vec::new());
    let mut theta = refit(fitting, &chosen, joint)?;
    for _ in 0..ROUNDS {
        let rows = model.rows(&theta);
        let linear = Linearised::new(fitting, &theta, fitting.pass(&rows, &[]));
        let before = chosen.clone();
        // What is missed: a joint fit of much that is alike leaves none of it standing alone.
        let fitted: usize = chosen.iter().map(|h| h.free.len()).sum();
        let others = free(&calibrated, &chosen, None);
        let best = all
            .iter()
            .filter(|h| !chosen.contains(h) && !barred.contains(&h.candidate.effect) && fitted + h.free.len() <= most)
            .filter_map(|h| Some((p_of(&linear, h, &others)?, h)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, hypothesis)) = best.filter(|(p, _)| p * tried < FAMILY_ERROR) {
            chosen.push(hypothesis.clone());
        }
        prune(&linear, &mut chosen, &calibrated, tried);
        while chosen.iter().map(|h| h.free.len()).sum::<usize>() > most {
            chosen.pop();
        }
        // What chooses: sizes of the data that fit must gain there.
        while let Some(place) = in_vain(&linear, &chosen, &calibrated) {
            barred.push(chosen.remove(place).candidate.effect);
        }
        let moved = refit(fitting, &chosen, &theta)?;
        if let Some((place, reason)) = outside(model, &chosen, &moved) {
            let effect = chosen.remove(place).candidate.effect;
            refused.push((effect, reason));
            barred.push(effect);
            theta = refit(fitting, &chosen, &theta)?;
            continue;
        }
        theta = moved;
        if chosen == before {
            break;
        }
    }
    // What was refused is no matter if nothing of it is left beside what was chosen instead.
    let rows = model.rows(&theta);
    let linear = Linearised::new(fitting, &theta, fitting.pass(&rows, &[]));
    let others = free(&calibrated, &chosen, None);
    let remains = |effect: &str| {
        let refused = all.iter().find(|h| h.candidate.effect == effect);
        refused.and_then(|h| p_of(&linear, h, &others)).is_some_and(|p| p * tried < FAMILY_ERROR)
    };
    refused.retain(|(effect, _)| remains(effect));
    Some((Chosen { hypotheses: chosen, theta, refused }, round))
}

/// Probability by chance of what a hypothesis adds to `others`, and to the entry whose higher order it is; `None` where
/// the log does not determine it.
fn p_of<M: LogModel>(linear: &Linearised<'_, M>, hypothesis: &Hypothesis, others: &[Column]) -> Option<f64> {
    let mut others = others.to_vec();
    others.extend(columns(&hypothesis.lower).into_iter().filter(|column| !others.contains(column)).collect::<Vec<_>>());
    let effect = hypothesis.candidate.effect;
    let ranges: Vec<[f64; 2]> = (0..hypothesis.free.len()).map(|place| catalogue_range(effect, place)).collect();
    if !linear.is_determined(hypothesis, &others, &ranges) {
        return None;
    }
    Some(linear.added(&columns(&hypothesis.free), &others, hypothesis.free.len())?.p)
}

/// Drops the weakest until each that is left is significant beside the others.
fn prune<M: LogModel>(linear: &Linearised<'_, M>, chosen: &mut Vec<Hypothesis>, calibrated: &[Column], tried: f64) {
    loop {
        let p = |place: usize| p_of(linear, &chosen[place], &free(calibrated, chosen, Some(place))).unwrap_or(1.0);
        let weakest = (0..chosen.len()).map(|place| (p(place), place)).max_by(|a, b| a.0.total_cmp(&b.0));
        match weakest {
            Some((p, place)) if p * tried >= FAMILY_ERROR => {
                // Of several that say nothing the one with the least gain goes first.
                let least = (0..chosen.len())
                    .filter(|place| p_of(linear, &chosen[*place], &free(calibrated, chosen, Some(*place))).is_none())
                    .map(|place| {
                        let cost = COST * chosen[place].free.len() as f64;
                        (gain_of(linear, chosen, calibrated, place) - cost, place)
                    })
                    .min_by(|a, b| a.0.total_cmp(&b.0));
                chosen.remove(least.map_or(place, |(_, place)| place));
            }
            _ => return,
        }
    }
}

fn gain_of<M: LogModel>(linear: &Linearised<'_, M>, chosen: &[Hypothesis], calibrated: &[Column], place: usize) -> f64 {
    let others = free(calibrated, chosen, Some(place));
    linear.added(&columns(&chosen[place].free), &others, 1).map_or(0.0, |added| added.gain)
}

/// The chosen entry that loses most on the data that choose, if one does.
fn in_vain<M: LogModel>(linear: &Linearised<'_, M>, chosen: &[Hypothesis], calibrated: &[Column]) -> Option<usize> {
    (0..chosen.len())
        .map(|place| (linear.chosen_gain(&columns(&chosen[place].free), &free(calibrated, chosen, Some(place))), place))
        .filter(|(gain, _)| *gain <= 0.0)
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, place)| place)
}

/// A chosen entry with a size that this vehicle cannot have, and why.
fn outside<M: LogModel>(model: &M, chosen: &[Hypothesis], theta: &[f64]) -> Option<(usize, String)> {
    chosen.iter().enumerate().find_map(|(place, h)| {
        let effect = h.candidate.effect;
        h.free.iter().enumerate().find_map(|(size, column)| {
            let [low, high] = model.limits(effect, size);
            let value = theta[*column];
            let parameter = h.candidate.info().parameters.get(size).or(h.candidate.info().parameters.last())?;
            (!(low..=high).contains(&value)).then(|| {
                let unit = parameter.unit;
                let reason = format!(
                    "{effect} would have to be {} = {value:.2} {unit}, where {low:.2} to {high:.2} {unit} is possible: something \
                     else is the cause",
                    parameter.name
                );
                (place, reason)
            })
        })
    })
}

/// Every entry by itself beside what is always fitted, best first: for the page.
fn ladder<M: LogModel>(linear: &Linearised<'_, M>, all: &[Hypothesis], calibrated: &[Column]) -> Vec<Evidence> {
    let evidence = |h: &Hypothesis| {
        let own = columns(&h.free);
        let added = linear.added(&own, calibrated, h.free.len())?;
        let with: Vec<Column> = calibrated.iter().chain(&own).copied().collect();
        let fit = linear.fit(&with)?;
        let sizes: Vec<f64> = h
            .free
            .iter()
            .zip(&fit.theta[calibrated.len()..])
            .map(|(column, step)| linear.theta[*column] + step)
            .collect();
        Some(Evidence {
            instance: Instance { candidate: h.candidate, sizes },
            gain: added.gain,
            inflation: added.inflation,
            degrees: h.free.len(),
            held_gain: linear.chosen_gain(&own, calibrated),
            p: added.p,
            p_beside_lower: 0.0,
            is_determined: true,
        })
    };
    let mut ladder: Vec<Evidence> = all.iter().filter_map(evidence).collect();
    ladder.sort_by(|a, b| b.score().total_cmp(&a.score()));
    ladder
}

fn hypothesis(effect: &'static str, free: Vec<usize>) -> Hypothesis {
    Hypothesis {
        candidate: Candidate { effect, member: None, span: None },
        free,
        ends: Vec::new(),
        fixed: Vec::new(),
        lower: Vec::new(),
    }
}
