//! The declared vehicle with the effects found.

use super::TERMS_FILE;
use backseat_core::effects::ParameterId;
use backseat_diagnose::diagnosis::Diagnosis;
use backseat_diagnose::log_effects::is_of_readings;
use backseat_logs::VehicleFile;

/// The vehicle with the effects and their intervals; and a note for each that stands in its `[installation]`, or that it
/// cannot hold.
pub fn of(vehicle: &VehicleFile, diagnosis: &Diagnosis, is_dynamic: bool) -> (VehicleFile, Vec<String>) {
    let mut file = augmented(vehicle, diagnosis);
    let notes = install(&mut file, diagnosis, is_dynamic);
    (file, notes)
}

/// Where `[installation]` of the vehicle file declares what an effect corrects: key, and number of values.
const INSTALLED: [(&str, &str, usize); 6] = [
    ("gnss_lever_arm", "installation.gnss_arm_m", 2),
    ("dvl_lever_arm", "installation.dvl_arm_m", 3),
    ("transducer_lever_arm", "installation.transducer_arm_m", 3),
    ("dvl_delay", "installation.dvl_delay_s", 1),
    ("gnss_delay", "installation.gnss_delay_s", 1),
    ("heading_lag", "installation.ahrs_delay_s", 1),
];

/// Corrects `[installation]` by the effects found; returns a note for each that it cannot hold. Of a log with fins and
/// propeller, a late heading is no late AHRS, whose delay would shift rates and pitch as well.
fn install(file: &mut VehicleFile, diagnosis: &Diagnosis, is_dynamic: bool) -> Vec<String> {
    let mut notes = Vec::new();
    for found in &diagnosis.effects {
        let effect = found.instance.candidate.effect;
        let mut places = INSTALLED.iter().filter(|(name, ..)| !(is_dynamic && is_of_readings(name)));
        let Some((_, key, count)) = places.find(|(name, ..)| *name == effect) else {
            if is_dynamic && is_of_readings(effect) {
                notes.push(format!(
                    "{effect} is no part of a vehicle file: --report writes {TERMS_FILE}, which `navigate --terms` takes \
                     out of a log"
                ));
            } else if backseat_core::effects::find(effect).is_none() {
                notes.push(format!("{effect} is no part of a vehicle file: it is written nowhere"));
            }
            continue;
        };
        let declared = file.flatten();
        // an axis of an arm that the log does not show stays as it is declared
        let is_shown = |place: usize| {
            found.values.get(place).is_none_or(|value| value.ci95[0] > 0.0 || value.ci95[1] < 0.0) || *count == 1
        };
        let sizes = found.instance.sizes.iter().take(*count).enumerate().filter(|(place, _)| is_shown(*place));
        let moved = sizes.map(|(place, size)| {
            let name = if *count == 1 { (*key).to_owned() } else { format!("{key}[{place}]") };
            let before = declared.iter().find(|(of, _)| *of == name).map_or(0.0, |(_, value)| *value);
            (name, before + size)
        });
        let moved: Vec<(String, f64)> = moved.collect();
        let is_partial = moved.len() < *count;
        match file.apply(moved) {
            Ok(()) if is_partial => notes.push(format!(
                "{effect} is written into {key} of the vehicle file, but for axes whose interval holds zero"
            )),
            Ok(()) => notes.push(format!("{effect} is written into {key} of the vehicle file")),
            Err(error) => notes.push(format!("{effect} is not written into the vehicle file: {error}")),
        }
    }
    notes
}

/// The declared vehicle with the effects found and their intervals.
fn augmented(vehicle: &VehicleFile, diagnosis: &Diagnosis) -> VehicleFile {
    let mut file = vehicle.clone();
    file.effects.set = diagnosis.set(&vehicle.effects.set.into()).board;
    for found in &diagnosis.effects {
        for value in &found.values {
            let Some(id) = ParameterId::find(found.instance.candidate.effect, value.name) else { continue };
            let [low, high] = value.ci95;
            // A value held at the edge of what is plausible has no interval.
            let is_interval = low < high && low.is_finite() && high.is_finite();
            if is_interval && (low..=high).contains(&file.effects.set.get(id)) {
                file.effects.ci95.push((id, value.ci95));
            }
        }
    }
    file
}
