//! The answer first: the diagnosis in one sentence, in degrees and minutes, and what to do next.

use super::DiagnosisResult;
use super::files::{Files, Options};
use backseat_core::effects::{FIN_NAMES, ParameterKind, fin_index};
use backseat_diagnose::diagnosis::FoundEffect;
use backseat_diagnose::remaining::Remaining;
use backseat_diagnose::samples::ResidualChannel;
use backseat_diagnose::scores::{PREDICTED, Scores, VELOCITY_HORIZON};
use backseat_diagnose::verdict::Verdict;
use backseat_logs::Column;
use std::path::Path;

/// Effects in words; `{name}` is the value of that parameter, a fin by its name. What is not here is listed by its
/// names.
const WORDS: [(&str, &str); 41] = [
    ("thrust_change", "the propeller loses thrust, or the hull drags by the square of speed, {k_n_s2_per_rad_m} more"),
    ("heading_change", "the compass turns by {rad}"),
    ("buoyancy_change", "the buoyancy changes by {kg}, and the trim in pitch by {trim_rad}"),
    ("pitch_change", "the pitch sensor slips by {rad}"),
    ("dvl_change", "the DVL turns by {yaw_rad} in yaw, and its scale changes by {ratio}"),
    ("clock_change", "the clocks jump apart by {s}"),
    ("fin_bias_change", "the {fin} fin slips by {rad} against its command"),
    ("usbl_turn", "the USBL array is turned by {rad}"),
    (
        "transponder_place",
        "transponder {transponder} stands {north_m} to the north and {east_m} to the east of its declared place",
    ),
    ("linear_drag", "the hull drags {surge_ns_per_m} more in surge"),
    ("drag_change", "the hull drags {surge_ns_per_m} more in surge"),
    ("thrust_loss", "the propeller loses thrust with speed, or the hull drags by its square, {k_n_s2_per_rad_m}"),
    ("thrust_decay", "the propeller loses thrust in time, {per_hour}"),
    ("roll_trim", "the vehicle is trimmed by {rad} in roll"),
    ("pitch_trim", "the vehicle is trimmed by {rad} in pitch"),
    ("buoyancy_offset", "its buoyancy is off by {kg}"),
    ("fin_lag", "the fins follow their command {s} late"),
    ("fin_bias", "the {fin} fin stands {rad} off its command"),
    ("fin_stuck", "the {fin} fin is stuck at {rad}"),
    ("pitch_sensor", "the pitch sensor is off by {bias_rad} and a factor {scale}"),
    ("gyro_bias", "the gyros are off by {p_radps}, {q_radps} and {r_radps}"),
    ("depth_bias", "the depth reads {m} too deep"),
    ("dvl_misalignment", "the DVL is turned by {yaw_rad} in yaw and {pitch_rad} in pitch"),
    ("dvl_misalignment", "the DVL is turned by {yaw_rad} in yaw"),
    ("clock_offset", "the clocks are {s} apart"),
    ("clock_drift", "the clocks drift by {ppm}"),
    ("range_outliers", "a share of {share} of the ranges is wrong"),
    ("waves", "waves move the vehicle by {amplitude_mps} every {period_s}"),
    ("heading_lag", "the heading is {s} late"),
    ("dvl_delay", "the DVL is {s} late"),
    ("gnss_delay", "the fixes are {s} late"),
    ("dvl_lever_arm", "the DVL stands {x_m} ahead and {y_m} to starboard of where it is declared"),
    ("soft_iron", "soft iron turns the compass by {sin2_rad} sin 2ψ and {cos2_rad} cos 2ψ"),
    ("depth_scale", "the depth reads a factor {ratio} too deep"),
    ("input_delay", "fins and propeller are {s} late"),
    ("fin_rate", "the servos take {s_per_rad} to turn the fins"),
    ("propeller_lag", "the propeller comes to its speed {s} late"),
    ("propeller_torque", "the hull rolls against the propeller, {arm_m} times its thrust"),
    ("gnss_lever_arm", "the antenna stands {x_m} ahead and {y_m} to starboard of where it is declared"),
    (
        "transducer_lever_arm",
        "the transducer stands {x_m} ahead, {y_m} to starboard and {z_m} below where it is declared",
    ),
    ("magnetic_declination", "the compass is off by {rad}"),
];

/// What is said of a negative size instead: the vehicle is faster than it is declared.
const FASTER: [(&str, &str); 5] = [
    ("thrust_change", "the propeller gains thrust, or the hull drags by the square of speed, {k_n_s2_per_rad_m} less"),
    ("linear_drag", "the hull drags {surge_ns_per_m} less in surge"),
    ("drag_change", "the hull drags {surge_ns_per_m} less in surge"),
    (
        "thrust_loss",
        "the propeller pushes more than declared, or the hull drags less by its square, {k_n_s2_per_rad_m}",
    ),
    ("thrust_decay", "the propeller gains thrust in time, {per_hour}"),
];

/// The diagnosis in one sentence.
pub fn sentence(result: &DiagnosisResult<'_>) -> String {
    let d = &result.diagnosis;
    // Without a DVL what it measures was logged by something else.
    let carrier = if result.log.has(Column::DvlU) { "the DVL is" } else { "the logged speed is" };
    let phrases: Vec<String> = d.effects.iter().map(|found| phrase(found).replace("the DVL is", carrier)).collect();
    let found = phrases.join("; ");
    let mut parts = match d.verdict {
        Verdict::None => vec!["Nothing found: the declared model leaves no significant residual".to_owned()],
        Verdict::Implausible => {
            let beyond = d.remaining.iter().filter(|remaining| remaining.is_beyond()).map(Remaining::describe);
            let left = beyond.collect::<Vec<_>>().join(", ");
            let term = d.structure.hints.first().map(|hint| format!(" ({} takes part of it)", hint.generic.name()));
            let term = term.unwrap_or_default();
            let what = format!(
                "not to be believed: there is left a {left}{term}; no entry of the catalogue accounts for it; a cause that \
                 sets in or varies under way, or a wrong column that the checks of `info` cannot show"
            );
            std::iter::once(what).chain((!found.is_empty()).then_some(found)).collect()
        }
        Verdict::Undecided => {
            let what = format!("not decided: {}", d.reason);
            std::iter::once(what).chain((!found.is_empty()).then_some(found)).collect()
        }
        Verdict::Unexplained if phrases.is_empty() => {
            vec![format!("Not explained: {}, and no entry of the catalogue describes what remains", d.reason)]
        }
        Verdict::Unexplained => vec![found, format!("that does not explain all of it: {}", d.reason)],
        Verdict::Explained | Verdict::Ambiguous => vec![found],
    };
    parts.extend(gain(&result.before, &result.after).filter(|_| !phrases.is_empty()));
    parts.extend(d.effects.iter().filter_map(others));
    capital(&parts.join("; ")) + "."
}

/// With a capital first letter.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// One effect with its time in front: "since minute 37 the starboard fin is stuck at 1.0 degree", or "from minute 12 to
/// minute 20" where it ended.
fn phrase(found: &FoundEffect) -> String {
    let minute = |kind| found.values.iter().find(|value| value.kind == kind).map(|value| value.value / 60.0);
    let when = match (minute(ParameterKind::Onset), minute(ParameterKind::End)) {
        (Some(onset), Some(end)) => format!("from minute {onset:.0} to minute {end:.0} "),
        (Some(onset), None) => format!("since minute {onset:.0} "),
        _ => String::new(),
    };
    let effect = found.instance.candidate.effect;
    let is_negative = found.values.iter().any(|value| value.kind == ParameterKind::Size && value.value < 0.0);
    let faster = FASTER.iter().filter(|(name, _)| is_negative && *name == effect);
    let is_faster = faster.clone().next().is_some();
    let texts: Vec<(&str, String)> = found
        .values
        .iter()
        .filter(|value| !matches!(value.kind, ParameterKind::Onset | ParameterKind::End))
        .map(|value| {
            let text = match value.kind {
                ParameterKind::Fin => fin_index(value.value).map_or("unknown", |fin| FIN_NAMES[fin]).to_owned(),
                ParameterKind::Transponder => format!("{:.0}", value.value),
                _ if is_faster => quantity(value.value.abs(), value.unit),
                _ => quantity(value.value, value.unit),
            };
            (value.name, text)
        })
        .collect();
    let value = |name: &str| found.values.iter().find(|value| value.name == name).map_or(0.0, |value| value.value);
    if ["water_current", "current_change"].contains(&effect) {
        let (speed_mps, towards) = current(value("north_mps"), value("east_mps"));
        let [before, after] =
            if effect == "water_current" { ["a current of", " sets"] } else { ["the current gains", ""] };
        let speed = quantity(speed_mps, "m/s");
        return format!("{when}{before} {speed}{after} towards {towards:.0} degrees");
    }
    let filled = |words: &&str| {
        let fill = |text: String, (name, value): &(&str, String)| text.replace(&format!("{{{name}}}"), value);
        texts.iter().fold((*words).to_owned(), fill)
    };
    // a log may show fewer of an entry's sizes than the board has
    let words = WORDS.iter().filter(|(name, _)| *name == effect);
    let mut told = faster.chain(words).map(|(_, words)| filled(words));
    match told.find(|text| !text.contains('{')) {
        Some(text) => when + &text,
        None => {
            let listed: Vec<String> = texts.iter().map(|(name, text)| format!("{} {text}", plain(name))).collect();
            format!("{when}the model lacks {} ({})", plain(effect), listed.join(", "))
        }
    }
}

/// Speed of a current, m/s, and where it sets towards, degrees.
fn current(north_mps: f64, east_mps: f64) -> (f64, f64) {
    (north_mps.hypot(east_mps), east_mps.atan2(north_mps).to_degrees().rem_euclid(360.0))
}

/// A name without its unit and underscores.
fn plain(name: &str) -> String {
    let units = ["_radps", "_rad", "_mps", "_m", "_s", "_kg", "_ns_per_m", "_n_s2_per_rad_m"];
    let stem = units.iter().find_map(|unit| name.strip_suffix(unit)).unwrap_or(name);
    stem.replace('_', " ")
}

/// A value as people say it: angles in degrees, shares in per cent, three digits at most.
fn quantity(value: f64, unit: &str) -> String {
    let (value, unit) = match unit {
        "rad" => (value.to_degrees(), "degrees"),
        "rad/s" => (value.to_degrees(), "degrees/s"),
        "1/h" => (100.0 * value, "% an hour"),
        "1" => (value, ""),
        unit => (value, unit),
    };
    let digits = (1.0 - value.abs().max(1e-6).log10().floor()).clamp(0.0, 6.0) as usize;
    let number = format!("{value:.digits$}");
    let unit = if unit == "degrees" && number.trim_start_matches('-') == "1.0" { "degree" } else { unit };
    format!("{number} {unit}").trim_end().to_owned()
}

/// What the effects change on held-out data: of the position where it can be compared, else of the velocity; where that
/// stays as it is, of the prediction that falls most as well.
fn gain(before: &Scores, after: &Scores) -> Option<String> {
    let position = before.position_rmse_m.zip(after.position_rmse_m).map(|pair| ("position error", pair, "m", 2));
    let velocity = || before.velocity_rmse_mps.zip(after.velocity_rmse_mps);
    let told = position.or_else(|| velocity().map(|pair| ("velocity error", pair, "m/s", 4)));
    let text = told.map(|(what, (before, after), unit, digits)| {
        format!("held-out {what} {before:.digits$} -> {after:.digits$} {unit}")
    });
    let predicted = predicted(before, after).filter(|_| told.is_none_or(|(_, pair, ..)| !falls(pair)));
    let predicted = predicted.map(|(channel, (before, after))| {
        let [before, after] = [before, after].map(|value| quantity(value, channel.unit()));
        format!("{} predicted over ten seconds to {after} instead of {before}", channel.name())
    });
    let parts: Vec<String> = text.into_iter().chain(predicted).collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// Whether an error is less by a tenth or more.
fn falls((before, after): (f64, f64)) -> bool {
    after <= 0.9 * before
}

/// Of attitude, rates and depth predicted over ten seconds the one whose error falls most, if one does, before and after.
pub fn predicted(before: &Scores, after: &Scores) -> Option<(ResidualChannel, (f64, f64))> {
    let error = |scores: &Scores, place: usize| scores.prediction.get(place)?[VELOCITY_HORIZON];
    let of = PREDICTED.iter().enumerate().skip(3);
    let of = of.filter_map(|(place, channel)| Some((*channel, (error(before, place)?, error(after, place)?))));
    let share = |(_, (before, after)): &(ResidualChannel, (f64, f64))| after / before;
    of.filter(|(_, pair)| falls(*pair)).min_by(|a, b| share(a).total_cmp(&share(b)))
}

/// What would fit as well, and what tells it apart.
fn others(found: &FoundEffect) -> Option<String> {
    let own = found.instance.candidate;
    let possible: Vec<_> =
        found.alternatives.iter().filter(|other| other.is_possible() && other.instance.candidate != own).collect();
    let name = |place: usize| match own.effect {
        "transponder_place" => format!("transponder {place}"),
        _ => format!("the {} fin", own.which(place)),
    };
    let mut names: Vec<String> = possible
        .iter()
        .map(|other| match other.instance.candidate {
            candidate if candidate.effect == own.effect => candidate.member.map_or_else(|| plain(own.effect), name),
            candidate => candidate.label().replace('_', " "),
        })
        .collect();
    names.dedup();
    let names = names.join(" or ");
    let manoeuvre = possible.iter().find_map(|other| other.separating_manoeuvre);
    match (names.as_str(), manoeuvre) {
        ("", _) => None,
        (_, None) => Some(format!("{names} would fit almost as well")),
        (_, Some(manoeuvre)) => {
            Some(format!("{names} would fit almost as well; to tell them apart: {}", lower(manoeuvre)))
        }
    }
}

/// With a small first letter, unless it begins an abbreviation.
fn lower(text: &str) -> String {
    let mut letters = text.chars();
    match (letters.next(), letters.clone().next()) {
        (Some(first), Some(second)) if second.is_lowercase() => first.to_lowercase().chain(letters).collect(),
        _ => text.to_owned(),
    }
}

/// The next command, and what it brings. A figure is promised of no other command: each judges by another measure.
pub fn next(result: &DiagnosisResult<'_>, files: &Files<'_>) -> (String, String) {
    let log = backseat_report::word(&result.log.path);
    let d = &result.diagnosis;
    let Options { read, beside, judge, vehicle, is_navigable } = &files.options;
    let is_navigable = *is_navigable && beside.is_empty();
    match (files.vehicle, d.verdict) {
        (_, Verdict::None) if is_navigable => (
            format!("backseat navigate {log}{read}{vehicle}{judge}"),
            "the track with the declared vehicle, which fits this log".to_owned(),
        ),
        _ if d.effects.is_empty() || d.verdict.is_doubtful() => {
            let why = "what the numbers of this log look like: a wrong unit or sign is no entry of the catalogue";
            (format!("backseat info {log}{read}"), why.to_owned())
        }
        (Some(file), _) if is_navigable => {
            let terms =
                files.terms.map_or_else(String::new, |file| format!(" --terms {}", backseat_report::word(file)));
            (
                format!("backseat navigate {log}{read} --vehicle {}{terms}{judge}", backseat_report::word(file)),
                "the track with the vehicle as it was found".to_owned(),
            )
        }
        (Some(file), _) => (
            format!("backseat vehicle check {}", backseat_report::word(file)),
            "the vehicle file with what was found in it".to_owned(),
        ),
        (None, _) => (
            format!("backseat diagnose {log}{read}{beside}{vehicle}{judge} --report {}", free_folder(Path::new("."))),
            "writes the report and the corrected vehicle".to_owned(),
        ),
    }
}

/// `why`, `why2`, ...: the first that a report of another log in the same place did not take.
fn free_folder(place: &Path) -> String {
    let names = std::iter::once("why".to_owned()).chain((2..100).map(|n| format!("why{n}")));
    names.into_iter().find(|name| !place.join(name).exists()).unwrap_or_else(|| "why".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_sent_where_none_is() {
        let place = tempfile::tempdir().unwrap();
        assert_eq!(free_folder(place.path()), "why");
        std::fs::create_dir(place.path().join("why")).unwrap();
        assert_eq!(free_folder(place.path()), "why2");
    }

    #[test]
    fn values_are_in_degrees_and_to_the_digits_that_matter() {
        for (value, unit, expected) in [
            (0.017_68, "rad", "1.0 degree"),
            (0.03, "rad", "1.7 degrees"),
            (-0.000_2, "rad/s", "-0.011 degrees/s"),
            (0.008_515, "N s^2/(rad m)", "0.0085 N s^2/(rad m)"),
            (0.25, "1", "0.25"),
            (12.3, "m", "12 m"),
        ] {
            assert_eq!(quantity(value, unit), expected);
        }
    }

    #[test]
    fn a_current_has_a_direction() {
        assert_eq!(current(0.0, -0.2), (0.2, 270.0));
    }

    #[test]
    fn every_effect_in_words_is_in_the_catalogue_with_those_parameters() {
        for (effect, words) in WORDS {
            let info = backseat_core::effects::find_of_log(effect).unwrap_or_else(|| panic!("{effect}"));
            for name in words.split('{').skip(1).filter_map(|rest| rest.split('}').next()) {
                assert!(info.parameters.iter().any(|parameter| parameter.name == name), "{effect}: {name}");
            }
        }
    }
}
