//! The automatic method: adaptive identification, instrumental variables, output error, output error with cross drag; a
//! step is taken only where the last fifth of the log, which nothing was fitted to, is predicted better.

use crate::aid;
use crate::data::IdentificationData;
use crate::estimate::{Estimate, Step};
use crate::excitation::described;
use crate::instrumental;
use crate::options::{IdentifyError, Method, Options};
use crate::output_error;
use crate::parameters::{self, Extended};
use backseat_core::dynamics::VehicleParameters;
use nalgebra::DMatrix;

/// Share of the log that is fitted.
const FITTED: f64 = 0.8;
/// Held-out segments, s: long enough that what drifts is seen to.
const HORIZON_S: f64 = 50.0;
/// An improvement has to be this many standard errors.
const CERTAIN: f64 = 2.0;

/// Where the climb stands.
struct Incumbent {
    parameters: Extended,
    covariance: Option<DMatrix<f64>>,
    vehicle: VehicleParameters,
    method: Method,
}

pub(crate) fn identify(
    data: &IdentificationData,
    prior: &VehicleParameters,
    options: &Options,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Estimate, IdentifyError> {
    let [fitted, held] = data.split(FITTED);
    if held.stretches.is_empty() || fitted.stretches.is_empty() {
        return Err(IdentifyError::TooShort);
    }
    let adapted = aid::refine(&fitted, prior, options, &|share| progress(0.2 * share))?;
    let from = parameters::of(&adapted);
    let mut incumbent = Incumbent { parameters: from, covariance: None, vehicle: adapted, method: Method::Aid };
    let mut steps = vec![compare("adaptive identification", &held, prior, &incumbent.vehicle, options)];
    steps[0].accepted = steps[0].held_out[1] < steps[0].held_out[0];
    if !steps[0].accepted {
        (incumbent.parameters, incumbent.vehicle) = (parameters::of(prior), *prior);
    }

    let free = output_error::free(options, options.cross_drag);
    let attempt = instrumental::solve(&fitted, prior, &incumbent.parameters, &free, options, &|share| {
        progress(0.2 + 0.1 * share);
    });
    if let Ok(solved) = attempt {
        let candidate = (solved.parameters, solved.covariance);
        steps.push(incumbent.offer("instrumental variables", Method::Iv, candidate, &held, prior, options));
    }
    for (index, (what, cross)) in [("output error", options.cross_drag), ("output error with d26 and d35", true)]
        .into_iter()
        .enumerate()
        .take(if options.cross_drag { 1 } else { 2 })
    {
        let free = output_error::free(options, cross);
        let attempt = output_error::fit(&fitted, prior, (&incumbent.parameters, true), &free, options, &|share| {
            progress(0.3 + 0.35 * (index as f64 + share));
        });
        if let Ok(fit) = attempt {
            let candidate = (fit.parameters, fit.covariance);
            steps.push(incumbent.offer(what, Method::OutputError, candidate, &held, prior, options));
        }
    }
    progress(1.0);
    let covariance = incumbent.covariance.as_ref();
    let mut estimate = described(Method::Auto, data, prior, options, &incumbent.parameters, covariance);
    estimate.steps = steps;
    estimate.notes.push(format!(
        "method chosen: {}; fitted to the first {:.0} % of the log, judged on the rest",
        incumbent.method,
        100.0 * FITTED
    ));
    Ok(estimate)
}

impl Incumbent {
    /// Takes a candidate if it predicts the held-out part better.
    fn offer(
        &mut self,
        what: &str,
        method: Method,
        (parameters, covariance): (Extended, DMatrix<f64>),
        held: &IdentificationData,
        prior: &VehicleParameters,
        options: &Options,
    ) -> Step {
        let vehicle = parameters::with(prior, &parameters);
        let step = compare(what, held, &self.vehicle, &vehicle, options);
        if step.accepted {
            *self = Self { parameters, covariance: Some(covariance), vehicle, method };
        }
        step
    }
}

/// Compares two vehicles on held-out segments, in units of what the better one leaves of each output.
fn compare(
    what: &str,
    held: &IdentificationData,
    before: &VehicleParameters,
    after: &VehicleParameters,
    options: &Options,
) -> Step {
    let declared = output_error::declared_sigma(options);
    let [first, second] = [before, after].map(|vehicle| output_error::left_over(held, vehicle, &declared));
    let sigma = first.inf(&second);
    let [first, second] = [before, after].map(|vehicle| output_error::held_out(held, vehicle, &sigma, HORIZON_S));
    let count = first.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let differences: Vec<f64> = first.iter().zip(&second).map(|(first, second)| first - second).collect();
    let gain = mean(&differences);
    let variance = differences.iter().map(|d| (d - gain).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    let standard_error = (variance / count).sqrt();
    let accepted = gain > CERTAIN * standard_error || (mean(&first).is_infinite() && mean(&second).is_finite());
    Step { what: what.to_owned(), held_out: [mean(&first), mean(&second)], standard_error, accepted }
}
