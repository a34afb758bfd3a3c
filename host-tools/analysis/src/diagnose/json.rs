//! The diagnosis in JSON.

use super::sentence::sentence;
use super::{DiagnosisResult, HELD_OUT};
use backseat_core::effects::{FIN_NAMES, ParameterKind, fin_index};
use backseat_diagnose::diagnosis::FoundEffect;
use backseat_diagnose::proposal::ProposedTerm;
use backseat_diagnose::remaining::Remaining;
use backseat_diagnose::scores::{HORIZONS_S, PREDICTED, Scores};
use backseat_diagnose::structure::NamedTerm;
use backseat_report::Report;
use serde_json::{Map, Value, json};

/// Adds the values of the object.
pub fn values(report: Report, result: &DiagnosisResult<'_>) -> Report {
    let d = &result.diagnosis;
    let hints = d.structure.hints.iter().map(
        |h| json!({"term": h.generic.name(), "value": h.value, "gain": h.gain, "held_out_gain": h.held_gain, "p_value": h.p}),
    );
    let named_hints = d.structure.named.iter().map(
        |t| json!({"term": t.name, "value": t.values, "gain": t.gain, "held_out_gain": t.held_gain, "p_value": t.p}),
    );
    let terms = d.proposed.iter().map(proposed).chain(d.structure.named.iter().map(named));
    report
        .value("verdict", d.verdict.name())
        .value("sentence", sentence(result))
        .value("reason", d.reason)
        .value("remaining", d.remaining.iter().map(remaining).collect::<Vec<_>>())
        .value("trust", if result.is_doubtful() { "suspicious" } else { "ok" })
        .value("doubts", result.doubts.clone())
        .value("effects", d.effects.iter().map(effect).collect::<Vec<_>>())
        .value("before", scores(&result.before))
        .value("position_by_part_m", by_part(&result.position_by_part))
        .value("after", scores(&result.after))
        .value("unexplained_structure", hints.chain(named_hints).collect::<Vec<_>>())
        .value("proposed_terms", terms.collect::<Vec<_>>())
        .value("with_proposed_terms", result.with_terms.as_ref().map(scores))
        .value("held_out", HELD_OUT)
        .value("simulated_s", result.log.duration_s())
        .value("wall_s", result.wall_s)
}

fn by_part([before, after]: &[[Option<f64>; 2]; 2]) -> Value {
    let parts = |[between, forecast]: &[Option<f64>; 2]| json!({"between": between, "forecast": forecast});
    json!({"before": parts(before), "after": parts(after)})
}

fn remaining(of: &Remaining) -> Value {
    json!({"what": of.what, "unit": of.unit, "left": of.left, "most_of_sensors": of.most})
}

fn proposed(term: &ProposedTerm) -> Value {
    json!({"formula": term.formula(), "adds_to": term.term.target.symbol(), "times": term.term.factor.symbol(),
        "value": term.value, "ci95": term.ci95, "unit": term.unit(), "physical_reading": term.physical_reading(),
        "p_value": term.p, "gain": term.gain, "held_out_gain": term.held_gain})
}

fn named(term: &NamedTerm) -> Value {
    json!({"formula": term.name, "value": term.values, "ci95": term.ci95, "p_value": term.p, "gain": term.gain,
        "held_out_gain": term.held_gain})
}

fn effect(found: &FoundEffect) -> Value {
    let mut parameters = Map::new();
    for value in &found.values {
        let number = if value.kind == ParameterKind::Fin {
            json!({"value": fin_index(value.value).map(|fin| FIN_NAMES[fin])})
        } else {
            json!({"value": value.value, "ci95": value.ci95, "unit": value.unit})
        };
        parameters.insert(value.name.to_owned(), number);
    }
    let own = found.instance.candidate.effect;
    let alternatives: Vec<_> = found.possible_alternatives().collect();
    let mut names: Vec<&str> = alternatives.iter().map(|alternative| alternative.instance.candidate.effect).collect();
    names.dedup();
    json!({
        "name": own,
        "parameters": parameters,
        "p_value": found.p_value,
        "ambiguous_with": names,
        "separating_manoeuvre": alternatives.iter().find_map(|alternative| alternative.separating_manoeuvre),
        "chi_square_gain": found.gain,
        "held_out_gain_per_block": found.held_gain.map(|(mean, ci95)| json!({"value": mean, "ci95": ci95})),
    })
}

fn scores(scores: &Scores) -> Value {
    let mut prediction = Map::new();
    for (channel, row) in PREDICTED.iter().zip(&scores.prediction) {
        let by_horizon: Map<String, Value> =
            HORIZONS_S.iter().zip(row).map(|(h, rmse)| (format!("{h:.0}_s"), json!(rmse))).collect();
        prediction.insert(channel.name().replace(' ', "_"), Value::Object(by_horizon));
    }
    let nis: Map<String, Value> =
        scores.whiteness.iter().map(|w| (w.channel.name().replace(' ', "_"), json!(w.nis))).collect();
    json!({
        "velocity_rmse_mps": scores.velocity_rmse_mps,
        "position_rmse_m": scores.position_rmse_m,
        "position_against": scores.position_against,
        "innovation_whiteness_p": scores.innovation_whiteness_p,
        "max_autocorrelation": scores.max_autocorrelation,
        "nis": nis,
        "prediction_rmse": prediction,
        "unexplained_variance": scores.unexplained_variance.iter().map(|(name, share)| ((*name).to_owned(), json!(share))).collect::<Map<_, _>>(),
    })
}
