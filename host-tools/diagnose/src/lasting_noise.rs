//! Noise that lasts, of a log in which effects may be: estimated beside them, so that it does not take up what is none.

use crate::candidates::{Instance, set_of};
use crate::coloured_noise::{self, Noise, SENSORS};
use crate::found::FoundEffect;
use crate::prepared_log::{DataPart, PreparedLog};
use crate::samples::ResidualChannel;
use crate::split::Split;
use crate::structure;
use crate::whitener::{self, Pass, Residual};

/// Puts noise that lasts, estimated beside effects, in the place of what there was; whether there is any.
pub fn take(log_data: &mut PreparedLog, beside: &[Instance], is_swell_kept: bool) -> Option<bool> {
    let kept: &[ResidualChannel] = if is_swell_kept { &MOVED_BY_WAVES } else { &[] };
    begin_as_declared(log_data, kept);
    let noise = estimate(log_data, beside, kept)?;
    if noise.is_empty() {
        return Some(false);
    }
    log_data.setup.scale = log_data.own_scale;
    noise.iter().for_each(|noise| noise.apply(&mut log_data.setup));
    log_data.own_scale = log_data.setup.scale;
    log_data.setup.swing = swing(log_data, beside)?;
    log_data.noise_beside = beside.iter().map(|instance| instance.candidate.effect).collect();
    // Against noise as it is the timing of the inputs shows better. A lag takes up half a sample of it.
    let is_late = beside.iter().any(|instance| instance.candidate.is_lag());
    if is_late || !log_data.retime(beside)? {
        log_data.declared = log_data.pass(&log_data.scope.declared, &[])?;
    }
    log_data.event_times_s.extend(jumps(&log_data.declared));
    Some(true)
}

/// By how much the readings that waves move err more than the others: what waves do is no evidence of an effect.
fn swing(log_data: &PreparedLog, beside: &[Instance]) -> Option<[f64; ResidualChannel::COUNT]> {
    const FEWEST: usize = 30;
    // With the first the filter follows waves less, and errs more.
    const ROUNDS: usize = 3;
    let mut setup = log_data.setup.clone();
    for _ in 0..ROUNDS {
        let pass = whitener::run(&setup, &log_data.samples, &set_of(&log_data.scope.declared, beside), &[])?;
        let moved = |r: &&Residual| r.used && r.is_moved_by_waves && log_data.split.is_at(DataPart::Seen, r.t_s);
        let mut sums = [(0, 0.0); ResidualChannel::COUNT];
        for r in pass.residuals.iter().filter(moved) {
            let (count, square) = &mut sums[r.channel as usize];
            (*count, *square) = (*count + 1, *square + r.normalised().powi(2));
        }
        for (swing, (count, square)) in setup.swing.iter_mut().zip(sums).filter(|(_, (count, _))| *count >= FEWEST) {
            *swing = (*swing * (square / count as f64).sqrt()).max(1.0);
        }
    }
    Some(setup.swing)
}

/// What was estimated before, beside other effects, is no beginning: a search from its white part does not come far.
fn begin_as_declared(log_data: &mut PreparedLog, kept: &[ResidualChannel]) {
    (log_data.own_scale, log_data.setup.colours) = (log_data.declared_scale, Vec::new());
    (log_data.setup.noise, log_data.setup.surface) = log_data.declared_noise;
    log_data.setup.swing = [1.0; ResidualChannel::COUNT];
    for channel in ResidualChannel::ALL.into_iter().filter(|channel| !kept.contains(channel)) {
        log_data.setup.scale[channel as usize] = log_data.declared_scale[channel as usize];
    }
}

/// The noise that lasts, beside what was found and terms in no catalogue, so that it does not take up what is none; that of
/// ranges and fixes beside that of the vehicle's own sensors.
fn estimate(log_data: &PreparedLog, beside: &[Instance], kept: &[ResidualChannel]) -> Option<Vec<Noise>> {
    let left = structure::find(log_data, beside, !kept.is_empty())?;
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

/// Jumps of a sensor that may slip which no effect accounts for, each in a sentence: readings one behind the other that no
/// noise makes, and that are off to the same side.
pub fn jumps_left(pass: &Pass, split: &Split) -> Vec<String> {
    const SIGMAS: f64 = 8.0;
    let of = |channel: &ResidualChannel| {
        let own: Vec<&Residual> =
            pass.residuals.iter().filter(|r| r.channel == *channel && r.used && !r.is_moved_by_waves).collect();
        let is_jump = |pair: &&[&Residual]| {
            let off = [pair[0].normalised(), pair[1].normalised()];
            off.iter().all(|e| e.abs() > SIGMAS) && off[0] * off[1] > 0.0 && !split.is_unjudged(pair[0].t_s)
        };
        own.windows(2).find(is_jump).map(|pair| {
            let (name, unit, minute) = (channel.name(), channel.unit(), pair[0].t_s / 60.0);
            let (size, sigmas) = (pair[0].innovation, pair[0].normalised());
            format!(
                "{name} jumps by {size:.3} {unit} ({sigmas:.0} sigmas) in minute {minute:.1}: no effect accounts for it"
            )
        })
    };
    SLIPPING.iter().filter_map(of).collect()
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

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_logs::VehicleFile;
    use hil_sim::dataset::{self, Spec};
    use hil_sim::noise::NoiseKind;

    /// A heading that jumps is told; a lone reading that is off, one that waves move, and the onset of what is named are not.
    #[test]
    fn a_jump_that_no_effect_accounts_for_is_told() {
        let pass = |innovations: [f64; 4], is_moved_by_waves| {
            let residual = |(k, innovation): (usize, f64)| Residual {
                t_s: 600.0 + 0.1 * k as f64,
                channel: ResidualChannel::Heading,
                innovation,
                sigma: 0.002,
                alike: 1.0,
                used: true,
                station: None,
                is_moved_by_waves,
            };
            Pass { residuals: innovations.into_iter().enumerate().map(residual).collect(), ..Pass::default() }
        };
        let jump = [0.001, -0.03, -0.02, -0.004];
        let mut split = Split::of_one_run(1200.0, 20.0, 0.1);
        let told = jumps_left(&pass(jump, false), &split);
        assert_eq!(told, ["heading jumps by -0.030 rad (-15 sigmas) in minute 10.0: no effect accounts for it"]);
        assert!(jumps_left(&pass([0.001, -0.03, 0.002, 0.03], false), &split).is_empty());
        assert!(jumps_left(&pass(jump, true), &split).is_empty());
        split.except(vec![[570.0, 590.0]]);
        assert!(jumps_left(&pass(jump, false), &split).is_empty());
    }

    /// What was found before is no part of what is found.
    #[test]
    fn noise_that_is_estimated_again_is_the_same() {
        let mut spec = Spec::new(VehicleFile::reference());
        (spec.noise, spec.duration_s) = (NoiseKind::Mixed, 900.0);
        let log = dataset::simulate(&spec, 116).log;
        let mut log_data = PreparedLog::new(&log, &VehicleFile::reference(), true).unwrap();
        let [first, second] = [(); 2].map(|()| {
            assert_eq!(take(&mut log_data, &[], false), Some(true));
            let setup = &log_data.setup;
            (setup.scale, setup.colours.clone(), setup.noise, setup.surface)
        });
        assert_eq!(first, second);
    }
}
