//! The tables as Markdown.

use super::ensemble::{ItemRuns, Verdict};
use super::grid::{grid, seeds, summary};
use crate::wrap::wrapped;
use backseat_report::markdown::markdown_table;
use std::fmt::Write as _;

const INTRODUCTION: &str = "\
Every item is simulated under the conditions that the thesis prints for it; what the thesis does not say, and we had to \
choose, stands in brackets. The vehicle's parameters are nowhere printed, so that no run can be exactly the thesis' own. \
Numbers are the median and the middle 95 % of the runs, in which another single run is to be expected: the thesis reports \
single runs. Rows \"printed\" are the thesis' numbers of the row above. *Independent* rows are of another implementation of \
the thesis' corrected equations (medians or means of its runs).";

/// What has nothing to reproduce.
const WITHOUT_RESULT: &str = "\
## Without a result to reproduce

- Tables 2.1, 2.2, 3.1 to 3.3, 4.1, 4.5 to 4.7, 4.9, 4.13, 4.14 and 5.1 are conditions; they stand at the items that use them.
- Tables 4.2 and 4.4 and Figures 4.1 to 4.6 are measured on the author's own bench, Table 4.3 is a data sheet. `backseat bench` \
gives the same numbers of a static log of one's own sensors.
- Figure 2.1 is a sketch, Figure 3.4 a photograph.
- Maps (Figures 2.2, 2.3, 2.7, 2.8, 3.1, 3.2, 3.5 to 3.7, 4.7, 5.1) come without numbers: the errors of the same runs stand \
in their place.
";

pub fn page(ensemble: &ItemRuns<'_>) -> String {
    let ItemRuns { items, runs, build, .. } = ensemble;
    let mut out = format!(
        "# The thesis' tables and figures, reproduced\n\n\
         Made by `cargo lab reproduce --runs {runs}` (version {}, build {build}; seeds 1 to {runs}, methods were tuned on seeds from {} on).\n\
         {INTRODUCTION}\n\n",
        env!("CARGO_PKG_VERSION"),
        super::FIRST_TUNING_SEED
    );
    if items.len() > 1 {
        out += "## Summary\n\n";
        write_grid(&mut out, &summary(ensemble));
    }
    for item in *items {
        let ours = ensemble.table(item);
        let _ = writeln!(out, "\n## {}: {}\n", item.id, item.title);
        let _ = writeln!(out, "Thesis: {}\n", item.thesis);
        let _ = writeln!(out, "Conditions: {} Runs: {}.\n", item.conditions, seeds(*runs));
        write_grid(&mut out, &grid(item, &ours));
        let _ = writeln!(out, "\n{}{}", Verdict::of(item, &ours).text(), item.differs);
    }
    if items.len() > 1 {
        let _ = write!(out, "\n{WITHOUT_RESULT}");
    }
    wrapped(&out)
}

fn write_grid(out: &mut String, grid: &[Vec<String>]) {
    let Some((header, rows)) = grid.split_first() else { return };
    let mut table = markdown_table(header.iter().cloned());
    table.add_rows(rows.iter().cloned());
    let _ = writeln!(out, "{table}");
}
