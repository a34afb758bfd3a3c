//! Noise that lasts, of a log in which effects may be: estimated beside them, so that it does not take up what is none.

use crate::candidates::{Instance, set_of};
use crate::coloured_noise::{self, Noise, SENSORS};
use crate::found::FoundEffect;
use crate::prepared_log::PreparedLog;
use crate::samples::ResidualChannel;
use crate::structure;
use crate::whitener::{Pass, Residual};

/// Puts noise that lasts, estimated beside effects, in the place of what there was; whether there is any.
pub fn take(log_data: &mut PreparedLog, beside: &[Instance], is_swell_kept: bool) -> Option<bool> {
    (log_data.own_scale, log_data.setup.colours) = (log_data.declared_scale, Vec::new());
    log_data.setup.noise = log_data.declared_noise;
    let noise = estimate(log_data, beside, is_swell_kept)?;
    if noise.is_empty() {
        return Some(false);
    }
    log_data.setup.scale = log_data.own_scale;
    noise.iter().for_each(|noise| noise.apply(&mut log_data.setup));
    log_data.own_scale = log_data.setup.scale;
    log_data.noise_beside = beside.iter().map(|instance| instance.candidate.effect).collect();
    // Against noise as it is the timing of the inputs shows better. A lag takes up half a sample of it.
    let is_late = beside.iter().any(|instance| instance.candidate.is_lag());
    if is_late || !log_data.retime(beside)? {
        log_data.declared = log_data.pass(&log_data.scope.declared, &[])?;
    }
    log_data.event_times_s.extend(jumps(&log_data.declared));
    Some(true)
}

/// The noise that lasts, beside what was found and terms in no catalogue, so that it does not take up what is none; that of
/// ranges and fixes beside that of the vehicle's own sensors.
fn estimate(log_data: &PreparedLog, beside: &[Instance], is_swell: bool) -> Option<Vec<Noise>> {
    let kept: &[ResidualChannel] = if is_swell { &MOVED_BY_WAVES } else { &[] };
    let left = structure::find(log_data, beside, is_swell)?;
    let mut found: Vec<Noise> = Vec::new();
    for sensors in &SENSORS {
        let mut first = log_data.first(sensors.longest_s)?;
        first.setup.proposed = left.hints.iter().map(|hint| (hint.generic, hint.value)).collect();
        found.iter().for_each(|noise| noise.apply(&mut first.setup));
        found.extend(coloured_noise::estimate(&first, &set_of(&first.scope.declared, beside), sensors, kept));
    }
    Some(found)
}

/// Times at which a sensor that may slip reads what no motion and no noise makes, s: a step that is a second late misses a
/// jump of a good compass altogether.
fn jumps(pass: &Pass) -> Vec<f64> {
    const SIGMAS: f64 = 5.0;
    const MOST: usize = 2;
    const APART_S: f64 = 5.0;
    let of = |channel: &ResidualChannel| {
        let all = pass.residuals.iter().filter(|r| r.channel == *channel && r.normalised().abs() > SIGMAS);
        let mut largest: Vec<&Residual> = all.collect();
        largest.sort_by(|a, b| b.normalised().abs().total_cmp(&a.normalised().abs()));
        let mut times: Vec<f64> = Vec::new();
        for residual in largest {
            if times.len() < MOST && times.iter().all(|t_s| (t_s - residual.t_s).abs() > APART_S) {
                times.push(residual.t_s);
            }
        }
        times
    };
    SLIPPING.iter().flat_map(of).collect()
}

/// Channels of sensors that may slip in their mount.
const SLIPPING: [ResidualChannel; 4] =
    [ResidualChannel::Heading, ResidualChannel::Pitch, ResidualChannel::DvlU, ResidualChannel::DvlV];

pub fn has_waves(noise_effects: &[FoundEffect]) -> bool {
    noise_effects.iter().any(|found| found.instance.candidate.effect == "waves")
}

/// Channels that swing in waves.
const MOVED_BY_WAVES: [ResidualChannel; 4] =
    [ResidualChannel::DvlU, ResidualChannel::DvlV, ResidualChannel::DvlW, ResidualChannel::Depth];
