//! Logs without fins and propeller: dead reckoning on logged heading and speed against GNSS.
//!
//! The plainest model that such a log supports says that between two fixes the vehicle moved along its heading by its
//! speed. What the fixes show beyond that is regressed on a current, a compass error, a speed scale and (with a DVL) a
//! misalignment. Fixes half a minute apart are compared, so that their noise (declared, or what their second
//! differences show) stays small against the way between them.

use crate::bench::{BLOCK_S, Bench, Part};
use crate::candidates::{Candidate, Hypothesis, Instance, Scope};
use crate::diagnosis::{Diagnosis, Found, Value, Verdict};
use crate::gram::{Normal, NormalBuilder};
use crate::linear;
use crate::rivals::{Rival, manoeuvre};
use crate::samples::{Channel, Samples};
use crate::scores::whiteness;
use crate::search::{self, Round};
use crate::statistics::chi2_tail;
use crate::structure::Structure;
use crate::whitener::{Pass, Residual, Setup};
use backseat_core::effects::{EffectSet, ParameterKind};
use backseat_core::navigation::SurfaceNoise;
use backseat_data::log::Column;
use backseat_data::stats::{Z_95, mean_ci95, median};
use backseat_data::{Log, VehicleFile};

/// Time between the fixes compared, s: one row of the regression a block and axis.
const APART_S: f64 = BLOCK_S;
/// A gap in heading or speed longer than this ends a stretch, s.
const LONGEST_GAP_S: f64 = 5.0;

/// Probability of the remaining residuals under whiteness below which they have structure.
const STRUCTURE: f64 = 1e-4;

/// Columns: current north, east; heading constant, sine, cosine; speed scale; DVL yaw.
const COLUMNS: usize = 7;

/// One stretch between two fixes: what dead reckoning lacks, and how that moves with each column.
struct Stretch {
    t_s: f64,
    missing_m: [f64; 2],
    slopes: [[f64; COLUMNS]; 2],
}

/// Diagnoses a log on heading and speed alone; `None` if it has too few fixes, headings or speeds.
#[must_use]
pub fn run(log: &Log, vehicle: &VehicleFile) -> Option<(Bench, Diagnosis)> {
    let has_dvl = log.has(Column::DvlU) && log.has(Column::DvlV);
    let stretches = stretches(log, has_dvl);
    if stretches.len() < 12 {
        return None;
    }
    let sigma_m = sigma(&stretches).max(vehicle.sensors.gnss_m * 2.0_f64.sqrt() * 0.2);
    let pass_of = |theta: &[f64; COLUMNS]| pass(&stretches, sigma_m, theta);
    let declared = pass_of(&[0.0; COLUMNS]);
    let mut present = [false; Channel::COUNT];
    present[Channel::GnssX as usize] = true;
    let samples = Samples { duration_s: log.duration_s(), ..Samples::default() };
    let scope = Scope { present, has_density: false, duration_s: samples.duration_s, declared: EffectSet::NONE };
    let bench = Bench {
        setup: Setup {
            parameters: vehicle.parameters,
            noise: vehicle.noise,
            surface: SurfaceNoise::DYNAMIC,
            sensors: vehicle.sensors,
            ship_transducer_depth_m: 0.0,
            scale: [1.0; Channel::COUNT],
            outliers: Vec::new(),
            block_s: BLOCK_S,
        },
        samples,
        scope,
        own_scale: [1.0; Channel::COUNT],
        declared: declared.clone(),
    };
    let hypotheses = hypotheses(has_dvl);
    let (mut chosen, mut rounds): (Vec<Hypothesis>, Vec<Round>) = (Vec::new(), Vec::new());
    loop {
        let left: Vec<Hypothesis> = hypotheses.iter().filter(|h| !chosen.contains(h)).cloned().collect();
        let nuisance: Vec<usize> = chosen.iter().flat_map(|h| h.free.clone()).collect();
        let round = search::judge(&bench, &declared, &left, &nuisance);
        let best = round.ladder.iter().find(|e| round.is_significant(e)).map(|e| e.instance.candidate);
        rounds.push(round);
        match best.and_then(|best| left.into_iter().find(|h| h.candidate == best)) {
            Some(hypothesis) => chosen.push(hypothesis),
            None => break,
        }
    }
    let (effects, theta) = describe(&bench, &declared, &chosen, &hypotheses, &rounds)?;
    let is_ambiguous = effects.iter().any(|found| found.rivals.iter().any(Rival::is_possible));
    let after = pass_of(&theta);
    let is_left = whiteness(&bench, &after).iter().any(|w| w.p < STRUCTURE);
    let verdict = match effects.is_empty() {
        _ if is_left => Verdict::Unexplained,
        true => Verdict::None,
        false if is_ambiguous => Verdict::Ambiguous,
        false => Verdict::Explained,
    };
    let notes = vec![
        "no fins and propeller in the log: dead reckoning on logged heading and speed is taken as the declared model, \
         and only what moves the horizontal position can be judged (a current, the compass, the speed)"
            .to_owned(),
        format!("a stretch of {APART_S:.0} s between fixes is taken as good to {sigma_m:.2} m, from its own scatter"),
        "a vehicle at the surface is moved by wind and waves too: a current found there is what moves the vehicle, \
         whatever it is"
            .to_owned(),
    ];
    let diagnosis =
        Diagnosis { verdict, effects, rounds, structure: Structure::default(), before: declared, after, notes };
    Some((bench, diagnosis))
}

fn hypotheses(has_dvl: bool) -> Vec<Hypothesis> {
    let entry = |effect, free: &[usize]| Hypothesis {
        candidate: Candidate { effect, fin: None, onset_s: None },
        free: free.to_vec(),
        fixed: Vec::new(),
    };
    let mut all = vec![entry("water_current", &[0, 1]), entry("heading_bias", &[2, 3, 4]), entry("dvl_scale", &[5])];
    if has_dvl {
        all.push(entry("dvl_misalignment", &[6]));
    }
    all
}

/// Walks over the log and closes a stretch at the first fix that is far enough in time.
fn stretches(log: &Log, has_dvl: bool) -> Vec<Stretch> {
    let start_us = log.rows.first().map_or(0, |row| row.time_us);
    let (mut heading, mut fix): (Option<f64>, Option<(f64, [f64; 2])>) = (None, None);
    let mut last: Option<(f64, [f64; 2])> = None;
    let (mut moved, mut slopes) = ([0.0; 2], [[0.0; COLUMNS]; 2]);
    let mut found = Vec::new();
    for row in &log.rows {
        let t_s = (row.time_us - start_us) as f64 * 1e-6;
        heading = row.get(Column::Heading).or(heading);
        let body = if has_dvl {
            row.get(Column::DvlU).zip(row.get(Column::DvlV)).map(|(u, v)| [u, v])
        } else {
            row.get(Column::SpeedLog).map(|speed| [speed, 0.0])
        };
        if let (Some(body), Some(psi)) = (body, heading) {
            if let Some((before_s, before)) = last {
                let dt = t_s - before_s;
                if dt > LONGEST_GAP_S {
                    fix = None;
                } else {
                    let [u, v] = [0, 1].map(|axis| 0.5 * (before[axis] + body[axis]));
                    let (sin, cos) = psi.sin_cos();
                    let along = [u * cos - v * sin, u * sin + v * cos];
                    let across = [-along[1], along[0]];
                    for axis in 0..2 {
                        moved[axis] += along[axis] * dt;
                        let by = &mut slopes[axis];
                        by[axis] += dt;
                        // True heading is measured less bias: the way turns back by it.
                        for (column, factor) in [(2, 1.0), (3, sin), (4, cos)] {
                            by[column] -= factor * across[axis] * dt;
                        }
                        by[5] -= along[axis] * dt;
                        // v_measured = Rz(yaw)ᵀ v: the true velocity is turned by yaw.
                        by[6] += across[axis] * dt;
                    }
                }
            }
            last = Some((t_s, body));
        }
        let Some(now) = row.gnss_m().filter(|_| last.is_some_and(|(at_s, _)| t_s - at_s < LONGEST_GAP_S)) else {
            continue;
        };
        match fix {
            Some((fix_s, _)) if t_s - fix_s < APART_S => continue,
            Some((_, before)) => {
                let missing_m = [0, 1].map(|axis| now[axis] - before[axis] - moved[axis]);
                found.push(Stretch { t_s, missing_m, slopes });
            }
            None => {}
        }
        fix = Some((t_s, now));
        (moved, slopes) = ([0.0; 2], [[0.0; COLUMNS]; 2]);
    }
    found
}

/// Scatter of a stretch, by differences of neighbours: whatever is slow does not count.
fn sigma(stretches: &[Stretch]) -> f64 {
    let jumps: Vec<f64> = stretches
        .windows(2)
        .flat_map(|w| [0, 1].map(|axis| ((w[1].missing_m[axis] - w[0].missing_m[axis]) / 2.0_f64.sqrt()).abs()))
        .collect();
    1.482_602 * median(&jumps).unwrap_or(1.0)
}

fn pass(stretches: &[Stretch], sigma_m: f64, theta: &[f64; COLUMNS]) -> Pass {
    let mut residuals = Vec::new();
    let mut blocks = Vec::new();
    rayon::in_place_scope(|scope| {
        let mut builder = NormalBuilder::new(COLUMNS, BLOCK_S, scope);
        for stretch in stretches {
            for (axis, channel) in [Channel::GnssX, Channel::GnssY].into_iter().enumerate() {
                let slopes = &stretch.slopes[axis];
                let known: f64 = slopes.iter().zip(theta).map(|(slope, value)| slope * value).sum();
                let innovation = stretch.missing_m[axis] - known;
                residuals.push(Residual { t_s: stretch.t_s, channel, innovation, sigma: sigma_m, used: true });
                builder.row(stretch.t_s, innovation / sigma_m, slopes, -1.0 / sigma_m);
            }
        }
        blocks = builder.finish();
    });
    Pass { residuals, trace: Vec::new(), normal: Normal::collect(COLUMNS, blocks) }
}

/// Values on the training blocks, rivals on all of them.
fn describe(
    bench: &Bench,
    pass: &Pass,
    chosen: &[Hypothesis],
    all: &[Hypothesis],
    rounds: &[Round],
) -> Option<(Vec<Found>, [f64; COLUMNS])> {
    let sum = |part| pass.normal.sum(|block| bench.is_in(part, block));
    let (train, held, whole) = (sum(Part::Train), sum(Part::Held), sum(Part::Whole));
    let free: Vec<usize> = chosen.iter().flat_map(|h| h.free.clone()).collect();
    let mut theta = [0.0; COLUMNS];
    if free.is_empty() {
        return Some((Vec::new(), theta));
    }
    let fit = linear::fit(&train, &free, &[])?;
    let sigmas = linear::sigmas(&pass.normal, |block| bench.is_in(Part::Train, block), &free, &fit, &[]);
    for (column, value) in free.iter().zip(&fit.theta) {
        theta[*column] = *value;
    }
    let tried = rounds.first().map_or(1, |round| round.tried) as f64;
    let mut effects = Vec::new();
    for hypothesis in chosen {
        let others: Vec<usize> = free.iter().copied().filter(|column| !hypothesis.free.contains(column)).collect();
        let base = linear::fit(&whole, &others, &[]).map_or(0.0, |fit| fit.gain);
        let gain = linear::fit(&whole, &free, &[])?.gain - base;
        let values: Vec<Value> = hypothesis
            .candidate
            .info()
            .parameters
            .iter()
            .zip(&hypothesis.free)
            .map(|(parameter, column)| {
                let place = free.iter().position(|c| c == column).unwrap_or(0);
                let half = Z_95 * sigmas[place];
                let value = theta[*column];
                let ci95 = [value - half, value + half];
                Value { name: parameter.name, unit: parameter.unit, kind: ParameterKind::Size, value, ci95 }
            })
            .collect();
        let blocks: Vec<f64> = pass
            .normal
            .blocks
            .iter()
            .enumerate()
            .filter(|(index, block)| bench.is_in(Part::Held, *index) && block.count > 0)
            .map(|(_, block)| linear::gain_of(block, &free, &fit.theta, &[]))
            .collect();
        let held_gain = mean_ci95(&blocks)
            .map(|(low, high)| (linear::gain_of(&held, &free, &fit.theta, &[]) / blocks.len() as f64, [low, high]));
        let mut rivals = Vec::new();
        for rival in all.iter().filter(|h| !chosen.contains(h)) {
            let columns: Vec<usize> = others.iter().chain(&rival.free).copied().collect();
            let Some(alone) = linear::fit(&whole, &columns, &[]) else { continue };
            let both: Vec<usize> = columns.iter().chain(&hypothesis.free).copied().collect();
            let Some(together) = linear::fit(&whole, &both, &[]) else { continue };
            let (inflation, count) = linear::inflation(&pass.normal, |_| true, &both, &together, &[]);
            let p = search::tail(together.gain - alone.gain, inflation, count, hypothesis.candidate.degrees());
            let sizes = alone.theta[others.len()..].to_vec();
            rivals.push(Rival {
                instance: Instance { candidate: rival.candidate, sizes },
                deficit: gain + base - alone.gain,
                p,
                separating_manoeuvre: manoeuvre(&hypothesis.candidate, &rival.candidate),
            });
        }
        rivals.sort_by(|a, b| a.deficit.total_cmp(&b.deficit));
        // A DVL's pitch is not seen from above.
        let mut sizes: Vec<f64> = hypothesis.free.iter().map(|column| theta[*column]).collect();
        sizes.resize(hypothesis.candidate.bounds().len(), 0.0);
        // The vehicle file takes what is plausible; what was found stands in the values.
        for (size, [low, high]) in sizes.iter_mut().zip(hypothesis.candidate.bounds()) {
            *size = size.clamp(low, high);
        }
        let instance = Instance { candidate: hypothesis.candidate, sizes };
        let p_value = (chi2_tail(gain, hypothesis.candidate.degrees()) * tried).min(1.0);
        effects.push(Found { instance, values, p_value, gain, held_gain, rivals });
    }
    Some((effects, theta))
}
