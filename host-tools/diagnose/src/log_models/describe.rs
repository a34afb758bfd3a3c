//! What was found, with intervals and alternatives, and what remains.

use super::evidence::{Chosen, Linearised, columns, free};
use super::fit::Fitting;
use super::model::{LogModel, Row, catalogue_range};
use crate::alternatives::{Alternative, manoeuvre};
use crate::borne_out::{BorneOut, gain_per_block};
use crate::candidates::{self, Hypothesis, Instance, continued_by};
use crate::diagnosis::{FoundEffect, ParameterEstimate};
use crate::normal_equations::Column;
use crate::split::DataPart;
use crate::structure::NamedTerm;
use crate::whitener::Pass;
use backseat_logs::stats::{Z_95, chi_square_tail};

/// Probability by chance, all terms counted, below which a term outside the catalogue is reported.
const OUTSIDE: f64 = 2e-3;
/// Most terms outside the catalogue that are reported.
const MOST_OUTSIDE: usize = 3;

/// An entry that was tested and is not named.
#[derive(Clone, Debug, PartialEq)]
pub struct NotNamed {
    /// Which.
    pub effect: &'static str,
    /// What the log allows of its sizes; empty where it says too little of them.
    pub values: Vec<ParameterEstimate>,
}

/// An effect that was found, and what the data that judge say of it.
pub(super) type JudgedEffect = (FoundEffect, BorneOut);

pub(super) struct Described<'a, M> {
    pub fitting: &'a Fitting<'a, M>,
    pub chosen: &'a Chosen,
    pub all: &'a [Hypothesis],
}

impl<M: LogModel> Described<'_, M> {
    fn linearised(&self, after: &Pass) -> Linearised<'_, M> {
        Linearised::new(self.fitting, self.chosen.theta.clone(), after.clone())
    }

    fn calibrated(&self) -> Vec<Column> {
        columns(&self.fitting.model.calibrated())
    }

    fn places(&self) -> Vec<usize> {
        let chosen = self.chosen.hypotheses.iter().flat_map(|h| h.free.clone());
        self.fitting.model.calibrated().into_iter().chain(chosen).collect()
    }

    /// Effects with values of the data that fit and choose and alternatives, and beside each what the data that judge say of
    /// it; one sigma of every column.
    pub fn effects(&self, after: &Pass) -> Option<(Vec<JudgedEffect>, Vec<f64>)> {
        let (theta, model) = (&self.chosen.theta, self.fitting.model);
        let linear = self.linearised(after);
        let places = self.places();
        let mut sigmas = vec![0.0; theta.len()];
        for (column, sigma) in places.iter().zip(self.fitting.sigmas(after, &linear.seen, &places)?) {
            sigmas[*column] = sigma;
        }
        let mut effects = Vec::new();
        for (place, hypothesis) in self.chosen.hypotheses.iter().enumerate() {
            let others = free(&self.calibrated(), &self.chosen.hypotheses, Some(place));
            let own = columns(&hypothesis.free);
            let added = linear.added(&own, &others, hypothesis.free.len())?;
            let mut alternatives: Vec<Alternative> = self
                .all
                .iter()
                .filter(|h| !self.chosen.hypotheses.contains(h))
                // What continues an entry is none that could stand in its place.
                .filter(|h| continued_by(h.candidate.effect) != Some(hypothesis.candidate.effect))
                .filter_map(|h| self.alternative(&linear, (hypothesis, added.gain), h, &others))
                .collect();
            alternatives.sort_by(|a, b| a.deficit.total_cmp(&b.deficit));
            let without = self.chosen.hypotheses.iter().filter(|h| *h != hypothesis).cloned().collect::<Vec<_>>();
            let without = self.fitting.refit(&without, theta)?;
            let without = self.fitting.pass(&model.rows(&without), &[]);
            let found = FoundEffect {
                instance: self.instance(hypothesis),
                values: self.values(hypothesis, &sigmas),
                p_value: (added.p * self.all.len() as f64).min(1.0),
                gain: added.gain,
                held_gain: gain_per_block(&without, after, self.fitting.is_in(DataPart::Judge)),
                alternatives,
            };
            effects.push((found, borne_out(self.fitting, &without, after)));
        }
        Some((effects, sigmas))
    }

    /// Another entry in the place of one that was chosen and gains so much; `None` if it is impossible there for this
    /// vehicle.
    fn alternative(
        &self,
        linear: &Linearised<'_, M>,
        (chosen, gain): (&Hypothesis, f64),
        other: &Hypothesis,
        others: &[Column],
    ) -> Option<Alternative> {
        let evidence = linear.evidence(other, others)?;
        let is_possible = evidence.instance.sizes.iter().enumerate().all(|(size, value)| {
            let [low, high] = self.fitting.model.limits(other.candidate.effect, size);
            (low..=high).contains(value)
        });
        if !is_possible {
            return None;
        }
        let alone: Vec<Column> = others.iter().copied().chain(columns(&other.free)).collect();
        let deficit = gain - evidence.gain;
        let p = match linear.added(&columns(&chosen.free), &alone, chosen.free.len()) {
            Some(added) => added.p,
            // The two are one and the same to the log.
            None => chi_square_tail(deficit, chosen.free.len()),
        };
        Some(Alternative {
            instance: evidence.instance,
            deficit,
            p,
            is_separable: other.lower.is_empty(),
            separating_manoeuvre: manoeuvre(&chosen.candidate, &other.candidate),
        })
    }

    fn values(&self, hypothesis: &Hypothesis, sigmas: &[f64]) -> Vec<ParameterEstimate> {
        let of = |column: &usize| (self.chosen.theta[*column], sigmas[*column]);
        ParameterEstimate::sizes(&hypothesis.candidate, hypothesis.free.iter().map(of))
    }

    /// As the vehicle file takes it: what was found, within what is plausible.
    fn instance(&self, hypothesis: &Hypothesis) -> Instance {
        let bounds = hypothesis.candidate.bounds();
        let mut sizes: Vec<f64> = hypothesis.free.iter().map(|column| self.chosen.theta[*column]).collect();
        // A DVL's pitch is not seen from above.
        sizes.resize(bounds.len(), 0.0);
        for (size, [low, high]) in sizes.iter_mut().zip(bounds) {
            *size = size.clamp(low, high);
        }
        Instance { candidate: hypothesis.candidate, sizes }
    }

    /// One sigma of the sizes of every entry with all others fitted beside it: what the log itself says of them, whatever was
    /// chosen. Empty where some of them are one and the same to the log.
    pub fn sigmas_beside_all(&self, after: &Pass) -> Vec<(&'static str, Vec<f64>)> {
        let entries = self.all.iter().flat_map(|h| h.free.clone());
        let mut places: Vec<usize> = self.fitting.model.calibrated().into_iter().chain(entries).collect();
        places.sort_unstable();
        places.dedup();
        let Some(sigmas) = self.fitting.sigmas(after, &self.linearised(after).seen, &places) else { return Vec::new() };
        let of = |column: &usize| places.binary_search(column).map_or(f64::INFINITY, |place| sigmas[place]);
        self.all.iter().map(|h| (h.candidate.effect, h.free.iter().map(of).collect())).collect()
    }

    /// Entries that were tested and not accepted, with how large they may be.
    pub fn not_named(&self, after: &Pass) -> Vec<NotNamed> {
        let linear = self.linearised(after);
        let places = self.places();
        let mut found = Vec::new();
        for h in self.all.iter().filter(|h| !self.chosen.hypotheses.contains(h)) {
            let effect = h.candidate.effect;
            if self.chosen.refused.iter().any(|(refused, _)| *refused == effect) {
                continue;
            }
            let mut with = places.clone();
            with.extend(h.lower.iter().filter(|column| !places.contains(column)));
            let from = with.len();
            with.extend(&h.free);
            let fit = linear.fit(&columns(&with));
            let sigmas = self.fitting.sigmas(after, &linear.seen, &with);
            let (Some(fit), Some(sigmas)) = (fit, sigmas) else { continue };
            let says_little = h.free.iter().enumerate().any(|(size, _)| {
                let [low, high] = catalogue_range(effect, size);
                2.0 * Z_95 * fit.sigma(from + size) > high - low
            });
            let of =
                |(i, column): (usize, &usize)| (self.chosen.theta[*column] + fit.theta[from + i], sigmas[from + i]);
            let values = ParameterEstimate::sizes(&h.candidate, h.free.iter().enumerate().map(of));
            found.push(NotNamed { effect, values: if says_little { Vec::new() } else { values } });
        }
        found
    }

    /// Entries that were refused, and those that were not accepted with how large they may be.
    pub fn notes(&self, not_named: &[NotNamed]) -> Vec<String> {
        let of = |entry: &NotNamed| {
            let effect = entry.effect;
            let sizes = entry.values.iter().map(|p| {
                let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
                format!("{} {:.3} (±{:.3}){unit}", p.name, p.value, 0.5 * (p.ci95[1] - p.ci95[0]))
            });
            if entry.values.is_empty() {
                undetermined(effect)
            } else {
                format!("{effect} not significant: {}", sizes.collect::<Vec<_>>().join(", "))
            }
        };
        self.chosen.refused.iter().map(|(_, reason)| reason.clone()).chain(not_named.iter().map(of)).collect()
    }

    /// Columns without a name beside everything found, one after the other, best first.
    pub fn outside_catalogue(&self, after: &Pass) -> Vec<NamedTerm> {
        let linear = self.linearised(after);
        let all = self.fitting.model.outside_catalogue();
        let mut others = columns(&self.places());
        let mut found: Vec<NamedTerm> = Vec::new();
        while found.len() < MOST_OUTSIDE {
            let left = all.iter().filter(|(name, _)| found.iter().all(|term| term.name != *name));
            let best = left
                .filter_map(|(name, own)| {
                    let own = columns(own);
                    let added = linear.added(&own, &others, own.len())?;
                    let with: Vec<Column> = others.iter().chain(&own).copied().collect();
                    let values = linear.fit(&with)?.theta[others.len()..].to_vec();
                    let held_gain = linear.chosen_gain(&own, &others);
                    let p = (added.p * all.len() as f64).min(1.0);
                    Some((own, NamedTerm { name, values, ci95: Vec::new(), gain: added.gain, held_gain, p }))
                })
                .filter(|(_, term)| term.p < OUTSIDE && term.held_gain > 0.0)
                .min_by(|a, b| a.1.p.total_cmp(&b.1.p).then(b.1.gain.total_cmp(&a.1.gain)));
            let Some((own, term)) = best else { break };
            others.extend(own);
            found.push(term);
        }
        found
    }

    /// The terms outside the catalogue fitted with everything found: rows and their pass.
    pub fn with_terms(&self, named: &mut [NamedTerm]) -> Option<(Vec<Row>, Pass)> {
        if named.is_empty() {
            return None;
        }
        let (fitting, model) = (self.fitting, self.fitting.model);
        let all = model.outside_catalogue();
        let own: Vec<Vec<usize>> = named
            .iter()
            .map(|term| all.iter().find(|(name, _)| *name == term.name).map_or_else(Vec::new, |(_, own)| own.clone()))
            .collect();
        let places: Vec<usize> = self.places().into_iter().chain(own.iter().flatten().copied()).collect();
        let theta = fitting.solve(&places, &self.chosen.theta, DataPart::Seen)?;
        if own.iter().flatten().all(|column| theta[*column] == 0.0) {
            // Significant to first order, and no step from the values found makes the data better.
            return None;
        }
        let rows = model.rows(&theta);
        let pass = fitting.pass(&rows, &[]);
        let sigmas = fitting.sigmas(&pass, &fitting.equations(&pass, &theta, DataPart::Seen), &places)?;
        for (term, own) in named.iter_mut().zip(&own) {
            term.values = own.iter().map(|column| theta[*column]).collect();
            let half = |column: &usize| {
                places.iter().position(|place| place == column).map_or(f64::INFINITY, |at| Z_95 * sigmas[at])
            };
            term.ci95 =
                own.iter().map(|column| [theta[*column] - half(column), theta[*column] + half(column)]).collect();
        }
        Some((rows, pass))
    }
}

fn undetermined(effect: &str) -> String {
    let alike = || format!("{effect} cannot be separated from other entries: they change this log in the same way");
    candidates::inseparable(effect).unwrap_or_else(alike)
}

/// What the data that judge say of the difference between two passes.
pub(super) fn borne_out<M: LogModel>(fitting: &Fitting<'_, M>, before: &Pass, after: &Pass) -> BorneOut {
    let layout = &fitting.layout;
    BorneOut::of(before, after, |t_s| layout.is_judged(t_s).then(|| layout.block(t_s)))
}
