//! The page: how many wrong recordings are told, and which are not.

use super::judge::{Judged, Verdict};
use super::logs::Clean;
use crate::wrap::wrapped;
use backseat_report::markdown::markdown_table;
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// One base log.
pub struct Row {
    pub name: String,
    /// Nobody looked at it while the tests of columns were written.
    pub is_held_out: bool,
    /// What is said against it as it is.
    pub clean: Vec<String>,
    /// What became of each mistake that it has the columns for.
    pub judged: BTreeMap<String, Judged>,
}

/// All that was done.
pub struct Page {
    pub first_seed: u64,
    pub seconds: f64,
    /// Kind, seed, what it is, and what is said against it.
    pub clean: Vec<(Clean, u64, String, Vec<String>)>,
    pub rows: Vec<Row>,
}

/// Recordings, and of these: refused with the right mend alone, among others, refused otherwise, remarked, said to be no
/// matter of this log, silent.
#[derive(Clone, Copy, Default)]
pub struct Counts([usize; 7]);

impl Counts {
    pub fn of<'a>(judged: impl IntoIterator<Item = &'a Judged>) -> Self {
        let mut counts = Self::default();
        for Judged { verdict, .. } in judged {
            counts.0[0] += 1;
            counts.0[*verdict as usize + 1] += 1;
        }
        counts
    }

    /// Those of which the log shows something.
    pub fn shown(&self) -> usize {
        self.0[0] - self.0[5]
    }

    /// Those that are named with the right mend.
    pub fn named(&self) -> usize {
        self.0[1] + self.0[2]
    }

    #[cfg(test)]
    pub fn silent(&self) -> usize {
        self.0[6]
    }
}

/// A kind of clean log by its name.
pub fn kind(kind: Clean) -> &'static str {
    match kind {
        Clean::AsDeclared => "torpedo as declared",
        Clean::WithEffect => "torpedo with an undeclared effect",
        Clean::Vessel => "ship on the surface",
    }
}

fn percent(part: usize, of: usize) -> String {
    if of == 0 { "-".to_owned() } else { format!("{:.0} %", 100.0 * part as f64 / of as f64) }
}

impl Page {
    pub fn markdown(&self) -> String {
        let mut page = String::from("# Wrong recordings\n\n");
        let _ = writeln!(
            page,
            "Made by `cargo lab wrong-recordings --first-seed {} --clean {}` (version {}), each recorded log below given by \
             `--log`, or by `--held-out` where nobody looked at it while the tests of columns were written. A log that is \
             right is recorded wrongly by an exact change of its columns, as far as it has them, and examined as \
             `backseat info` does. The tests were written in sight of all {} mistakes, so that no table here says what becomes \
             of one that nobody thought of. Twice such were made: of 29, other units and signs of the columns' own, 57 to \
             63 % of what the logs show were named right; of 47, from stranger units to columns of other sensors, 16 (held \
             out) to 21 %, the others refused without the right lines, and 6 of 170 passed in silence. Simulated logs have {:.0} min.\n",
            self.first_seed,
            self.clean.len(),
            env!("CARGO_PKG_VERSION"),
            super::latest::all().len(),
            self.seconds / 60.0
        );
        page += "*Named*: refused (exit 3) with the lines of a mapping that undo the mistake, alone; *among others*: they \
                 stand beside others that the log supports as well. *Refused*: without the right lines. *Remarked*: named, \
                 but not refused. *Told*: this log does not show it, and the test that would is said to be impossible. \
                 *Silent*: none of these. Percentages are of what the log shows, and of all.\n\n";
        let _ = writeln!(page, "{}\n", self.table());
        page += &self.missed();
        page += &self.clean();
        page += &self.told();
        wrapped(&page)
    }

    fn table(&self) -> String {
        let mut table = markdown_table([
            "log",
            "mistakes",
            "named",
            "among others",
            "refused",
            "remarked",
            "told",
            "silent",
            "right of shown",
            "right of all",
        ]);
        let mut sums = [Counts::default(); 2];
        let mut row = |name: &str, counts: &Counts| {
            let cells = counts.0.iter().map(ToString::to_string);
            let shares = [counts.shown(), counts.0[0]].map(|of| percent(counts.named(), of));
            table.add_row(std::iter::once(name.to_owned()).chain(cells).chain(shares));
        };
        for log in &self.rows {
            let counts = Counts::of(log.judged.values());
            let sum = &mut sums[usize::from(log.is_held_out)];
            (0..7).for_each(|k| sum.0[k] += counts.0[k]);
            let note = if log.is_held_out { " (held out)" } else { "" };
            row(&format!("{}{note}", log.name), &counts);
        }
        for (name, counts) in ["all but held out", "all held out"].into_iter().zip(&sums) {
            if counts.0[0] > 0 {
                row(&format!("**{name}**"), counts);
            }
        }
        table.to_string()
    }

    /// What is not named with the right mend, but for what the log does not show.
    fn missed(&self) -> String {
        let mut text = String::from("## Not named with the right mend\n\n");
        for row in &self.rows {
            let of = |verdict: Verdict| {
                let names =
                    row.judged.iter().filter(|(_, judged)| judged.verdict == verdict).map(|(name, _)| name.as_str());
                names.collect::<Vec<_>>().join("; ")
            };
            for (verdict, word) in
                [(Verdict::Silent, "silent"), (Verdict::Remarked, "remarked"), (Verdict::Refused, "refused")]
            {
                let names = of(verdict);
                if !names.is_empty() {
                    let _ = writeln!(text, "- {}, {word}: {names}", row.name);
                }
            }
        }
        text + "\n"
    }

    fn told(&self) -> String {
        let mut text = String::from("## Not shown by the log, and told so\n\n");
        for row in &self.rows {
            let told = row.judged.iter().filter(|(_, judged)| judged.verdict == Verdict::Told);
            let names: Vec<&str> = told.map(|(name, _)| name.as_str()).collect();
            if !names.is_empty() {
                let _ = writeln!(text, "- {}: {}", row.name, names.join("; "));
            }
        }
        text + "\n"
    }

    fn clean(&self) -> String {
        let mut text = String::from("## Logs that are right\n\n");
        let mut table = markdown_table(["simulated logs", "logs", "accused"]);
        for of in [Clean::AsDeclared, Clean::WithEffect, Clean::Vessel] {
            let logs = self.clean.iter().filter(|log| log.0 == of);
            let accused = logs.clone().filter(|log| !log.3.is_empty()).count();
            table.add_row([kind(of).to_owned(), logs.count().to_string(), accused.to_string()]);
        }
        let _ = writeln!(
            text,
            "Drawn by seeds {} to {}: 10, 30 or 90 min; lines or dives; white or correlated noise; with and without DVL, \
             ranges, a current, a CTD; ships with and without wind and logged velocities.\n\n{table}\n",
            self.first_seed + 100,
            self.first_seed + 99 + self.clean.len() as u64
        );
        for (_, seed, what, accused) in self.clean.iter().filter(|log| !log.3.is_empty()) {
            let _ = writeln!(text, "- seed {seed}, {what}: {}", accused.join(" | "));
        }
        for row in self.rows.iter().filter(|row| !row.clean.is_empty()) {
            let _ = writeln!(text, "- {}, as it is: {}", row.name, row.clean.join(" | "));
        }
        text + "\n"
    }
}
