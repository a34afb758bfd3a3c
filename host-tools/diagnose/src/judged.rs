//! What an effect must be to be named: possible for the vehicle, not zero, and of use on the data that judges.

use crate::borne_out::BorneOut;
use crate::candidates::Instance;
use crate::prepared_log::{DataPart, JointFit, PreparedLog};
use crate::selection::{Evidence, Ground, Refusal, Round};
use crate::whitener::Pass;
use backseat_core::effects::{ParameterInfo, ParameterKind};
use backseat_logs::stats::Z_95;
use rayon::prelude::*;

/// Entries that say where a sensor sits.
const ARMS: [&str; 3] = ["gnss_lever_arm", "dvl_lever_arm", "transducer_lever_arm"];
/// Entries that say how late a sensor is.
const DELAYS: [&str; 3] = ["heading_lag", "dvl_delay", "gnss_delay"];
/// Whether a vehicle of this length can have it, of sizes known to these sigmas: no arm is longer than the hull, and no
/// sensor reads what has not happened yet.
#[must_use]
pub fn is_possible(instance: &Instance, sigmas: &[f64], length_m: f64) -> bool {
    let effect = instance.candidate.effect;
    let all = |holds: &dyn Fn(f64, f64) -> bool| {
        instance.sizes.iter().zip(sigmas).all(|(size, sigma)| holds(*size, Z_95 * sigma))
    };
    (!ARMS.contains(&effect) || all(&|arm_m, half| arm_m.abs() - half <= length_m))
        && (!DELAYS.contains(&effect) || all(&|delay_s, half| delay_s + half >= 0.0))
}

/// The size that the fit left at the largest plausible value, in words. A fin that is stuck may stand at its stop, and a
/// size of zero is at no limit.
fn at_limit(instance: &Instance) -> Option<String> {
    let of_entry = instance.candidate.info().parameters.iter().filter(|p| p.kind == ParameterKind::Size);
    let is_at = |size: f64, [low, high]: [f64; 2]| size != 0.0 && (size <= low || size >= high);
    let at = |(parameter, size): (&ParameterInfo, &f64)| {
        let words = format!("{} of {size:.2} {}", parameter.name, parameter.unit);
        is_at(*size, [parameter.min, parameter.max]).then_some(words)
    };
    if instance.candidate.is_stuck() { None } else { of_entry.zip(&instance.sizes).find_map(at) }
}

/// What a sea, a hull and a mounting are not steady to: smaller sizes are not named, however sure a long log is of them.
const STEADY: [(&str, f64); 3] = [("m/s", 0.01), ("kg", 0.02), ("rad", 0.002)];

/// Whether a size in a unit is less than what is steady.
#[must_use]
pub fn is_below_steady(unit: &str, size: f64) -> bool {
    STEADY.iter().any(|(of, least)| *of == unit && size.abs() < *least)
}

/// Whether all sizes of an effect are too small to be named, those of one unit taken together.
fn is_negligible(instance: &Instance) -> bool {
    let sizes = || {
        let of_entry = instance.candidate.info().parameters.iter().filter(|p| p.kind == ParameterKind::Size);
        of_entry.zip(&instance.sizes)
    };
    sizes().all(|(parameter, _)| {
        let square: f64 = sizes().filter(|(other, _)| other.unit == parameter.unit).map(|(_, size)| size * size).sum();
        is_below_steady(parameter.unit, square.sqrt())
    })
}

/// Why not.
const IMPOSSIBLE: &str = "no vehicle of this length has it of that size, and no sensor is early";

/// Entries that are significant beside what was accepted, on the data that judge as well, and that this vehicle cannot
/// have: something else is the cause.
#[must_use]
pub fn impossible(log_data: &PreparedLog, accepted: &JointFit, last: &Round) -> Vec<String> {
    let length_m = log_data.setup.parameters.length_m;
    let stands = |e: &&Evidence| {
        last.is_significant(e)
            && e.instance.is_resolved()
            && !is_possible(&e.instance, &e.sigmas(), length_m)
            && is_borne_out_beside(log_data, accepted, &e.instance)
    };
    last.ladder.iter().filter(stands).map(|e| impossible_note(&e.instance)).collect()
}

/// Whether the data that judge gain by an effect beside those accepted most of what they should.
fn is_borne_out_beside(log_data: &PreparedLog, accepted: &JointFit, instance: &Instance) -> bool {
    let all: Vec<Instance> = accepted.instances.iter().chain([instance]).cloned().collect();
    let with = log_data.fit(&all, DataPart::Seen);
    with.is_some_and(|with| of_terms(log_data, &accepted.pass, &with.pass).is_borne_out())
}

fn impossible_note(instance: &Instance) -> String {
    let parameters = instance.candidate.info().parameters.iter().zip(&instance.sizes);
    let sizes: Vec<String> = parameters.map(|(parameter, size)| format!("{} {size:.2}", parameter.name)).collect();
    let (name, sizes) = (instance.candidate.label(), sizes.join(", "));
    format!("{name} of {sizes} would explain what is left, but {IMPOSSIBLE}: something else is the cause")
}

/// The passes with all effects of a joint fit but one each, fitted on a part.
#[must_use]
pub fn without_each(log_data: &PreparedLog, joint: &JointFit, part: DataPart) -> Option<Vec<Pass>> {
    let without = |place| match joint.instances.len() {
        1 => Some(log_data.declared.clone()),
        _ => Some(log_data.fit_without(joint, place, part)?.pass),
    };
    (0..joint.instances.len()).into_par_iter().map(without).collect()
}

/// What the data that choose say of each effect, with the values of those that train; or the effect that should not be
/// accepted: impossible, of a size whose interval holds zero or is too small to matter, or not borne out by them. Of an
/// event they may say nothing: it is refused here where they lose by it.
///
/// # Errors
/// The effect that is refused.
pub fn founded(log_data: &PreparedLog, joint: &JointFit) -> Result<Vec<BorneOut>, Refusal> {
    let refusal = |place, ground, note| Err(Refusal { place, note, ground });
    for (place, instance) in joint.instances.iter().enumerate() {
        let (name, sizes) = (instance.candidate.label(), &instance.sizes);
        let sigmas = joint.sigmas_of(place);
        let holds_zero =
            !instance.candidate.is_stuck() && sizes.iter().zip(sigmas).all(|(size, sigma)| size.abs() < Z_95 * sigma);
        if !is_possible(instance, sigmas, log_data.setup.parameters.length_m) {
            return refusal(place, Ground::Impossible, format!("{name} is not named: {IMPOSSIBLE}"));
        }
        if let Some(limit) = at_limit(instance) {
            let note =
                format!("{name} is not named: {limit} is the most that is plausible: something else is the cause");
            return refusal(place, Ground::Impossible, note);
        }
        if !instance.candidate.is_stuck() && is_negligible(instance) {
            let sizes: Vec<String> = sizes.iter().map(|size| format!("{size:.1e}")).collect();
            let note = format!("{name} is not named: of {} it is too small to matter", sizes.join(", "));
            return refusal(place, Ground::Unfounded, note);
        }
        if holds_zero {
            let note = format!("{name} is not named: the interval of its size holds zero");
            return refusal(place, Ground::Unfounded, note);
        }
    }
    let trained = log_data.fit(&joint.instances, DataPart::Train);
    let with_and_without =
        trained.and_then(|t| without_each(log_data, &t, DataPart::Train).map(|without| (t, without)));
    let Some((trained, without)) = with_and_without else {
        return Ok(vec![BorneOut::default(); joint.instances.len()]);
    };
    let of = borne_out(log_data, &joint.instances, &trained.pass, &without, DataPart::Choose);
    let is_event = |place: usize| joint.instances[place].candidate.span.is_some();
    let is_vain = |place: usize| if is_event(place) { of[place].is_lost_by() } else { of[place].is_refuted() };
    let Some(place) = worst(&of, is_vain) else { return Ok(of) };
    let name = joint.instances[place].candidate.label();
    let reason = "what is kept to choose by does not bear it out";
    refusal(place, Ground::Unfounded, format!("{name} is not named: {reason} ({})", of[place]))
}

/// The effect that the data that judge speak against, if there is one: it is not named, and the verdict says so. An event
/// had its times to choose among much noise: the data that choose and those that judge have to bear it out together.
#[must_use]
pub fn refuted(log_data: &PreparedLog, joint: &JointFit, without: &[Pass], chosen: &[BorneOut]) -> Option<Refusal> {
    let of = borne_out(log_data, &joint.instances, &joint.pass, without, DataPart::Judge);
    let together = |place: usize| of[place].and(&chosen[place]);
    let is_vain = |place: usize| {
        let is_event = joint.instances[place].candidate.span.is_some();
        of[place].is_refuted() || is_event && !together(place).is_borne_out()
    };
    let place = worst(&of, is_vain)?;
    let name = joint.instances[place].candidate.label();
    let (ground, reason) = if together(place).is_tested() || of[place].is_refuted() {
        (Ground::Refuted, "it is significant where it was fitted, and the data that judge do not bear it out")
    } else {
        (Ground::Unfounded, "it is significant where it was fitted, and no other data say anything of it")
    };
    Some(Refusal { place, note: format!("{name} is not named: {reason} ({})", of[place]), ground })
}

/// What the data that judge say of proposed terms, by the passes before and with them.
#[must_use]
pub fn of_terms(log_data: &PreparedLog, before: &Pass, with: &Pass) -> BorneOut {
    let block = |t_s: f64| block_of(log_data, DataPart::Judge, t_s);
    BorneOut::of(before, with, block)
}

/// What an event stands for may set in over so long, s: there a step says how it sets in, and not whether it is there.
const SETTLING_S: f64 = 120.0;

/// Of each effect, by the passes with all and without each; of an event, if need be, of what lies beyond its setting in.
fn borne_out(
    log_data: &PreparedLog,
    instances: &[Instance],
    with: &Pass,
    without: &[Pass],
    part: DataPart,
) -> Vec<BorneOut> {
    let of = |(instance, without): (&Instance, &Pass)| {
        let all = BorneOut::of(without, with, |t_s| block_of(log_data, part, t_s));
        let Some(span) = instance.candidate.span.filter(|_| !all.is_borne_out()) else { return all };
        let is_settled = |t_s: f64| {
            [Some(span.onset_s), span.end_s].into_iter().flatten().all(|edge_s| (t_s - edge_s).abs() > SETTLING_S)
        };
        let block = |t_s: f64| block_of(log_data, part, t_s).filter(|_| is_settled(t_s));
        let settled = BorneOut::of(without, with, block);
        if settled.is_borne_out() { settled } else { all }
    };
    instances.iter().zip(without).map(of).collect()
}

/// The block of a time, if it is of a part.
fn block_of(log_data: &PreparedLog, part: DataPart, t_s: f64) -> Option<usize> {
    log_data.split.is_at(part, t_s).then(|| (t_s / log_data.split.block_s) as usize)
}

/// The one that falls short most.
fn worst(of: &[BorneOut], choose: impl Fn(usize) -> bool) -> Option<usize> {
    let short = |place: &usize| of[*place].expected - of[*place].gain;
    (0..of.len()).filter(|place| choose(*place)).max_by(|a, b| short(a).total_cmp(&short(b)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::candidates::Candidate;

    fn instance(effect: &'static str, sizes: &[f64]) -> Instance {
        Instance { candidate: Candidate { effect, member: None, span: None }, sizes: sizes.to_vec() }
    }

    #[test]
    fn what_no_sea_and_no_hull_is_steady_to_is_not_named() {
        let of = |effect, sizes: &[f64]| is_negligible(&instance(effect, sizes));
        assert!(of("water_current", &[0.006, -0.006]) && !of("water_current", &[0.008, -0.008]));
        assert!(of("buoyancy_change", &[0.009, 0.001]) && !of("buoyancy_change", &[0.009, 0.02]));
        assert!(of("heading_bias", &[0.001, 0.0, -0.001]) && !of("heading_bias", &[0.0, 0.0, 0.01]));
        assert!(!of("clock_offset", &[1e-5]));
    }

    #[test]
    fn no_arm_is_longer_than_the_hull_and_no_sensor_is_early() {
        let of = |effect, sizes: &[f64]| is_possible(&instance(effect, sizes), &vec![0.1; sizes.len()], 2.0);
        assert!(of("dvl_lever_arm", &[0.6, 0.0, -0.1]));
        assert!(of("gnss_lever_arm", &[2.1, 0.0]) && !of("gnss_lever_arm", &[3.7, 0.0]));
        assert!(of("heading_lag", &[1.2]));
        assert!(of("dvl_delay", &[-0.1]) && !of("dvl_delay", &[-1.2]));
        assert!(of("water_current", &[-3.0, 0.0]));
    }
}
