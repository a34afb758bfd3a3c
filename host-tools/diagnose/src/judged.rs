//! What an effect must be to be named: possible for the vehicle, not zero, and of use on the data that judges.

use crate::candidates::Instance;
use crate::prepared_log::{DataPart, JointFit, PreparedLog};
use crate::whitener::Pass;
use backseat_logs::stats::Z_95;
use rayon::prelude::*;

/// Entries that say where a sensor sits.
const ARMS: [&str; 3] = ["gnss_lever_arm", "dvl_lever_arm", "transducer_lever_arm"];
/// Entries that say how late a sensor is.
const DELAYS: [&str; 2] = ["heading_lag", "dvl_delay"];
/// An effect that by its size would gain less than this where nothing was fitted is not judged there.
const LEAST_EXPECTED: f64 = 6.0;

/// Whether a vehicle of this length can have it: no arm is longer than the hull, and no sensor reads what has not
/// happened yet.
#[must_use]
pub fn is_possible(instance: &Instance, length_m: f64) -> bool {
    let effect = instance.candidate.effect;
    let fits = |arm_m: &f64| arm_m.abs() <= length_m;
    (!ARMS.contains(&effect) || instance.sizes.iter().all(fits))
        && (!DELAYS.contains(&effect) || instance.sizes.iter().all(|delay_s| *delay_s >= 0.0))
}

/// The passes with all effects but one each, fitted as the joint fit is.
#[must_use]
pub fn without_each(log_data: &PreparedLog, accepted: &[Instance]) -> Option<Vec<Pass>> {
    (0..accepted.len())
        .into_par_iter()
        .map(|place| {
            let mut others = accepted.to_vec();
            others.remove(place);
            if others.is_empty() {
                return Some(log_data.declared.clone());
            }
            Some(log_data.fit(&others, DataPart::Seen)?.pass)
        })
        .collect()
}

/// The effect that should not be named, if there is one: impossible, of a size whose interval holds zero, or of no use
/// where nothing was fitted though by its size it should be.
#[must_use]
pub fn unfounded(log_data: &PreparedLog, joint: &JointFit, without: &[Pass]) -> Option<(usize, String)> {
    let judge = joint.pass.normal.sum(|block| log_data.is_in(DataPart::Judge, block));
    let mut worst: Option<(f64, usize, String)> = None;
    let mut at = 0;
    for (place, (instance, without)) in joint.instances.iter().zip(without).enumerate() {
        let name = instance.candidate.label();
        let sizes = &instance.sizes;
        let sigmas = &joint.sigmas[at..at + sizes.len()];
        let expected: f64 = (0..sizes.len())
            .flat_map(|i| (0..sizes.len()).map(move |j| (i, j)))
            .map(|(i, j)| sizes[i] * sizes[j] * judge.information(at + i, at + j))
            .sum();
        at += sizes.len();
        let gain: f64 = log_data.gains(DataPart::Judge, without, &joint.pass).iter().sum();
        // A fin that is stuck at zero is an effect already.
        let is_stuck = instance.candidate.fin.is_some() && instance.candidate.span.is_some();
        let holds_zero = !is_stuck && sizes.iter().zip(sigmas).all(|(size, sigma)| size.abs() < Z_95 * sigma);
        let reason = if !is_possible(instance, log_data.setup.parameters.length_m) {
            format!("{name} is not named: no vehicle of this length has it of that size, and no sensor is early")
        } else if holds_zero {
            format!("{name} is not named: the interval of its size holds zero")
        } else if gain <= 0.0 && (is_stuck || expected > LEAST_EXPECTED) {
            format!("{name} is not named: it takes nothing away where nothing was fitted")
        } else {
            continue;
        };
        if worst.as_ref().is_none_or(|(least, ..)| gain < *least) {
            worst = Some((gain, place, reason));
        }
    }
    worst.map(|(_, place, reason)| (place, reason))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidates::Candidate;

    fn instance(effect: &'static str, sizes: &[f64]) -> Instance {
        Instance { candidate: Candidate { effect, fin: None, span: None }, sizes: sizes.to_vec() }
    }

    #[test]
    fn no_arm_is_longer_than_the_hull_and_no_sensor_is_early() {
        assert!(is_possible(&instance("dvl_lever_arm", &[0.6, 0.0, -0.1]), 2.0));
        assert!(!is_possible(&instance("gnss_lever_arm", &[3.7, 0.0]), 2.0));
        assert!(is_possible(&instance("heading_lag", &[1.2]), 2.0));
        assert!(!is_possible(&instance("dvl_delay", &[-1.2]), 2.0));
        assert!(is_possible(&instance("water_current", &[-3.0, 0.0]), 2.0));
    }
}
