//! What a board names of what has changed, in words and as JSON: by its telemetry, and by its acoustic uplink.

use backseat_core::control::Manoeuvre;
use backseat_core::effects::FIN_NAMES;
use backseat_core::navigation::naming::Cause;
use backseat_logs::stats::Z_95;
use backseat_wire::hostlink::{Decision, DecisionReason, NamedCause, Naming, Question, UsedFor};
use backseat_wire::named::{MOST_STEPS, NONE_OF_THESE, Named};
use serde_json::{Map, Value, json};

/// Half a step of a size in a packet, as a share of it.
const HALF_STEP: f64 = 0.09;

/// Name of a cause, with its fin.
#[must_use]
pub fn cause_name(cause: Cause) -> String {
    let fin = cause.fin().and_then(|fin| FIN_NAMES.get(fin)).map(|fin| format!(" {fin}")).unwrap_or_default();
    format!("{}{fin}", cause.name())
}

/// A record names other causes than the one before it, or tells another decision, manoeuvre or what came of it.
#[must_use]
pub fn is_new(before: Option<&Naming>, now: &Naming) -> bool {
    let causes = |naming: &Naming| {
        let causes = naming.named.iter().map(|named| named.cause).collect::<Vec<_>>();
        let asked = naming.question.map(|question| (question.time_us, question.after.is_some()));
        (naming.unexplained, causes, naming.decision.map(|decision| decision.time_us), asked)
    };
    before.is_none_or(|before| causes(before) != causes(now))
}

/// What a record names; whether that is worth a warning.
#[must_use]
pub fn sentence(naming: &Naming) -> (bool, String) {
    let causes = naming.named.iter().filter_map(named).collect::<Vec<_>>().join("; beside it ");
    let decision = naming.decision.as_ref().map(|decision| format!("; {}", decided(decision))).unwrap_or_default();
    let asked = naming.question.as_ref().map(|question| format!("; {}", asked(question))).unwrap_or_default();
    let decision = format!("{decision}{asked}");
    let causes = format!("{causes}{decision}");
    match (naming.unexplained, naming.named.is_empty()) {
        (true, true) => (true, "something has changed; none of the known causes explains it".to_owned()),
        (true, false) => (true, format!("something has changed; no known cause explains it, the nearest is {causes}")),
        (false, true) => (false, format!("nothing is named any longer{decision}")),
        (false, false) => (true, format!("changed: {causes}")),
    }
}

fn named(named: &NamedCause) -> Option<String> {
    let cause = Cause::from_number(named.cause)?;
    let rival = Cause::from_number(named.rival).map(|rival| format!(", or {}", cause_name(rival))).unwrap_or_default();
    let (since_s, probability) = (named.since_us as f64 * 1e-6, named.probability);
    let sizes = sizes(cause, named);
    Some(format!("{}, {sizes}, since {since_s:.0} s{rival} (probability {probability:.2})", cause_name(cause)))
}

/// A decision whether a cause is used, and its reason.
#[must_use]
pub fn decided(decision: &Decision) -> String {
    let used = match decision.used_for {
        UsedFor::Nothing => "not used any more",
        UsedFor::Navigation => "used by the filter",
        UsedFor::NavigationAndControl => "used by the filter and the controller",
    };
    let cause = Cause::from_number(decision.cause).map(cause_name).unwrap_or_default();
    let (at_s, gain) = (decision.time_us as f64 * 1e-6, decision.gain);
    let reason = match decision.reason {
        DecisionReason::Sure => "it is sure".to_owned(),
        DecisionReason::Resized => "it has another size now".to_owned(),
        DecisionReason::NotNamed => "it is named no longer".to_owned(),
        DecisionReason::NotBetter => format!("it has not predicted better, ln of the likelihood ratio {gain:.1}"),
        DecisionReason::Restarted => "the filter has started again".to_owned(),
    };
    format!("{cause} {used} from {at_s:.0} s on: {reason}")
}

/// A manoeuvre that tells two causes apart, and what came of it.
#[must_use]
pub fn asked(question: &Question) -> String {
    let [one, two] = question.causes.map(|cause| Cause::from_number(cause).map(cause_name).unwrap_or_default());
    let manoeuvre = Manoeuvre::from_number(question.manoeuvre).map(Manoeuvre::name).unwrap_or_default();
    let (at_s, before) = (question.time_us as f64 * 1e-6, question.before);
    let after = question.after.map(|after| format!(", after it {after:.1}")).unwrap_or_default();
    format!(
        "{manoeuvre} at {at_s:.0} s asks whether it is {one} or {two}: ln of their odds {before:.1}{after}, expected to \
         move by {:.1}",
        question.expected
    )
}

/// Its numbers with their intervals of 95 %.
#[must_use]
pub fn sizes(cause: Cause, named: &NamedCause) -> String {
    let sizes =
        intervals(cause, named).map(|(name, size, [low, high])| format!("{name} {size:.3} ({low:.3} to {high:.3})"));
    sizes.collect::<Vec<_>>().join(", ")
}

/// Name, value and interval of 95 % of each of its numbers.
fn intervals(cause: Cause, named: &NamedCause) -> impl Iterator<Item = (&'static str, f32, [f32; 2])> {
    let numbers = cause.numbers().into_iter().zip(named.size.into_iter().zip(named.sigma));
    let half = |sigma: f32| Z_95 as f32 * sigma;
    let of = move |((name, _), (size, sigma)): ((&'static str, _), (f32, f32))| {
        (name, size, [size - half(sigma), size + half(sigma)])
    };
    numbers.map(of).filter(|(name, ..)| !name.is_empty())
}

/// What a record names.
#[must_use]
pub fn object(naming: &Naming) -> Value {
    let named = naming.named.iter().filter_map(|named| {
        let cause = Cause::from_number(named.cause)?;
        let sizes = intervals(cause, named);
        let sizes = sizes.map(|(name, size, ci95)| (name.to_owned(), json!({ "value": size, "ci95": ci95 })));
        Some(json!({
            "cause": cause_name(cause),
            "size": sizes.collect::<Map<_, _>>(),
            "since_s": named.since_us as f64 * 1e-6,
            "probability": named.probability,
            "rival": Cause::from_number(named.rival).map(cause_name),
        }))
    });
    let decision = naming.decision.map(|decision| {
        let used = match decision.used_for {
            UsedFor::Nothing => "nothing",
            UsedFor::Navigation => "navigation",
            UsedFor::NavigationAndControl => "navigation and control",
        };
        json!({
            "time_s": decision.time_us as f64 * 1e-6,
            "cause": Cause::from_number(decision.cause).map(cause_name),
            "size": decision.size[0],
            "used_for": used,
            "reason": decided(&decision),
            "log_likelihood_gain": decision.gain,
        })
    });
    let question = naming.question.map(|question| {
        json!({
            "time_s": question.time_us as f64 * 1e-6,
            "causes": question.causes.map(|cause| Cause::from_number(cause).map(cause_name)),
            "manoeuvre": Manoeuvre::from_number(question.manoeuvre).map(Manoeuvre::name),
            "expected_gain": question.expected,
            "log_odds_before": question.before,
            "log_odds_after": question.after,
        })
    });
    let named = named.collect::<Vec<_>>();
    json!({ "named": named, "unexplained": naming.unexplained, "decision": decision, "question": question })
}

/// What an uplink names.
#[must_use]
pub fn told(named: &Named) -> String {
    let rival = Cause::from_number(named.rival).map(cause_name);
    if named.cause == NONE_OF_THESE {
        let nearest = rival.map(|rival| format!(", the nearest is {rival}")).unwrap_or_default();
        return format!("something has changed; no known cause explains it{nearest}");
    }
    if named.cause == 0 {
        return "nothing is named".to_owned();
    }
    let Some(cause) = Cause::from_number(named.cause) else {
        return format!("changed: cause {}, which this program does not know", named.cause);
    };
    let beside = if named.beside { "beside it " } else { "" };
    let numbers = cause.numbers().into_iter().zip(told_sizes(cause, named));
    let sizes = numbers.filter(|((name, _), _)| !name.is_empty()).map(|((name, _), size)| format!(", {name} {size}"));
    let rival = rival.map(|rival| format!(", or {rival}")).unwrap_or_default();
    let sure = if named.is_sure { ", sure" } else { "" };
    format!("changed: {beside}{}{}{rival}{sure}", cause_name(cause), sizes.collect::<String>())
}

/// The same where there is little room: a cause and its size, what may be taken as known without a mark.
#[must_use]
pub fn told_briefly(named: &Named) -> String {
    let Some(cause) = Cause::from_number(named.cause) else { return "no known cause".to_owned() };
    let [first, second] = told_sizes(cause, named);
    let [_, (other, _)] = cause.numbers();
    let size = if other.is_empty() { first } else { format!("{first} {second}") };
    let mark = if named.is_sure { "" } else { " ?" };
    format!("{} {size}{mark}", cause_name(cause))
}

/// Its numbers to one or two digits: a step is 19 %.
fn told_sizes(cause: Cause, named: &Named) -> [String; 2] {
    let [first, second] = cause.size_of(named.size);
    let [a, b] = named.size;
    [(first, a), (second, b)].map(|(size, steps)| match steps {
        0 => "small".to_owned(),
        steps if steps.unsigned_abs() >= MOST_STEPS.unsigned_abs() => format!("{size:.2} or beyond"),
        _ => {
            let digits = (1.0 - size.abs().log10().floor()).clamp(0.0, 6.0) as usize;
            format!("{size:.digits$}")
        }
    })
}

/// What an uplink names, told since a UTC second.
#[must_use]
pub fn told_object(named: &Named, since_s: u32) -> Value {
    let cause = Cause::from_number(named.cause);
    let sizes = cause.map(|cause| {
        let sizes = cause.numbers().into_iter().zip(cause.size_of(named.size));
        sizes.filter(|((name, _), _)| !name.is_empty()).map(|((name, _), size)| {
            let half = HALF_STEP * size.abs();
            (name.to_owned(), json!({ "value": size, "rounded": [size - half, size + half] }))
        })
    });
    json!({
        "cause": cause.map(cause_name),
        "none_of_these": named.cause == NONE_OF_THESE,
        "size": sizes.map_or_else(Map::new, Iterator::collect),
        "sure": named.is_sure,
        "rival": Cause::from_number(named.rival).map(cause_name),
        "told_since_s": since_s,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_packet_and_a_record_tell_the_same_in_their_own_digits() {
        let fin = Cause::FinLost(1);
        let record = NamedCause {
            cause: fin.number(),
            rival: Cause::FinStuck(1).number(),
            size: [0.43, 0.0],
            sigma: [0.04, 0.0],
            since_us: 768_000_000,
            probability: 0.97,
        };
        let naming = Naming { time_us: 1, named: [record].into_iter().collect(), ..Naming::default() };
        let expected = "changed: fin_lost bottom, share_lost 0.430 (0.352 to 0.508), since 768 s, or fin_stuck bottom (probability 0.97)";
        assert_eq!(sentence(&naming), (true, expected.to_owned()));
        let decision =
            Decision { time_us: 1_000_000_000, cause: 2, used_for: UsedFor::Navigation, ..Decision::default() };
        let used = Naming { decision: Some(decision), ..naming.clone() };
        assert!(is_new(Some(&naming), &used));
        let expected = format!("{expected}; fin_lost bottom used by the filter from 1000 s on: it is sure");
        assert_eq!(sentence(&used).1, expected);
        let question =
            Question { causes: [2, 6], manoeuvre: 2, expected: 8.0, before: 0.5, after: None, ..Question::default() };
        let asking = Naming { question: Some(question), ..naming.clone() };
        let over = Naming { question: Some(Question { after: Some(6.25), ..question }), ..naming.clone() };
        assert!(is_new(Some(&naming), &asking) && is_new(Some(&asking), &over) && !is_new(Some(&over), &over));
        let expected = "a doublet of the rudder at 0 s asks whether it is fin_lost bottom or fin_stuck bottom: ln of their odds 0.5, after it 6.2, expected to move by 8.0";
        assert!(sentence(&over).1.ends_with(expected), "{}", sentence(&over).1);
        let told_by = Named {
            cause: record.cause,
            rival: record.rival,
            beside: false,
            is_sure: true,
            size: fin.steps([0.43, 0.0]),
        };
        // 0.3 · 2^(2/4) = 0.424
        assert_eq!(told_briefly(&told_by), "fin_lost bottom 0.42");
        assert_eq!(told(&told_by), "changed: fin_lost bottom, share_lost 0.42, or fin_stuck bottom, sure");
        let object = told_object(&told_by, 9);
        assert_eq!(
            (&object["cause"], &object["sure"], &object["told_since_s"]),
            (&json!("fin_lost bottom"), &json!(true), &json!(9))
        );
        let unknown = Named { cause: NONE_OF_THESE, ..told_by };
        assert_eq!(
            told(&unknown),
            "something has changed; no known cause explains it, the nearest is fin_stuck bottom"
        );
        assert_eq!(told_object(&unknown, 9)["none_of_these"], true);
        // 30 is no cause: a newer vehicle
        assert_eq!(told(&Named { cause: 30, ..told_by }), "changed: cause 30, which this program does not know");
        assert_eq!(told(&Named::NOTHING), "nothing is named");
    }
}
