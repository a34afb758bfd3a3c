//! What each stretch of a log is used for: to fit, to choose, to judge.
//!
//! Every run is split by itself and from its own beginning, so that neither the order of runs nor what lies between them
//! changes what a stretch is used for. A block is as long as the coloured part of most residuals, or longer.

/// Blocks in a row that fit, that choose and that judge.
const CYCLE: [usize; 3] = [15, 6, 6];
/// Share at the end of a run that is a forecast: it judges, and nothing after it is fitted.
pub const FORECAST_SHARE: f64 = 0.1;

/// A part of a log, as sums over blocks name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataPart {
    /// Where parameters are fitted while effects are chosen.
    Train,
    /// Where effects that were fitted on [`DataPart::Train`] have to gain.
    Choose,
    /// Both: significance, noise, timing and events are of these, and the values that are reported.
    Seen,
    /// Where nothing was fitted, chosen or estimated: the figures before and after.
    Judge,
    /// Of [`DataPart::Judge`] the last part of each run, after everything that was fitted.
    Forecast,
}

/// How a log is split.
#[derive(Clone, Debug, PartialEq)]
pub struct Split {
    /// Length of a block, s.
    pub block_s: f64,
    /// Share at the end of a run that is a forecast.
    pub forecast_share: f64,
    /// Beginning and end of each run, s since the log's first row, in order of time.
    runs: Vec<[f64; 2]>,
    /// Times between which an event begins or ends, as far as the log says: no model is judged there, s.
    unjudged: Vec<[f64; 2]>,
}

impl Split {
    /// Of one run.
    #[must_use]
    pub fn of_one_run(duration_s: f64, block_s: f64, forecast_share: f64) -> Self {
        Self::of_runs(vec![[0.0, duration_s]], block_s, forecast_share)
    }

    /// Of several runs: beginning and end of each, s since the log's first row.
    #[must_use]
    pub fn of_runs(mut runs: Vec<[f64; 2]>, block_s: f64, forecast_share: f64) -> Self {
        runs.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self { block_s, forecast_share, runs, unjudged: Vec::new() }
    }

    /// Judges nothing between these times: what begins or ends within a stretch that judges is not found there, and its time
    /// is not known any better.
    pub fn except(&mut self, unjudged: Vec<[f64; 2]>) {
        self.unjudged = unjudged;
    }

    /// Whether a block belongs to a part.
    #[must_use]
    pub fn is_in(&self, part: DataPart, block: usize) -> bool {
        let middle_s = (block as f64 + 0.5) * self.block_s;
        let run = self.runs.partition_point(|[from_s, _]| *from_s <= middle_s).saturating_sub(1);
        let [from_s, to_s] = self.runs.get(run).copied().unwrap_or([0.0, f64::INFINITY]);
        let is_forecast = middle_s - from_s >= (1.0 - self.forecast_share) * (to_s - from_s);
        let place = ((middle_s - from_s).max(0.0) / self.block_s) as usize % CYCLE.iter().sum::<usize>();
        let is_train = !is_forecast && place < CYCLE[0];
        let is_judge = is_forecast || place >= CYCLE[0] + CYCLE[1];
        let is_open = !self.is_unjudged(middle_s);
        match part {
            DataPart::Train => is_train,
            DataPart::Choose => !is_train && !is_judge,
            DataPart::Seen => !is_judge,
            DataPart::Judge => is_judge && is_open,
            DataPart::Forecast => is_forecast && is_open,
        }
    }

    /// Whether an event that is named begins or ends about here, as far as the log says.
    #[must_use]
    pub fn is_unjudged(&self, t_s: f64) -> bool {
        let about = |[from_s, to_s]: &[f64; 2]| (from_s - self.block_s..=to_s + self.block_s).contains(&t_s);
        self.unjudged.iter().any(about)
    }

    /// Whether a time belongs to a part.
    #[must_use]
    pub fn is_at(&self, part: DataPart, t_s: f64) -> bool {
        self.is_in(part, (t_s / self.block_s) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(split: &Split, part: DataPart, blocks: usize) -> usize {
        (0..blocks).filter(|block| split.is_in(part, *block)).count()
    }

    #[test]
    fn every_block_fits_or_chooses_or_judges() {
        let split = Split::of_one_run(3600.0, 20.0, FORECAST_SHARE);
        let [train, choose, judge] =
            [DataPart::Train, DataPart::Choose, DataPart::Judge].map(|part| count(&split, part, 180));
        assert_eq!(train + choose + judge, 180);
        assert_eq!(train + choose, count(&split, DataPart::Seen, 180));
        assert_eq!(count(&split, DataPart::Forecast, 180), 18);
        assert!((40..70).contains(&judge), "{judge}");
    }

    #[test]
    fn a_run_is_split_alike_wherever_it_stands() {
        let [short, long] = [400.0, 1000.0];
        let first = Split::of_runs(vec![[0.0, short], [short, short + long]], 20.0, FORECAST_SHARE);
        let second = Split::of_runs(vec![[long, long + short], [0.0, long]], 20.0, FORECAST_SHARE);
        for part in [DataPart::Train, DataPart::Choose, DataPart::Judge, DataPart::Forecast] {
            for block in 0..20 {
                assert_eq!(first.is_in(part, block), second.is_in(part, block + 50), "{part:?} {block}");
            }
            for block in 0..50 {
                assert_eq!(first.is_in(part, block + 20), second.is_in(part, block), "{part:?} {block}");
            }
        }
    }
}
