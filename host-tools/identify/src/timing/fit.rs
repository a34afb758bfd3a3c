//! Gauss-Newton on parameters, delays and the start of every segment.

use super::result::OutputWhiteness;
use crate::bordered::Bordered;
use crate::data::{IdentificationData, LoggedInputs};
use crate::options::Options;
use crate::output_error::{self, SHORT_S, SMALLEST, Segment};
use crate::parameters::{self, EXTENDED, Extended};
use crate::sample::Sample;
use crate::simulation::{self, OUTPUTS, Output, Sensitive, moved};
use backseat_core::dynamics::{INPUTS, VehicleModel, VehicleParameters};
use backseat_core::state::VehicleState;
use backseat_estimation::commands::InputTiming;
use backseat_logs::stats::{autocorrelation, ljung_box};
use nalgebra::DVector;
use rayon::prelude::*;

/// Names of the outputs whose residuals are looked at.
const OUTPUT_NAMES: [&str; OUTPUTS] = ["roll", "pitch", "u", "v", "w", "p", "q", "r"];
/// Unknowns that all segments share: the parameters and the delays.
const SHARED: usize = EXTENDED + INPUTS;
/// With the outputs at the start of a segment.
const COLUMNS: usize = SHARED + OUTPUTS;
/// Step of the derivative by a delay, s.
const STEP_S: f64 = 0.02;
/// Delays looked for, s.
const LATEST_S: f64 = 2.0;
/// Lags of the autocorrelation.
const LAGS: usize = 20;

/// What one segment says.
type Evaluated = Bordered<COLUMNS, SHARED>;

/// Parameters, timing and starts at one step of the fit.
#[derive(Clone)]
pub(super) struct Trial {
    parameters: Extended,
    pub(super) timing: InputTiming,
    starts: Vec<VehicleState>,
    /// −2 ln L.
    pub(super) cost: f64,
    sigma: Output,
    /// One sigma of each delay, s.
    pub(super) delay_sigma_s: [f64; INPUTS],
}

pub(super) struct Problem<'a> {
    pub(super) data: &'a IdentificationData,
    pub(super) inputs: &'a LoggedInputs,
    pub(super) prior: &'a VehicleParameters,
    pub(super) options: &'a Options,
    pub(super) free: Vec<usize>,
    pub(super) reference: Extended,
    /// Every so many segments are looked at.
    pub(super) stride: usize,
}

impl Problem<'_> {
    pub(super) fn start(&self) -> Trial {
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
            .map(|(segment, start)| (output_error::squares(&model, segment.samples, start), segment.samples.len() - 1))
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
    pub(super) fn fit(&self, from: Trial, delays: bool, steps: usize) -> Option<Trial> {
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
        let delays = if delays { EXTENDED..SHARED } else { 0..0 };
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
        let right = DVector::from_fn(unknowns.len(), |i, _| {
            let at = unknowns[i];
            ridge[i] * if at < EXTENDED { self.reference[at] - trial.parameters[at] } else { 0.0 }
        });
        let change = Bordered::step(evaluated.iter(), &unknowns, &ridge, right, damping)?;
        let mut next = trial.clone();
        next.parameters += change.fixed_rows::<EXTENDED>(0);
        parameters::project(self.prior, self.options.box_ratio, &mut next.parameters);
        for (actuator, hold) in next.timing.iter_mut().enumerate() {
            hold.delay_s = (hold.delay_s + change[EXTENDED + actuator]).clamp(-LATEST_S, LATEST_S);
        }
        for (segment, start) in evaluated.iter().zip(&mut next.starts) {
            *start = moved(start, &segment.start_step(&change, damping));
        }
        Some(next)
    }

    /// The larger of the information's and of the sandwich's.
    fn delay_sigmas(&self, evaluated: &[Evaluated]) -> Option<[f64; INPUTS]> {
        let unknowns = self.unknowns(true);
        let [inverse, robust] = Bordered::covariances(evaluated.iter(), &unknowns, &self.ridge(&unknowns))?;
        Some(core::array::from_fn(|actuator| {
            let at = self.free.len() + actuator;
            inverse[(at, at)].max(robust[(at, at)]).sqrt()
        }))
    }

    pub(super) fn whiteness(&self, trial: &Trial) -> Option<[OutputWhiteness; OUTPUTS]> {
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
    Bordered::sum(|add| {
        for (k, sample) in samples.iter().enumerate() {
            let residual = simulation::residual(sample, &run.state);
            let by_delay = later
                .each_ref()
                .map(|run_later| (simulation::output(&run_later[2 * k]) - simulation::output(&run.state)) / STEP_S);
            for output in 0..OUTPUTS {
                let row = core::array::from_fn(|column| match column {
                    ..EXTENDED => run.sensitivity[(output, column)],
                    EXTENDED..SHARED => by_delay[column - EXTENDED][output],
                    _ => run.sensitivity[(output, column - INPUTS)],
                });
                add(&row, weights[output], residual[output]);
            }
            run.advance(model, &sample.input);
        }
    })
}
