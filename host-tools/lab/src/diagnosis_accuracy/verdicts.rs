//! Tables of verdicts against what was injected.

use super::outcome::{Answer, JudgedEffect};
use super::plan::{Class, entries};
use super::run::DiagnosedLog;
use super::sections::{BANDS, Choose, Findings, Section, in_band, is_apart, is_blamed, is_invisible, is_single};
use crate::intervals::{Share, short};
use std::collections::{BTreeMap, BTreeSet};

impl Findings<'_> {
    pub fn confusion(&self) -> Section {
        let mut rows = Vec::new();
        for info in entries() {
            let cases = self.cases(|case| is_single(case) && case.truth.effect == info.name);
            rows.extend((!cases.is_empty()).then(|| answers(info.name, &cases)));
        }
        rows.push(answers("all", &self.cases(is_single)));
        Section {
            title: "Single effects: injected and found",
            text: "Amplitudes are drawn log-uniformly from barely noticeable to the largest plausible, so that some effects \
                   cannot be found by any method: the bands of separability below separate those. The last column is the share \
                   named first, whether or not others are possible, with Wilson's 95 % interval."
                .to_owned(),
            header: answer_header("injected"),
            rows,
        }
    }

    pub fn classes(&self) -> Section {
        let groups: [(&str, Choose); 8] = [
            ("manoeuvres that excite", |run| run.excite),
            ("lines to and fro", |run| !run.excite),
            ("white noise", |run| !run.mixed),
            ("mixed noise", |run| run.mixed),
            ("with a DVL", |run| run.dvl),
            ("without", |run| !run.dvl),
            ("inputs held between samples", |run| !run.ramps),
            ("inputs that move on", |run| run.ramps),
        ];
        let mut rows: Vec<Vec<String>> =
            groups.map(|(name, is_in)| answers(name, &self.cases(|case| is_single(case) && is_in(case.run)))).into();
        rows.push(answers("each effect of a pair", &self.cases(|case| case.run.class == Class::Pair)));
        rows.push(answers("each effect of a triple", &self.cases(|case| case.run.class == Class::Triple)));
        let has_all = |run: &DiagnosedLog| {
            run.injected.iter().all(|truth| run.found.iter().any(|found| found.effect == truth.effect))
        };
        let shares = |class: Class| {
            let runs = self.of_class(class);
            let all = Share::of(&runs, |run| has_all(run));
            let exactly = Share::of(&runs, |run| run.found.len() == run.injected.len() && has_all(run));
            (all.text(), exactly.text())
        };
        let [(both, only_both), (three, only_three)] = [Class::Pair, Class::Triple].map(shares);
        Section {
            title: "By manoeuvre, noise, sensors and inputs; pairs and triples",
            text: format!(
                "Of the pairs, both effects are named in {both}; both and nothing else in {only_both}. Of the triples, all three \
                 in {three}; all three and nothing else in {only_three}. The vehicle's motion and the sensors come from the \
                 simulator's own equations in every run; mixed noise is drawn from equations of the simulator's own.",
            ),
            header: answer_header("single effects"),
            rows,
        }
    }

    pub fn bands(&self) -> Section {
        let mut rows = Vec::new();
        for (kind, class) in [("single", Class::Single), ("of a pair", Class::Pair), ("of a triple", Class::Triple)] {
            let known = self.cases(|case| case.run.class == class && case.separability.is_some()).len();
            for (band, (name, ..)) in BANDS.iter().enumerate() {
                let choose = |invisible: bool| {
                    self.cases(|case| case.run.class == class && in_band(case, band) && is_invisible(case) == invisible)
                };
                for (invisible, note) in [(false, ""), (true, ", closest to nothing at all")] {
                    let cases = choose(invisible);
                    if !cases.is_empty() {
                        let mut row = answers(&format!("{kind}, {name}{note}"), &cases);
                        row.insert(1, format!("{:.1} %", 100.0 * cases.len() as f64 / known.max(1) as f64));
                        rows.push(row);
                    }
                }
            }
        }
        let mut header = answer_header("separability");
        header.insert(1, "share of logs");
        Section {
            title: "By separability",
            text: "Separability is the square root of the χ² between the true effect and the best-fitting other entry (or the \
                   declared model) on the same log without noise: how many standard deviations of a single number the log \
                   holds for telling them apart. Above 5 the cause is to be named first; below 1.5 no method can, and the \
                   verdict is to be ambiguous and list it. Range outliers and waves are noise and have none. Each effect of a \
                   pair or triple competes beside the others."
                .to_owned(),
            header,
            rows,
        }
    }

    pub fn clear(&self) -> Section {
        let mut rows = Vec::new();
        for info in entries() {
            let cases = self.cases(|case| is_single(case) && case.truth.effect == info.name && in_band(case, 0));
            rows.extend((!cases.is_empty()).then(|| answers(info.name, &cases)));
        }
        Section {
            title: "Single effects of separability 5 or more",
            text: String::new(),
            header: answer_header("injected"),
            rows,
        }
    }

    pub fn wrong(&self) -> Section {
        let cases = self.cases(|case| is_single(case) && in_band(case, 0) && !case.first);
        let row = |case: &&JudgedEffect<'_>| {
            let named: Vec<&str> = case.run.found.iter().map(|found| found.effect.as_str()).collect();
            vec![
                case.run.seed.to_string(),
                case.truth.effect.clone(),
                short(case.amplitude()),
                format!("{:.1} ({})", case.separability().unwrap_or(0.0), competitor(case)),
                flown(case.run),
                format!("{} {}", case.run.verdict, named.join(", ")),
            ]
        };
        Section {
            title: "Separable, and not named first",
            text: String::new(),
            header: vec!["seed", "injected", "size", "separability (from)", "log", "verdict"],
            rows: cases.iter().map(row).collect(),
        }
    }

    pub fn out_of_catalogue(&self) -> Section {
        let all = self.of_class(Class::Outside);
        let mut by: BTreeMap<&str, Vec<&DiagnosedLog>> = BTreeMap::new();
        for run in &all {
            for effect in &run.injected {
                by.entry(effect.effect.as_str()).or_default().push(run);
            }
        }
        let row = |(name, runs): (&str, Vec<&DiagnosedLog>)| {
            let large: Vec<&DiagnosedLog> = runs.iter().copied().filter(|run| run.raises_error()).collect();
            let mut hints: BTreeMap<&str, usize> = BTreeMap::new();
            for hint in large.iter().filter_map(|run| run.hint.as_deref()) {
                *hints.entry(hint).or_default() += 1;
            }
            let mut hints: Vec<(&str, usize)> = hints.into_iter().collect();
            hints.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
            let mut blamed: BTreeSet<&str> = BTreeSet::new();
            for run in large.iter().filter(|run| is_blamed(run)) {
                blamed.extend(run.found.iter().map(|found| found.effect.as_str()));
            }
            let count = |is: &dyn Fn(&DiagnosedLog) -> bool| large.iter().filter(|run| is(run)).count().to_string();
            vec![
                name.to_owned(),
                runs.len().to_string(),
                large.len().to_string(),
                count(&DiagnosedLog::is_left_open),
                count(&is_blamed),
                count(&|run| run.verdict == "none"),
                blamed.into_iter().collect::<Vec<_>>().join(", "),
                hints.first().map_or_else(String::new, |(hint, _)| (*hint).to_owned()),
            ]
        };
        let mut rows: Vec<Vec<String>> = by.into_iter().map(row).collect();
        rows.push(row(("all", all.clone())));
        let small: Vec<&DiagnosedLog> = all.iter().copied().filter(|run| !run.raises_error()).collect();
        let quiet = Share::of(&small, |run| !is_blamed(run));
        Section {
            title: "Effects that are no entry",
            text: format!(
                "Counted are those that raise an error on held-out parts by a fifth or more over the same flight without them: \
                 velocity after ten seconds (against the DVL, without one against the truth) or position (against the truth). \
                 Of the {} that do not, {} are blamed on no entry.",
                small.len(),
                quiet.text()
            ),
            header: vec![
                "injected",
                "logs",
                "raise the error",
                "not explained",
                "blamed on an entry",
                "none",
                "blamed on",
                "most frequent first hint",
            ],
            rows,
        }
    }

    pub fn outside_bands(&self) -> Section {
        let outside = self.outside();
        let row = |(band, (name, ..)): (usize, &(&str, f64, f64))| {
            let runs: Vec<&DiagnosedLog> = outside.iter().copied().filter(|run| is_apart(run, band)).collect();
            let count = |is: &dyn Fn(&DiagnosedLog) -> bool| runs.iter().filter(|run| is(run)).count().to_string();
            let mut causes: BTreeMap<&str, usize> = BTreeMap::new();
            for truth in runs.iter().flat_map(|run| &run.injected) {
                *causes.entry(truth.effect.as_str()).or_default() += 1;
            }
            let causes: Vec<String> = causes.into_iter().map(|(name, count)| format!("{name} {count}")).collect();
            vec![
                (*name).to_owned(),
                runs.len().to_string(),
                count(&DiagnosedLog::is_left_open),
                count(&|run| run.is_left_open() && run.hint.is_some()),
                count(&is_blamed),
                count(&|run| run.verdict == "none"),
                causes.join(", "),
            ]
        };
        Section {
            title: "Effects that are no entry, by separability from every entry",
            text: "Of those that raise an error: the square root of the χ² that the best-fitting entry, or the entries named \
                   together, leave on the same log without noise, less what the model leaves of the same flight without the \
                   effect. Where this is 1.5 or less the effect *is* that entry, as far as such a log can say (the motor's \
                   current at one speed is a constant of the compass, a shear at one depth is a current), and naming it is right."
                .to_owned(),
            header: vec![
                "separability",
                "logs",
                "not explained",
                "with a term",
                "blamed on an entry",
                "none",
                "effects",
            ],
            rows: BANDS.iter().enumerate().map(row).collect(),
        }
    }

    pub fn blamed(&self) -> Section {
        let row = |run: &&DiagnosedLog| {
            let injected = run.injected.first();
            let size = |(name, value): (&String, &f64)| format!("{name} {}", short(*value));
            let sizes: Vec<String> =
                injected.iter().flat_map(|injected| injected.parameters.iter().map(size)).collect();
            let ratio = |with: Option<f64>, without: Option<f64>| {
                with.zip(without).map_or_else(|| "–".to_owned(), |(with, without)| format!("{:.2}", with / without))
            };
            vec![
                run.seed.to_string(),
                format!("{}: {}", injected.map_or("", |injected| injected.effect.as_str()), sizes.join(", ")),
                flown(run),
                run.found.iter().map(|found| found.effect.as_str()).collect::<Vec<_>>().join(", "),
                run.apart().map_or_else(String::new, |of| format!("{:.1} ({})", of.value, of.competitor)),
                ratio(run.declared.position_m, run.declaring_truth.position_m),
                ratio(run.after.position_m, run.declaring_truth.position_m),
            ]
        };
        Section {
            title: "No entry, and blamed on one",
            text: "Position errors on held-out parts, over those of the same flight without the effect: before and after the \
                   entry that is blamed is added."
                .to_owned(),
            header: vec![
                "seed",
                "injected",
                "log",
                "blamed on",
                "separability (from)",
                "position before",
                "position after",
            ],
            rows: self.outside().iter().filter(|run| is_blamed(run)).map(row).collect(),
        }
    }

    pub fn alarms(&self) -> Section {
        let runs = self.of_class(Class::None);
        let row = |run: &&DiagnosedLog| {
            let named: Vec<&str> = run.found.iter().map(|found| found.effect.as_str()).collect();
            let what = if named.is_empty() { run.hint.clone().unwrap_or_default() } else { named.join(", ") };
            vec![run.seed.to_string(), flown(run), run.verdict.clone(), what]
        };
        let alarms: Vec<&DiagnosedLog> = runs.iter().copied().filter(|run| run.verdict != "none").collect();
        let white = Share::of(&runs.iter().filter(|run| !run.mixed).collect::<Vec<_>>(), |run| run.verdict != "none");
        let mixed = Share::of(&runs.iter().filter(|run| run.mixed).collect::<Vec<_>>(), |run| run.verdict != "none");
        Section {
            title: "False alarms",
            text: format!("Where nothing was injected: white noise {}, mixed noise {}.", white.text(), mixed.text()),
            header: vec!["seed", "log", "verdict", "what was found"],
            rows: alarms.iter().map(row).collect(),
        }
    }

    pub fn not_judged(&self) -> Section {
        let runs: Vec<&DiagnosedLog> = self.runs.iter().filter(|run| run.not_judged.is_some()).collect();
        let mut by: BTreeMap<&str, Vec<&DiagnosedLog>> = BTreeMap::new();
        for run in &runs {
            by.entry(run.not_judged.as_deref().unwrap_or_default()).or_default().push(run);
        }
        let row = |(reason, runs): (&str, Vec<&DiagnosedLog>)| {
            let count = |verdict: &str| runs.iter().filter(|run| run.verdict == verdict).count().to_string();
            let mut row = vec![reason.to_owned(), runs.len().to_string()];
            row.extend(["none", "explained", "ambiguous", "unexplained"].map(count));
            row
        };
        Section {
            title: "Not judged",
            text: "Effects that logs of their kind cannot show, which `diagnose` reports; their runs are in none of the tables above."
                .to_owned(),
            header: vec!["reason", "logs", "none", "explained", "ambiguous", "unexplained"],
            rows: by.into_iter().map(row).collect(),
        }
    }
}

fn competitor<'a>(case: &'a JudgedEffect<'_>) -> &'a str {
    case.separability.map_or("", |of| of.competitor.as_str())
}

fn flown(run: &DiagnosedLog) -> String {
    let manoeuvre = if run.excite { "excites" } else { "lines" };
    let noise = if run.mixed { "mixed" } else { "white" };
    format!("{manoeuvre}, {noise}, {}", if run.dvl { "DVL" } else { "no DVL" })
}

fn answer_header(first: &'static str) -> Vec<&'static str> {
    let mut header = vec![first, "logs"];
    header.extend(Answer::ALL.map(Answer::name));
    header.push("named first");
    header
}

fn answers(name: &str, cases: &[&JudgedEffect<'_>]) -> Vec<String> {
    let mut row = vec![name.to_owned(), cases.len().to_string()];
    row.extend(Answer::ALL.map(|answer| cases.iter().filter(|case| case.answer == answer).count().to_string()));
    row.push(Share::of(cases, |case| case.first).text());
    row
}
