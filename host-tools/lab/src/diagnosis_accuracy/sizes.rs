//! Tables of sizes: parameters and intervals, the smallest size found, remaining errors.

use super::estimate::smallest;
use super::outcome::Answer;
use super::plan::{Class, entries};
use super::run::{DiagnosedLog, HeldOutErrors};
use super::sections::{Choose, Findings, Section, is_single};
use crate::intervals::{Share, short};
use backseat_core::effects::FIN_NAMES;
use backseat_logs::stats::{mean, median, percentile};
use std::collections::BTreeSet;

/// A number that was estimated.
struct SizeCompared {
    name: String,
    truth: f64,
    value: f64,
    ci95: [f64; 2],
}

impl SizeCompared {
    fn is_covered(&self) -> bool {
        (self.ci95[0]..=self.ci95[1]).contains(&self.truth)
    }
}

impl Findings<'_> {
    /// Numbers with a finite interval, of effects named without another possible.
    fn compared(&self) -> Vec<SizeCompared> {
        let mut all = Vec::new();
        for case in self.cases.iter().filter(|case| case.answer == Answer::Named && case.first) {
            for found in case.run.found.iter().filter(|found| found.effect == case.truth.effect) {
                for (name, sized) in &found.parameters {
                    if let (Some(truth), Some(ci95)) = (case.truth.parameters.get(name), sized.ci95) {
                        let name = format!("{}.{name}", found.effect);
                        all.push(SizeCompared { name, truth: *truth, value: sized.value, ci95 });
                    }
                }
            }
        }
        all
    }

    pub fn coverage(&self) -> Share {
        Share::of(&self.compared(), SizeCompared::is_covered)
    }

    /// Of onsets and ends of events alone.
    pub fn coverage_in_time(&self) -> Share {
        let is_time =
            |compared: &SizeCompared| [".time_s", ".until_s"].iter().any(|name| compared.name.ends_with(name));
        Share::of(&self.compared().into_iter().filter(is_time).collect::<Vec<_>>(), SizeCompared::is_covered)
    }

    /// Of effects of one fin that are named: it is the right one.
    fn fins(&self) -> Share {
        let pairs: Vec<(&str, usize)> = self
            .cases
            .iter()
            .filter_map(|case| {
                let found = case.run.found.iter().find(|found| found.effect == case.truth.effect)?;
                Some((found.fin.as_deref()?, *case.truth.parameters.get("fin")? as usize))
            })
            .collect();
        Share::of(&pairs, |(found, truth)| FIN_NAMES.get(truth - 1) == Some(found))
    }

    pub fn parameters(&self) -> Section {
        let compared = self.compared();
        let names: BTreeSet<&String> = compared.iter().map(|compared| &compared.name).collect();
        let row = |name: &String| {
            let of: Vec<&SizeCompared> = compared.iter().filter(|compared| compared.name == *name).collect();
            let middle = |value: fn(&SizeCompared) -> f64| {
                let values: Vec<f64> = of.iter().map(|compared| value(compared)).collect();
                median(&values).map_or_else(|| "–".to_owned(), short)
            };
            vec![
                name.clone(),
                middle(|compared| compared.truth.abs()),
                middle(|compared| (compared.value - compared.truth).abs()),
                middle(|compared| 0.5 * (compared.ci95[1] - compared.ci95[0])),
                Share::of(&of, |compared| compared.is_covered()).text(),
            ]
        };
        Section {
            title: "Sizes and their intervals",
            text: format!(
                "Of effects named with nothing else possible, single, of pairs and of triples, in the units of the names. All intervals \
                 together hold the truth in {}. Where an effect of one fin is named, the fin is the right one in {}.",
                self.coverage().text(),
                self.fins().text()
            ),
            header: vec!["parameter", "median size", "median error", "median half width", "interval holds the truth"],
            rows: names.into_iter().map(row).collect(),
        }
    }

    pub fn smallest(&self) -> Section {
        let mut rows = Vec::new();
        for info in entries() {
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
                .filter(|name| !["fin", "time_s", "until_s", "period_s", "scale"].contains(name))
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
            title: "Smallest size detected in 95 % of the logs",
            text: "Detected is: the verdict is not `none`. The last column is where the isotonic fit of the share detected over \
                   the size (length of the vector of all the numbers given) reaches 95 %, over all manoeuvres, noises and \
                   sensors together; a few tens of logs an effect make it good to a factor of about two."
                .to_owned(),
            header: vec!["effect", "size of", "tried", "detected", "detected in 95 % from"],
            rows,
        }
    }

    /// Position error after diagnosis over that with the true effects declared, of runs in which every effect is named.
    pub fn ratios(&self) -> Vec<f64> {
        self.ratios_of(
            |run| matches!(run.class, Class::Single | Class::Pair | Class::Triple),
            |errors| errors.position_m,
        )
    }

    fn ratios_of(
        &self,
        choose: impl Fn(&DiagnosedLog) -> bool,
        error: impl Fn(&HeldOutErrors) -> Option<f64>,
    ) -> Vec<f64> {
        let named = |run: &&DiagnosedLog| {
            choose(run)
                && run.not_judged.is_none()
                && run.verdict != "none"
                && run.injected.iter().all(|truth| run.found.iter().any(|found| found.effect == truth.effect))
        };
        self.runs
            .iter()
            .filter(named)
            .filter_map(|run| Some(error(&run.after)? / error(&run.declaring_truth)?))
            .collect()
    }

    pub fn after(&self) -> Section {
        let groups: [(&str, Choose); 5] = [
            ("single effects", |run| run.class == Class::Single),
            ("pairs", |run| run.class == Class::Pair),
            ("triples", |run| run.class == Class::Triple),
            ("all of them, with a DVL", |run| run.dvl && run.class != Class::Outside),
            ("all of them, without", |run| !run.dvl && run.class != Class::Outside),
        ];
        let mut rows = Vec::new();
        for (name, is_in) in groups {
            for (what, error) in [
                ("position", (|errors| errors.position_m) as fn(&HeldOutErrors) -> Option<f64>),
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
            title: "Error after diagnosis over the error with the true effects declared",
            text: "On held-out parts, of runs in which every effect injected is named: position of the flight filter against \
                   the truth, and velocity predicted over ten seconds by the model alone. Values are fitted on half of the \
                   log, and on nothing that is held out."
                .to_owned(),
            header: vec!["runs", "error", "number", "median", "mean", "95th percentile", "at most 1.15"],
            rows,
        }
    }
}
