//! Mistakes that begin or end within a log: new settings between two dives, a sensor that was turned, two logs in one.

use super::grid::Grid;
use super::relation::State;
use super::{Search, Tested, all_tested};
use crate::log::Column;
use crate::log::plausibility::{Finding, MENDED_BY, Severity};

/// Where a log is parted at first, and then around the part that tells most, shares of its length.
const CUTS: [f64; 3] = [0.25, 0.5, 0.75];
const FINER: [f64; 5] = [-0.125, -0.0625, 0.0, 0.0625, 0.125];
/// Shorter parts show too little, s.
const SHORTEST_S: f64 = 180.0;

/// A log that was recorded in two ways.
pub(super) struct Change {
    /// Columns of the relations that hold in one part alone.
    pub columns: Vec<Column>,
    pub findings: Vec<Finding>,
}

/// The two parts at one cut.
struct Parted {
    at: usize,
    grids: [Grid; 2],
    tested: [Vec<Tested>; 2],
    /// Relations, by their place, that hold in one part, are contradicted in the other, and do not hold in the whole log.
    differing: Vec<usize>,
}

impl Parted {
    fn of(grid: &Grid, whole: &[Tested], share: f64) -> Option<Self> {
        let at = (grid.len as f64 * share) as usize;
        let least = grid.cells(SHORTEST_S, 1);
        if at < least || grid.len - at < least {
            return None;
        }
        let grids = [grid.part(0..at), grid.part(at..grid.len)];
        let tested = grids.each_ref().map(all_tested);
        let is = |side: usize, place: usize, state| tested[side][place].is(state);
        let differs = |place: &usize| {
            [[0, 1], [1, 0]]
                .iter()
                .any(|[good, bad]| is(*good, *place, State::Holds) && is(*bad, *place, State::Contradicted))
                && !whole[*place].is(State::Holds)
        };
        let differing = (0..whole.len()).filter(differs).collect();
        Some(Self { at, grids, tested, differing })
    }
}

/// The cut of some at which most relations differ, the middle one of equals, if any do.
fn most(grid: &Grid, whole: &[Tested], shares: &[f64]) -> Option<(f64, Parted)> {
    let of = |share: &f64| Some((*share, Parted::of(grid, whole, *share)?));
    let mut all: Vec<(f64, Parted)> = shares.iter().filter_map(of).collect();
    let most = all.iter().map(|(_, parted)| parted.differing.len()).max().filter(|most| *most > 0)?;
    all.retain(|(_, parted)| parted.differing.len() == most);
    Some(all.swap_remove((all.len() - 1) / 2))
}

/// Whether relations hold in one part of a log and are contradicted in the other.
pub(super) fn differ(grid: &Grid, whole: &[Tested]) -> bool {
    most(grid, whole, &CUTS).is_some()
}

/// What was recorded otherwise in a part of a log, where relations differ.
pub(super) fn check(grid: &Grid, whole: &[Tested], search: &Search<'_>) -> Option<Change> {
    let (share, _) = most(grid, whole, &CUTS)?;
    let (_, Parted { at, grids, tested, differing }) = most(grid, whole, &FINER.map(|more| share + more))?;
    let is_contradicted = |side: usize, place: &usize| tested[side][*place].is(State::Contradicted);
    let contradicted = [0, 1].map(|side| differing.iter().filter(|place| is_contradicted(side, place)).count());
    let bad = usize::from(contradicted[1] >= contradicted[0]);
    let mut columns: Vec<Column> = differing.iter().flat_map(|place| whole[*place].columns()).collect();
    let at_s = grid.start_s + at as f64 * grid.cell_s;
    let (when, otherwise) = match bad {
        1 => (format!("from about {at_s:.0} s on"), "before that"),
        _ => (format!("until about {at_s:.0} s"), "after that"),
    };
    let (explained, ..) = {
        let [first, second] = grids;
        let [of_first, of_second] = tested;
        if bad == 1 { search.explain(second, of_second) } else { search.explain(first, of_first) }
    };
    let mut findings: Vec<Finding> = Vec::new();
    for finding in explained.into_iter().filter(|finding| finding.severity == Severity::Suspicious) {
        let said = finding.message.split(MENDED_BY).next().unwrap_or_default();
        let message = format!(
            "{when} {said}; {otherwise} it is not so. No mapping mends a part: cut the log there, and examine each part \
             by itself"
        );
        columns.extend(finding.column);
        findings.push(Finding { message, mend: None, alternatives: Vec::new(), ..finding });
    }
    (!findings.is_empty()).then_some(Change { columns, findings })
}
