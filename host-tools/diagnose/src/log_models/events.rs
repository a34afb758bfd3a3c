//! Entries that begin or end within a log: a current that sets in, a compass that something was laid beside.

use super::describe::{JudgedEffect, borne_out};
use super::evidence::{Chosen, Linearised, columns, free};
use super::fit::{Fitting, Step};
use super::model::{LogModel, Row};
use crate::borne_out::gain_per_block;
use crate::candidates::{Candidate, Hypothesis, Instance, Span};
use crate::diagnosis::{FoundEffect, ParameterEstimate};
use crate::normal_equations::Column;
use crate::search;
use crate::selection::FAMILY_ERROR;
use crate::split::DataPart;
use crate::whitener::Pass;
use backseat_core::effects::ParameterKind;

/// What a gain may fall short of the best within the 95 % interval of a time, χ² of one number.
const INTERVAL_GAIN: f64 = 3.84;

/// An entry that is there for a part of the log.
#[derive(Clone, Debug)]
pub(super) struct Event {
    hypothesis: Hypothesis,
    span: Span,
    /// Of its beginning and end, s.
    intervals: [[f64; 2]; 2],
    sizes: Vec<f64>,
    sigmas: Vec<f64>,
    p: f64,
    gain: f64,
    chosen_gain: f64,
    /// What else was fitted, beside it.
    theta: Vec<f64>,
    /// What was chosen and says nothing beside it.
    weak: Vec<Hypothesis>,
}

/// Takes what events make of the residuals out of them.
pub(super) fn apply(rows: &mut [Row], model: &impl LogModel, events: &[Event]) {
    for event in events {
        let ends = std::iter::once((event.span.onset_s, 1.0)).chain(event.span.end_s.map(|end_s| (end_s, -1.0)));
        for (time_s, sign) in ends {
            let mut origins: std::collections::BTreeMap<_, Vec<f64>> = std::collections::BTreeMap::new();
            for row in rows.iter_mut() {
                let own: Vec<f64> = event.hypothesis.free.iter().map(|column| row.slopes[*column]).collect();
                if row.t_s < time_s {
                    if model.is_summed(row.channel) {
                        origins.insert((row.sequence, row.channel), own);
                    }
                    continue;
                }
                let origin = origins.get(&(row.sequence, row.channel));
                for (place, (slope, size)) in own.iter().zip(&event.sizes).enumerate() {
                    row.residual -= sign * size * (slope - origin.map_or(0.0, |origin| origin[place]));
                }
            }
        }
    }
}

/// The event that explains most, where one is significant beside what is chosen; it takes the place of the lasting entry
/// of its name where that is not needed beside it.
pub(super) fn find<M: LogModel>(
    fitting: &Fitting<'_, M>,
    chosen: &mut Chosen,
    all: &[Hypothesis],
    duration_s: f64,
) -> Option<Vec<Event>> {
    let names = fitting.model.events();
    let wanted: Vec<&Hypothesis> = all.iter().filter(|h| names.contains(&h.candidate.effect)).collect();
    if wanted.is_empty() {
        return Some(Vec::new());
    }
    let times = search::coarse_times(duration_s);
    let onsets: Vec<f64> = std::iter::once(f64::NEG_INFINITY).chain(times.iter().copied()).collect();
    let mut spans = search::open_or_until(&onsets, &times);
    spans.retain(|span| span.onset_s.is_finite() || span.end_s.is_some());
    let tried = (wanted.len() * spans.len()) as f64;
    let mut best: Option<Event> = None;
    for hypothesis in &wanted {
        let Some(event) = over_spans(fitting, chosen, hypothesis, &spans, &times, tried) else { continue };
        if best.as_ref().is_none_or(|other| event.gain > other.gain) {
            best = Some(event);
        }
    }
    let Some(coarse) = best else { return Some(Vec::new()) };
    // Finer times about the best ones, of this entry alone.
    let cell_s = search::coarse_step_s(duration_s);
    let about = |time_s: f64| (-8..=8).map(move |k| time_s + cell_s * f64::from(k) / 8.0);
    let onsets: Vec<f64> =
        if coarse.span.onset_s.is_finite() { about(coarse.span.onset_s).collect() } else { vec![f64::NEG_INFINITY] };
    let ends: Vec<Option<f64>> = coarse.span.end_s.map_or_else(|| vec![None], |end_s| about(end_s).map(Some).collect());
    let spans = search::spans(&onsets, &ends);
    let mut times: Vec<f64> =
        onsets.iter().copied().chain(ends.iter().flatten().copied()).filter(|time_s| time_s.is_finite()).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let event = over_spans(fitting, chosen, &coarse.hypothesis, &spans, &times, tried).unwrap_or(coarse);
    // What was chosen in its stead is not needed beside it.
    chosen.hypotheses.retain(|h| !event.weak.contains(h));
    for column in event.weak.iter().flat_map(|h| &h.free) {
        chosen.theta[*column] = 0.0;
    }
    let event = if event.weak.is_empty() {
        event
    } else {
        over_spans(fitting, chosen, &event.hypothesis, &spans, &times, tried).unwrap_or(event)
    };
    chosen.hypotheses.retain(|h| *h != event.hypothesis);
    chosen.theta.clone_from(&event.theta);
    Some(vec![event])
}

/// The best span of one entry, if it is significant, better than the lasting entry, and gains where effects are chosen.
fn over_spans<M: LogModel>(
    fitting: &Fitting<'_, M>,
    chosen: &Chosen,
    hypothesis: &Hypothesis,
    spans: &[Span],
    times: &[f64],
    tried: f64,
) -> Option<Event> {
    let model = fitting.model;
    let steps: Vec<Step> = hypothesis
        .free
        .iter()
        .flat_map(|column| times.iter().map(|onset_s| Step { column: *column, onset_s: *onset_s }))
        .collect();
    let rows = model.rows(&chosen.theta);
    let linear = Linearised::new(fitting, chosen.theta.clone(), fitting.pass(&rows, &steps));
    let lasting = columns(&hypothesis.free);
    let place = chosen.hypotheses.iter().position(|h| h == hypothesis);
    let others = free(&columns(&model.calibrated()), &chosen.hypotheses, place);
    let at = |size: usize, time_s: f64| {
        let time = times.iter().position(|time| *time == time_s)?;
        Some(model.columns() + size * times.len() + time)
    };
    let span_columns = |span: &Span| -> Option<Vec<Column>> {
        (0..hypothesis.free.len())
            .map(|size| {
                let begin = if span.onset_s.is_finite() { at(size, span.onset_s)? } else { hypothesis.free[size] };
                let end = span.end_s.map(|end_s| at(size, end_s));
                Some(Column::until(begin, end.map_or(Some(None), |end| end.map(Some))?))
            })
            .collect()
    };
    let gain_of = |own: &[Column]| {
        let with: Vec<Column> = others.iter().chain(own).copied().collect();
        linear.fit(&with).map(|fit| fit.gain)
    };
    let always = gain_of(&lasting).unwrap_or(f64::NEG_INFINITY);
    let never = linear.fit(&others)?.gain;
    let gains: Vec<(f64, &Span)> =
        spans.iter().filter_map(|span| Some((gain_of(&span_columns(span)?)?, span))).collect();
    let times_of = |span: &Span| usize::from(span.onset_s.is_finite()) + usize::from(span.end_s.is_some());
    let score = |(gain, span): &(f64, &Span)| gain - search::END_GAIN * times_of(span) as f64;
    let (gain, span) = gains.iter().copied().max_by(|a, b| score(a).total_cmp(&score(b)))?;
    let own = span_columns(span)?;
    let degrees = hypothesis.free.len() + times_of(span);
    let added = linear.added(&own, &others, degrees)?;
    let chosen_gain = linear.chosen_gain(&own, &others);
    let is_better = gain > always.max(never) + search::END_GAIN * times_of(span) as f64 * added.inflation.max(1.0);
    if !is_better || added.p * tried >= FAMILY_ERROR || chosen_gain <= 0.0 {
        return None;
    }
    let with: Vec<Column> = others.iter().chain(&own).copied().collect();
    let fit = linear.fit(&with)?;
    let near = gain - INTERVAL_GAIN * added.inflation.max(1.0);
    let within = |of: &dyn Fn(&Span) -> f64| {
        let near = gains.iter().filter(|(gain, _)| *gain >= near).map(|(_, span)| of(span));
        near.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], time| [low.min(time), high.max(time)])
    };
    let sigmas = crate::linear::sigmas(&linear.pass.normal, fitting.is_in(DataPart::Seen), &with, &fit, &[]);
    let mut theta = chosen.theta.clone();
    for column in &hypothesis.free {
        theta[*column] = 0.0;
    }
    let rest = chosen.hypotheses.iter().filter(|h| *h != hypothesis).flat_map(|h| h.free.clone());
    for (column, step) in model.calibrated().into_iter().chain(rest).zip(&fit.theta) {
        theta[column] += step;
    }
    let is_weak = |h: &&Hypothesis| {
        let place = chosen.hypotheses.iter().position(|other| other == *h);
        let rest = free(&columns(&model.calibrated()), &chosen.hypotheses, place);
        let beside: Vec<Column> =
            rest.into_iter().filter(|column| !lasting.contains(column)).chain(own.clone()).collect();
        let added = linear.added(&columns(&h.free), &beside, h.free.len());
        added.is_none_or(|added| added.p * chosen.hypotheses.len() as f64 >= FAMILY_ERROR)
    };
    let weak = chosen.hypotheses.iter().filter(|h| *h != hypothesis).filter(is_weak).cloned().collect();
    Some(Event {
        theta,
        weak,
        hypothesis: hypothesis.clone(),
        span: *span,
        intervals: [within(&|span| span.onset_s), within(&|span| span.end_s.unwrap_or(f64::INFINITY))],
        sizes: fit.theta[others.len()..].to_vec(),
        sigmas: sigmas[others.len()..].to_vec(),
        p: (added.p * tried).min(1.0),
        gain: added.gain,
        chosen_gain,
    })
}

impl Event {
    /// Times between which it begins or ends, as far as the log says, s.
    pub fn intervals(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        self.intervals.iter().copied().filter(|interval| interval.iter().all(|time_s| time_s.is_finite()))
    }

    /// In the catalogue's form, and what the data that judge say of it. No vehicle file holds it: its sizes there are zero.
    pub fn described<M: LogModel>(&self, fitting: &Fitting<'_, M>, theta: &[f64], after: &Pass) -> JudgedEffect {
        let candidate = Candidate { span: Some(self.span), ..self.hypothesis.candidate };
        let sizes = self.sizes.iter().copied().zip(self.sigmas.iter().copied());
        let mut values = ParameterEstimate::sizes(&candidate, sizes);
        let time = |name, kind, value, ci95| ParameterEstimate { name, unit: "s", kind, value, ci95 };
        if self.span.onset_s.is_finite() {
            values.push(time("onset_s", ParameterKind::Onset, self.span.onset_s, self.intervals[0]));
        }
        if let Some(end_s) = self.span.end_s {
            values.push(time("end_s", ParameterKind::End, end_s, self.intervals[1]));
        }
        let without = fitting.pass(&fitting.model.rows(theta), &[]);
        let found = FoundEffect {
            instance: Instance { candidate, sizes: vec![0.0; candidate.bounds().len()] },
            values,
            p_value: self.p,
            gain: self.gain.max(self.chosen_gain),
            held_gain: gain_per_block(&without, after, fitting.is_in(DataPart::Judge)),
            alternatives: Vec::new(),
        };
        (found, borne_out(fitting, &without, after))
    }
}
