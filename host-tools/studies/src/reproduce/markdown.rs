//! The tables as Markdown.

use super::ensemble::Ensemble;
use super::text::{grid, seeds, summary};
use crate::table::markdown_table;
use std::fmt::Write as _;

pub fn page(ensemble: &Ensemble<'_>) -> String {
    let Ensemble { items, runs, store } = ensemble;
    let mut out = format!(
        "# The thesis' tables and figures, reproduced\n\n\
         Made by `backseat reproduce --runs {runs}` (version {}, build {}; seeds 1 to {runs}, methods were tuned on seeds from {} on).\n\
         Every number is from a simulated run, shown as the median and the middle 95 % of the runs, in which another single run, as the\n\
         thesis reports them, is to be expected. The thesis itself was not at hand: each item states how it was read, and\n\
         printed figures appear where they are known. *Independent* rows are of an independent implementation of the thesis'\n\
         corrected equations (medians or means of its runs).\n\n",
        env!("CARGO_PKG_VERSION"),
        store.build(),
        super::FIRST_TUNING_SEED
    );
    if items.len() > 1 {
        out += "## Summary\n\n";
        write_grid(&mut out, &summary(ensemble));
    }
    for item in *items {
        let ours = ensemble.table(item);
        let _ = writeln!(out, "\n## {}: {}\n", item.id, item.title);
        let _ = writeln!(out, "Taken as: {}.\n", item.taken_as);
        let _ = writeln!(out, "Conditions: {} Runs: {}.\n", item.conditions, seeds(ensemble, &ours));
        write_grid(&mut out, &grid(item, &ours));
        let printed = if item.printed.is_empty() { "The thesis' printed figures are not at hand. " } else { "" };
        let _ = writeln!(out, "\n{printed}{}", item.differs);
    }
    out
}

fn write_grid(out: &mut String, grid: &[Vec<String>]) {
    let Some((header, rows)) = grid.split_first() else { return };
    let mut table = markdown_table(header.iter().cloned());
    table.add_rows(rows.iter().cloned());
    let _ = writeln!(out, "{table}");
}
