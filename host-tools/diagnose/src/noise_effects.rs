//! Effects that are noise and not motion: ranges that are wrong now and then, and waves.

use crate::candidates::{Candidate, Instance};
use crate::found::{FoundEffect, ParameterEstimate};
use crate::noise;
use crate::prepared_log::{DataPart, PreparedLog};
use crate::samples::ResidualChannel;
use crate::selection::FAMILY_ERROR;
use crate::waves;
use crate::whitener::Residual;
use backseat_logs::stats::{Z_95, wilson_ci95};

/// Outliers and waves in the innovations of a pass, where nothing judges; what is found changes the log's noise.
pub fn noise_effects(log_data: &mut PreparedLog, residuals: &[Residual]) -> Option<Vec<FoundEffect>> {
    let mut found = Vec::new();
    let before = (log_data.setup.outliers.clone(), log_data.setup.scale);
    log_data.setup.scale = log_data.own_scale;
    let outliers = noise::outliers(residuals, &log_data.split);
    let flags = noise::flags(&log_data.samples, &outliers);
    if flags.contains(&true) || log_data.setup.outliers.contains(&true) {
        log_data.setup.outliers = flags;
    }
    let is_seen = |t_s: f64| log_data.split.is_at(DataPart::Seen, t_s);
    let seen: Vec<bool> = outliers.iter().filter(|(t_s, _)| is_seen(*t_s)).map(|(_, is_out)| *is_out).collect();
    let hits = seen.iter().filter(|is_out| **is_out).count();
    let p_value = noise::outlier_tail(hits, seen.len());
    if p_value < FAMILY_ERROR / 10.0 {
        let share = hits as f64 / seen.len() as f64;
        let (low, high) = wilson_ci95(hits as u64, seen.len() as u64).unwrap_or((0.0, 1.0));
        found.push(noise_found("range_outliers", &[(share, [low, high])], p_value));
    }
    if let Some(waves) = waves::find(&log_data.samples, residuals, &log_data.split).filter(is_swell) {
        let interval = |value: f64, sigma: f64| (value, [value - Z_95 * sigma, value + Z_95 * sigma]);
        let sizes =
            [interval(waves.amplitude_mps, waves.amplitude_sigma_mps), interval(waves.period_s, waves.period_sigma_s)];
        let declared = log_data.setup.sensors.dvl_mps;
        let scale = (1.0 + 0.5 * (waves.amplitude_mps / declared).powi(2)).sqrt();
        for channel in [ResidualChannel::DvlU, ResidualChannel::DvlV, ResidualChannel::DvlW] {
            log_data.setup.scale[channel as usize] = log_data.setup.scale[channel as usize].max(scale);
        }
        // Carried up and down, the vehicle's depth swings as well.
        let swing_m = waves.amplitude_mps * waves.period_s / std::f64::consts::TAU;
        let depth = (1.0 + 0.5 * (swing_m / log_data.setup.sensors.depth_m).powi(2)).sqrt();
        let scale = &mut log_data.setup.scale[ResidualChannel::Depth as usize];
        *scale = scale.max(depth);
        found.push(noise_found("waves", &sizes, waves.p));
    }
    if before != (log_data.setup.outliers.clone(), log_data.setup.scale) {
        log_data.declared = log_data.pass(&log_data.scope.declared, &[])?;
    }
    Some(found)
}

/// A peak that is unlikely by chance, and an amplitude that the velocities themselves show.
fn is_swell(waves: &waves::Waves) -> bool {
    waves.p < FAMILY_ERROR / 10.0 && waves.amplitude_mps > 3.0 * waves.amplitude_sigma_mps
}

fn noise_found(effect: &'static str, sizes: &[(f64, [f64; 2])], p_value: f64) -> FoundEffect {
    let candidate = Candidate { effect, member: None, span: None };
    let parameters = candidate.info().parameters.iter().zip(sizes);
    let values = parameters
        .map(|(p, (value, ci95))| ParameterEstimate {
            name: p.name,
            unit: p.unit,
            kind: p.kind,
            value: *value,
            ci95: *ci95,
        })
        .collect();
    let sizes = sizes.iter().map(|(value, _)| *value).collect();
    FoundEffect {
        instance: Instance { candidate, sizes },
        values,
        p_value,
        gain: 0.0,
        held_gain: None,
        alternatives: Vec::new(),
    }
}
