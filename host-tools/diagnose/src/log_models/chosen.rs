//! What the search for effects has come to, and its fit.

use super::evidence::columns;
use super::fit::Fitting;
use super::model::LogModel;
use crate::candidates::Hypothesis;
use crate::normal_equations::Column;
use crate::split::DataPart;

/// Entries that were significant and yet are no explanation, with the reason.
pub(super) type Refused = (&'static str, String);

/// What the search for effects has come to.
pub(super) struct Chosen {
    pub hypotheses: Vec<Hypothesis>,
    pub theta: Vec<f64>,
    pub refused: Vec<Refused>,
}

/// Fits what is chosen; the rest is zero.
pub(super) fn refit<M: LogModel>(fitting: &Fitting<'_, M>, chosen: &[Hypothesis], from: &[f64]) -> Option<Vec<f64>> {
    let free: Vec<usize> =
        fitting.model.calibrated().into_iter().chain(chosen.iter().flat_map(|h| h.free.clone())).collect();
    let guess = fitting.model.guess();
    let start: Vec<f64> = (0..from.len())
        .map(|column| match (free.contains(&column), from[column] != 0.0) {
            (true, true) => from[column],
            (true, false) => guess[column],
            (false, _) => 0.0,
        })
        .collect();
    fitting.solve(&free, &start, DataPart::Seen)
}

/// Columns free with all chosen but one.
pub(super) fn free(calibrated: &[Column], chosen: &[Hypothesis], but: Option<usize>) -> Vec<Column> {
    let rest = chosen.iter().enumerate().filter(|(place, _)| Some(*place) != but).flat_map(|(_, h)| columns(&h.free));
    calibrated.iter().copied().chain(rest).collect()
}
