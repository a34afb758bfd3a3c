//! The tables of the page.

use super::estimate::{Share, smallest};
use super::outcome::{Answer, Case};
use super::plan::Class;
use super::run::Run;
use backseat_core::effects::CATALOGUE;
use backseat_data::stats::{mean, median, percentile};
use std::collections::{BTreeMap, BTreeSet};

/// A heading, a paragraph and a table.
pub struct Section {
    pub title: &'static str,
    pub text: String,
    pub header: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
}

/// Something that is asked of the study.
pub struct Target {
    pub what: &'static str,
    pub asked: &'static str,
    pub found: String,
    /// `None` where it cannot be said of so few runs.
    pub reached: Option<bool>,
}

/// Bands of separability; only the outer two are scored.
const BANDS: [(&str, f64, f64); 3] =
    [("5 and more", 5.0, f64::INFINITY), ("1.5 to 5", 1.5, 5.0), ("1.5 and less", 0.0, 1.5)];

/// All runs, and the effects in them.
pub struct Study<'a> {
    runs: &'a [Run],
    cases: Vec<Case<'a>>,
}

impl<'a> Study<'a> {
    pub fn new(runs: &'a [Run]) -> Self {
        Self { runs, cases: runs.iter().flat_map(Run::cases).collect() }
    }

    fn of_class(&self, class: Class) -> Vec<&'a Run> {
        self.runs.iter().filter(|run| run.class == class).collect()
    }

    fn cases(&self, choose: impl Fn(&Case<'_>) -> bool) -> Vec<&Case<'a>> {
        self.cases.iter().filter(|case| choose(case)).collect()
    }

    /// Out of catalogue, and large enough to matter.
    fn outside(&self) -> Vec<&'a Run> {
        self.of_class(Class::Outside).into_iter().filter(|run| run.raises_error()).collect()
    }

    pub fn targets(&self) -> Vec<Target> {
        let share = |share: Share, enough: bool| (share.text(), (share.of > 0).then_some(enough));
        let target = |what, asked, (found, reached): (String, Option<bool>)| Target { what, asked, found, reached };
        let clear = self.cases(|case| is_single(case) && in_band(case, 0));
        let first = Share::of(&clear, |case| case.first);
        let alike = self.cases(|case| is_single(case) && in_band(case, 2) && !is_invisible(case));
        let listed = Share::of(&alike, |case| case.answer == Answer::Listed);
        let alarms = Share::of(&self.of_class(Class::None), |run| run.verdict != "none");
        let allowed = (alarms.of as f64 * 2.0 / 320.0).floor() as usize;
        let outside = self.outside();
        let unexplained = Share::of(&outside, |run| run.verdict == "unexplained");
        let blamed = Share::of(&outside, |run| is_blamed(run));
        let covered = self.coverage();
        let ratios = self.ratios();
        let middle = median(&ratios);
        vec![
            target(
                "single effects of separability 5 or more: named first",
                "at least 95 %",
                share(first, first.value() >= 0.95),
            ),
            target(
                "single effects of separability 1.5 or less from another: ambiguous, and listed",
                "all",
                share(listed, listed.hits == listed.of),
            ),
            target(
                "false alarms where nothing was injected",
                "at most 2 in 320",
                share(alarms, alarms.hits <= allowed),
            ),
            target(
                "out of catalogue, held-out error raised by 20 % or more: unexplained",
                "at least 90 %",
                share(unexplained, unexplained.value() >= 0.9),
            ),
            target("the same, blamed on an entry", "at most 5 %", share(blamed, blamed.value() <= 0.05)),
            target(
                "95 % intervals of correctly named effects that hold the truth",
                "92 to 98 %, of at least 600",
                share(covered, (0.92..=0.98).contains(&covered.value())),
            ),
            target(
                "position error after over that of a filter that was told, median of runs correctly named",
                "at most 1.15",
                (
                    middle.map_or_else(|| "–".to_owned(), |middle| format!("{middle:.3} of {} runs", ratios.len())),
                    middle.map(|middle| middle <= 1.15),
                ),
            ),
        ]
    }

    pub fn sections(&self) -> Vec<Section> {
        vec![
            self.confusion(),
            self.classes(),
            self.bands(),
            self.clear(),
            self.wrong(),
            self.parameters(),
            self.smallest(),
            self.after(),
            self.out_of_catalogue(),
            self.alarms(),
            self.not_judged(),
        ]
    }

    fn confusion(&self) -> Section {
        let mut rows = Vec::new();
        for info in CATALOGUE {
            let cases = self.cases(|case| is_single(case) && case.truth.effect == info.name);
            rows.extend((!cases.is_empty()).then(|| answers(info.name, &cases)));
        }
        rows.push(answers("all", &self.cases(is_single)));
        Section {
            title: "Single effects: what was injected, what was said",
            text: "Amplitudes are drawn log-uniformly from what is barely noticed to what is plausible at most, so that some \
                   cannot be found by anybody: the bands of separability below tell those apart. The last column is the share \
                   named first, whether or not others are possible, with Wilson's 95 % interval."
                .to_owned(),
            header: answer_header("injected"),
            rows,
        }
    }

    fn classes(&self) -> Section {
        let groups: [(&str, fn(&Run) -> bool); 6] = [
            ("manoeuvres that excite", |run| run.excite),
            ("lines to and fro", |run| !run.excite),
            ("white noise", |run| !run.coloured),
            ("coloured noise", |run| run.coloured),
            ("with a DVL", |run| run.dvl),
            ("without", |run| !run.dvl),
        ];
        let mut rows: Vec<Vec<String>> =
            groups.map(|(name, is_in)| answers(name, &self.cases(|case| is_single(case) && is_in(case.run)))).into();
        let pairs = self.of_class(Class::Pair);
        rows.push(answers("each effect of a pair", &self.cases(|case| case.run.class == Class::Pair)));
        let both = Share::of(&pairs, |run| {
            run.injected.iter().all(|truth| run.found.iter().any(|found| found.effect == truth.effect))
        });
        let exactly = Share::of(&pairs, |run| {
            run.found.len() == run.injected.len()
                && run.injected.iter().all(|truth| run.found.iter().any(|found| found.effect == truth.effect))
        });
        Section {
            title: "By manoeuvre, noise and sensors; pairs",
            text: format!(
                "Of the pairs, both effects are named in {}; both and nothing else in {}. The vehicle's motion and the sensors \
                 come from the simulator's own equations in every run; the coloured noise has other spectra than the filter \
                 assumes.",
                both.text(),
                exactly.text()
            ),
            header: answer_header("single effects"),
            rows,
        }
    }

    fn bands(&self) -> Section {
        let mut rows = Vec::new();
        for (kind, class) in [("single", Class::Single), ("of a pair", Class::Pair)] {
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
                   pair competes beside the other."
                .to_owned(),
            header,
            rows,
        }
    }

    fn clear(&self) -> Section {
        let mut rows = Vec::new();
        for info in CATALOGUE {
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

    fn wrong(&self) -> Section {
        let cases = self.cases(|case| is_single(case) && in_band(case, 0) && !case.first);
        let row = |case: &&Case<'_>| {
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

    fn coverage(&self) -> Share {
        Share::of(&self.compared(), |(_, truth, _, [low, high])| (*low..=*high).contains(truth))
    }

    fn parameters(&self) -> Section {
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

    fn smallest(&self) -> Section {
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
    fn ratios(&self) -> Vec<f64> {
        self.ratios_of(|run| run.class == Class::Single || run.class == Class::Pair, |errors| errors.position_m)
    }

    fn ratios_of(&self, choose: impl Fn(&Run) -> bool, error: impl Fn(&super::run::Errors) -> Option<f64>) -> Vec<f64> {
        let named = |run: &&Run| {
            choose(run)
                && run.not_judged.is_none()
                && run.verdict != "none"
                && run.injected.iter().all(|truth| run.found.iter().any(|found| found.effect == truth.effect))
        };
        self.runs.iter().filter(named).filter_map(|run| Some(error(&run.after)? / error(&run.told)?)).collect()
    }

    fn after(&self) -> Section {
        let groups: [(&str, fn(&Run) -> bool); 4] = [
            ("single effects", |run| run.class == Class::Single),
            ("pairs", |run| run.class == Class::Pair),
            ("single and pairs, with a DVL", |run| run.dvl && run.class != Class::Outside),
            ("single and pairs, without", |run| !run.dvl && run.class != Class::Outside),
        ];
        let mut rows = Vec::new();
        for (name, is_in) in groups {
            for (what, error) in [
                ("position", (|errors| errors.position_m) as fn(&super::run::Errors) -> Option<f64>),
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

    fn out_of_catalogue(&self) -> Section {
        let all = self.of_class(Class::Outside);
        let mut by: BTreeMap<&str, Vec<&Run>> = BTreeMap::new();
        for run in &all {
            for effect in &run.injected {
                by.entry(effect.effect.as_str()).or_default().push(run);
            }
        }
        let row = |(name, runs): (&str, Vec<&Run>)| {
            let large: Vec<&Run> = runs.iter().copied().filter(|run| run.raises_error()).collect();
            let mut hints: BTreeMap<&str, usize> = BTreeMap::new();
            for hint in large.iter().filter_map(|run| run.hint.as_deref()) {
                *hints.entry(hint).or_default() += 1;
            }
            let mut hints: Vec<(&str, usize)> = hints.into_iter().collect();
            hints.sort_by(|a, b| b.1.cmp(&a.1));
            let mut blamed: BTreeSet<&str> = BTreeSet::new();
            for run in large.iter().filter(|run| is_blamed(run)) {
                blamed.extend(run.found.iter().map(|found| found.effect.as_str()));
            }
            let count = |is: &dyn Fn(&Run) -> bool| large.iter().filter(|run| is(run)).count().to_string();
            vec![
                name.to_owned(),
                runs.len().to_string(),
                large.len().to_string(),
                count(&|run| run.verdict == "unexplained"),
                count(&is_blamed),
                count(&|run| run.verdict == "none"),
                blamed.into_iter().collect::<Vec<_>>().join(", "),
                hints.first().map_or_else(String::new, |(hint, _)| (*hint).to_owned()),
            ]
        };
        let mut rows: Vec<Vec<String>> = by.into_iter().map(row).collect();
        rows.push(row(("all", all.clone())));
        let small: Vec<&Run> = all.iter().copied().filter(|run| !run.raises_error()).collect();
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
                "unexplained",
                "blamed on an entry",
                "none",
                "blamed on",
                "most frequent first hint",
            ],
            rows,
        }
    }

    fn alarms(&self) -> Section {
        let runs = self.of_class(Class::None);
        let row = |run: &&Run| {
            let named: Vec<&str> = run.found.iter().map(|found| found.effect.as_str()).collect();
            let what = if named.is_empty() { run.hint.clone().unwrap_or_default() } else { named.join(", ") };
            vec![run.seed.to_string(), flown(run), run.verdict.clone(), what]
        };
        let alarms: Vec<&Run> = runs.iter().copied().filter(|run| run.verdict != "none").collect();
        let white =
            Share::of(&runs.iter().filter(|run| !run.coloured).collect::<Vec<_>>(), |run| run.verdict != "none");
        let coloured =
            Share::of(&runs.iter().filter(|run| run.coloured).collect::<Vec<_>>(), |run| run.verdict != "none");
        Section {
            title: "False alarms",
            text: format!(
                "Where nothing was injected: white noise {}, coloured noise {}.",
                white.text(),
                coloured.text()
            ),
            header: vec!["seed", "log", "verdict", "what was found"],
            rows: alarms.iter().map(row).collect(),
        }
    }

    fn not_judged(&self) -> Section {
        let runs: Vec<&Run> = self.runs.iter().filter(|run| run.not_judged.is_some()).collect();
        let mut by: BTreeMap<&str, Vec<&Run>> = BTreeMap::new();
        for run in &runs {
            by.entry(run.not_judged.as_deref().unwrap_or_default()).or_default().push(run);
        }
        let row = |(reason, runs): (&str, Vec<&Run>)| {
            let count = |verdict: &str| runs.iter().filter(|run| run.verdict == verdict).count().to_string();
            let mut row = vec![reason.to_owned(), runs.len().to_string()];
            row.extend(["none", "explained", "ambiguous", "unexplained"].map(count));
            row
        };
        Section {
            title: "Not judged",
            text: "Effects that logs of their kind cannot show, as `diagnose` says of them; their runs are in no table above."
                .to_owned(),
            header: vec!["reason", "logs", "none", "explained", "ambiguous", "unexplained"],
            rows: by.into_iter().map(row).collect(),
        }
    }
}

fn is_single(case: &Case<'_>) -> bool {
    case.run.class == Class::Single
}

fn in_band(case: &Case<'_>, band: usize) -> bool {
    let (_, low, high) = BANDS[band];
    let is_in = |value: f64| {
        (if band == 0 { value >= low } else { value > low || low == 0.0 })
            && (value < high || (band == 2 && value <= high))
    };
    case.separability().is_some_and(is_in)
}

/// The declared model is what comes closest: the log hardly shows that there is anything.
fn is_invisible(case: &Case<'_>) -> bool {
    case.separability.is_some_and(|of| of.competitor == "none") && case.separability().is_some_and(|value| value < 5.0)
}

fn is_blamed(run: &Run) -> bool {
    run.verdict == "explained" || run.verdict == "ambiguous"
}

fn competitor<'a>(case: &'a Case<'_>) -> &'a str {
    case.separability.map_or("", |of| of.competitor.as_str())
}

fn flown(run: &Run) -> String {
    let manoeuvre = if run.excite { "excites" } else { "lines" };
    let noise = if run.coloured { "coloured" } else { "white" };
    format!("{manoeuvre}, {noise}, {}", if run.dvl { "DVL" } else { "no DVL" })
}

fn answer_header(first: &'static str) -> Vec<&'static str> {
    let mut header = vec![first, "logs"];
    header.extend(Answer::ALL.map(Answer::name));
    header.push("named first");
    header
}

fn answers(name: &str, cases: &[&Case<'_>]) -> Vec<String> {
    let mut row = vec![name.to_owned(), cases.len().to_string()];
    row.extend(Answer::ALL.map(|answer| cases.iter().filter(|case| case.answer == answer).count().to_string()));
    row.push(Share::of(cases, |case| case.first).text());
    row
}

/// Two significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = (1.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}
