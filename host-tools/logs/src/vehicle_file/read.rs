//! Parsing: every complaint names line, column and what was expected.

use super::effects::{self, VehicleEffects};
use super::schema::{self, BOARD_SECTION, OPTIONAL, keys, short_key};
use super::short_runs;
use super::source::{FileText, Value, kind};
use super::{VehicleFile, in_words};
use crate::DataError;
use backseat_app::parameters::{Parameter, Settings};
use backseat_core::effects::FIN_NAMES;
use backseat_core::navigation::{LEARNT_NAMES, NotPositiveDefinite};
use backseat_core::parameters::{Presence, SECTIONS, Shape, joint_check};
use std::ops::Range;
use std::path::Path;
use toml::de::DeTable;

impl FileText<'_> {
    /// The numbers of a key with their places in the text.
    fn numbers<'v, 'i>(&self, key: &Parameter, value: &'v Value<'i>) -> Result<Vec<&'v Value<'i>>, DataError> {
        match key.shape {
            Shape::Scalar => Ok(vec![value]),
            Shape::Vector(length) => Ok(self.array(value, length, key.key)?.iter().collect()),
            Shape::Matrix(rows, columns) => {
                let mut all = Vec::with_capacity(rows * columns);
                for row in self.array(value, rows, key.key)? {
                    all.extend(self.array(row, columns, key.key)?);
                }
                Ok(all)
            }
        }
    }

    /// Refuses fins in another order.
    fn fin_names(&self, value: &Value<'_>) -> Result<(), DataError> {
        for (name, expected) in self.array(value, 4, "fins.names")?.iter().zip(FIN_NAMES) {
            if self.string(name, "fins.names")? != expected {
                let message = format!("fins.names: expected {FIN_NAMES:?}, in this order");
                return Err(self.error(name.span(), message));
            }
        }
        Ok(())
    }

    /// Refuses keys that the section does not have.
    fn check_keys(&self, section: &str, table: &DeTable<'_>) -> Result<(), DataError> {
        let text_key = match section {
            "vehicle" => Some("name"),
            "fins" => Some("names"),
            _ => None,
        };
        let known: Vec<&str> = text_key.into_iter().chain(keys(section).map(|key| short_key(&key[0]))).collect();
        match table.keys().find(|key| !known.contains(&key.get_ref().as_ref())) {
            Some(key) => {
                let message = format!("unknown key {} in [{section}]; it has {}", key.get_ref(), known.join(", "));
                Err(self.error(key.span(), message))
            }
            None => Ok(()),
        }
    }
}

/// What is in a file.
pub(super) struct Contents {
    /// The vehicle, if the file has any section of one.
    pub(super) vehicle: Option<VehicleFile>,
    /// The numbers of `[app]` under their dotted names.
    pub(super) app: Vec<(String, f64)>,
}

/// Parses a file; `whole`: it has to have a vehicle.
pub(super) fn parse(text: &str, path: &Path, whole: bool) -> Result<Contents, DataError> {
    let source = FileText { text, path };
    let root = source.root()?;
    let root = root.get_ref();
    let sections = || SECTIONS.map(|section| format!("[{}]", section.name)).join(", ");
    for (key, value) in root {
        let known = [effects::SECTION, short_runs::SECTION, BOARD_SECTION].contains(&key.get_ref().as_ref())
            || SECTIONS.iter().any(|section| section.name == key.get_ref());
        if !known {
            return Err(source.error(key.span(), format!("unknown key {}; expected {}", key.get_ref(), sections())));
        }
        if !value.get_ref().is_table() {
            let message = format!("{}: expected a table, found {}", key.get_ref(), kind(value.get_ref()));
            return Err(source.error(value.span(), message));
        }
    }
    let mut numbers = Numbers { settings: Settings::DEFAULT, places: Vec::new() };
    let table_of = |section: &str| {
        root.get_key_value(section).and_then(|(header, table)| Some((header.span(), table.get_ref().as_table()?)))
    };
    let mut app: Vec<(String, f64)> = Vec::new();
    let board = table_of(BOARD_SECTION);
    if let Some((header, table)) = &board {
        let first = numbers.places.len();
        numbers.read(&source, BOARD_SECTION, header, table, false)?;
        let named =
            |(parameter, _): &(&'static Parameter, _)| (parameter.name.to_owned(), parameter.get(&numbers.settings));
        app = numbers.places[first..].iter().map(named).collect();
    }
    let mut vehicle = None;
    if whole || root.keys().any(|key| key.get_ref() != BOARD_SECTION) {
        let (mut name, mut effects) = (String::new(), VehicleEffects::default());
        for section in SECTIONS {
            let Some((header, table)) = table_of(section.name) else {
                if section.presence != Presence::Required {
                    continue;
                }
                let message = format!("section [{}] is missing; expected {}", section.name, sections());
                return Err(DataError::file(path, message));
            };
            numbers.read(&source, section.name, &header, table, section.presence != Presence::Optional)?;
            match (section.name, table.get("name")) {
                ("vehicle", Some(value)) => name = source.string(value, "vehicle.name")?,
                ("vehicle", None) => return Err(source.error(header, "[vehicle] lacks name (a text)")),
                ("fins", _) => table.get("names").map_or(Ok(()), |names| source.fin_names(names))?,
                _ => {}
            }
        }
        if let Some((_, table)) = table_of(effects::SECTION) {
            effects = VehicleEffects::parse(&source, table)?;
        }
        let short_runs =
            table_of(short_runs::SECTION).map(|(_, table)| short_runs::parse(&source, table)).transpose()?;
        let settings = &numbers.settings;
        vehicle = Some(VehicleFile {
            name,
            parameters: settings.vehicle,
            noise: settings.navigation.process_noise,
            sensors: settings.navigation.sensors,
            priors: settings.navigation.priors,
            learnt: settings.learnt,
            installation: settings.app.installation,
            safety: settings.app.safety,
            effects,
            short_runs,
            app: app.clone(),
        });
    }
    // A file with [app] alone leaves the vehicle to the board.
    if vehicle.is_some() {
        let checked_mps = board.is_some().then_some(numbers.settings.control.cruise_speed_mps);
        if let Err(NotPositiveDefinite(i, j)) = numbers.settings.learnt.check() {
            let (name, other) = (LEARNT_NAMES[i], LEARNT_NAMES[j]);
            let key = format!("learnt.correlation_{name}");
            let place = numbers.places.iter().find(|(parameter, _)| parameter.key == key);
            let message = format!(
                "{key}: parameters do not go together: no covariance has these correlations; the largest is {} of {name} and \
                 {other}. Expected a positive definite matrix; take the section from a file that a tool wrote, or leave it out",
                numbers.settings.learnt.correlation(i, j)
            );
            return Err(source.error(place.map_or(0..0, |(_, span)| span.clone()), message));
        }
        if let Err(inconsistent) = joint_check(&numbers.settings.vehicle, checked_mps, &numbers.settings.learnt) {
            let named = |(parameter, _): &&(&Parameter, _)| inconsistent.parameters().contains(&parameter.name);
            let span = numbers.places.iter().find(named).map_or(0..0, |(_, span)| span.clone());
            return Err(source.error(span, in_words(inconsistent, &numbers.settings)));
        }
    }
    Ok(Contents { vehicle, app })
}

/// The numbers of a file as they are read.
struct Numbers {
    settings: Settings,
    /// Where they stand, in the order of the file.
    places: Vec<(&'static Parameter, Range<usize>)>,
}

impl Numbers {
    /// Reads a section; `required`: only keys that are [`OPTIONAL`] may be left out.
    fn read(
        &mut self,
        source: &FileText<'_>,
        section: &str,
        header: &Range<usize>,
        table: &DeTable<'_>,
        required: bool,
    ) -> Result<(), DataError> {
        source.check_keys(section, table)?;
        for key in keys(section) {
            let [first, ..] = key else { continue };
            let Some(value) = table.get(short_key(first)) else {
                if required && !OPTIONAL.contains(&first.key) {
                    let message = format!("[{section}] lacks {} ({}): {}", short_key(first), first.unit, first.help);
                    return Err(source.error(header.clone(), message));
                }
                continue;
            };
            for (parameter, value) in key.iter().zip(source.numbers(first, value)?) {
                let number = source.number(value, parameter.name)?;
                if !parameter.admits(number) {
                    return Err(source.error(value.span(), schema::complaint(parameter, number)));
                }
                parameter.set(&mut self.settings, number);
                self.places.push((parameter, value.span()));
            }
        }
        Ok(())
    }
}
