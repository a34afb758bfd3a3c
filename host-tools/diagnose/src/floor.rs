//! The floor under a verdict: what is left on data that judges, beside what the sensors can make.

use crate::diagnosis::Diagnosis;
use crate::prepared_log::{DataPart, PreparedLog};
use crate::remaining::Remaining;
use crate::samples::ResidualChannel;
use crate::scores::Scores;
use crate::whitener::Pass;
use backseat_logs::plausible_noise::{Carrier, most_position_error_m};
use backseat_logs::stats::rms;

/// Blocks that judge, below which nothing is said.
pub const FEWEST_JUDGED: usize = 3;

/// A log of which more than this share of the largest position error is left is not explained. Of clean logs of two
/// simulators that share nothing with ours none leaves more than 0.27.
const ORDINARY_SHARE: f64 = 0.5;

/// Puts the floor under the verdict on a log of the vehicle's dynamics; `scores` are those of the model that is proposed,
/// effects and terms included.
#[must_use]
pub fn under(mut diagnosis: Diagnosis, log_data: &PreparedLog, scores: &Scores) -> Diagnosis {
    let pass = diagnosis.with_terms.as_ref().unwrap_or(&diagnosis.after);
    let judged = |(index, block): (usize, &crate::normal_equations::NormalEquations)| {
        log_data.is_in(DataPart::Judge, index) && block.count > 0
    };
    let blocks = pass.normal.blocks.iter().enumerate().filter(|block| judged(*block)).count();
    let position = position(log_data, pass, scores);
    diagnosis.conditions.much_is_left =
        position.as_ref().is_some_and(|position| position.left > ORDINARY_SHARE * position.most);
    let remaining = position.into_iter().chain(channels(log_data, pass)).collect();
    diagnosis.held_to(remaining, blocks < FEWEST_JUDGED)
}

/// Innovations of each channel that waves do not move, beside the filter's own uncertainty and the largest plausible noise
/// of its sensor: what a hull does in waves differs from one surfacing to the next, and is no sensor's error.
fn channels(log_data: &PreparedLog, pass: &Pass) -> Vec<Remaining> {
    let of = |channel: ResidualChannel| {
        let most = channel.sensor().most(&log_data.setup.sensors);
        let own = pass.telling().filter(|r| r.channel == channel);
        let judged: Vec<_> = own.filter(|r| log_data.split.is_at(DataPart::Judge, r.t_s)).collect();
        let left = rms(&judged.iter().map(|r| r.innovation).collect::<Vec<_>>())?;
        let most = rms(&judged.iter().map(|r| r.sigma.hypot(most)).collect::<Vec<_>>())?;
        Some(Remaining { what: format!("{} innovation", channel.name()), unit: channel.unit(), left, most })
    };
    ResidualChannel::ALL.into_iter().filter_map(of).collect()
}

/// The flight filter's position, beside what drifts between the fixes that it was given.
fn position(log_data: &PreparedLog, pass: &Pass, scores: &Scores) -> Option<Remaining> {
    /// Ranges that make a fix: two that cross, each twice for the geometry.
    const RANGES_A_FIX: f64 = 4.0;
    let present = &log_data.scope.present;
    let carrier = if present[ResidualChannel::DvlU as usize] { Carrier::BottomTrack } else { Carrier::WaterSpeed };
    let runs = distances_run(pass);
    let total_m = runs.last()?.1;
    let of = |channel| pass.residuals.iter().filter(|r| r.channel == channel && r.used).count() as f64;
    // a USBL makes a fix by itself
    let ranges = of(ResidualChannel::Range) + RANGES_A_FIX * of(ResidualChannel::UsblAlong);
    let between_fixes_m = if ranges > 0.0 { RANGES_A_FIX * total_m / ranges } else { total_m };
    let judged = scores.position_errors.iter().filter(|(t_s, _)| log_data.is_judged(*t_s));
    let (mut left, mut most) = (Vec::new(), Vec::new());
    for (t_s, error_m) in judged {
        let at = runs.partition_point(|(run_s, _)| run_s <= t_s);
        let run_m = at.checked_sub(1).map_or(0.0, |at| runs[at].1);
        left.push(*error_m);
        most.push(most_position_error_m(carrier, run_m.min(between_fixes_m), &log_data.setup.sensors));
    }
    Some(Remaining { what: "position error".to_owned(), unit: "m", left: rms(&left)?, most: rms(&most)? })
}

/// Time in s and distance run since the filter started, m.
fn distances_run(pass: &Pass) -> Vec<(f64, f64)> {
    let mut run_m = 0.0;
    let mut last = None;
    let step = |trace: &crate::whitener::Trace| {
        let [north_m, east_m] = [trace.x[0], trace.x[1]];
        if let Some([north, east]) = last.replace([north_m, east_m]) {
            run_m += f64::hypot(north_m - north, east_m - east);
        }
        (trace.t_s, run_m)
    };
    pass.trace.iter().map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_figure_in_words() {
        let remaining = Remaining { what: "position error".to_owned(), unit: "m", left: 87.0, most: 12.0 };
        assert!(remaining.is_beyond());
        assert_eq!(remaining.describe(), "position error of 87 m, where the sensors make at most 12 m");
    }
}
