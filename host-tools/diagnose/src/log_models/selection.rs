//! Diagnosis by a log model: the selection begins with all entries fitted together on the data that fit and choose, so
//! that none hides another. The data that judge take part in none of this.

use super::describe::{self, JudgedEffect, NotNamed};
use super::events;
use super::evidence::{Chosen, Linearised, columns, free};
use super::fit::Fitting;
use super::layout::Layout;
use super::model::LogModel;
use super::noise::Noise;
use super::scoring;
use crate::candidates::{self, Candidate, Hypothesis, Instance};
use crate::diagnosis::{Diagnosis, FoundEffect};
use crate::floor::FEWEST_JUDGED;
use crate::normal_equations::Column;
use crate::scores::Scores;
use crate::selection::{
    self, BLOCKS_A_NUMBER, COST, Evidence, FAMILY_ERROR, Ground, Refusal, Round, Selectable, Worth,
};
use crate::split::DataPart;
use crate::structure::Structure;
use crate::verdict::Conditions;
use backseat_logs::{Log, VehicleFile};

/// Probability of the remaining residuals under whiteness below which they have structure. Whitened fixes of every second
/// show a receiver's own filter, which no position depends on.
const STRUCTURE: f64 = 1e-6;

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
    let plain = fitting.refit(&[], &joint)?;
    let before_rows = model.rows(&plain);
    let before = fitting.pass(&before_rows, &[]);
    let mut all: Vec<Hypothesis> = model.entries().into_iter().map(|(effect, free)| hypothesis(effect, free)).collect();
    candidates::set_lower(&mut all);
    let blocks = before.normal.blocks.iter().enumerate();
    let [seen, judged] = [DataPart::Seen, DataPart::Judge].map(|part| {
        blocks.clone().filter(|(place, block)| block.count > 0 && fitting.layout.is_in(part, *place)).count()
    });
    let (mut chosen, round) = choose(&fitting, joint, &all, seen)?;
    let events =
        if runs.len() == 1 { events::find(&fitting, &mut chosen, &all, log.duration_s())? } else { Vec::new() };
    fitting.layout.except(events.iter().flat_map(events::Event::intervals).collect());
    let theta = &chosen.theta;
    let mut after_rows = model.rows(theta);
    events::apply(&mut after_rows, model, &events);
    let after = fitting.pass(&after_rows, &[]);
    let described = describe::Described { fitting: &fitting, chosen: &chosen, all: &all };
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
        conditions,
        effects,
        rounds: vec![round],
        structure: Structure { named, ..Structure::default() },
        before,
        after,
        notes,
        ..Diagnosis::default()
    };
    let diagnosis = diagnosis.held_to(remaining, judged < FEWEST_JUDGED || has_more_than_all);
    let theta = [plain, chosen.theta];
    let noise = fitting.noise;
    Some(LogModelDiagnosis { diagnosis, theta, sigmas, not_named, sigmas_beside_all, noise, scores, with_terms })
}

/// A log model's entries, beside what every fit has.
struct Entries<'a, M> {
    fitting: &'a Fitting<'a, M>,
    all: &'a [Hypothesis],
    calibrated: Vec<Column>,
    /// Most numbers that the log can bear.
    most: usize,
}

impl<'a, M: LogModel> Entries<'a, M> {
    fn hypotheses(&self, effects: &[Instance]) -> Vec<Hypothesis> {
        let of = |effect: &Instance| self.all.iter().find(|h| h.candidate == effect.candidate).cloned();
        effects.iter().filter_map(of).collect()
    }

    fn linearised(&self, theta: Vec<f64>) -> Linearised<'a, M> {
        let pass = self.fitting.pass(&self.fitting.model.rows(&theta), &[]);
        Linearised::new(self.fitting, theta, pass)
    }

    /// Why an entry cannot have these sizes on this vehicle.
    fn outside(&self, effect: &Instance) -> Option<String> {
        let info = effect.candidate.info();
        effect.sizes.iter().enumerate().find_map(|(size, value)| {
            let ([low, high], name) = (self.fitting.model.limits(info.name, size), info.name);
            let parameter = info.parameters.get(size).or(info.parameters.last())?;
            let (of, unit) = (parameter.name, parameter.unit);
            let must = format!("{name} would have to be {of} = {value:.2} {unit}");
            let may = format!("{low:.2} to {high:.2} {unit} is possible: something else is the cause");
            (!(low..=high).contains(value)).then(|| format!("{must}, where {may}"))
        })
    }
}

impl<'a, M: LogModel> Selectable for Entries<'a, M> {
    type Fit = Linearised<'a, M>;

    fn round(&self, accepted: &[Instance], linear: &Linearised<'a, M>) -> Option<Round> {
        let chosen = self.hypotheses(accepted);
        let fitted: usize = chosen.iter().map(|h| h.free.len()).sum();
        let others = free(&self.calibrated, &chosen, None);
        let left = self.all.iter().filter(|h| !chosen.contains(h) && fitted + h.free.len() <= self.most);
        let mut ladder: Vec<Evidence> = left.filter_map(|h| linear.evidence(h, &others)).collect();
        ladder.sort_by(|a, b| b.score().total_cmp(&a.score()));
        Some(Round { ladder, events: Vec::new(), tried: self.all.len() })
    }

    fn fit(&self, effects: &mut Vec<Instance>, from: &Linearised<'a, M>, _: DataPart) -> Option<Linearised<'a, M>> {
        let mut chosen = self.hypotheses(effects);
        while chosen.iter().map(|h| h.free.len()).sum::<usize>() > self.most {
            chosen.pop();
        }
        let theta = self.fitting.refit(&chosen, &from.theta)?;
        *effects = instances(&chosen, &theta);
        Some(self.linearised(theta))
    }

    fn cost(&self, effects: &[Instance], linear: &Linearised<'a, M>) -> f64 {
        let numbers: usize = effects.iter().map(|effect| effect.sizes.len()).sum();
        self.fitting.cost(&linear.pass, &linear.theta, DataPart::Seen) + COST * numbers as f64
    }

    /// All are tried at once, so that their number counts here. Of several that are alike one is none, and goes first.
    fn worth(&self, effects: &[Instance], place: usize, linear: &Linearised<'a, M>) -> Worth {
        if effects[place].sizes.iter().all(|size| *size == 0.0) {
            return Worth::by_chance(self.all.len() as f64, f64::NEG_INFINITY);
        }
        let chosen = self.hypotheses(effects);
        let evidence = linear.evidence(&chosen[place], &free(&self.calibrated, &chosen, Some(place)));
        let nothing = (1.0, -COST * chosen[place].free.len() as f64);
        let (p, score) = evidence.map_or(nothing, |evidence| (evidence.chance(), evidence.score()));
        Worth::by_chance(p * self.all.len() as f64, score)
    }

    /// Outside what this vehicle can have; or the entry that loses most where effects are chosen, by sizes of the data
    /// that fit.
    fn refusal(&self, effects: &[Instance], linear: &Linearised<'a, M>) -> Option<Refusal> {
        let chosen = self.hypotheses(effects);
        let outside =
            |place: usize| Some(Refusal { place, note: self.outside(&effects[place])?, ground: Ground::Impossible });
        let gain = |place: usize| {
            linear.chosen_gain(&columns(&chosen[place].free), &free(&self.calibrated, &chosen, Some(place)))
        };
        let in_vain = || {
            let lost = (0..effects.len()).map(|place| (gain(place), place)).filter(|(gain, _)| *gain <= 0.0);
            let (_, place) = lost.min_by(|a, b| a.0.total_cmp(&b.0))?;
            Some(Refusal { place, note: String::new(), ground: Ground::Unfounded })
        };
        (0..effects.len()).find_map(outside).or_else(in_vain)
    }
}

fn instances(chosen: &[Hypothesis], theta: &[f64]) -> Vec<Instance> {
    let sizes = |h: &Hypothesis| h.free.iter().map(|column| theta[*column]).collect();
    chosen.iter().map(|h| Instance { candidate: h.candidate, sizes: sizes(h) }).collect()
}

/// Begins with every entry; beside what is selected every entry by itself, for the page.
fn choose<M: LogModel>(
    fitting: &Fitting<'_, M>,
    joint: Vec<f64>,
    all: &[Hypothesis],
    seen_blocks: usize,
) -> Option<(Chosen, Round)> {
    let calibrated = columns(&fitting.model.calibrated());
    let mut entries = Entries { fitting, all, calibrated, most: usize::MAX };
    let joint = entries.linearised(joint);
    let alone = entries.round(&[], &joint)?;
    entries.most = seen_blocks / BLOCKS_A_NUMBER;
    let start = (instances(all, &joint.theta), joint);
    let selected = selection::select(&mut entries, start, &mut |_| ())?;
    // What was refused is no matter if nothing of it is left beside what was chosen instead.
    let hypotheses = entries.hypotheses(&selected.accepted);
    let others = free(&entries.calibrated, &hypotheses, None);
    let remains = |(effect, _): &(&'static str, String)| {
        let refused = all.iter().find(|h| h.candidate.effect == *effect);
        let evidence = refused.and_then(|h| selected.fit.evidence(h, &others));
        evidence.is_some_and(|e| e.chance() * (all.len() as f64) < FAMILY_ERROR)
    };
    let refused = selected.refused.into_iter().filter(remains).collect();
    Some((Chosen { hypotheses, theta: selected.fit.theta, refused }, alone))
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
