//! A compass error that is the declination: a magnetic heading taken for true.

use backseat_diagnose::diagnosis::FoundEffect;
use backseat_logs::Log;

/// What a constant of `heading_bias` means where the log's place and date make just such a declination: a heading that is
/// magnetic reads the declination too little.
pub(super) fn note(log: &Log, effects: &[FoundEffect]) -> Option<String> {
    let found = effects.iter().find(|found| found.instance.candidate.effect == "heading_bias")?;
    let constant = found.values.iter().find(|value| value.name == "const_rad")?;
    let (declination, words) = log.declination()?;
    let [low, high] = constant.ci95;
    let holds = |value: f64| (low..=high).contains(&value);
    (holds(-declination) && !holds(0.0)).then(|| {
        format!(
            "the heading may be magnetic: its constant of {:+.1} deg ({:.1} to {:.1}) is what the declination here, {words}, makes of \
             a magnetic heading that is taken for true. A mapping that makes it true: columns.heading_rad = {{ column = \
             \"heading_rad\", unit = \"rad\", offset = {declination:.4} }}",
            constant.value.to_degrees(),
            low.to_degrees(),
            high.to_degrees()
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::effects::ParameterKind;
    use backseat_diagnose::candidates::{Candidate, Instance};
    use backseat_diagnose::diagnosis::ParameterEstimate;

    #[test]
    fn a_constant_that_is_the_declination_is_told_as_magnetic() {
        // Off Miami in October 2022: 7.1 degrees west.
        let log =
            Log { origin_deg: Some([25.91, -80.14]), start_unix_us: Some(1_665_100_800_000_000), ..Log::default() };
        let of = |value: f64, half: f64| {
            let ci95 = [value - half, value + half];
            let kind = ParameterKind::Size;
            let candidate = Candidate { effect: "heading_bias", member: None, span: None };
            FoundEffect {
                instance: Instance { candidate, sizes: vec![value, 0.0, 0.0] },
                values: vec![ParameterEstimate { name: "const_rad", unit: "rad", kind, value, ci95 }],
                p_value: 1e-9,
                gain: 100.0,
                held_gain: None,
                alternatives: Vec::new(),
            }
        };
        let said = note(&log, &[of(0.12, 0.02)]).expect("as much as the declination");
        assert!(said.contains("-7.1 deg") && said.contains("offset = -0.12"), "{said}");
        // The other way, far off, or not different from nothing.
        for (value, half) in [(-0.12, 0.02), (0.05, 0.02), (0.10, 0.15)] {
            assert_eq!(note(&log, &[of(value, half)]), None, "{value} {half}");
        }
        assert_eq!(note(&Log::default(), &[of(0.12, 0.02)]), None);
    }
}
