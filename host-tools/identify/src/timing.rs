//! When does an input act?
//!
//! A log samples its commands. Whether an actuator stays where it was put until the next sample, or moves on and is
//! merely sampled, shifts what it does by half a sample; a servo or a bus may add a delay. Taken wrongly, half a sample
//! bends drag, lift and masses by 10 to 20 %. So the delay of every actuator is fitted beside the parameters, by the
//! prediction error over segments of ten seconds: no effect comes before its cause, so that an actuator that seems to
//! act half a sample early is one that moves on (first-order hold). Where both holds are possible, the likelihood
//! decides. An actuator that is not seen, or whose delay is not significant, is held without delay.

use crate::aid;
use crate::data::{IdentificationData, LoggedInputs};
use crate::options::{IdentifyError, Options};
use crate::output_error::{self, SHORT_S, SMALLEST, Segment, free};
use crate::parameters::{self, EXTENDED, Extended};
use crate::sample::Sample;
use crate::simulation::{self, OUTPUT_STATES, OUTPUTS, Output, Sensitive};
use backseat_core::dynamics::{INPUTS, VehicleModel, VehicleParameters};
use backseat_core::state::VehicleState;
use backseat_data::commands::{ACTUATORS, Hold, HoldKind, InputTiming};
use backseat_data::stats::{Z_95, autocorrelation, ljung_box};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};
use rayon::prelude::*;

/// Names of the outputs whose residuals are looked at.
const OUTPUT_NAMES: [&str; OUTPUTS] = ["roll", "pitch", "u", "v", "w", "p", "q", "r"];
/// Columns: the parameters, the delays, the outputs at the start.
const COLUMNS: usize = EXTENDED + INPUTS + OUTPUTS;
/// Step of the derivative by a delay, s.
const STEP_S: f64 = 0.02;
/// Segments looked at, evenly over the log: 50 minutes.
const MOST_SEGMENTS: usize = 300;
/// Delays looked for, s.
const LATEST_S: f64 = 2.0;
/// A delay is believed from so many standard errors on: residuals of a real vehicle are never white.
const BELIEVED: f64 = 5.0;
/// A shorter delay changes nothing that matters, s.
const SHORTEST_S: f64 = 0.004;
/// By how much −2 ln L must be smaller for the other kind of hold to be taken.
const CLEARLY: f64 = 10.0;
/// An autocorrelation of the residuals from here on is reported as structure.
const COLOURED: f64 = 0.1;
/// Lags of the autocorrelation.
const LAGS: usize = 20;

type Normal = SMatrix<f64, COLUMNS, COLUMNS>;

/// What a log says about one actuator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ActuatorTiming {
    /// Which, as in [`ACTUATORS`].
    pub name: &'static str,
    /// How it follows its command.
    pub hold: Hold,
    /// 95 % interval of the delay, s; `None` where the motion does not show it.
    pub ci95: Option<[f64; 2]>,
}

/// Residuals of one output in segments of ten seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutputWhiteness {
    /// Which.
    pub name: &'static str,
    /// Ljung and Box: probability under whiteness.
    pub p: f64,
    /// Largest autocorrelation up to two seconds.
    pub max_autocorrelation: f64,
}

/// When the actuators follow, and what is left then.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingEstimate {
    /// By actuator.
    pub actuators: [ActuatorTiming; INPUTS],
    /// By how much −2 ln L is smaller than with all commands held and without delay.
    pub gain: f64,
    /// By output.
    pub whiteness: [OutputWhiteness; OUTPUTS],
}

impl TimingEstimate {
    /// For [`LoggedInputs::act`].
    #[must_use]
    pub fn timing(&self) -> InputTiming {
        self.actuators.map(|actuator| actuator.hold)
    }

    /// In sentences: what is not held without delay, and a warning where the fit is not white.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        for actuator in self.actuators.iter().filter(|actuator| actuator.hold != Hold::default()) {
            let moves = match actuator.hold.kind {
                HoldKind::Held => "holds each command until the next sample",
                HoldKind::Linear => "moves on between the samples of its command",
            };
            let delay =
                actuator.ci95.filter(|_| actuator.hold.delay_s != 0.0).map_or_else(String::new, |[low, high]| {
                    format!(", {:.3} s late ({low:.3} to {high:.3})", actuator.hold.delay_s)
                });
            notes.push(format!("{} {moves}{delay}", actuator.name));
        }
        let coloured: Vec<String> = self
            .whiteness
            .iter()
            .filter(|output| output.max_autocorrelation > COLOURED && output.p < 1.0e-12)
            .map(|output| format!("{} {:.2}", output.name, output.max_autocorrelation))
            .collect();
        if !coloured.is_empty() {
            notes.push(format!(
                "warning: residuals are not white (largest autocorrelation {}): the water disturbs, or model or timing lack \
                 something; `backseat diagnose` looks for it",
                coloured.join(", ")
            ));
        }
        notes
    }
}

/// Parameters, timing and starts at one step of the fit.
#[derive(Clone)]
struct Trial {
    parameters: Extended,
    timing: InputTiming,
    starts: Vec<VehicleState>,
    /// −2 ln L.
    cost: f64,
    sigma: Output,
    /// One sigma of each delay, s.
    delay_sigma_s: [f64; INPUTS],
}

/// What one segment says.
struct Evaluated {
    normal: Normal,
    gradient: SVector<f64, COLUMNS>,
}

struct Problem<'a> {
    data: &'a IdentificationData,
    inputs: &'a LoggedInputs,
    prior: &'a VehicleParameters,
    options: &'a Options,
    free: Vec<usize>,
    reference: Extended,
    /// Every so many segments are looked at.
    stride: usize,
}

/// Finds out when fins and propeller follow their commands.
///
/// # Errors
/// If the prior is unusable or the data determine nothing.
pub fn estimate(
    data: &IdentificationData,
    inputs: &LoggedInputs,
    prior: &VehicleParameters,
    options: &Options,
) -> Result<TimingEstimate, IdentifyError> {
    let adapted = aid::online(data, prior, options)?;
    let reference = parameters::of(&adapted.vehicle);
    let count = output_error::segments(data, SHORT_S).len();
    let stride = count.div_ceil(MOST_SEGMENTS).max(1);
    let problem = Problem { data, inputs, prior, options, free: free(options, true), reference, stride };
    let failed = || IdentifyError::Degenerate("the delays of the inputs cannot be fitted to this log".to_owned());
    let held = problem.fit(problem.start(), false, 8).ok_or_else(failed)?;
    let mut best = problem.fit(held.clone(), true, 8).ok_or_else(failed)?;
    let half_s: [f64; INPUTS] =
        core::array::from_fn(|actuator| 0.5 * inputs.commands().period_s(actuator).unwrap_or(0.0));
    let mut moves = false;
    for (actuator, hold) in best.timing.iter_mut().enumerate() {
        let is_seen = best.delay_sigma_s[actuator] * BELIEVED < half_s[actuator];
        if is_seen && hold.delay_s < -0.5 * half_s[actuator] {
            *hold = turned(*hold, half_s[actuator]);
            moves = true;
        }
    }
    if moves {
        best.cost = f64::INFINITY;
        best = problem.fit(best, true, 6).ok_or_else(failed)?;
    }
    // Either hold is possible where the other is not early: first of all that are late, for one logger samples them all;
    // then of each.
    let is_late = |best: &Trial, actuator: usize| {
        best.timing[actuator].delay_s > 0.6 * half_s[actuator] && is_believed(best, actuator)
    };
    let all: Vec<usize> = (0..INPUTS).filter(|actuator| is_late(&best, *actuator)).collect();
    let together = (all.len() > 1).then(|| all.clone());
    for group in together.into_iter().chain(all.into_iter().map(|one| vec![one])) {
        let mut other = best.clone();
        for &actuator in &group {
            other.timing[actuator] = turned(other.timing[actuator], half_s[actuator]);
        }
        other.cost = f64::INFINITY;
        best = problem.fit(other, true, 4).filter(|other| other.cost < best.cost - CLEARLY).unwrap_or(best);
    }
    let actuators = core::array::from_fn(|actuator| {
        let (fitted, sigma) = (best.timing[actuator], best.delay_sigma_s[actuator]);
        let is_seen = BELIEVED * sigma < half_s[actuator].max(0.05);
        let is_late = is_believed(&best, actuator) && fitted.delay_s > SHORTEST_S;
        let hold = match (is_seen, is_late) {
            (false, _) => Hold::default(),
            (true, false) => Hold { delay_s: 0.0, ..fitted },
            (true, true) => fitted,
        };
        let reach = Z_95 * sigma;
        let ci95 = is_seen.then_some([fitted.delay_s - reach, fitted.delay_s + reach]);
        ActuatorTiming { name: ACTUATORS[actuator], hold, ci95 }
    });
    let whiteness = problem.whiteness(&best).ok_or_else(failed)?;
    Ok(TimingEstimate { actuators, gain: held.cost - best.cost, whiteness })
}

/// The other kind of hold, with the delay that comes closest.
fn turned(hold: Hold, half_s: f64) -> Hold {
    match hold.kind {
        HoldKind::Held => Hold { kind: HoldKind::Linear, delay_s: hold.delay_s + half_s },
        HoldKind::Linear => Hold { kind: HoldKind::Held, delay_s: hold.delay_s - half_s },
    }
}

fn is_believed(trial: &Trial, actuator: usize) -> bool {
    trial.timing[actuator].delay_s.abs() > BELIEVED * trial.delay_sigma_s[actuator]
}

impl Problem<'_> {
    fn start(&self) -> Trial {
        let starts = self.segments(&self.data.clone()).iter().map(|segment| segment.start).collect();
        Trial {
            parameters: self.reference,
            timing: InputTiming::default(),
            starts,
            cost: f64::INFINITY,
            sigma: output_error::declared_sigma(self.options),
            delay_sigma_s: [f64::INFINITY; INPUTS],
        }
    }

    fn segments<'d>(&self, data: &'d IdentificationData) -> Vec<Segment<'d>> {
        output_error::segments(data, SHORT_S).into_iter().step_by(self.stride).collect()
    }

    /// The data with another timing.
    fn timed(&self, timing: &InputTiming) -> IdentificationData {
        let mut data = self.data.clone();
        self.inputs.act(timing, &mut data.samples);
        data
    }

    fn model(&self, parameters: &Extended) -> Option<VehicleModel> {
        VehicleModel::new(&parameters::with(self.prior, parameters)).ok()
    }

    /// −2 ln L up to a constant, and the root mean square of each output.
    fn likelihood(&self, data: &IdentificationData, trial: &Trial) -> Option<(f64, Output)> {
        let model = self.model(&trial.parameters)?;
        let parts: Vec<(Output, usize)> = self
            .segments(data)
            .par_iter()
            .zip(&trial.starts)
            .map(|(segment, start)| (squares(&model, segment.samples, start), segment.samples.len() - 1))
            .collect();
        let count: f64 = parts.iter().map(|(_, count)| *count as f64).sum();
        let sum = parts.iter().fold(Output::zeros(), |sum, (squares, _)| sum + squares);
        let sigma = (sum / count.max(1.0)).map(f64::sqrt).sup(&Output::from(SMALLEST));
        // Below the smallest sigma a square still counts.
        let cost =
            sigma.iter().zip(sum.iter()).map(|(sigma, sum)| 2.0 * count * sigma.ln() + sum / (sigma * sigma)).sum();
        f64::is_finite(cost).then_some((cost, sigma))
    }

    /// Gauss-Newton from a trial; the delays move only if they are free.
    fn fit(&self, from: Trial, delays: bool, steps: usize) -> Option<Trial> {
        let mut trial = from;
        let mut data = self.timed(&trial.timing);
        (trial.cost, trial.sigma) = self.likelihood(&data, &trial)?;
        let mut damping = 1.0e-3;
        let mut evaluated = Vec::new();
        for step in 0..=steps {
            evaluated = self.evaluate(&data, &trial)?;
            if step == steps {
                break;
            }
            let mut accepted = false;
            for _ in 0..6 {
                let moved = self.newton(&evaluated, &trial, delays, damping).and_then(|candidate| {
                    let data = self.timed(&candidate.timing);
                    let (cost, sigma) = self.likelihood(&data, &candidate)?;
                    (cost < trial.cost).then_some((data, Trial { cost, sigma, ..candidate }))
                });
                if let Some((moved_data, moved)) = moved {
                    accepted = trial.cost - moved.cost > 0.1;
                    (data, trial) = (moved_data, moved);
                    damping = (damping * 0.1).max(1.0e-9);
                    break;
                }
                damping = (damping * 10.0).max(1.0e-6);
            }
            if !accepted {
                break;
            }
        }
        trial.delay_sigma_s = self.delay_sigmas(&evaluated)?;
        Some(trial)
    }

    fn evaluate(&self, data: &IdentificationData, trial: &Trial) -> Option<Vec<Evaluated>> {
        let model = self.model(&trial.parameters)?;
        let weights = output_error::weights(&trial.sigma);
        let later: Vec<IdentificationData> = (0..INPUTS)
            .map(|actuator| {
                let mut timing = trial.timing;
                timing[actuator].delay_s += STEP_S;
                self.timed(&timing)
            })
            .collect();
        let later: Vec<Vec<Segment<'_>>> = later.iter().map(|data| self.segments(data)).collect();
        let segments = self.segments(data);
        let all = (0..segments.len()).into_par_iter().map(|k| {
            let late = core::array::from_fn(|actuator| later[actuator][k].samples);
            evaluate(&model, segments[k].samples, &late, &trial.starts[k], &weights)
        });
        Some(all.collect())
    }

    /// Unknowns beside the starts: the free parameters, then the delays.
    fn unknowns(&self, delays: bool) -> Vec<usize> {
        let delays = if delays { EXTENDED..EXTENDED + INPUTS } else { 0..0 };
        self.free.iter().copied().chain(delays).collect()
    }

    /// A plausible error of each unknown as one weak measurement: settles what the data leave open.
    fn ridge(&self, unknowns: &[usize]) -> DVector<f64> {
        let scale = parameters::scale(self.prior);
        DVector::from_fn(unknowns.len(), |i, _| scale.get(unknowns[i]).copied().unwrap_or(0.5).powi(-2))
    }

    fn newton(&self, evaluated: &[Evaluated], trial: &Trial, delays: bool, damping: f64) -> Option<Trial> {
        let unknowns = self.unknowns(delays);
        let ridge = self.ridge(&unknowns);
        let mut matrix = DMatrix::from_diagonal(&ridge);
        let mut right = DVector::from_fn(unknowns.len(), |i, _| {
            let at = unknowns[i];
            ridge[i] * if at < EXTENDED { self.reference[at] - trial.parameters[at] } else { 0.0 }
        });
        for segment in evaluated {
            let (part, gradient) = reduce(segment, &unknowns, damping);
            matrix += part;
            right += gradient;
        }
        for i in 0..unknowns.len() {
            matrix[(i, i)] *= 1.0 + damping;
        }
        let step = output_error::solve(&matrix, &right)?;
        let mut change = SVector::<f64, { EXTENDED + INPUTS }>::zeros();
        for (&at, value) in unknowns.iter().zip(step.iter()) {
            change[at] = *value;
        }
        let mut moved = trial.clone();
        moved.parameters += change.fixed_rows::<EXTENDED>(0);
        parameters::project(self.prior, self.options.box_ratio, &mut moved.parameters);
        for (actuator, hold) in moved.timing.iter_mut().enumerate() {
            hold.delay_s = (hold.delay_s + change[EXTENDED + actuator]).clamp(-LATEST_S, LATEST_S);
        }
        for (segment, start) in evaluated.iter().zip(&mut moved.starts) {
            let across = segment.normal.fixed_view::<OUTPUTS, { EXTENDED + INPUTS }>(EXTENDED + INPUTS, 0);
            let right = segment.gradient.fixed_rows::<OUTPUTS>(EXTENDED + INPUTS) - across * change;
            let by = start_inverse(segment, damping) * right;
            for (index, by) in OUTPUT_STATES.iter().zip(by.iter()) {
                start[*index] += by;
            }
        }
        Some(moved)
    }

    /// The larger of the information's and of the sandwich's.
    fn delay_sigmas(&self, evaluated: &[Evaluated]) -> Option<[f64; INPUTS]> {
        let unknowns = self.unknowns(true);
        let mut matrix = DMatrix::from_diagonal(&self.ridge(&unknowns));
        let mut scatter = DMatrix::zeros(unknowns.len(), unknowns.len());
        for segment in evaluated {
            let (part, gradient) = reduce(segment, &unknowns, 0.0);
            matrix += part;
            scatter += &gradient * gradient.transpose();
        }
        let unit = matrix.diagonal().map(|d| 1.0 / d.sqrt());
        let scaled = DMatrix::from_fn(unknowns.len(), unknowns.len(), |i, j| matrix[(i, j)] * unit[i] * unit[j]);
        let inverse = scaled.cholesky()?.inverse();
        let inverse = DMatrix::from_fn(unknowns.len(), unknowns.len(), |i, j| inverse[(i, j)] * unit[i] * unit[j]);
        let robust = &inverse * scatter * &inverse;
        Some(core::array::from_fn(|actuator| {
            let at = self.free.len() + actuator;
            inverse[(at, at)].max(robust[(at, at)]).sqrt()
        }))
    }

    fn whiteness(&self, trial: &Trial) -> Option<[OutputWhiteness; OUTPUTS]> {
        let model = self.model(&trial.parameters)?;
        let data = self.timed(&trial.timing);
        let residuals: Vec<Vec<Output>> = self
            .segments(&data)
            .iter()
            .zip(&trial.starts)
            .map(|(segment, start)| {
                let run = simulation::free_run(&model, start, segment.samples);
                segment.samples.iter().zip(run.iter().step_by(2)).map(|(s, x)| simulation::residual(s, x)).collect()
            })
            .collect();
        Some(core::array::from_fn(|output| {
            let of: Vec<Vec<f64>> =
                residuals.iter().map(|segment| segment.iter().map(|r| r[output]).collect()).collect();
            // Each segment by itself, weighted by its power: neighbours in the list may be far apart in time.
            let (mut correlation, mut power, mut count) = (vec![0.0; LAGS], 0.0, 0);
            for part in &of {
                let own: f64 = part.iter().map(|r| r * r).sum();
                for (sum, r) in correlation.iter_mut().zip(autocorrelation(part, LAGS)) {
                    *sum += r * own;
                }
                (power, count) = (power + own, count + part.len());
            }
            correlation.iter_mut().for_each(|sum| *sum /= power.max(f64::MIN_POSITIVE));
            let p = ljung_box(&correlation, count, 0);
            let max_autocorrelation = correlation.iter().fold(0.0, |most: f64, r| most.max(r.abs()));
            OutputWhiteness { name: OUTPUT_NAMES[output], p, max_autocorrelation }
        }))
    }
}

fn squares(model: &VehicleModel, samples: &[Sample], start: &VehicleState) -> Output {
    let run = simulation::free_run(model, start, samples);
    samples.iter().zip(run.iter().step_by(2)).fold(Output::zeros(), |sum, (sample, x)| {
        let residual = simulation::residual(sample, x);
        sum + residual.component_mul(&residual)
    })
}

/// One segment; `late` are its samples with each actuator later by [`STEP_S`].
fn evaluate(
    model: &VehicleModel,
    samples: &[Sample],
    late: &[&[Sample]; INPUTS],
    start: &VehicleState,
    weights: &Output,
) -> Evaluated {
    let mut run = Sensitive::new(start);
    let later = late.map(|samples| simulation::free_run(model, start, samples));
    let mut result = Evaluated { normal: Normal::zeros(), gradient: SVector::zeros() };
    for (k, sample) in samples.iter().enumerate() {
        let residual = simulation::residual(sample, &run.state);
        let by_delay = later
            .each_ref()
            .map(|run_later| (simulation::output(&run_later[2 * k]) - simulation::output(&run.state)) / STEP_S);
        for output in 0..OUTPUTS {
            let row: [f64; COLUMNS] = core::array::from_fn(|column| match column {
                ..EXTENDED => run.sensitivity[(output, column)],
                _ if column < EXTENDED + INPUTS => by_delay[column - EXTENDED][output],
                _ => run.sensitivity[(output, column - INPUTS)],
            });
            for (j, (column, element)) in result.normal.data.0.iter_mut().zip(&row).enumerate() {
                let factor = weights[output] * element;
                for (sum, other) in column[..=j].iter_mut().zip(&row) {
                    *sum += factor * other;
                }
                result.gradient[j] += factor * residual[output];
            }
        }
        run.advance(model, &sample.input);
    }
    result.normal.fill_lower_triangle_with_upper_triangle();
    result
}

fn start_inverse(segment: &Evaluated, damping: f64) -> SMatrix<f64, OUTPUTS, OUTPUTS> {
    let mut block = segment.normal.fixed_view::<OUTPUTS, OUTPUTS>(EXTENDED + INPUTS, EXTENDED + INPUTS).into_owned();
    for i in 0..OUTPUTS {
        block[(i, i)] *= 1.0 + damping + 1.0e-12;
    }
    block.cholesky().map_or_else(SMatrix::zeros, |factor| factor.inverse())
}

/// Normal equations of the unknowns with the start taken out.
fn reduce(segment: &Evaluated, unknowns: &[usize], damping: f64) -> (DMatrix<f64>, DVector<f64>) {
    const REST: usize = EXTENDED + INPUTS;
    let across = segment.normal.fixed_view::<REST, OUTPUTS>(0, REST).into_owned();
    let gain = across * start_inverse(segment, damping);
    let full = segment.normal.fixed_view::<REST, REST>(0, 0) - gain * across.transpose();
    let right = segment.gradient.fixed_rows::<REST>(0) - gain * segment.gradient.fixed_rows::<OUTPUTS>(REST);
    let n = unknowns.len();
    (DMatrix::from_fn(n, n, |i, j| full[(unknowns[i], unknowns[j])]), DVector::from_fn(n, |i, _| right[unknowns[i]]))
}
