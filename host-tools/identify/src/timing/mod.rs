//! When does an input act?
//!
//! A log samples its commands. Whether an actuator stays where it was put until the next sample, or moves on and is
//! merely sampled, shifts what it does by half a sample; a servo or a bus may add a delay. Taken wrongly, half a sample
//! bends drag, lift and masses by 10 to 20 %. So the delay of every actuator is fitted beside the parameters, by the
//! prediction error over segments of ten seconds: no effect comes before its cause, so that an actuator that seems to
//! act half a sample early is one that moves on, along a smooth curve. Where both holds are possible, the likelihood
//! decides. An actuator that is not seen, or whose delay is not significant, is held without delay.

mod fit;
mod result;

pub use result::{ActuatorTiming, OutputWhiteness, TimingEstimate};

use crate::aid;
use crate::data::{IdentificationData, LoggedInputs};
use crate::options::{IdentifyError, Options};
use crate::output_error::{self, SHORT_S, free};
use crate::parameters;
use backseat_core::dynamics::{INPUTS, VehicleParameters};
use backseat_estimation::commands::{ACTUATORS, Hold, HoldKind};
use backseat_logs::stats::Z_95;
use fit::{Problem, Trial};

/// Segments looked at, evenly over the log: 50 minutes.
const MOST_SEGMENTS: usize = 300;
/// A delay is believed from so many standard errors on: residuals of a real vehicle are never white.
const BELIEVED: f64 = 5.0;
/// A shorter delay changes nothing that matters, s.
const SHORTEST_S: f64 = 0.004;
/// By how much −2 ln L must be smaller for the other kind of hold to be taken.
const CLEARLY: f64 = 10.0;

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
        HoldKind::Held => Hold { kind: HoldKind::Continuous, delay_s: hold.delay_s + half_s },
        HoldKind::Continuous => Hold { kind: HoldKind::Held, delay_s: hold.delay_s - half_s },
    }
}

fn is_believed(trial: &Trial, actuator: usize) -> bool {
    trial.timing[actuator].delay_s.abs() > BELIEVED * trial.delay_sigma_s[actuator]
}
