//! Signs, axes and units of columns against physics that needs no vehicle.
//!
//! Every relation between columns (`rates`, `dive`, `fins`, `course`, `propeller`, `ranges`, `usbl`) is tested as recorded. Where
//! one is contradicted, every mistake in recording (`mend`) is tried: the one that mends most contradictions, and breaks
//! nothing that held, is named with the lines of a column mapping that undo it.

mod course;
mod dive;
mod fins;
mod grid;
mod legs;
mod mend;
mod pace;
mod parts;
mod propeller;
mod ranges;
mod rates;
mod relation;
mod slip;
mod slope;
mod usbl;

use super::{Finding, MENDED_BY, Severity, Untested};
use crate::log::{Column, Log};
use crate::stats::percentile;
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
        .chain(&pace::RELATIONS)
        .chain(&usbl::RELATIONS)
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

    /// Its columns that the log has.
    fn used(&self, grid: &Grid) -> Vec<Column> {
        self.columns().into_iter().filter(|column| grid.has(*column)).collect()
    }

    fn columns(&self) -> Vec<Column> {
        self.relation.needs.iter().chain(self.relation.uses).copied().collect()
    }
}

/// A relation that nothing contradicts is another column's only from this correlation on.
const OF_EXCHANGE: f64 = 0.5;

/// Relations that have to hold by another unit of the time.
const OF_TIME: usize = 2;
/// A vehicle that is slower than this most of the time, m/s, turns by its moorings and the wind.
const SLOW_MPS: f64 = 0.1;

/// A mend that explains something, and what the relations that it touches would be.
struct Candidate<'a> {
    score: i32,
    mend: &'a Mend,
    outcomes: Vec<(usize, Outcome)>,
}

/// Correlation of sway and turn from which on the place of the DVL alone would have to be beyond the bow.
const CLOSE: f64 = 0.7;

/// What a mend is worth for each column whose values are odd.
const OF_ODD: i32 = 3;

/// What a mend is worth for one relation. To break one is worth more than to mend several; to lose one, for its noise grows
/// or the log shows less, costs less than to mend one.
const fn value(before: State, after: State) -> i32 {
    match (before, after) {
        (State::Contradicted, State::Holds) => 10,
        (State::Contradicted, _) => 0,
        (_, State::Contradicted) => -100,
        (State::Absent, State::Holds) => 2,
        (State::Untested, State::Holds) => 1,
        (State::Holds, State::Untested | State::Absent) => -1,
        _ => 0,
    }
}

/// Sizes that a relation leaves open where it holds, by its name: any that it expects, which its evidence states.
const LEFT_OPEN: [(&str, &str); 2] = [
    ("propeller against speed, size", "a factor of prop_rpm within what is expected"),
    ("depth against pitch", "a factor of depth_m within what is expected"),
];

/// What a log says of how its columns were recorded.
#[derive(Default)]
pub(super) struct Tests {
    pub findings: Vec<Finding>,
    pub untested: Vec<Untested>,
    /// Relations that hold, and the columns of the log that they are of.
    pub holding: Vec<(&'static str, Vec<Column>)>,
    /// Angle from heading to course, rad, and one sigma of it.
    pub turn: Option<[f64; 2]>,
    /// The unit of the heading, where it is not in radians.
    pub heading: Option<Mend>,
    /// Columns that were recorded in two ways: no mapping mends them.
    pub changed: Vec<Column>,
}

/// Median of the speed that a log states first, m/s.
fn typical_speed_mps(log: &Log) -> Option<f64> {
    let of = |column| log.column(column).map(|(_, speed)| speed.abs()).collect::<Vec<f64>>();
    [Column::DvlU, Column::SpeedLog].into_iter().find_map(|column| percentile(&of(column), 0.5))
}

/// What contradicts signs, axes and units, and what this log cannot show. Columns whose values are `odd` are the first to
/// be blamed; a heading in another unit is read in that of `headings` that fits best; columns that are doubted are left
/// out.
pub(super) fn check(log: &Log, odd: &[Column], headings: &[Mend], is_doubted: impl Fn(Column) -> bool) -> Tests {
    let mut tests = Tests { heading: headings.first().cloned(), ..Tests::default() };
    let scale = headings.first().map_or(1.0, Mend::scale);
    let Some(mut grid) = Grid::of(log, scale, &is_doubted) else { return tests };
    if headings.len() > 1 {
        // by what the course and the yaw rate say of each, with either sign
        let of_heading = || relations().filter(|relation| relation.needs.contains(&Column::Heading));
        let holding = |grid: &Grid| of_heading().filter(|relation| test(relation, grid).state == State::Holds).count();
        let fits = |grid: &Grid| {
            let negated = Mend::sign(&[Column::Heading]).apply(grid);
            [grid, &negated].map(|grid| (holding(grid), course::turn(grid).map_or(f64::MAX, |[_, sigma]| sigma)))
        };
        let is_better = |a: &(usize, f64), b: &(usize, f64)| a.0 > b.0 || (a.0 == b.0 && a.1 < b.1);
        let best_of = |[a, b]: [(usize, f64); 2]| if is_better(&b, &a) { b } else { a };
        let mut best = best_of(fits(&grid));
        for heading in &headings[1..] {
            let Some(other) = Grid::of(log, heading.scale(), &is_doubted) else { continue };
            let fit = best_of(fits(&other));
            if is_better(&fit, &best) {
                (best, grid) = (fit, other);
                tests.heading = Some(heading.clone());
            }
        }
    }
    tests.turn = course::turn(&grid);
    let tested = all_tested(&grid);
    let of_state = |tested: &&Tested, state| tested.outcome.state == state;
    let holding = tested.iter().filter(|tested| of_state(tested, State::Holds));
    tests.holding = holding.map(|tested| (tested.relation.name, tested.used(&grid))).collect();
    tests.untested = tested
        .iter()
        .filter(|tested| matches!(tested.outcome.state, State::Untested | State::Absent))
        .map(|tested| Untested {
            test: tested.relation.name,
            columns: tested.columns(),
            lacks_columns: tested.relation.needs.iter().any(|column| !grid.has(*column)),
            is_inconclusive: tested.outcome.is_compared,
            why: tested.outcome.evidence.clone(),
        })
        .collect();
    let left_open = |tested: &Tested| {
        let (_, test) = LEFT_OPEN.iter().find(|(name, _)| *name == tested.relation.name && tested.is(State::Holds))?;
        let columns = vec![tested.relation.needs[0]];
        let why = tested.outcome.evidence.clone();
        Some(Untested { test, columns, lacks_columns: false, is_inconclusive: false, why })
    };
    tests.untested.extend(tested.iter().filter_map(left_open));
    let search = Search {
        odd,
        is_slow: typical_speed_mps(log).is_some_and(|speed_mps| speed_mps < SLOW_MPS),
        heading: tests.heading.as_ref(),
    };
    let change = parts::check(&grid, &tested, &search);
    let (findings, mended, tested) = search.explain(grid, tested);
    // a mistake of the whole log may leave a part in which a relation holds by chance: mended, it holds in both
    let is_whole = findings.iter().any(|finding| finding.mend.is_some()) && !parts::differ(&mended, &tested);
    tests.findings = findings;
    if let Some(change) = change.filter(|_| !is_whole) {
        // what two recordings together contradict says nothing of either
        tests.findings.retain(|finding| finding.column.is_none_or(|column| !change.columns.contains(&column)));
        tests.findings.extend(change.findings);
        tests.changed = change.columns;
    }
    tests
}

/// What a grid says of a relation.
fn test(relation: &Relation, grid: &Grid) -> Outcome {
    let missing: Vec<&str> =
        relation.needs.iter().filter(|column| !grid.has(**column)).map(|column| column.name()).collect();
    if !missing.is_empty() {
        return Outcome::untested(format!("no {}", missing.join(", ")));
    }
    (relation.test)(grid)
}

/// What it says of all; few logs have a USBL: of others nothing is said of it.
fn all_tested(grid: &Grid) -> Vec<Tested> {
    let is_asked = |of: &&Relation| !of.needs.contains(&Column::UsblRange) || grid.has(Column::UsblRange);
    relations().filter(is_asked).map(|relation| Tested { relation, outcome: test(relation, grid) }).collect()
}

/// The search for mistakes that explain contradictions.
struct Search<'a> {
    /// Columns that are the first to be blamed.
    odd: &'a [Column],
    /// The vehicle hardly moves.
    is_slow: bool,
    /// The heading's unit, in which the grid has it.
    heading: Option<&'a Mend>,
}

impl Search<'_> {
    /// The mistakes that explain what is contradicted, and what none explains; the log without these mistakes.
    fn explain(&self, mut grid: Grid, mut tested: Vec<Tested>) -> (Vec<Finding>, Grid, Vec<Tested>) {
        let mut findings: Vec<Finding> = Vec::new();
        let mut done: Vec<Mend> = self.heading.into_iter().cloned().collect();
        // an angle that is counted from elsewhere rests there
        let is_likely = |mend: &Mend| mend.fits(&grid) && mend.turns().is_none_or(|column| self.odd.contains(&column));
        let mends: Vec<Mend> = mend::all().into_iter().filter(is_likely).collect();
        for _ in 0..MOST_MENDS {
            let mut found: Vec<Candidate<'_>> = Vec::new();
            for mend in &mends {
                let is_touched = |tested: &Tested| mend.touches(&tested.columns());
                // a relation that is absent is noise, unless another column has it, and not what these columns have themselves
                let is_reason = |tested: &Tested| {
                    let is_absent =
                        !tested.is(State::Holds) && tested.outcome.correlation.is_some_and(|own| own <= OF_EXCHANGE);
                    tested.is(State::Contradicted) || (mend.is_exchange && is_absent)
                };
                let reasons =
                    (0..tested.len()).filter(|&place| is_touched(&tested[place]) && is_reason(&tested[place]));
                let reasons: Vec<usize> = reasons.collect();
                if reasons.is_empty() {
                    continue;
                }
                let mended = mend.apply(&grid);
                let mut outcomes: Vec<(usize, Outcome)> =
                    reasons.iter().map(|&place| (place, test(tested[place].relation, &mended))).collect();
                let is_mended = |(place, outcome): &(usize, Outcome)| {
                    let is_close = outcome.correlation.is_some_and(|correlation| correlation > OF_EXCHANGE);
                    outcome.state == State::Holds && (tested[*place].is(State::Contradicted) || is_close)
                };
                // one relation is no witness of all times, nor is a vehicle that hardly moves
                let least = if mend.is_time() { OF_TIME } else { 1 };
                if outcomes.iter().filter(|outcome| is_mended(outcome)).count() < least
                    || (mend.is_time() && self.is_slow)
                {
                    continue;
                }
                let rest = (0..tested.len()).filter(|place| is_touched(&tested[*place]) && !reasons.contains(place));
                outcomes.extend(rest.map(|place| (place, test(tested[place].relation, &mended))));
                let change = outcomes.iter().map(|(place, outcome)| value(tested[*place].outcome.state, outcome.state));
                let blamed = self.odd.iter().filter(|column| mend.touches(&[**column])).count() as i32;
                let score = change.sum::<i32>();
                if score > 0 {
                    // two mistakes only where one explains less
                    let score = score + OF_ODD * blamed - i32::from(mend.is_double());
                    found.push(Candidate { score, mend, outcomes });
                }
            }
            let Some(most) = found.iter().map(|candidate| candidate.score).max() else { break };
            found.retain(|candidate| candidate.score == most);
            // the first of those that explain the same; the sort is stable
            found.sort_by_key(|candidate| candidate.mend.edits.len());
            let names: Vec<Mend> = found.iter().map(|candidate| candidate.mend.clone().after(&done)).collect();
            let Candidate { mend, outcomes, .. } = found.swap_remove(0);
            let evidence: Vec<String> = outcomes
                .iter()
                .filter(|(place, outcome)| outcome.state == State::Holds && !tested[*place].is(State::Holds))
                .map(|(place, _)| tested[*place].outcome.evidence.clone())
                .collect();
            findings.push(finding(&names, &evidence));
            for (place, outcome) in outcomes {
                tested[place].outcome = outcome;
            }
            grid = mend.apply(&grid);
            done.push(names[0].clone());
            // what is mended twice is said once, by the line that does both
            let is_said = |finding: &Finding| finding.mend.as_ref().is_some_and(|lines| names[0].replaces(lines));
            let last = findings.len() - 1;
            let before: Vec<usize> = (0..last).filter(|&place| is_said(&findings[place])).collect();
            for place in before.into_iter().rev() {
                let earlier = findings.remove(place);
                if let Some(latest) = findings.last_mut() {
                    latest.message = format!("{}, and {}", earlier.what, latest.message);
                    latest.what = format!("{}, and {}", earlier.what, latest.what);
                }
            }
        }
        findings.extend(tested.iter().filter(|tested| tested.is(State::Contradicted)).map(unexplained));
        let is_blamed = findings.iter().any(|finding| finding.column == Some(Column::DvlV));
        let outcome = test(&slip::RELATION, &grid);
        if outcome.state == State::Contradicted && !is_blamed {
            findings.push(slips_inwards(&outcome));
        }
        (findings, grid, tested)
    }
}

/// A contradiction that one mistake explains.
fn finding(mends: &[Mend], evidence: &[String]) -> Finding {
    let first = &mends[0];
    let others: Vec<&str> = mends.iter().skip(1).map(|mend| mend.what.as_str()).collect();
    let others = if others.is_empty() { String::new() } else { format!("; or {}", others.join("; or ")) };
    let lines: Vec<String> = mends.iter().map(Mend::lines).collect();
    let evidence = evidence.join("; ");
    Finding {
        column: first.edits.first().map(|edit| edit.target),
        severity: Severity::Suspicious,
        message: format!("{}{others}: {evidence}{MENDED_BY}{}", first.what, lines.join(" or ").replace('\n', " and ")),
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

/// A DVL ahead of the point that a hull turns about sees the same: in a close relation that place is beyond the bow.
fn slips_inwards(outcome: &Outcome) -> Finding {
    let is_close = outcome.correlation.is_some_and(|correlation| correlation < -CLOSE);
    let what = "dvl_v_mps slips into turns, where a hull slips out of them: it has the wrong sign, or the DVL is far ahead \
                of the point that the hull turns about";
    let lines = Mend::sign(&[Column::DvlV]).lines();
    let severity = if is_close { Severity::Suspicious } else { Severity::Remark };
    let finding = Finding::new(severity, Some(Column::DvlV), format!("{what}: {}", outcome.evidence));
    Finding { what: what.to_owned(), evidence: outcome.evidence.clone(), ..finding }.mended_by(lines)
}
