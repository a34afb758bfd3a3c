//! Tables of how large: parameters and intervals, the smallest size found, errors that are left.

use super::estimate::{Share, smallest};
use super::outcome::Answer;
use super::plan::Class;
use super::run::{Errors, Run};
use super::sections::{Section, Study, is_single, short};
use backseat_core::effects::CATALOGUE;
use backseat_data::stats::{mean, median, percentile};
use std::collections::BTreeSet;

impl Study<'_> {
    /// Numbers with a finite interval, of effects named without another possible: name, truth, value, interval.
    fn compared(&self) -> Vec<(String, f64, f64, [f64; 2])> {
        let mut all = Vec::new();
        for case in self.cases.iter().filter(|case| case.answer == Answer::Named && case.first) {
            for found in case.run.found.iter().filter(|found| found.effect == case.truth.effect) {
                for (name, sized) in &found.parameters {
                    if let (Some(truth), Some(ci95)) = (case.truth.parameters.get(name), sized.ci95) {
                        all.push((format!("{}.{name}", found.effect), *truth, sized.value, ci95));
                    }
                }
            }
        }
        all
    }

    pub fn coverage(&self) -> Share {
        Share::of(&self.compared(), |(_, truth, _, [low, high])| (*low..=*high).contains(truth))
    }

    pub fn parameters(&self) -> Section {
        let compared = self.compared();
        let names: BTreeSet<&String> = compared.iter().map(|(name, ..)| name).collect();
        let row = |name: &String| {
            let of: Vec<_> = compared.iter().filter(|(other, ..)| other == name).collect();
            let middle = |value: fn(&(String, f64, f64, [f64; 2])) -> f64| {
                median(&of.iter().map(|compared| value(compared)).collect::<Vec<_>>())
                    .map_or_else(|| "–".to_owned(), short)
            };
            vec![
                name.clone(),
                middle(|(_, truth, ..)| truth.abs()),
                middle(|(_, truth, value, _)| (value - truth).abs()),
                middle(|(.., [low, high])| 0.5 * (high - low)),
                Share::of(&of, |(_, truth, _, [low, high])| (*low..=*high).contains(truth)).text(),
            ]
        };
        Section {
            title: "Sizes and their intervals",
            text: format!(
                "Of effects named with nothing else possible, single and of pairs, in the units of the names. All intervals \
                 together hold the truth in {}.",
                self.coverage().text()
            ),
            header: vec!["parameter", "median size", "median error", "median half width", "interval holds the truth"],
            rows: names.into_iter().map(row).collect(),
        }
    }

    pub fn smallest(&self) -> Section {
        let mut rows = Vec::new();
        for info in CATALOGUE {
            let cases = self.cases(|case| is_single(case) && case.truth.effect == info.name);
            if cases.is_empty() {
                continue;
            }
            let tried: Vec<(f64, bool)> = cases.iter().map(|case| (case.amplitude(), case.is_detected())).collect();
            let sizes: Vec<f64> = tried.iter().map(|(size, _)| *size).collect();
            let at = |q| percentile(&sizes, q).map_or_else(|| "–".to_owned(), short);
            let found = smallest(&tried, 0.95).map_or_else(|| "more than tried".to_owned(), short);
            let unit: Vec<&str> = info
                .parameters
                .iter()
                .map(|parameter| parameter.name)
                .filter(|name| !["fin", "time_s", "period_s", "scale"].contains(name))
                .collect();
            let share = Share::of(&cases, |case| case.is_detected());
            rows.push(vec![
                info.name.to_owned(),
                unit.join(", "),
                format!("{} to {}", at(0.0), at(1.0)),
                share.text(),
                found,
            ]);
        }
        Section {
            title: "Smallest size found in 95 % of the logs",
            text: "Found is: named, or listed as possible. The last column is where the isotonic fit of the share found over \
                   the size (length of the vector of all the numbers given) reaches 95 %, over all manoeuvres, noises and \
                   sensors together; a few tens of logs an effect make it good to a factor of about two."
                .to_owned(),
            header: vec!["effect", "size of", "tried", "found", "found in 95 % from"],
            rows,
        }
    }

    /// Position error after over told, of runs in which every effect is named.
    pub fn ratios(&self) -> Vec<f64> {
        self.ratios_of(|run| run.class == Class::Single || run.class == Class::Pair, |errors| errors.position_m)
    }

    fn ratios_of(&self, choose: impl Fn(&Run) -> bool, error: impl Fn(&Errors) -> Option<f64>) -> Vec<f64> {
        let named = |run: &&Run| {
            choose(run)
                && run.not_judged.is_none()
                && run.verdict != "none"
                && run.injected.iter().all(|truth| run.found.iter().any(|found| found.effect == truth.effect))
        };
        self.runs.iter().filter(named).filter_map(|run| Some(error(&run.after)? / error(&run.told)?)).collect()
    }

    pub fn after(&self) -> Section {
        let groups: [(&str, fn(&Run) -> bool); 4] = [
            ("single effects", |run| run.class == Class::Single),
            ("pairs", |run| run.class == Class::Pair),
            ("single and pairs, with a DVL", |run| run.dvl && run.class != Class::Outside),
            ("single and pairs, without", |run| !run.dvl && run.class != Class::Outside),
        ];
        let mut rows = Vec::new();
        for (name, is_in) in groups {
            for (what, error) in [
                ("position", (|errors| errors.position_m) as fn(&Errors) -> Option<f64>),
                ("velocity in 10 s", |errors| errors.velocity_mps),
            ] {
                let ratios = self.ratios_of(is_in, error);
                let text = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"));
                rows.push(vec![
                    name.to_owned(),
                    what.to_owned(),
                    ratios.len().to_string(),
                    text(median(&ratios)),
                    text(mean(&ratios)),
                    text(percentile(&ratios, 0.95)),
                    Share::of(&ratios, |ratio| *ratio <= 1.15).text(),
                ]);
            }
        }
        Section {
            title: "Error after, over that of a filter that was told the truth",
            text: "On held-out parts, of runs in which every effect injected is named: position of the flight filter against \
                   the truth, and velocity predicted over ten seconds by the model alone. Values are fitted on half of the \
                   log, and on nothing that is held out."
                .to_owned(),
            header: vec!["runs", "error", "number", "median", "mean", "95th percentile", "at most 1.15"],
            rows,
        }
    }
}
