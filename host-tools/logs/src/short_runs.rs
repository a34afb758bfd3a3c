//! What short runs of a torpedo show beyond the other sections of a vehicle file: how late what they record is, and what
//! differs between configurations.
//!
//! They are `[short_runs]` of a vehicle file. `diagnose` of a folder of runs writes them, and `diagnose --predict` uses
//! them; a term at its default changes nothing. The plant of the file is that of the first configuration.

/// One number of the section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Key in the file.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Value without the effect.
    pub default: f64,
    /// Smallest value that is accepted.
    pub min: f64,
    /// Largest.
    pub max: f64,
    /// How it enters.
    pub help: &'static str,
}

const fn term(name: &'static str, unit: &'static str, [default, min, max]: [f64; 3], help: &'static str) -> Term {
    Term { name, unit, default, min, max, help }
}

/// Terms that all runs have in common, and that no other section has.
pub const COMMON: [Term; 4] = [
    term("fin_delay_s", "s", [0.0, -3.0, 5.0], "The fins do at t what the row of t - fin_delay_s holds"),
    term("propeller_delay_s", "s", [0.0, -3.0, 5.0], "The same of the propeller"),
    term("attitude_delay_s", "s", [0.0, -1.0, 3.0], "Roll, pitch, heading are this much older than their row"),
    term("ahrs_tilt", "1", [0.0, -1.0, 3.0], "Roll and pitch are those of the specific force, in this share"),
];

/// What a configuration adds to the other sections.
pub const OF_CONFIGURATION: [Term; 7] = [
    term("k_uu", "N s^2/m", [0.0, -20.0, 20.0], "Added to drag.moment_uu[0]"),
    term("m_uu", "N s^2/m", [0.0, -20.0, 20.0], "Added to drag.moment_uu[1]"),
    term("n_uu", "N s^2/m", [0.0, -20.0, 20.0], "Added to drag.moment_uu[2]"),
    term("b_x_m", "m", [0.0, -0.2, 0.2], "Added to vehicle.b_cb_to_cg_m[0]: trim in pitch"),
    term("b_y_m", "m", [0.0, -0.2, 0.2], "Added to vehicle.b_cb_to_cg_m[1]: trim in roll"),
    term("buoyancy_kg", "kg", [0.0, -5.0, 5.0], "Added to vehicle.displaced_mass_kg"),
    term("rudder_gain", "1", [0.0, -2.0, 2.0], "Added to fins.gain of top and bottom"),
];

/// A value with its 95 % interval, where it was estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// The value.
    pub value: f64,
    /// Low and high.
    pub ci95: Option<[f64; 2]>,
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self { value, ci95: None }
    }
}

/// The runs that were flown alike.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// What it is called in reports.
    pub name: String,
    /// Settings that a run of it has; an empty value: the setting is absent.
    pub settings: Vec<(String, String)>,
    /// In the order of [`OF_CONFIGURATION`].
    pub values: [Value; OF_CONFIGURATION.len()],
}

/// The section.
#[derive(Clone, Debug, PartialEq)]
pub struct ShortRuns {
    /// In the order of [`COMMON`].
    pub common: [Value; COMMON.len()],
    /// Configurations; the first one holds for a run of none.
    pub configurations: Vec<Configuration>,
}

impl Default for ShortRuns {
    fn default() -> Self {
        Self { common: COMMON.map(|term| term.default.into()), configurations: Vec::new() }
    }
}

impl Configuration {
    /// How many of its settings a run has, and of how many.
    fn agreement(&self, facts: &[(String, String)]) -> (usize, usize) {
        let has = |(key, value): &&(String, String)| {
            let found = facts.iter().find(|(name, _)| name == key).map_or("", |(_, value)| value.as_str());
            found == value
        };
        (self.settings.iter().filter(has).count(), self.settings.len())
    }
}

impl ShortRuns {
    /// The configuration of a run by its settings: the one of which it has most, the first of equals; with whether it has
    /// all of them.
    pub fn configuration_of(&self, facts: &[(String, String)]) -> Option<(usize, bool)> {
        let mut best: Option<(usize, usize, bool)> = None;
        for (place, configuration) in self.configurations.iter().enumerate() {
            let (agree, of) = configuration.agreement(facts);
            if best.is_none_or(|(_, most, _)| agree > most) {
                best = Some((place, agree, agree == of));
            }
        }
        best.map(|(place, _, whole)| (place, whole))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_belongs_to_the_configuration_whose_settings_it_has() {
        let of = |name: &str, value: &str| Configuration {
            name: name.to_owned(),
            settings: vec![("control.rollpidp".to_owned(), value.to_owned())],
            values: [Value::default(); OF_CONFIGURATION.len()],
        };
        let runs = ShortRuns { configurations: vec![of("with", "0.5"), of("without", "")], ..ShortRuns::default() };
        let facts = |value: &str| vec![("control.rollpidp".to_owned(), value.to_owned())];
        assert_eq!(runs.configuration_of(&facts("0.5")), Some((0, true)));
        assert_eq!(runs.configuration_of(&[]), Some((1, true)));
        assert_eq!(runs.configuration_of(&facts("0.3")), Some((0, false)));
        assert_eq!(ShortRuns::default().configuration_of(&[]), None);
    }
}
