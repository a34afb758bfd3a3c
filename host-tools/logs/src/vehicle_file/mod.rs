//! The vehicle file: everything declared about a vehicle, in TOML with units and ranges.
//!
//! Sections and keys are those of `vehicles/iver3.toml`; the table of parameters in `backseat_core` declares them.
//! `[noise]`, `[sensors]` and `[installation]`, any key in them and some of the plant that most vehicles do not need may be
//! left out, `[prior]` and `[learnt]` as a whole; the values of that file then hold. Every other key must be there, and no
//! other may.
//! `[effects.NAME]` tables hold effects of the catalogue ([`VehicleEffects`]). A section `[app]` is the board's
//! ([`BoardFile`]); it is checked all the same. `[short_runs]` holds what runs of a torpedo showed beyond the board's
//! model ([`ShortRuns`]).

mod board;
mod effects;
mod page;
mod read;
mod schema;
mod short_runs;
mod source;

pub use board::{BoardFile, BoardParameter};
pub use effects::VehicleEffects;
pub use page::parameters_page;

use crate::DataError;
use crate::output::{self, Existing};
use crate::short_runs::ShortRuns;
use backseat_app::parameters::{self, Parameter, Settings};
use backseat_core::dynamics::VehicleParameters;
use backseat_core::effects::FIN_NAMES;
use backseat_core::navigation::{Learnt, Priors, ProcessNoise, SensorNoise};
use backseat_core::parameters::{Inconsistent, Installation, SECTIONS, SafetyLimits, joint_check};
use std::fmt::Write as _;
use std::path::Path;

/// The reference vehicle as shipped.
const REFERENCE: &str = include_str!("../../vehicles/iver3.toml");

/// What a vehicle file declares.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleFile {
    /// Name of the vehicle.
    pub name: String,
    /// Plant and actuators.
    pub parameters: VehicleParameters,
    /// Process noise of the dynamic model.
    pub noise: ProcessNoise,
    /// One-sigma noise of the sensors.
    pub sensors: SensorNoise,
    /// One sigma of what the declaration leaves open.
    pub priors: Priors,
    /// What dives and identification have shown of it.
    pub learnt: Learnt,
    /// Where the sensors sit, how they are turned and how late they are.
    pub installation: Installation,
    /// What ends a mission though navigation is valid.
    pub safety: SafetyLimits,
    /// What it does beyond what is declared.
    pub effects: VehicleEffects,
    /// What short runs showed beyond the other sections.
    pub short_runs: Option<ShortRuns>,
    /// What the file says of the board, section `[app]`, under its dotted names.
    pub app: Vec<(String, f64)>,
}

impl VehicleFile {
    /// The built-in reference vehicle, `vehicles/iver3.toml`.
    ///
    /// # Panics
    /// Never: a test parses the file that is built in.
    #[must_use]
    pub fn reference() -> Self {
        Self::parse(REFERENCE, Path::new("vehicles/iver3.toml")).expect("the built-in vehicle file is valid")
    }

    /// Reads a vehicle file.
    ///
    /// # Errors
    /// The first key that is unknown, missing, of the wrong type or out of its range: line, column.
    pub fn read(path: &Path) -> Result<Self, DataError> {
        let text = crate::settings::read(path)?;
        Self::parse(&text, path)
    }

    /// Parses the text of a vehicle file; `path` is for the messages.
    ///
    /// # Errors
    /// As [`VehicleFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, DataError> {
        let file = read::parse(text, path, true)?;
        file.vehicle.ok_or_else(|| DataError::file(path, "no section of a vehicle"))
    }

    /// The text of a vehicle file, with unit and range beside every number; `source` says in its
    /// first lines where the numbers come from.
    pub fn to_toml(&self, source: &str) -> String {
        let mut text = String::new();
        for line in source.lines() {
            let _ = writeln!(text, "# {line}");
        }
        let settings = self.settings();
        for section in SECTIONS.iter().filter(|section| section.name != "learnt" || self.learnt != Learnt::NONE) {
            let _ = writeln!(text, "\n[{}]  # {}", section.name, section.about);
            match section.name {
                "vehicle" => writeln!(text, "name = {}", toml::Value::from(self.name.as_str())),
                "fins" => writeln!(text, "names = {:?}", FIN_NAMES),
                _ => Ok(()),
            }
            .ok();
            for key in schema::keys(section.name) {
                let (name, value) = (schema::short_key(&key[0]), schema::value_text(key, &settings));
                let _ = writeln!(text, "{name} = {value}  # {}", schema::comment(key));
            }
        }
        text.push_str(&self.effects.to_toml());
        text.push_str(&self.short_runs.as_ref().map_or_else(String::new, short_runs::to_toml));
        if !self.app.is_empty() {
            let _ = writeln!(text, "\n[{}]  # what belongs to the board itself", schema::BOARD_SECTION);
        }
        for (name, value) in &self.app {
            if let Some(parameter) = parameters::find(name) {
                let comment = schema::comment(std::slice::from_ref(parameter));
                let _ = writeln!(text, "{} = {value:?}  # {comment}", schema::short_key(parameter));
            }
        }
        text
    }

    /// The speed that the vehicle is usually flown at, `[app] cruise_speed_mps`, where the file says it, m/s.
    pub fn cruise_speed_mps(&self) -> Option<f64> {
        self.app.iter().find(|(name, _)| name == "app.cruise_speed_mps").map(|(_, value)| *value)
    }

    /// Writes the vehicle file, whole or not at all.
    ///
    /// # Errors
    /// If the file exists and is to be kept, or cannot be written.
    pub fn write(&self, path: &Path, source: &str, existing: Existing) -> Result<(), DataError> {
        output::write(path, existing, |file| file.write_all(self.to_toml(source).as_bytes()))
    }

    /// Every number under its dotted key: `vehicle.mass_kg`, `inertia.m_diag[0]`, `fins.cp_m[1][2]` …
    /// (also the names of the board's parameters).
    pub fn flatten(&self) -> Vec<(String, f64)> {
        let settings = self.settings();
        let keys = SECTIONS.iter().flat_map(|section| schema::keys(section.name)).flatten();
        let numbers = keys.map(|parameter| (parameter.name.to_owned(), parameter.get(&settings)));
        numbers.chain(self.effects.flatten()).collect()
    }

    /// Sets numbers by their dotted keys (see [`VehicleFile::flatten`]), all or none.
    ///
    /// # Errors
    /// In one line, if a key is unknown or a value is outside its range.
    pub fn apply<K: AsRef<str>>(&mut self, pairs: impl IntoIterator<Item = (K, f64)>) -> Result<(), String> {
        let mut file = self.clone();
        let mut settings = self.settings();
        for (name, value) in pairs {
            let name = name.as_ref();
            if let Some(applied) = file.effects.apply(name, value) {
                applied?;
                continue;
            }
            let is_vehicle = |of: &&Parameter| SECTIONS.iter().any(|section| section.name == of.section());
            let known = parameters::find(name).filter(is_vehicle);
            let parameter = known.ok_or_else(|| format!("unknown parameter {name}"))?;
            if !parameter.admits(value) {
                return Err(schema::complaint(parameter, value));
            }
            parameter.set(&mut settings, value);
        }
        joint_check(&settings.vehicle, None, &settings.learnt)
            .map_err(|inconsistent| in_words(inconsistent, &settings))?;
        file.take(&settings);
        *self = file;
        Ok(())
    }
}

/// What does not go together, with the numbers of a set.
fn in_words(inconsistent: Inconsistent, settings: &Settings) -> String {
    let value = |name: &str| parameters::find(name).map(|parameter| parameter.get(settings));
    inconsistent.with_values(value).to_string()
}

/// A limit in its shortest form.
fn short(limit: f64) -> String {
    if limit == 0.0 || (1e-3..1e5).contains(&limit.abs()) {
        let text = format!("{limit:.3}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{limit:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_file_is_the_reference_of_the_core() {
        let file = VehicleFile::reference();
        assert_eq!(file.parameters, VehicleParameters::IVER3);
        assert_eq!(file.noise, ProcessNoise::DYNAMIC);
        assert_eq!(file.sensors, backseat_core::navigation::NavigationConfig::REFERENCE.sensors);
        assert_eq!(file.installation, Installation::DEFAULT);
        assert_eq!(file.name, "iver3-ref");
    }

    /// `UPDATE_PAGES=1 cargo test -p backseat-logs` writes the file anew.
    #[test]
    fn built_in_file_is_as_written() {
        let source: Vec<&str> =
            REFERENCE.lines().take_while(|line| line.starts_with('#')).map(|line| &line[2..]).collect();
        let text = VehicleFile::reference().to_toml(&source.join("\n"));
        if std::env::var_os("UPDATE_PAGES").is_some() {
            std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/vehicles/iver3.toml"), text).unwrap();
        } else {
            assert_eq!(text, REFERENCE);
        }
    }

    #[test]
    fn written_file_reads_back_the_same() {
        let mut file = VehicleFile::reference();
        file.name = "a \"quoted\" name".to_owned();
        let third = 1.0 / 3.0;
        file.apply([("drag.quadratic_diag[3]", third), ("fins.cp_m[3][1]", 0.131), ("fins.gain[0]", 0.3)]).unwrap();
        file.app = vec![("app.fin_limit_rad".to_owned(), 0.5), ("app.cruise_speed_mps".to_owned(), 1.42)];
        let text = file.to_toml("identified\nfrom a log");
        assert!(text.starts_with("# identified\n# from a log\n"));
        assert_eq!(VehicleFile::parse(&text, Path::new("v.toml")).unwrap(), file);
        assert_eq!(file.cruise_speed_mps(), Some(1.42));
    }

    #[test]
    fn what_most_vehicles_do_not_need_may_be_left_out() {
        let is_kept =
            |line: &&str| !["gain", "moment_uu", "z_uw", "torque_arm_m"].iter().any(|key| line.starts_with(key));
        let short: Vec<&str> = REFERENCE.lines().filter(is_kept).collect();
        assert_eq!(short.len(), REFERENCE.lines().count() - 4);
        assert_eq!(VehicleFile::parse(&short.join("\n"), Path::new("v.toml")).unwrap(), VehicleFile::reference());
    }

    #[test]
    fn effects_are_written_read_and_named() {
        let text = format!(
            "{REFERENCE}\n[effects.water_current]\nnorth_mps = {{ value = 0.12, ci95 = [0.1, 0.14] }}\neast_mps = -0.05\n\
             [effects.fin_stuck]\nfin = \"port\"\nrad = 0.05\ntime_s = 1200\n\
             [effects.drag_change]\nsurge_ns_per_m = 1.5\ntime_s = 300\nuntil_s = 900\n"
        );
        let file = VehicleFile::parse(&text, Path::new("v.toml")).unwrap();
        let present: Vec<_> = file.effects.set.active().map(|(_, info, values)| (info.name, values.to_vec())).collect();
        let expected = [
            ("water_current", vec![0.12, -0.05]),
            ("drag_change", vec![1.5, 300.0, 900.0]),
            ("fin_stuck", vec![3.0, 0.05, 1200.0, 0.0]),
        ];
        assert_eq!(present, expected);
        assert_eq!(file.effects.ci95[0].1, [0.1, 0.14]);
        assert_eq!(VehicleFile::parse(&file.to_toml("again"), Path::new("v.toml")).unwrap(), file);
        let mut other = VehicleFile::reference();
        other.apply([("effects.dvl_scale.ratio", 0.01)]).unwrap();
        other.apply(file.flatten()).unwrap();
        assert_eq!(other.effects.set, file.effects.set);
        assert!(other.apply([("effects.dvl_scale.ratio", 2.0)]).unwrap_err().contains("-0.1 to 0.1"));
    }

    #[test]
    fn wrong_effects_are_refused_where_they_stand() {
        let line = REFERENCE.lines().count() + 2;
        for (effect, line, words) in [
            ("[effects.water_curent]\nnorth_mps = 0.1", line, "unknown effect water_curent"),
            ("[effects.dvl_scale]\nscale = 0.1", line + 1, "unknown key scale in [effects.dvl_scale]; it has ratio"),
            ("[effects.dvl_scale]\nratio = 0.5", line + 1, "effects.dvl_scale.ratio: 0.5 is outside -0.1 to 0.1"),
            ("[effects.dvl_scale]\nratio = \"1\"", line + 1, "expected a number"),
            ("[effects.water_current]\nnorth_mps = 0.1", line, "lacks east_mps (m/s)"),
            (
                "[effects.drag_change]\nsurge_ns_per_m = 1\ntime_s = 300\nuntil_s = 200",
                line,
                "effects.drag_change.until_s: 200 s is not after effects.drag_change.time_s: 300 s",
            ),
            ("[effects.fin_bias]\nrad = 0.1\nfin = \"left\"", line + 2, "left is none of top, bottom, port, starboard"),
            ("[effects.dvl_scale]\nratio = { value = 0.0, ci95 = [1, 0] }", line + 1, "ci95 is low, high"),
        ] {
            let text = format!("{REFERENCE}\n{effect}\n");
            let error = VehicleFile::parse(&text, Path::new("v.toml")).unwrap_err().to_string();
            assert!(error.contains(words) && error.contains(&format!("v.toml:{line}:")), "{effect}: {error}");
        }
    }

    #[test]
    fn flat_names_go_both_ways() {
        let file = VehicleFile::reference();
        let pairs = file.flatten();
        let value = |key: &str| pairs.iter().find(|(name, _)| name == key).map(|(_, value)| *value);
        assert_eq!(value("vehicle.mass_kg"), Some(38.0));
        assert_eq!(value("inertia.m_diag[3]"), Some(0.20));
        assert_eq!(value("fins.cp_m[2][1]"), Some(-0.13));
        assert_eq!(value("noise.linear_mps2_per_sqrt_hz[0]"), Some(3.0e-3));
        assert_eq!(value("sensors.depth_m"), Some(0.06));
        let mut other = VehicleFile::reference();
        other.apply([("vehicle.mass_kg", 50.0), ("sensors.depth_m", 1.0)]).unwrap();
        other.apply(pairs).unwrap();
        assert_eq!(other, file);
    }

    #[test]
    fn apply_is_all_or_nothing() {
        let mut file = VehicleFile::reference();
        let before = file.clone();
        assert!(file.apply([("vehicle.mass_kg", 40.0), ("vehicle.mas_kg", 1.0)]).unwrap_err().contains("mas_kg"));
        assert!(file.apply([("vehicle.mass_kg", 40.0), ("sensors.depth_m", -1.0)]).unwrap_err().contains("outside"));
        assert!(file.apply([("vehicle.mass_kg", f64::NAN)]).is_err());
        assert_eq!(file, before);
    }

    fn section(name: &str) -> &'static str {
        let from = REFERENCE.find(&format!("[{name}]")).unwrap();
        let text = &REFERENCE[from..];
        text.split("\n\n").next().unwrap()
    }

    #[test]
    fn a_prior_is_whole_or_not_there_and_zero_means_known() {
        let prior = section("prior");
        let parse = |prior_text: &str| VehicleFile::parse(&REFERENCE.replace(prior, prior_text), Path::new("v.toml"));
        assert_eq!(parse("").unwrap(), VehicleFile::reference());
        let header = REFERENCE.lines().position(|line| line.starts_with("[prior]")).unwrap() + 1;
        for line in prior.lines().skip(1) {
            let key = line.split(" =").next().unwrap();
            let without = prior.lines().filter(|other| *other != line).collect::<Vec<_>>().join("\n");
            let error = parse(&without).unwrap_err().to_string();
            assert!(error.starts_with(&format!("v.toml:{header}:")), "{error}");
            assert!(error.contains(&format!("[prior] lacks {key} (")), "{error}");
            let at = REFERENCE.lines().position(|other| other == line).unwrap() + 1;
            let (first, rest) = line.split_once(" = ").unwrap();
            let number = rest.trim_start_matches('[').split([',', ' ', ']']).next().unwrap();
            for wrong in ["-0.1", "nan", "inf", "\"1\""] {
                let wrong_line = format!("{first} = {}", rest.replacen(number, wrong, 1));
                let error = parse(&prior.replace(line, &wrong_line)).unwrap_err().to_string();
                let expected = if wrong == "\"1\"" { "expected a number, found a text" } else { "is outside 0 to " };
                assert!(error.starts_with(&format!("v.toml:{at}:")) && error.contains(expected), "{error}");
                assert!(error.contains(&format!("prior.{key}")), "{error}");
            }
            let known = format!("{first} = {}", rest.replacen(number, "0", 1));
            assert!(parse(&prior.replace(line, &known)).is_ok(), "{known}");
        }
        let known = parse(&prior.replace("current_mps = 0.3", "current_mps = 0")).unwrap();
        assert_eq!(known.priors.current_mps, 0.0);
    }

    #[test]
    fn what_was_learnt_is_written_whole_and_checked() {
        let mut file = VehicleFile::reference();
        assert!(!file.to_toml("").contains("[learnt]"), "nothing was learnt");
        file.learnt = Learnt { dives: 3, mean: [0.01; 16], sigma: [0.05; 16], ..Learnt::NONE };
        file.learnt.set_correlation(7, 3, 0.96);
        file.learnt.set_correlation(15, 14, -1.0 / 3.0);
        let text = file.to_toml("");
        assert_eq!(VehicleFile::parse(&text, Path::new("v.toml")).unwrap(), file);
        let line = |start: &str| text.lines().position(|line| line.starts_with(start)).unwrap() + 1;
        let missing = text.replace("fin_lag_sigma_s = 0.05", "");
        let error = VehicleFile::parse(&missing, Path::new("v.toml")).unwrap_err().to_string();
        assert!(error.starts_with(&format!("v.toml:{}:", line("[learnt]"))), "{error}");
        assert!(error.contains("[learnt] lacks fin_lag_sigma_s (s)"), "{error}");
        // m11 and d11 are both wanted in step with beta5, and against each other.
        let mut wrong = file.clone();
        wrong.learnt.set_correlation(3, 0, -0.96);
        wrong.learnt.set_correlation(7, 0, 0.9);
        let text = wrong.to_toml("");
        let error = VehicleFile::parse(&text, Path::new("v.toml")).unwrap_err().to_string();
        assert!(error.starts_with(&format!("v.toml:{}:", line("correlation_beta5"))), "{error}");
        assert!(error.contains("learnt.correlation_beta5") && error.contains("0.96 of beta5 and d11"), "{error}");
        assert!(VehicleFile::reference().apply(wrong.flatten()).is_err());
    }

    #[test]
    fn noise_and_sensors_may_be_left_out() {
        let text = REFERENCE.split("[noise]").next().unwrap();
        assert_eq!(VehicleFile::parse(text, Path::new("v.toml")).unwrap(), VehicleFile::reference());
        let text = format!("{text}\n[sensors]\nrange_m = 3.0\n");
        assert_eq!(VehicleFile::parse(&text, Path::new("v.toml")).unwrap().sensors.range_m, 3.0);
    }
}
