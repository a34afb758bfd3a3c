//! Signs, axes and units of columns against physics that needs no vehicle.
//!
//! Every relation between columns (`rates`, `dive`, `fins`, `course`, `propeller`, `ranges`) is tested as recorded. Where
//! one is contradicted, every mistake in recording (`mend`) is tried: the one that mends most contradictions, and breaks
//! nothing that held, is named with the lines of a column mapping that undo it.

mod course;
mod dive;
mod fins;
mod grid;
mod legs;
mod mend;
mod propeller;
mod ranges;
mod rates;
mod relation;
mod slope;

use super::{Finding, Severity, Untested};
use crate::log::{Column, Log};
use grid::Grid;
pub(super) use mend::Mend;
use relation::{Outcome, Relation, State};

/// Mistakes in one log; more are found after these are mended.
const MOST_MENDS: usize = 4;

fn relations() -> impl Iterator<Item = &'static Relation> {
    rates::RELATIONS
        .iter()
        .chain(&dive::RELATIONS)
        .chain(&fins::RELATIONS)
        .chain(&course::RELATIONS)
        .chain(&propeller::RELATIONS)
        .chain(&ranges::RELATIONS)
}

/// A relation and what the log says of it now.
struct Tested {
    relation: &'static Relation,
    outcome: Outcome,
}

impl Tested {
    fn is(&self, state: State) -> bool {
        self.outcome.state == state
    }

    fn columns(&self) -> Vec<Column> {
        self.relation.needs.iter().chain(self.relation.uses).copied().collect()
    }
}

/// What contradicts signs, axes and units, and what this log cannot show; columns that are doubted are left out.
pub(super) fn check(
    log: &Log,
    is_in_degrees: bool,
    is_doubted: impl Fn(Column) -> bool,
) -> (Vec<Finding>, Vec<Untested>) {
    let Some(mut grid) = Grid::of(log, is_in_degrees, is_doubted) else { return (Vec::new(), Vec::new()) };
    let test = |relation: &'static Relation, grid: &Grid| {
        let missing: Vec<&str> =
            relation.needs.iter().filter(|column| !grid.has(**column)).map(|column| column.name()).collect();
        if !missing.is_empty() {
            return Outcome::untested(format!("no {}", missing.join(", ")));
        }
        (relation.test)(grid)
    };
    let mut tested: Vec<Tested> =
        relations().map(|relation| Tested { relation, outcome: test(relation, &grid) }).collect();
    let untested = tested
        .iter()
        .filter(|tested| matches!(tested.outcome.state, State::Untested | State::Absent))
        .map(|tested| Untested { test: tested.relation.name, why: tested.outcome.evidence.clone() })
        .collect();
    let mut findings = Vec::new();
    let mends: Vec<Mend> = mend::all().into_iter().filter(|mend| mend.fits(&grid)).collect();
    for _ in 0..MOST_MENDS {
        let is_bad = |tested: &Tested| tested.is(State::Contradicted) || tested.is(State::Absent);
        if !tested.iter().any(is_bad) {
            break;
        }
        let mut found: Vec<(usize, &Mend, Grid, Vec<(usize, Outcome)>)> = Vec::new();
        for mend in &mends {
            let counts = |tested: &Tested| {
                (tested.is(State::Contradicted) || (mend.is_exchange && tested.is(State::Absent)))
                    && mend.touches(&tested.columns())
            };
            if !tested.iter().any(counts) {
                continue;
            }
            let mended = mend.apply(&grid);
            let mut outcomes = Vec::new();
            let mut good = 0;
            for (place, tested) in tested.iter().enumerate().filter(|(_, tested)| counts(tested)) {
                let outcome = test(tested.relation, &mended);
                if outcome.state == State::Holds {
                    good += if tested.is(State::Contradicted) { 10 } else { 1 };
                }
                outcomes.push((place, outcome));
            }
            if good == 0 {
                continue;
            }
            let rest = tested.iter().enumerate().filter(|(_, tested)| !counts(tested) && mend.touches(&tested.columns()));
            let mut breaks = false;
            for (place, tested) in rest {
                let outcome = test(tested.relation, &mended);
                breaks |= match tested.outcome.state {
                    State::Holds => outcome.state != State::Holds,
                    State::Untested | State::Absent => outcome.state == State::Contradicted,
                    State::Contradicted => false,
                };
                outcomes.push((place, outcome));
            }
            if !breaks {
                found.push((good, mend, mended, outcomes));
            }
        }
        let Some(most) = found.iter().map(|(good, ..)| *good).max() else { break };
        found.retain(|(good, ..)| *good == most);
        // the first of those that explain the same; the sort is stable
        found.sort_by_key(|(_, mend, ..)| mend.edits.len());
        let names: Vec<Mend> = found.iter().map(|(_, mend, ..)| (*mend).clone()).collect();
        let (_, _, mended, outcomes) = found.swap_remove(0);
        let evidence: Vec<String> = outcomes
            .iter()
            .filter(|(place, outcome)| outcome.state == State::Holds && !tested[*place].is(State::Holds))
            .map(|(place, _)| tested[*place].outcome.evidence.clone())
            .collect();
        findings.push(finding(&names, &evidence));
        for (place, outcome) in outcomes {
            tested[place].outcome = outcome;
        }
        grid = mended;
    }
    findings.extend(tested.iter().filter(|tested| tested.is(State::Contradicted)).map(unexplained));
    (findings, untested)
}

/// A contradiction that one mistake explains.
fn finding(mends: &[Mend], evidence: &[String]) -> Finding {
    let first = &mends[0];
    let others: Vec<&str> = mends.iter().skip(1).map(|mend| mend.what.as_str()).collect();
    let others = if others.is_empty() { String::new() } else { format!("; or {}", others.join("; or ")) };
    let lines: Vec<String> = mends.iter().map(Mend::lines).collect();
    let evidence = evidence.join("; ");
    Finding {
        column: first.edits.first().map(|edit| edit.target()),
        severity: Severity::Suspicious,
        message: format!(
            "{}{others}: {evidence}; mended by {}",
            first.what,
            lines.join(" or ").replace('\n', " and ")
        ),
        what: first.what.clone(),
        evidence,
        mend: Some(lines[0].clone()),
        alternatives: lines[1..].to_vec(),
    }
}

/// A contradiction that no single mistake explains.
fn unexplained(tested: &Tested) -> Finding {
    let Tested { relation, outcome } = tested;
    // Dead reckoning may be poor for other reasons; one of two signs of the same fin may be chance of its control.
    let is_weak = relation.name.starts_with("range against the way") || relation.name.contains("fin");
    Finding {
        column: relation.needs.first().copied(),
        severity: if is_weak { Severity::Remark } else { Severity::Suspicious },
        message: format!("{}: {}; no single mistake in recording explains it", relation.name, outcome.evidence),
        what: format!("{} disagree", relation.name),
        evidence: outcome.evidence.clone(),
        mend: None,
        alternatives: Vec::new(),
    }
}
