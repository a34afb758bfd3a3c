//! Scores before and after on the data that judge.

use super::layout::Layout;
use super::model::{LogModel, Row, Unexplained};
use crate::samples::ResidualChannel;
use crate::scores::{HORIZONS_S, PREDICTED, Scores, Whiteness, max_autocorrelation, whiteness_p};
use crate::split::DataPart;
use crate::statistics;
use crate::whitener::Pass;
use backseat_logs::stats::{autocorrelation, rms};

/// Lags of the whiteness test.
const LAGS: usize = 20;

/// Scores of rows and their pass.
pub(super) fn scores(model: &impl LogModel, layout: &Layout, pass: &Pass, rows: &[Row]) -> Scores {
    let measures = model.measures(rows, layout);
    let judged = |errors: &[(f64, f64)]| rms_where(errors, |t_s| layout.is_judged(t_s));
    // Share of the variance about the mean.
    let share = |of: &Unexplained| {
        let judged: Vec<_> = of.values.iter().filter(|(t_s, ..)| layout.is_judged(*t_s)).collect();
        let mean = judged.iter().map(|(.., measured)| measured).sum::<f64>() / judged.len().max(1) as f64;
        let all: f64 = judged.iter().map(|(.., measured)| (measured - mean).powi(2)).sum();
        let left: f64 = judged.iter().map(|(_, residual, _)| residual.powi(2)).sum();
        (all > 0.0).then_some((of.name, left / all))
    };
    let unexplained_variance = measures.unexplained.iter().filter_map(share).collect();
    let whiteness = whiteness(layout, pass);
    let position_rmse_m = judged(&measures.position);
    Scores {
        velocity_rmse_mps: judged(&measures.velocity),
        position_rmse_m,
        position_against: measures.against.filter(|_| position_rmse_m.is_some()),
        innovation_whiteness_p: whiteness_p(&whiteness),
        max_autocorrelation: max_autocorrelation(&whiteness),
        whiteness,
        prediction: vec![[None; HORIZONS_S.len()]; PREDICTED.len()],
        position_errors: measures.position,
        track: Vec::new(),
        unexplained_variance,
    }
}

/// Root mean square of the errors at some times.
fn rms_where(errors: &[(f64, f64)], choose: impl Fn(f64) -> bool) -> Option<f64> {
    let of = errors.iter().filter(|(t_s, error)| error.is_finite() && choose(*t_s));
    rms(&of.map(|(_, error)| *error).collect::<Vec<_>>())
}

/// Whiteness of each channel on the data that judge.
fn whiteness(layout: &Layout, pass: &Pass) -> Vec<Whiteness> {
    let of = |channel: ResidualChannel| {
        // Run by run, so that neither their order nor what lies between them counts.
        let mut runs: Vec<(usize, Vec<f64>)> = Vec::new();
        for r in pass.residuals.iter().filter(|r| r.channel == channel && layout.is_judged(r.t_s)) {
            let run = layout.run(r.t_s);
            match runs.last_mut() {
                Some((last, e)) if *last == run => e.push(r.normalised()),
                _ => runs.push((run, vec![r.normalised()])),
            }
        }
        let count: usize = runs.iter().map(|(_, e)| e.len()).sum();
        let power = |e: &[f64]| e.iter().map(|e| e * e).sum::<f64>();
        let all: f64 = runs.iter().map(|(_, e)| power(e)).sum();
        let nis = all / count as f64;
        let mut correlation = vec![0.0; LAGS.min(count / 4)];
        for (_, e) in &runs {
            for (sum, own) in correlation.iter_mut().zip(autocorrelation(e, LAGS)) {
                *sum += own * power(e) / all.max(f64::MIN_POSITIVE);
            }
        }
        let (p, colour) = statistics::whiteness(&correlation, count);
        (count > 8).then_some(Whiteness { channel, count, nis, p, colour, correlation })
    };
    ResidualChannel::ALL.into_iter().filter_map(of).collect()
}

/// The forecast's part of the figures.
pub(super) fn forecast_note(model: &impl LogModel, layout: &Layout, rows: [&[Row]; 2]) -> Option<String> {
    let is_forecast = |t_s: f64| layout.is_in(DataPart::Forecast, layout.block(t_s));
    let of = |rows: &[Row]| {
        let measures = model.measures(rows, layout);
        let left = |errors: &[(f64, f64)]| rms_where(errors, is_forecast);
        left(&measures.position).map(|m| (m, "m")).or_else(|| left(&measures.velocity).map(|mps| (mps, "m/s")))
    };
    let (before, unit) = of(rows[0])?;
    let (after, _) = of(rows[1])?;
    Some(format!("of these the forecast, the end of each run: {before:.3} -> {after:.3} {unit}"))
}
