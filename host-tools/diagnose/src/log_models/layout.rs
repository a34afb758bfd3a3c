//! What each stretch of a log's runs is used for.
//!
//! Runs stand one after the other on a time axis of their own, each from the beginning of a block, so that the order in
//! which a log holds them changes nothing.

use crate::split::{DataPart, Split};

/// Blocks that a run should have, so that every part has some of it twice.
const BLOCKS_A_RUN: f64 = 54.0;
/// Shortest block, s.
const SHORTEST_S: f64 = 2.0;

/// Blocks of the runs, and their parts.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Beginning and end of each run in the log, and its beginning on the axis of blocks, s.
    runs: Vec<([f64; 2], f64)>,
    split: Split,
}

impl Layout {
    /// Of runs in order of time. A block is `longest_s` long, or shorter where the runs are short.
    #[must_use]
    pub fn new(runs: &[[f64; 2]], longest_s: f64, forecast_share: f64) -> Self {
        let mut lengths: Vec<f64> = runs.iter().map(|[from, to]| to - from).collect();
        lengths.sort_by(f64::total_cmp);
        let usual_s = lengths.get(lengths.len() / 2).copied().unwrap_or(0.0);
        let block_s = (usual_s / BLOCKS_A_RUN).clamp(SHORTEST_S.min(longest_s), longest_s);
        let (mut at_s, mut placed, mut spans) = (0.0, Vec::new(), Vec::new());
        for run in runs {
            placed.push((*run, at_s));
            let end_s = at_s + (run[1] - run[0]);
            spans.push([at_s, end_s]);
            at_s = ((end_s / block_s).floor() + 1.0) * block_s;
        }
        Self { runs: placed, split: Split::of_runs(spans, block_s, forecast_share) }
    }

    /// Judges nothing between these times of the log: what begins or ends there is not known any better.
    pub fn except(&mut self, unjudged: Vec<[f64; 2]>) {
        let placed = |t_s: f64| self.runs.get(self.run(t_s)).map_or(t_s, |([from_s, _], at_s)| t_s - from_s + at_s);
        let placed = unjudged.into_iter().map(|interval| interval.map(placed)).collect();
        self.split.except(placed);
    }

    /// Length of a block, s.
    #[must_use]
    pub fn block_s(&self) -> f64 {
        self.split.block_s
    }

    /// Place of a time's run.
    #[must_use]
    pub fn run(&self, t_s: f64) -> usize {
        self.runs.partition_point(|([from_s, _], _)| *from_s <= t_s).saturating_sub(1)
    }

    /// Number of a time's block.
    #[must_use]
    pub fn block(&self, t_s: f64) -> usize {
        let run = self.run(t_s);
        let Some(([from_s, _], at_s)) = self.runs.get(run) else { return 0 };
        ((t_s - from_s + at_s + 1e-9) / self.split.block_s).max(0.0) as usize
    }

    /// Whether a block belongs to a part.
    #[must_use]
    pub fn is_in(&self, part: DataPart, block: usize) -> bool {
        self.split.is_in(part, block)
    }

    /// Whether a time judges.
    #[must_use]
    pub fn is_judged(&self, t_s: f64) -> bool {
        self.is_in(DataPart::Judge, self.block(t_s))
    }

    /// The part of a time, as a number that changes where what it is used for does.
    #[must_use]
    pub fn use_of(&self, t_s: f64) -> u8 {
        let block = self.block(t_s);
        let is = |part| u8::from(self.is_in(part, block));
        is(DataPart::Train) + 2 * is(DataPart::Judge) + 4 * is(DataPart::Forecast)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_used_alike_wherever_it_stands() {
        let (short, long) = ([0.0, 400.0], [503.3, 1503.3]);
        let first = Layout::new(&[short, long], 20.0, 0.1);
        let second = Layout::new(&[[0.0, 1000.0], [1111.1, 1511.1]], 20.0, 0.1);
        assert_eq!(first.block_s(), second.block_s());
        for t in 0..1000 {
            let t_s = f64::from(t) + 0.5;
            assert_eq!(first.use_of(503.3 + t_s), second.use_of(t_s), "{t}");
            if t < 400 {
                assert_eq!(first.use_of(t_s), second.use_of(1111.1 + t_s), "{t}");
            }
        }
    }
}
