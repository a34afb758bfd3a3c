//! Common parts of the page's sections: runs, cases, targets.

use super::outcome::{Answer, JudgedEffect};
use super::plan::Class;
use super::run::DiagnosedLog;
use crate::intervals::Share;
use backseat_logs::stats::median;

/// A heading, a paragraph and a table.
pub struct Section {
    pub title: &'static str,
    pub text: String,
    pub header: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
}

/// A target of the study.
pub struct Target {
    pub what: &'static str,
    pub asked: &'static str,
    pub found: String,
    /// `None` if the runs are too few.
    pub reached: Option<bool>,
}

/// Bands of separability; only the outer two are scored.
pub const BANDS: [(&str, f64, f64); 3] =
    [("5 and more", 5.0, f64::INFINITY), ("1.5 to 5", 1.5, 5.0), ("1.5 and less", 0.0, 1.5)];

/// Some of the runs.
pub type Choose = fn(&DiagnosedLog) -> bool;

/// All runs, and the effects in them.
pub struct Findings<'a> {
    pub runs: &'a [DiagnosedLog],
    pub cases: Vec<JudgedEffect<'a>>,
}

impl<'a> Findings<'a> {
    pub fn new(runs: &'a [DiagnosedLog]) -> Self {
        Self { runs, cases: runs.iter().flat_map(DiagnosedLog::cases).collect() }
    }

    pub fn of_class(&self, class: Class) -> Vec<&'a DiagnosedLog> {
        self.runs.iter().filter(|run| run.class == class).collect()
    }

    pub fn cases(&self, choose: impl Fn(&JudgedEffect<'_>) -> bool) -> Vec<&JudgedEffect<'a>> {
        self.cases.iter().filter(|case| choose(case)).collect()
    }

    /// Out of catalogue, and large enough to matter.
    pub fn outside(&self) -> Vec<&'a DiagnosedLog> {
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
        let outside = self.outside();
        let unexplained = Share::of(&outside, |run| run.is_left_open());
        let blamed = Share::of(&outside, |run| is_blamed(run));
        let separable: Vec<&DiagnosedLog> = outside.iter().copied().filter(|run| is_apart(run, 0)).collect();
        let separable_unexplained = Share::of(&separable, |run| run.is_left_open());
        let separable_blamed = Share::of(&separable, |run| is_blamed(run));
        let (covered, in_time) = (self.coverage(), self.coverage_in_time());
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
            target("false alarms where nothing was injected", "at most 0.6 %", share(alarms, alarms.value() <= 0.006)),
            target(
                "out of catalogue, held-out error raised by 20 % or more: not explained (any word)",
                "at least 92 %",
                share(unexplained, unexplained.value() >= 0.92),
            ),
            target("the same, blamed on an entry", "at most 4 %", share(blamed, blamed.value() <= 0.04)),
            target(
                "of these, the log separates the cause from every entry (5 or more): not explained",
                "at least 92 %",
                share(separable_unexplained, separable_unexplained.value() >= 0.92),
            ),
            target(
                "the same, blamed on an entry",
                "at most 4 %",
                share(separable_blamed, separable_blamed.value() <= 0.04),
            ),
            target(
                "95 % intervals of correctly named effects that hold the truth",
                "93 to 97 %",
                share(covered, (0.93..=0.97).contains(&covered.value())),
            ),
            target("the same, of onsets and ends", "at least 90 %", share(in_time, in_time.value() >= 0.9)),
            target(
                "position error after diagnosis over that with the true effects declared, median of runs correctly named",
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
            self.outside_bands(),
            self.blamed(),
            self.alarms(),
            self.not_judged(),
        ]
    }
}

pub fn is_single(case: &JudgedEffect<'_>) -> bool {
    case.run.class == Class::Single
}

pub fn in_band(case: &JudgedEffect<'_>, band: usize) -> bool {
    case.separability().is_some_and(|value| is_within(value, band))
}

fn is_within(value: f64, band: usize) -> bool {
    let (_, low, high) = BANDS[band];
    (if band == 0 { value >= low } else { value > low || low == 0.0 }) && (value < high || (band == 2 && value <= high))
}

/// Whether the separability of a cause that is no entry from every entry lies in a band.
pub fn is_apart(run: &DiagnosedLog, band: usize) -> bool {
    run.apart().is_some_and(|of| is_within(of.value, band))
}

/// The declared model is the closest competitor: the log hardly shows any effect.
pub fn is_invisible(case: &JudgedEffect<'_>) -> bool {
    case.separability.is_some_and(|of| of.competitor == "none") && case.separability().is_some_and(|value| value < 5.0)
}

pub fn is_blamed(run: &DiagnosedLog) -> bool {
    run.verdict == "explained" || run.verdict == "ambiguous"
}
