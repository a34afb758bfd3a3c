//! The numbers of an effect with their intervals, and which of them are a finding.
//!
//! A finding lies outside what the textbook leaves open, more certainly than the largest of all numbers that were asked
//! would by chance (Bonferroni): with thirty numbers one and a half 95 % intervals exclude the truth.

use super::entries::{Entry, MOTOR_STOP};
use super::fitted::Fitted;
use super::timing::Timing;
use backseat_core::dynamics::VehicleParameters;
use backseat_identify::short_runs::unknowns::{Place, Unknown, open_moment};
use backseat_logs::short_runs::{COMMON, Configuration, OF_CONFIGURATION};
use backseat_logs::stats::f_tail;

/// Probability of a finding by chance, over all numbers.
const LEVEL: f64 = 0.05;
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
    /// Values that the textbook leaves open, the one without the effect among them.
    pub open: [f64; 2],
    /// Probability by chance of a value so far outside of that, over all numbers that were asked.
    pub p_value: f64,
    /// Share of the information that is the prior's.
    pub prior_share: f64,
}

impl Parameter {
    /// Whether it is a finding.
    #[must_use]
    pub fn is_shown(&self) -> bool {
        self.p_value < LEVEL
    }
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

/// What makes numbers of a fit.
pub(super) struct Numbers<'a> {
    fitted: &'a Fitted<'a>,
    configurations: &'a [Configuration],
    values: Vec<f64>,
    sigmas: Vec<f64>,
    prior_shares: Vec<f64>,
    degrees: usize,
    /// How many numbers were asked.
    asked: usize,
}

impl<'a> Numbers<'a> {
    pub(super) fn new(
        fitted: &'a Fitted<'a>,
        configurations: &'a [Configuration],
        asked: usize,
        timing: &Timing,
    ) -> Self {
        let fit = &fitted.fit;
        let (mut values, mut sigmas, mut prior_shares) = (fit.values.clone(), fit.sigmas(), fit.prior_share.clone());
        for (place, unknown) in fitted.problem.unknowns.iter().enumerate() {
            if let Some(known) = timing.known(unknown) {
                [values[place], sigmas[place], prior_shares[place]] = known;
            }
        }
        Self { fitted, configurations, values, sigmas, prior_shares, degrees: fit.degrees(), asked }
    }

    /// Of one value.
    pub(super) fn of(&self, place: usize) -> Parameter {
        let unknown = &self.fitted.problem.unknowns[place];
        let base = &self.fitted.problem.base;
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
        let value = declared + self.values[place];
        let open = self.open(place).map(|open| none + open);
        self.parameter(unknown.name.clone(), unit, [value, self.sigmas[place]], open, place)
    }

    /// What is open of a value around none.
    fn open(&self, place: usize) -> [f64; 2] {
        open_of(&self.fitted.problem.unknowns[place], &self.fitted.draft().parameters)
    }

    fn parameter(
        &self,
        name: String,
        unit: &'static str,
        [value, sigma]: [f64; 2],
        open: [f64; 2],
        place: usize,
    ) -> Parameter {
        let half = t_quantile(self.degrees) * sigma;
        let outside = (open[0] - value).max(value - open[1]).max(0.0) / sigma;
        let p_value = f_tail(outside * outside, 1.0, self.degrees as f64) * self.asked as f64;
        let prior_share = self.prior_shares[place];
        Parameter {
            name,
            unit,
            value,
            ci95: [value - half, value + half],
            open,
            p_value: p_value.min(1.0),
            prior_share,
        }
    }

    /// What a term of an effect differs by between the first configuration and each other one.
    pub(super) fn differences(&self, of_effect: &[usize]) -> Vec<Parameter> {
        let unknowns = &self.fitted.problem.unknowns;
        let place_of = |term: usize, configuration: usize| {
            of_effect.iter().copied().find(|&place| unknowns[place].place == Place::Of(term, configuration))
        };
        let mut differences = Vec::new();
        for (term, of_term) in OF_CONFIGURATION.iter().enumerate() {
            for configuration in 1..self.configurations.len() {
                let (Some(first), Some(other)) = (place_of(term, 0), place_of(term, configuration)) else { continue };
                let value = self.values[other] - self.values[first];
                let sigma = self.fitted.fit.sigma_of(&[(other, 1.0), (first, -1.0)]);
                let [name, first_name] = [configuration, 0].map(|place| &self.configurations[place].name);
                let name = difference(of_term.name, name, first_name);
                differences.push(self.parameter(name, of_term.unit, [value, sigma], self.open(other), other));
            }
        }
        differences
    }
}

/// What is open of an unknown around none, on a vehicle with these parameters.
pub(super) fn open_of(unknown: &Unknown, plant: &VehicleParameters) -> [f64; 2] {
    match unknown.place {
        Place::Of(axis @ 0..=2, _) => {
            let open = open_moment(plant, axis);
            [-open, open]
        }
        _ => unknown.open,
    }
}

/// Entries named as alike that are in the model too and whose values go together with the effect's, or that no fit of runs
/// can hold beside it; what stops of the motor separate is not alike in a log that has them.
pub(super) fn alike(fitted: &Fitted<'_>, entry: &'static Entry, has_stops: bool) -> Vec<(&'static str, &'static str)> {
    let covariance = &fitted.fit.covariance;
    let of = |name: &str| -> Vec<usize> {
        let unknowns = fitted.problem.unknowns.iter().enumerate();
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
        |other: &str| super::entries::of(other).is_none() && !fitted.problem.unknowns.iter().any(|u| u.name == other);
    let is_alike = |(other, manoeuvre): &&(&str, &str)| {
        !(has_stops && *manoeuvre == MOTOR_STOP) && (is_never_fitted(other) || go_together(other))
    };
    entry.confused_with.iter().filter(is_alike).copied().collect()
}

/// What a term differs by between two configurations, in words.
pub(super) fn difference(term: &str, name: &str, first: &str) -> String {
    format!("{term}, {name} less {first}")
}
