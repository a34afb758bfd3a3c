//! Logs that a reduced model explains: the machinery that [`planar`](crate::planar), [`glide`](crate::glide) and
//! [`pings`](crate::pings) share.
//!
//! A reduced model predicts scalars (rows) from what was logged and a vector θ of the effects' sizes; it needs no filter.
//! Its residuals are taken as first-order Gauss-Markov noise whose scatter and memory the log itself shows where every
//! known column is fitted (wander of a receiver, waves, eddies): differencing neighbours by it whitens rows and slopes
//! alike. From there on all is as with the full model: hypotheses of the catalogue one by one on training blocks, judged
//! on held-out ones, forward selection, rivals; then columns without a name in the catalogue, to say what remains.

mod describe;
mod fit;

use crate::bench::{Bench, Part};
use crate::candidates::{Candidate, Hypothesis, Scope};
use crate::diagnosis::{Diagnosis, Verdict};
use crate::rivals::Rival;
use crate::samples::{Channel, Samples};
use crate::scores::{HORIZONS_S, PREDICTED, Scores, whiteness};
use crate::search::{self, MOST_EFFECTS, Round};
use crate::structure::{NamedTerm, Structure};
use crate::whitener::Setup;
use backseat_core::effects::EffectSet;
use backseat_core::navigation::SurfaceNoise;
use backseat_data::stats::rms;
use backseat_data::{Log, VehicleFile};
pub use fit::Noise;

/// Probability of the remaining residuals under whiteness below which they have structure.
const STRUCTURE: f64 = 1e-4;
/// Probability of a nameless column by chance, all of them counted, below which it is told.
const NAMELESS: f64 = 2e-3;
/// Blocks that a log must have for each number of an effect: fewer fit anything.
const BLOCKS_A_NUMBER: usize = 8;
/// Most nameless columns told.
const MOST_NAMELESS: usize = 3;

/// One scalar: what was read less what the model says, and how the model moves with θ.
#[derive(Clone, Debug)]
pub struct Row {
    /// Time since the log's start, s.
    pub t_s: f64,
    /// Which scalar.
    pub channel: Channel,
    /// Measured minus predicted, in the channel's unit.
    pub residual: f64,
    /// ∂predicted/∂θ.
    pub slopes: Vec<f64>,
}

/// An entry of the catalogue with the columns of θ that are its sizes.
pub type Entry = (&'static str, Vec<usize>);
/// Columns without a name in the catalogue, with what they stand for.
pub type Nameless = (&'static str, Vec<usize>);

/// A model of a log.
pub trait ReducedModel: Sync {
    /// Length of θ.
    fn columns(&self) -> usize;
    /// Rows at θ, in order of time within each channel.
    fn rows(&self, theta: &[f64]) -> Vec<Row>;
    /// Columns that every fit has: what the plain model leaves to be calibrated.
    fn calibrated(&self) -> Vec<usize>;
    /// What may be found.
    fn entries(&self) -> Vec<Entry>;
    /// What may be told of the rest.
    fn nameless(&self) -> Vec<Nameless>;
    /// Length of a block, s.
    fn block_s(&self) -> f64;
}

/// A diagnosis by a reduced model.
pub struct Reduced {
    /// The log made ready.
    pub bench: Bench,
    /// What was found.
    pub diagnosis: Diagnosis,
    /// θ of the plain model and with the effects.
    pub theta: [Vec<f64>; 2],
    /// One sigma of every column of θ with the effects; 0 where it was not fitted.
    pub sigmas: Vec<f64>,
    /// Noise taken, by channel.
    pub noise: Vec<Noise>,
}

/// Diagnoses a log by a reduced model; `None` where θ cannot be fitted at all.
#[must_use]
pub fn run(model: &impl ReducedModel, log: &Log, vehicle: &VehicleFile) -> Option<Reduced> {
    let mut bench = empty(log, vehicle, model.block_s());
    let calibrated = model.calibrated();
    let zero = vec![0.0; model.columns()];
    let noise = fit::noise(model, &bench, &calibrated)?;
    let plain = fit::solve(model, &bench, &noise, &calibrated, &zero, Part::Train)?;
    bench.declared = fit::pass(model, &noise, &plain);
    for residual in &bench.declared.residuals {
        bench.scope.present[residual.channel as usize] = true;
    }
    let hypotheses: Vec<Hypothesis> =
        model.entries().into_iter().map(|(effect, free)| hypothesis(effect, free)).collect();
    let (mut chosen, mut rounds): (Vec<Hypothesis>, Vec<Round>) = (Vec::new(), Vec::new());
    let mut theta = plain.clone();
    let blocks = bench.declared.normal.blocks.iter().filter(|block| block.count > 0).count();
    while chosen.len() < MOST_EFFECTS {
        let left: Vec<Hypothesis> = hypotheses.iter().filter(|h| !chosen.contains(h)).cloned().collect();
        let round = search::judge(&bench, &fit::pass(model, &noise, &theta), &left, &free(&calibrated, &chosen));
        let fitted: usize = chosen.iter().map(|h| h.free.len()).sum();
        let most = (blocks / BLOCKS_A_NUMBER).saturating_sub(fitted);
        let stands = |e: &&search::Evidence| round.is_significant(e) && e.degrees <= most;
        let best = round.ladder.iter().find(stands).map(|e| e.instance.candidate);
        rounds.push(round);
        let Some(hypothesis) = best.and_then(|best| left.into_iter().find(|h| h.candidate == best)) else { break };
        chosen.push(hypothesis);
        match fit::solve(model, &bench, &noise, &free(&calibrated, &chosen), &theta, Part::Train) {
            Some(fitted) => theta = fitted,
            None => {
                chosen.pop();
                break;
            }
        }
    }
    let after = fit::pass(model, &noise, &theta);
    let tried = rounds.first().map_or(1, |round| round.tried) as f64;
    let described = describe::Described { model, bench: &bench, noise: &noise, theta: &theta, after: &after };
    let (effects, sigmas) = described.effects(&calibrated, &chosen, &hypotheses, tried)?;
    let named = described.nameless(&free(&calibrated, &chosen));
    let is_ambiguous = effects.iter().any(|found| found.rivals.iter().any(Rival::is_possible));
    let tests = whiteness(&bench, &after);
    let is_coloured = tests.iter().any(|w| w.p * (tests.len() as f64) < STRUCTURE);
    let verdict = match effects.is_empty() {
        _ if is_coloured || !named.is_empty() => Verdict::Unexplained,
        true => Verdict::None,
        false if is_ambiguous => Verdict::Ambiguous,
        false => Verdict::Explained,
    };
    let open = described.open(&free(&calibrated, &chosen), hypotheses.iter().filter(|h| !chosen.contains(h)));
    let held =
        format!("blocks of {:.0} s: nine of every 27, and the last fifth of the log, are held out", model.block_s());
    let notes = open.into_iter().chain(noise.iter().map(Noise::describe)).chain([held]).collect();
    let structure = Structure { named, ..Structure::default() };
    let before = bench.declared.clone();
    let diagnosis = Diagnosis { verdict, effects, rounds, structure, before, after, notes };
    Some(Reduced { bench, diagnosis, theta: [plain, theta], sigmas, noise })
}

/// Columns free together.
fn free(calibrated: &[usize], chosen: &[Hypothesis]) -> Vec<usize> {
    calibrated.iter().copied().chain(chosen.iter().flat_map(|h| h.free.clone())).collect()
}

fn hypothesis(effect: &'static str, free: Vec<usize>) -> Hypothesis {
    Hypothesis { candidate: Candidate { effect, fin: None, onset_s: None }, free, fixed: Vec::new() }
}

/// A bench without samples of a vehicle's dynamics.
fn empty(log: &Log, vehicle: &VehicleFile, block_s: f64) -> Bench {
    let samples = Samples { duration_s: log.duration_s(), ..Samples::default() };
    let present = [false; Channel::COUNT];
    let scope = Scope { present, has_density: false, duration_s: samples.duration_s, declared: EffectSet::NONE };
    let setup = Setup {
        parameters: vehicle.parameters,
        noise: vehicle.noise,
        surface: SurfaceNoise::DYNAMIC,
        sensors: vehicle.sensors,
        ship_transducer_depth_m: 0.0,
        scale: [1.0; Channel::COUNT],
        outliers: Vec::new(),
        block_s,
    };
    Bench { setup, samples, scope, own_scale: [1.0; Channel::COUNT], declared: crate::whitener::Pass::default() }
}

/// What is scored beside whiteness.
#[derive(Clone, Debug, Default)]
pub struct Measures {
    /// (time in s, error of a velocity in m/s).
    pub velocity: Vec<(f64, f64)>,
    /// (time in s, error of a position in m).
    pub position: Vec<(f64, f64)>,
    /// What the position is compared with.
    pub against: Option<&'static str>,
}

/// Scores of one pass with its errors, on the held-out blocks.
#[must_use]
pub fn scores(bench: &Bench, pass: &crate::whitener::Pass, measures: Measures) -> Scores {
    let held = |errors: &[(f64, f64)]| {
        let of: Vec<f64> = errors.iter().filter(|(t_s, _)| bench.is_held(*t_s)).map(|(_, error)| *error).collect();
        rms(&of)
    };
    let whiteness = whiteness(bench, pass);
    let tested = whiteness.len().max(1) as f64;
    let position_rmse_m = held(&measures.position);
    Scores {
        velocity_rmse_mps: held(&measures.velocity),
        position_rmse_m,
        position_against: measures.against.filter(|_| position_rmse_m.is_some()),
        innovation_whiteness_p: (whiteness.iter().map(|w| w.p).fold(1.0, f64::min) * tested).min(1.0),
        max_autocorrelation: whiteness.iter().flat_map(|w| &w.correlation).fold(0.0, |largest, r| r.abs().max(largest)),
        whiteness,
        prediction: vec![[None; HORIZONS_S.len()]; PREDICTED.len()],
        position_errors: measures.position,
    }
}

/// Times between which a sensor's readings repeat themselves far longer than they otherwise do: the sensor was not there
/// (or stood still to the last digit), and the log holds its last reading.
#[must_use]
pub fn held_readings(series: &[(f64, Vec<f64>)]) -> Vec<[f64; 2]> {
    /// Shorter repeats are chance.
    const SHORTEST_S: f64 = 10.0;
    /// How often longer than the median repeat.
    const LONGER: usize = 10;
    /// Fewest other readings by which to know what is usual.
    const FEWEST: usize = 20;
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (i, (_, reading)) in series.iter().enumerate() {
        match runs.last_mut() {
            Some((first, last)) if series[*first].1 == *reading => *last = i,
            _ => runs.push((i, i)),
        }
    }
    // Where nothing else varies, a constant is what was measured.
    if runs.len() < FEWEST {
        return Vec::new();
    }
    let mut lengths: Vec<usize> = runs.iter().map(|(first, last)| last - first + 1).collect();
    lengths.sort_unstable();
    let usual = lengths[lengths.len() / 2];
    let is_held = |(first, last): &(usize, usize)| {
        last - first + 1 >= LONGER * usual && series[*last].0 - series[*first].0 >= SHORTEST_S
    };
    runs.into_iter().filter(is_held).map(|(first, last)| [series[first].0, series[last].0]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_that_are_held_are_told_from_a_constant() {
        let series = |value: &dyn Fn(u32) -> f64| -> Vec<(f64, Vec<f64>)> {
            (0..100).map(|t| (f64::from(t), vec![value(t)])).collect()
        };
        assert!(held_readings(&series(&|_| 1.5)).is_empty());
        assert!(held_readings(&series(&|t| f64::from(t % 7))).is_empty());
        let held = held_readings(&series(&|t| if (40..60).contains(&t) { 0.5 } else { f64::from(t) }));
        assert_eq!(held, [[40.0, 59.0]]);
    }
}
