//! The fault table: one line a row, over all its seeds.

use super::judge::{SILENT_S, name};
use super::{JudgedFlight, Row};
use backseat_logs::stats::{median, percentile};
use backseat_report::markdown::markdown_table;
use backseat_wire::hostlink::Mode;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// A row and its flights.
#[derive(Clone, Debug)]
pub struct Summary {
    /// The row.
    pub row: Row,
    /// One a seed.
    pub outcomes: Vec<JudgedFlight>,
}

impl Summary {
    /// Every flight kept every rule and limit.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.outcomes.iter().all(|outcome| outcome.violations.is_empty())
    }

    fn of(&self, pick: impl Fn(&JudgedFlight) -> f64) -> Vec<f64> {
        self.outcomes.iter().map(pick).collect()
    }

    fn largest(&self, pick: impl Fn(&JudgedFlight) -> f64) -> f64 {
        self.of(pick).into_iter().reduce(f64::max).unwrap_or(f64::NAN)
    }

    /// Broken rules, with the number of flights.
    fn broken(&self) -> Vec<String> {
        let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
        for violation in self.outcomes.iter().flat_map(|outcome| &outcome.violations) {
            *kinds.entry(violation.clone()).or_default() += 1;
        }
        let of = self.outcomes.len();
        kinds.into_iter().map(|(kind, count)| format!("{kind} ({count} of {of})")).collect()
    }

    /// Modes from the first fault on: mode, reason, seconds after the fault, length, in how many flights.
    fn modes(&self) -> String {
        let mut seen: BTreeMap<(u8, String), (u64, u64, usize)> = BTreeMap::new();
        for outcome in &self.outcomes {
            let mut own: BTreeMap<(u8, String), (u64, u64)> = BTreeMap::new();
            for spell in &outcome.spells {
                let label = if spell.mode == Mode::Navigating {
                    name(&spell.mode)
                } else {
                    format!("{} ({})", name(&spell.mode), name(&spell.reason))
                };
                let begun = spell.from_us.max(outcome.fault_us);
                let entry = own.entry((spell.mode as u8, label)).or_insert((begun - outcome.fault_us, 0));
                entry.1 += (spell.from_us + spell.length_us).saturating_sub(begun);
            }
            for (label, (after_us, length_us)) in own {
                let entry = seen.entry(label).or_insert((u64::MAX, 0, 0));
                *entry = (entry.0.min(after_us), entry.1 + length_us, entry.2 + 1);
            }
        }
        let mut modes: Vec<_> = seen.into_iter().collect();
        modes.sort_by_key(|(_, (after_us, ..))| *after_us);
        let all = self.outcomes.len();
        let texts = modes.into_iter().map(|((_, label), (after_us, length_us, flights))| {
            let share = if flights == all { String::new() } else { format!(" [{flights} of {all}]") };
            let length_s = length_us as f64 * 1e-6 / flights as f64;
            format!("{label} +{:.0} s for {length_s:.0} s{share}", after_us as f64 * 1e-6)
        });
        texts.collect::<Vec<_>>().join("; ")
    }

    /// Mean counts a flight.
    fn alarms(&self) -> String {
        let mut sums: BTreeMap<&str, u32> = BTreeMap::new();
        for (alarm, count) in self.outcomes.iter().flat_map(|outcome| &outcome.alarms) {
            *sums.entry(alarm).or_default() += count;
        }
        let mean = |count: u32| f64::from(count) / self.outcomes.len() as f64;
        let texts: Vec<String> = sums
            .into_iter()
            .filter(|(_, count)| mean(*count) >= 0.5)
            .map(|(alarm, count)| format!("{alarm} {:.0}", mean(count)))
            .collect();
        if texts.is_empty() { "-".to_owned() } else { texts.join(", ") }
    }

    fn commands(&self) -> String {
        let sum = |i: usize| self.outcomes.iter().map(|outcome| outcome.commands[i]).sum::<u32>();
        let all = self.outcomes.len();
        let bad = self.outcomes.iter().flat_map(|o| &o.violations).any(|text| text.starts_with("commands"));
        let within = if bad { "OUT OF LIMITS" } else { "within limits" };
        let ended = self.outcomes.iter().filter(|outcome| outcome.commands[2] > 0).count();
        let stop = match ended {
            0 => "no stop".to_owned(),
            _ if ended == all => "neutral, stop".to_owned(),
            _ => format!("neutral, stop [{ended} of {all}]"),
        };
        format!("{} {within}; {stop}", sum(0) / all as u32)
    }

    fn limit(&self) -> String {
        let limits = &self.row.limits;
        let mut text = format!("{} m", limits.error_m);
        if let Some(end_error_m) = limits.end_error_m {
            let _ = write!(text, ", end {end_error_m} m");
        }
        if limits.navigating > 0.0 {
            let _ = write!(text, "; navigating {:.0} %", 100.0 * limits.navigating);
        }
        let _ = write!(text, "; mission {}", name(&limits.mission));
        if !limits.reasons.is_empty() {
            let _ = write!(text, "; {}", limits.reasons.join(" or "));
        }
        text
    }
}

/// The table in Markdown; `made_by` is the command.
#[must_use]
pub fn markdown(summaries: &[Summary], made_by: &str) -> String {
    let passed = summaries.iter().filter(|summary| summary.passes()).count();
    let mut text = format!(
        "# Fault table\n\nMade by `{made_by}`. {passed} of {} rows pass. {}\n\n{INTRODUCTION}\n",
        summaries.len(),
        share(summaries)
    );
    let mut flights = markdown_table([
        "row",
        "error median / max / end [m]",
        "error / own sigma (in any mode); silent, in depth [s]",
        "modes from the fault on",
        "alarms",
        "commands",
        "limit",
        "",
    ]);
    for summary in summaries {
        let verdict =
            if summary.passes() { "pass".to_owned() } else { format!("**FAIL** {}", summary.broken().join("; ")) };
        let unrevealable = if summary.row.limits.unrevealable.is_some() { " (u)" } else { "" };
        let median_m = median(&summary.of(|outcome| outcome.error_m[0])).unwrap_or(f64::NAN);
        let [largest_m, end_m, silent_s, silent_depth_s] = [
            summary.largest(|outcome| outcome.error_m[1]),
            summary.largest(|outcome| outcome.end_error_m),
            summary.largest(|outcome| outcome.silent_s[0]),
            summary.largest(|outcome| outcome.silent_s[1]),
        ];
        let ratios = [0, 1].map(|i| summary.largest(|outcome| outcome.ratios[i]));
        flights.add_row([
            format!("{}{unrevealable}", summary.row.name),
            format!("{median_m:.1} / {largest_m:.1} / {end_m:.1}"),
            format!("{:.1} ({:.1}); {silent_s:.0}, {silent_depth_s:.0}", ratios[0], ratios[1]),
            summary.modes(),
            summary.alarms(),
            summary.commands(),
            summary.limit(),
            verdict,
        ]);
    }
    text += &format!("{flights}\n");
    text += "\n## What is injected, and why these limits\n\n";
    for Summary { row, .. } in summaries {
        let faults: Vec<String> = row.scenario.settings.faults.iter().map(ToString::to_string).collect();
        let injected = if faults.is_empty() { "nothing".to_owned() } else { format!("`{}`", faults.join("`, `")) };
        let _ = writeln!(text, "- **{}**: {injected}. {}", row.name, row.limits.why);
    }
    let sinks = summaries.iter().filter_map(|Summary { row, .. }| Some((&row.name, row.limits.sinks.as_ref()?)));
    for (k, (name, why)) in sinks.enumerate() {
        if k == 0 {
            text += "\n## What sinks whatever is commanded\n\n";
        }
        let _ = writeln!(text, "- **{name}**: {why}");
    }
    let hidden =
        summaries.iter().filter_map(|Summary { row, .. }| Some((&row.name, row.limits.unrevealable.as_ref()?)));
    for (k, (name, why)) in hidden.enumerate() {
        if k == 0 {
            text += "\n## What no data on board can reveal (u)\n\n";
        }
        let _ = writeln!(text, "- **{name}**: {why}");
    }
    text
}

/// The section of drawn rows.
#[must_use]
pub fn drawn_markdown(summaries: &[Summary], made_by: &str) -> String {
    let mut text = format!("## Combinations drawn by a seed\n\nMade by `{made_by}`. {}\n\n", share(summaries));
    text += "Two or three faults and undeclared effects at a time, with sizes from what nobody notices to what nobody \
             misses. Only the rules that hold for every row are judged.\n\n";
    let mut table = markdown_table(["drawn", "silent, in depth [s]", "error max [m]", "deepest [m]", "navigating", ""]);
    for Summary { row, outcomes } in summaries {
        for flight in outcomes {
            let [silent_s, deep_s] = flight.silent_s;
            table.add_row([
                row.name.clone(),
                format!("{silent_s:.0}, {deep_s:.0}"),
                format!("{:.1}", flight.error_m[1]),
                format!("{:.1}", flight.deepest_m),
                format!("{:.0} %", 100.0 * flight.navigating),
                flight.violations.join("; "),
            ]);
        }
    }
    text += &format!("{table}\n");
    text
}

/// How many flights were wrong in silence for too long, and the error that is called good: every row, whether it can
/// be seen on board or not.
fn share(summaries: &[Summary]) -> String {
    let flights = || summaries.iter().flat_map(|summary| &summary.outcomes);
    let (silent, all) = (flights().filter(|flight| !flight.is_honest()).count(), flights().count());
    let mut text = format!(
        "{silent} of {all} flights ({:.1} %) were silently wrong for more than {SILENT_S:.0} s.",
        100.0 * silent as f64 / all.max(1) as f64
    );
    let errors_m: Vec<f64> = flights().flat_map(|flight| &flight.navigating_errors_m).copied().collect();
    if let Some(error_m) = percentile(&errors_m, 0.95) {
        text += &format!(" While the mode was `navigating`, the error was below {error_m:.1} m for 95 % of the time.");
    }
    text
}

const INTRODUCTION: &str = "\
Every row is a scenario of its own (`hil-sim/scenarios/faults/ROW.toml`), flown once for each seed in lock-step
with the app in this process. Errors are horizontal, of the backseat's own estimate, from the first fault to the end of the flight: median over the seeds of each flight's median, largest of
all, largest at the end. Error over own sigma: along the error, largest while the mode is `navigating` (and in any mode); then the
longest time in sum, in any window of 600 s, for which it is beyond three in a mode that steers (`navigating`, or `degraded` under way),
horizontally and in depth. Modes: seconds after the first fault, mean time in it, in how many flights where not in all. Alarms: mean
counts a flight of refused frames, gated measurements, packets without a range. Commands: steering commands a flight, checked one
by one against angle, rate, speed, acceleration and timeout. (u): see the last section.

A row passes when every flight keeps the row's limits and these rules: no panic; every command within limits and rates, none without
a mission, each with a timeout of 2 s at most; never more than 120 s of 600 s, in a mode that steers, with an error beyond three own sigmas horizontally or in depth (but for
(u)); not `navigating` after ten rejections of a source in a row; no source taken back with a covariance scaled to fit, unless a fix
came between; no deeper than 9 m in missions at 3 m (`safety.depth_below_leg_m` and 1 m; where the row says that the vehicle sinks whatever is commanded: until the mission's end); the same digest when flown again (first seed).
";
