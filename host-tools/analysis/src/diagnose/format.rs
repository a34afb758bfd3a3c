//! Numbers as a reader takes them.

use backseat_core::effects::{FIN_NAMES, ParameterKind, fin_index};
use backseat_diagnose::diagnosis::ParameterEstimate;

/// A value with its interval and unit, beside its name: a unit that the name spells out is not said again.
pub fn number(value: &ParameterEstimate) -> String {
    let is_said = value.unit == "1" || value.name.contains("_per_");
    let unit = if is_said { String::new() } else { format!(" {}", value.unit) };
    match value.kind {
        ParameterKind::Fin => fin_index(value.value).map_or("–", |fin| FIN_NAMES[fin]).to_owned(),
        ParameterKind::Transponder => format!("{:.0}", value.value),
        _ if value.ci95.iter().all(|end| end.is_finite()) => {
            let [low, high] = value.ci95;
            // Two digits of the interval's half width.
            let digits = (1.0 - ((high - low) * 0.5).max(1e-12).log10().floor()).clamp(0.0, 8.0) as usize;
            format!("{:.digits$}{unit} ({low:.digits$} to {high:.digits$})", value.value)
        }
        _ => format!("{:.6}{unit}", value.value),
    }
}

/// A probability for the report.
pub fn probability(p: f64) -> String {
    match p {
        p if p < 1e-12 => "< 1e-12".to_owned(),
        p if p < 1e-4 => format!("{p:.0e}"),
        p => format!("{p:.4}"),
    }
}

/// A value that may not have been measured.
pub fn optional(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.digits$}"))
}
