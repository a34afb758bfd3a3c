//! The catalogue as hypotheses: which columns a hypothesis has, and what its values mean.

use crate::log_effects::{self, Effects};
use crate::normal_equations::Column;
use crate::regressors::{Regressor, Variation};
use crate::samples::ResidualChannel;
use crate::whitener::STEP_S;
use backseat_core::effects::{self, CATALOGUE, EffectInfo, FIN_NAMES, LOG_CATALOGUE, ParameterInfo, ParameterKind};

/// When an event is there, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// From when on.
    pub onset_s: f64,
    /// Until when; `None`: to the end of the log.
    pub end_s: Option<f64>,
}

/// An entry of the catalogue, with its member and its time where it has them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The entry.
    pub effect: &'static str,
    /// Which of several that are alike: a fin, from 0, or a transponder, its number.
    pub member: Option<usize>,
    /// When, where it is an event.
    pub span: Option<Span>,
}

/// A candidate with the columns of a pass that stand for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// What.
    pub candidate: Candidate,
    /// Columns of its sizes.
    pub free: Vec<usize>,
    /// Columns that take them away again, one for each; empty where it does not end.
    pub ends: Vec<usize>,
    /// Columns that are present whole (a stuck fin no longer follows its command).
    pub fixed: Vec<(usize, f64)>,
    /// Columns of the entry it continues ([`continued_by`]); empty where that is accepted already.
    pub lower: Vec<usize>,
}

/// Entries that are a higher order of another: soft iron is the second harmonic of the heading, beside constant and first.
/// On few headings the higher order alone fits what is the lower one's: on two, any two numbers do. So it is only named
/// for what it explains beside the lower, which takes as many headings as both have numbers, here five.
const CONTINUES: [(&str, &str); 1] = [("soft_iron", "heading_bias")];

/// The entry whose higher order this one is.
#[must_use]
pub fn continued_by(effect: &str) -> Option<&'static str> {
    CONTINUES.iter().find(|(higher, _)| *higher == effect).map(|(_, lower)| *lower)
}

/// What separates an entry from the one whose higher order it is, if it is one, where a log does not.
#[must_use]
pub fn inseparable(effect: &str) -> Option<String> {
    let lower = continued_by(effect)?;
    let confusion = effects::find_of_log(effect)?.confused_with.iter().find(|confusion| confusion.effect == lower)?;
    let [when, manoeuvre] = [confusion.condition, confusion.separating_manoeuvre];
    Some(format!("{effect} cannot be separated from {lower} by this log. {when}. To separate them: {manoeuvre}"))
}

/// Tells every hypothesis the columns of the entry that it continues.
pub fn set_lower(hypotheses: &mut [Hypothesis]) {
    for place in 0..hypotheses.len() {
        let lower = continued_by(hypotheses[place].candidate.effect);
        let found = lower.and_then(|lower| hypotheses.iter().find(|h| h.candidate.effect == lower));
        hypotheses[place].lower = found.map_or_else(Vec::new, |found| found.free.clone());
    }
}

/// An effect with values.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    /// What.
    pub candidate: Candidate,
    /// Its sizes, in the order of the entry.
    pub sizes: Vec<f64>,
}

impl Span {
    /// From before the log to its end.
    pub const ALWAYS: Self = Self { onset_s: 0.0, end_s: None };
}

impl Hypothesis {
    /// The columns of its sizes: where it ends, what begins with it less what begins with its end.
    #[must_use]
    pub fn columns(&self) -> Vec<Column> {
        let column = |(i, at): (usize, &usize)| Column::until(*at, self.ends.get(i).copied());
        self.free.iter().enumerate().map(column).collect()
    }

    /// The columns that are present whole, likewise.
    #[must_use]
    pub fn fixed(&self) -> Vec<(Column, f64)> {
        self.fixed.iter().map(|(column, factor)| (Column::from(*column), *factor)).collect()
    }
}

impl Candidate {
    /// The entry of the catalogue.
    ///
    /// # Panics
    /// Never: candidates are made from the catalogue.
    #[must_use]
    pub fn info(&self) -> &'static EffectInfo {
        effects::find_of_log(self.effect).expect("candidates come from the catalogue")
    }

    /// Name with the fin or transponder, for the ladder of hypotheses.
    #[must_use]
    pub fn label(&self) -> String {
        match self.member {
            Some(member) => format!("{} ({})", self.effect, self.which(member)),
            None => self.effect.to_owned(),
        }
    }

    /// Name of the fin, or number of the transponder.
    #[must_use]
    pub fn which(&self, place: usize) -> String {
        let is_fin = self.info().parameters.iter().any(|parameter| parameter.kind == ParameterKind::Fin);
        FIN_NAMES.get(place).filter(|_| is_fin).map_or_else(|| place.to_string(), |name| (*name).to_owned())
    }

    /// All values of the entry with these sizes.
    #[must_use]
    pub fn values(&self, sizes: &[f64]) -> Vec<f64> {
        let mut sizes = sizes.iter();
        let value = |kind: ParameterKind, sizes: &mut std::slice::Iter<'_, f64>| match kind {
            ParameterKind::Fin => self.member.map_or(0.0, |fin| (fin + 1) as f64),
            ParameterKind::Transponder => self.member.map_or(0.0, |number| number as f64),
            ParameterKind::Onset => self.span.map_or(0.0, |span| span.onset_s),
            ParameterKind::End => self.span.and_then(|span| span.end_s).unwrap_or(0.0),
            ParameterKind::Size | ParameterKind::Shape => sizes.next().copied().unwrap_or(0.0),
        };
        self.info().parameters.iter().map(|parameter| value(parameter.kind, &mut sizes)).collect()
    }

    /// `set` with this effect of these sizes.
    #[must_use]
    pub fn apply(&self, set: &Effects, sizes: &[f64]) -> Effects {
        set.with(self.effect, &self.values(sizes)).unwrap_or(*set)
    }

    /// Least and largest plausible value of each size.
    #[must_use]
    pub fn bounds(&self) -> Vec<[f64; 2]> {
        let sizes = self.info().parameters.iter().filter(|p| p.kind == ParameterKind::Size);
        sizes.map(|p| [p.min, p.max]).collect()
    }

    /// Whether it delays the actuators.
    #[must_use]
    pub fn is_lag(&self) -> bool {
        self.info().parameters.iter().any(|p| p.kind == ParameterKind::Size && self.is_delay(p))
    }

    /// Whether it delays all actuators, and does nothing else.
    #[must_use]
    pub fn is_pure_delay(&self) -> bool {
        log_effects::is_of_inputs(self.effect)
    }

    /// Whether a parameter is a time by which actuators are late.
    fn is_delay(&self, parameter: &ParameterInfo) -> bool {
        let info = self.info();
        (info.hooks.input.is_some() || log_effects::is_of_inputs(info.name)) && parameter.unit == "s"
    }

    /// Whether it is a fin that no longer moves: one that is stuck at zero is an effect already.
    #[must_use]
    pub fn is_stuck(&self) -> bool {
        self.effect == "fin_stuck"
    }

    /// Whether it ends before the log does.
    #[must_use]
    pub fn ends(&self) -> bool {
        self.span.is_some_and(|span| span.end_s.is_some())
    }

    /// How many numbers are fitted, onset and end included.
    #[must_use]
    pub fn degrees(&self) -> usize {
        self.bounds().len() + usize::from(self.span.is_some()) + usize::from(self.ends())
    }
}

impl Instance {
    /// `set` with this effect.
    #[must_use]
    pub fn apply(&self, set: &Effects) -> Effects {
        self.candidate.apply(set, &self.sizes)
    }

    /// Whether the filter's own step can show it: a shorter lag cannot be separated from the step of integration, and
    /// coloured noise that comes back by the autopilot looks like one.
    #[must_use]
    pub fn is_resolved(&self) -> bool {
        let info = self.candidate.info();
        let is_lag = |(parameter, _): &(&ParameterInfo, &f64)| self.candidate.is_delay(parameter);
        let sizes = info.parameters.iter().filter(|parameter| parameter.kind == ParameterKind::Size);
        sizes.zip(&self.sizes).filter(is_lag).all(|(_, size)| *size >= STEP_S)
    }
}

/// What is declared, with all these effects.
#[must_use]
pub fn set_of(declared: &Effects, instances: &[Instance]) -> Effects {
    instances.iter().fold(*declared, |set, instance| instance.apply(&set))
}

/// All but one.
#[must_use]
pub fn others(instances: &[Instance], place: usize) -> Vec<Instance> {
    instances.iter().enumerate().filter(|(i, _)| *i != place).map(|(_, other)| other.clone()).collect()
}

/// What a log holds that the entries of the catalogue need.
#[derive(Clone, Debug)]
pub struct Scope {
    /// Channels with samples.
    pub present: [bool; ResidualChannel::COUNT],
    /// The log gives the density of the water.
    pub has_density: bool,
    /// Numbers of the fixed transponders that were heard.
    pub stations: Vec<u32>,
    /// Length of the log, s.
    pub duration_s: f64,
    /// Effects that the vehicle file declares.
    pub declared: Effects,
}

/// Entries that this log cannot test, with the reason.
#[must_use]
pub fn beyond(scope: &Scope) -> Vec<(&'static str, &'static str)> {
    let mut reasons = vec![(
        "depth_bias",
        "a constant depth error shows only at the surface, against the sensor's known depth there, which the log does not hold",
    )];
    if !scope.has_density {
        reasons.push((
            "water_density",
            "the log has no water_density_kg_per_m3; without it, a change of density looks like buoyancy_offset",
        ));
    }
    let has = |channel: ResidualChannel| scope.present[channel as usize];
    if !has(ResidualChannel::Range) {
        for effect in ["clock_offset", "clock_drift", "clock_change"] {
            reasons.push((effect, "the log has no ranges"));
        }
        if !has(ResidualChannel::UsblAlong) {
            for effect in ["sound_speed", "range_outliers"] {
                reasons.push((effect, "the log has no ranges"));
            }
        }
    }
    if !has(ResidualChannel::UsblAcross) {
        reasons.push(("usbl_turn", "the log has no fixes by USBL"));
    }
    if scope.stations.is_empty() {
        reasons.push(("transponder_place", "the log has no ranges to fixed transponders"));
    }
    if !scope.present[ResidualChannel::DvlU as usize] {
        for effect in ["dvl_scale", "dvl_misalignment", "dvl_delay", "dvl_lever_arm", "dvl_change", "waves"] {
            reasons.push((effect, "the log has no DVL velocity"));
        }
    }
    for (_, info, _) in scope.declared.board.active() {
        reasons.push((info.name, "the vehicle file already declares it"));
    }
    reasons
}

/// Terms and hypotheses of the whole catalogue about `set`; entries of `accepted` are nuisance columns, returned apart.
#[must_use]
pub fn catalogue(
    scope: &Scope,
    accepted: &[Instance],
    spans: &[Span],
) -> (Vec<Regressor>, Vec<Hypothesis>, Vec<usize>) {
    let set = set_of(&scope.declared, accepted);
    let skipped = beyond(scope);
    let (mut terms, mut hypotheses, mut nuisance) = (Vec::new(), Vec::new(), Vec::new());
    let mut column = 0;
    for instance in accepted {
        let own = own_terms(instance, &set);
        column += own.len();
        terms.extend(own);
    }
    nuisance.extend(0..column);
    for info in CATALOGUE.iter().chain(LOG_CATALOGUE) {
        let is_known = skipped.iter().any(|(name, _)| *name == info.name);
        let has_equations = log_effects::is_known(info.name)
            || info.hooks.plant.is_some()
            || info.hooks.input.is_some()
            || info.hooks.water.is_some()
            || info.hooks.measure.is_some();
        if is_known || !has_equations || accepted.iter().any(|a| a.candidate.effect == info.name) {
            continue;
        }
        let has = |kind| info.parameters.iter().any(|parameter| parameter.kind == kind);
        let is_event = has(ParameterKind::Onset);
        let members: Vec<Option<usize>> = match (has(ParameterKind::Fin), has(ParameterKind::Transponder)) {
            (true, _) => (0..FIN_NAMES.len()).map(Some).collect(),
            (_, true) => scope.stations.iter().map(|number| Some(*number as usize)).collect(),
            _ => vec![None],
        };
        for member in members {
            let candidate = Candidate { effect: info.name, member, span: is_event.then_some(Span::ALWAYS) };
            hypotheses.extend(add_entry(&set, &candidate, spans, &mut terms, &mut column));
        }
    }
    set_lower(&mut hypotheses);
    (terms, hypotheses, nuisance)
}

/// Terms of one entry, over every span if it is an event: a column for each time at which one begins or ends.
fn add_entry(
    set: &Effects,
    candidate: &Candidate,
    spans: &[Span],
    terms: &mut Vec<Regressor>,
    column: &mut usize,
) -> Vec<Hypothesis> {
    let is_event = candidate.span.is_some();
    // An event is always on in the sets; its columns begin at the times.
    let always = Candidate { span: is_event.then_some(Span::ALWAYS), ..*candidate };
    let bounds = always.bounds();
    let none = vec![0.0; bounds.len()];
    let is_stuck = candidate.is_stuck();
    let without = if is_stuck { always.apply(set, &none) } else { *set };
    let mut times: Vec<f64> = spans.iter().flat_map(|span| [Some(span.onset_s), span.end_s]).flatten().collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let starts = if is_event { times } else { vec![f64::NEG_INFINITY] };
    let mut add = |with: Effects, without: Effects, unit: f64| {
        let cause = Variation::Effects { with: Box::new(with), without: Box::new(without), unit };
        terms.push(Regressor { cause, onsets_s: starts.clone() });
        *column += starts.len();
        *column - starts.len()
    };
    let columns: Vec<usize> = (0..bounds.len())
        .map(|size| {
            let mut one = none.clone();
            one[size] = unit(bounds[size]);
            add(always.apply(set, &one), without, one[size])
        })
        .collect();
    let released = is_stuck.then(|| add(without, *set, 1.0));
    let hypothesis = |span: Option<Span>| {
        let place = |time: f64| starts.iter().position(|start| *start == time);
        let begins = span.and_then(|span| place(span.onset_s)).unwrap_or(0);
        let ends = span.and_then(|span| place(span.end_s?));
        let fixed = |first: usize| [Some((first + begins, 1.0)), ends.map(|end| (first + end, -1.0))];
        Hypothesis {
            candidate: Candidate { span, ..always },
            free: columns.iter().map(|first| first + begins).collect(),
            ends: ends.map_or_else(Vec::new, |end| columns.iter().map(|first| first + end).collect()),
            fixed: released.into_iter().flat_map(fixed).flatten().collect(),
            lower: Vec::new(),
        }
    };
    if is_event { spans.iter().map(|span| hypothesis(Some(*span))).collect() } else { vec![hypothesis(None)] }
}

/// Step of a derivative by differences: small against what is plausible.
fn unit([low, high]: [f64; 2]) -> f64 {
    1e-3 * if low < 0.0 { high.min(-low) } else { high }
}

/// One term for each size of an effect that is present in `set`.
#[must_use]
pub fn own_terms(instance: &Instance, set: &Effects) -> Vec<Regressor> {
    let bounds = instance.candidate.bounds();
    (0..bounds.len())
        .map(|size| {
            let [low, high] = bounds[size];
            let mut unit = unit([low, high]);
            // Stay inside what is plausible.
            if instance.sizes[size] + unit > high {
                unit = -unit;
            }
            let mut sizes = instance.sizes.clone();
            sizes[size] += unit;
            Regressor {
                cause: Variation::Effects {
                    with: Box::new(instance.candidate.apply(set, &sizes)),
                    without: Box::new(*set),
                    unit,
                },
                onsets_s: vec![f64::NEG_INFINITY],
            }
        })
        .collect()
}

/// Terms of several events, each over spans of its own, behind the nuisance columns of `others`; and the hypotheses of
/// each event, none of one that is not asked for.
#[must_use]
pub fn events(
    scope: &Scope,
    others: &[Instance],
    events: &[Option<(Candidate, Vec<Span>)>],
) -> (Vec<Regressor>, Vec<Vec<Hypothesis>>) {
    let set = set_of(&scope.declared, others);
    let mut terms: Vec<Regressor> = others.iter().flat_map(|instance| own_terms(instance, &set)).collect();
    let mut column = terms.len();
    let mut add = |(event, spans): &(Candidate, Vec<Span>)| add_entry(&set, event, spans, &mut terms, &mut column);
    let hypotheses = events.iter().map(|event| event.as_ref().map_or_else(Vec::new, &mut add)).collect();
    (terms, hypotheses)
}

/// The same of one event.
#[must_use]
pub fn event(
    scope: &Scope,
    others: &[Instance],
    event: &Candidate,
    spans: &[Span],
) -> (Vec<Regressor>, Vec<Hypothesis>) {
    let (terms, mut hypotheses) = events(scope, others, &[Some((*event, spans.to_vec()))]);
    (terms, hypotheses.pop().unwrap_or_default())
}
