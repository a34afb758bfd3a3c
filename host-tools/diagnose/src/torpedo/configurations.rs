//! Which runs were flown alike, by their settings: those of the fins' calibration, and which settings there are at all.

use backseat_identify::short_runs::model::add_to_plant;
use backseat_identify::short_runs::{Run, runs};
use backseat_logs::short_runs::{Configuration, OF_CONFIGURATION, ShortRuns, Value};
use backseat_logs::{Log, VehicleFile};

/// Settings whose value makes another vehicle of it; gains and limits of a controller do not.
const OF_THE_HULL: [&str; 2] = ["fins.", "ahrs."];
/// Letters of a label that say its day.
const DAY: usize = 8;

/// Settings of one run that tell configurations apart, among all runs.
fn telling(runs: &[Run]) -> Vec<String> {
    let mut keys: Vec<&String> = runs.iter().flat_map(|run| run.facts.iter().map(|(key, _)| key)).collect();
    keys.sort();
    keys.dedup();
    let value = |run: &Run, key: &str| run.facts.iter().find(|(name, _)| name == key).map(|(_, value)| value.clone());
    let with_facts: Vec<&Run> = runs.iter().filter(|run| !run.facts.is_empty()).collect();
    let differs = |key: &&&String| {
        let first = with_facts.first().and_then(|run| value(run, key));
        let is_of_hull = OF_THE_HULL.iter().any(|prefix| key.starts_with(prefix));
        with_facts.iter().any(|run| {
            let other = value(run, key);
            other.is_some() != first.is_some() || (is_of_hull && other != first)
        })
    };
    // the end of a file that is cut off may hold more or fewer settings: only sections that every run has in full count
    let is_whole = |key: &&&String| key.starts_with("control.") || key.starts_with("fins.") || key.starts_with("ahrs.");
    keys.iter().filter(is_whole).filter(differs).map(|key| (*key).clone()).collect()
}

/// Names and values of what a run was configured with.
type Settings = Vec<(String, String)>;

/// Groups the runs, the largest group first, and sets the configuration of each run.
pub fn group(runs: &mut [Run]) -> Vec<Configuration> {
    let keys = telling(runs);
    let settings = |run: &Run| -> Vec<(String, String)> {
        let of = |key: &String| {
            let found = run.facts.iter().find(|(name, _)| name == key);
            let is_of_hull = OF_THE_HULL.iter().any(|prefix| key.starts_with(prefix));
            let value = match found {
                None => String::new(),
                Some((_, value)) if is_of_hull => value.clone(),
                Some(_) => PRESENT.to_owned(),
            };
            (key.clone(), value)
        };
        if run.facts.is_empty() { Vec::new() } else { keys.iter().map(of).collect() }
    };
    let mut groups: Vec<(Settings, Vec<usize>)> = Vec::new();
    for (place, run) in runs.iter().enumerate() {
        let own = settings(run);
        match groups.iter_mut().find(|(known, _)| *known == own) {
            Some((_, members)) => members.push(place),
            None => groups.push((own, vec![place])),
        }
    }
    let samples = |members: &[usize]| -> usize {
        let powered = |run: &Run| run.samples.iter().filter(|s| s.is_powered() && s.depth_m > 0.5).count();
        members.iter().map(|&member| powered(&runs[member])).sum()
    };
    let mut sized: Vec<(usize, usize)> = groups.iter().enumerate().map(|(i, (_, m))| (samples(m), i)).collect();
    sized.sort_by_key(|(count, place)| (std::cmp::Reverse(*count), *place));
    let mut configurations = Vec::new();
    for (place, (_, group)) in sized.into_iter().enumerate() {
        let (settings, members) = &groups[group];
        let mut days: Vec<&str> = members.iter().filter_map(|&member| runs[member].label.get(..DAY)).collect();
        days.dedup();
        let name = if days.is_empty() { "all runs".to_owned() } else { days.join(", ") };
        let values = OF_CONFIGURATION.map(|term| Value::from(term.default));
        configurations.push(Configuration { name, settings: settings.clone(), values });
        let members = members.clone();
        members.into_iter().for_each(|member| runs[member].configuration = place);
    }
    configurations
}

/// Stands for a setting that is there, whatever its value.
pub const PRESENT: &str = "present";

/// Sets the configuration of each run by what a vehicle file says; names runs of none.
pub fn assign(runs: &mut [Run], declared: Option<&ShortRuns>) -> Vec<String> {
    let mut notes = Vec::new();
    let Some(declared) = declared.filter(|declared| declared.configurations.len() > 1) else { return notes };
    for run in runs.iter_mut() {
        let mut facts = run.facts.clone();
        for (key, value) in &mut facts {
            if !OF_THE_HULL.iter().any(|prefix| key.starts_with(prefix)) {
                PRESENT.clone_into(value);
            }
        }
        if let Some((place, is_whole)) = declared.configuration_of(&facts) {
            run.configuration = place;
            if !is_whole {
                let name = &declared.configurations[place].name;
                notes.push(format!("{}: of no known configuration; taken for one of {name}", run.label));
            }
        }
    }
    notes
}

/// The vehicle as the runs of a log had it, with the name of their configuration; `None`: the file has but one, or the runs
/// are of several.
#[must_use]
pub fn vehicle_of(log: &Log, declared: &VehicleFile) -> Option<(VehicleFile, String)> {
    let known = declared.short_runs.as_ref().filter(|known| known.configurations.len() > 1)?;
    let mut runs = runs(log);
    assign(&mut runs, Some(known));
    let place = runs.first()?.configuration;
    let configuration =
        known.configurations.get(place).filter(|_| runs.iter().all(|run| run.configuration == place))?;
    let mut vehicle = declared.clone();
    add_to_plant(&mut vehicle.parameters, &configuration.values.map(|value| value.value));
    Some((vehicle, configuration.name.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use backseat_core::dynamics::ActuatorInput;
    use backseat_identify::short_runs::recording::RunSample;

    fn run(label: &str, facts: &[(&str, &str)], samples: usize) -> Run {
        let input = ActuatorInput { propeller_radps: 100.0, fins_rad: [0.0; 4] };
        let sample = RunSample { t_s: 0.0, attitude_rad: [0.0; 3], depth_m: 2.0, dvl_mps: None, input };
        let facts = facts.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        Run { label: label.to_owned(), facts, configuration: 9, samples: vec![sample; samples] }
    }

    #[test]
    fn gains_do_not_make_another_vehicle_but_a_controller_more_does() {
        let mut runs = vec![
            run("20220101120000", &[("control.depthpidp", "2"), ("fins.count", "1")], 5),
            run("20220102120000", &[("control.depthpidp", "2"), ("control.rollpidp", "0.5"), ("fins.count", "1")], 9),
            run("20220102130000", &[("control.depthpidp", "3"), ("control.rollpidp", "0.2"), ("fins.count", "1")], 9),
        ];
        let found = group(&mut runs);
        assert_eq!(runs.iter().map(|run| run.configuration).collect::<Vec<_>>(), [1, 0, 0]);
        assert_eq!(found.iter().map(|of| of.name.as_str()).collect::<Vec<_>>(), ["20220102", "20220101"]);
        let declared = ShortRuns { configurations: found, ..ShortRuns::default() };
        let mut unseen = vec![run("x", &[("control.rollpidp", "0.7")], 1), run("y", &[("control.depthpidp", "1")], 1)];
        assert!(assign(&mut unseen, Some(&declared)).is_empty());
        assert_eq!(unseen.iter().map(|run| run.configuration).collect::<Vec<_>>(), [0, 1]);
        // another calibration of the fins is another configuration
        runs[2].facts[2].1 = "2".to_owned();
        assert_eq!(group(&mut runs).len(), 3);
    }
}
