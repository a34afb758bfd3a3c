//! What the board has learnt of its vehicle in its dives: to be seen, and to be forgotten.

use crate::board::Common;
use anyhow::bail;
use backseat_app::parameters::{self, Settings};
use backseat_core::navigation::{ESTIMATE_UNITS, LEARNT_NAMES, LEARNT_STATES, Learnt};
use backseat_link::board::{Board, Declared, reason};
use backseat_report::{Report, Table};
use serde_json::{Map, json};

const SECTION: &str = "learnt.";

/// Its numbers on the board, and as a set.
fn read(board: &mut Board) -> anyhow::Result<(Vec<Declared>, Learnt)> {
    let all = board.parameters()?;
    let own: Vec<Declared> = all.into_iter().filter(|parameter| parameter.name.starts_with(SECTION)).collect();
    let mut settings = Settings::DEFAULT;
    for parameter in &own {
        if let Some(known) = parameters::find(&parameter.name) {
            known.set(&mut settings, parameter.value);
        }
    }
    Ok((own, settings.learnt))
}

/// The largest correlation of a state: with which one, and how large.
fn most_correlated(learnt: &Learnt, i: usize) -> Option<(usize, f64)> {
    let others = (0..LEARNT_STATES).filter(|j| *j != i && learnt.sigma[*j] > 0.0);
    others.map(|j| (j, learnt.correlation(i, j))).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// Shows them.
pub fn show(common: &Common) -> anyhow::Result<()> {
    let (own, learnt) = read(&mut common.connect()?)?;
    if own.is_empty() {
        bail!("{}: the board's firmware keeps nothing of what a dive learns", common.port);
    }
    if learnt.is_none() {
        let report = Report::new("Learnt", "nothing learnt: the next dive starts from section [prior]");
        return common.show(&report.value("dives", learnt.dives).value("learnt", json!({})));
    }
    let mut values = Map::new();
    let mut table = Table::new("", &["", "estimate", "sigma", "unit", "largest correlation"]);
    for (i, name) in LEARNT_NAMES.iter().enumerate().filter(|(i, _)| learnt.sigma[*i] > 0.0) {
        let (mean, sigma, unit) = (learnt.mean[i], learnt.sigma[i], ESTIMATE_UNITS[i]);
        let most = most_correlated(&learnt, i);
        let with = most.map_or_else(String::new, |(j, r)| format!("{r:+.2} with {}", LEARNT_NAMES[j]));
        table = table.row([name, &*format!("{mean:.5}"), &*format!("{sigma:.5}"), unit, &*with]);
        let most = most.map(|(j, r)| json!({"with": LEARNT_NAMES[j], "value": r}));
        values.insert(
            (*name).to_owned(),
            json!({"value": mean, "sigma": sigma, "unit": unit, "largest_correlation": most}),
        );
    }
    let report = Report::new("Learnt", format!("learnt in {} dives", learnt.dives)).table(table);
    let report = report.text("Of m11 to beta5 it is the logarithm of true over declared.");
    common.show(&report.value("dives", learnt.dives).value("learnt", values))
}

/// Sets all of them to nothing, and has the board store that.
pub fn forget(common: &Common) -> anyhow::Result<()> {
    let mut board = common.connect()?;
    let (own, learnt) = read(&mut board)?;
    let zeros: Vec<(String, f64)> =
        own.iter().filter(|parameter| parameter.value != 0.0).map(|parameter| (parameter.name.clone(), 0.0)).collect();
    if zeros.is_empty() {
        return common.say(&json!({"forgotten": false}), "nothing was learnt, nothing forgotten\n");
    }
    board.set_parameters(&zeros, &own, false)?;
    if let Err(refusal) = board.store_parameters()? {
        bail!("{}: forgotten, but only until power-off: the board stored nothing: {}", common.port, reason(refusal));
    }
    let text = format!("what {} dives have taught is forgotten; the next starts from section [prior]\n", learnt.dives);
    common.say(&json!({"forgotten": true, "dives": learnt.dives}), &text)
}
