//! Parsing: every complaint names line, column and what was expected.

use super::effects::{self, VehicleEffects};
use super::schema::{self, BOARD_SECTION, OPTIONAL, keys, short_key};
use super::{BoardFile, VehicleFile, in_words};
use crate::DataError;
use backseat_app::parameters::{Parameter, Settings};
use backseat_core::parameters::{SECTIONS, Shape, joint_check};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Names the fins must have, if they are named.
pub(super) const FIN_NAMES: [&str; 4] = ["top", "bottom", "port", "starboard"];

pub(super) type Value<'i> = Spanned<DeValue<'i>>;

/// A text with its origin, to say where in it something is wrong.
pub(super) struct Source<'a> {
    text: &'a str,
    path: &'a Path,
}

impl Source<'_> {
    pub(super) fn error(&self, span: Range<usize>, message: impl Into<String>) -> DataError {
        let before = self.text.get(..span.start).unwrap_or(self.text);
        let line = before.bytes().filter(|&byte| byte == b'\n').count() + 1;
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        DataError::at(self.path, line as u64, column as u64, message)
    }

    fn root(&self) -> Result<Spanned<DeTable<'_>>, DataError> {
        DeTable::parse(self.text).map_err(|e| {
            let at = e.span().unwrap_or(0..0);
            // Some of the parser's messages go on in a second line.
            self.error(at, e.message().lines().collect::<Vec<_>>().join("; "))
        })
    }

    pub(super) fn number(&self, value: &Value<'_>, name: &str) -> Result<f64, DataError> {
        let parsed = match value.get_ref() {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|n| n as f64),
            other => {
                let message = format!("{name}: expected a number, found {}", kind(other));
                return Err(self.error(value.span(), message));
            }
        };
        parsed.ok_or_else(|| self.error(value.span(), format!("{name}: not a number that fits")))
    }

    pub(super) fn array<'v, 'i>(
        &self,
        value: &'v Value<'i>,
        length: usize,
        name: &str,
    ) -> Result<&'v [Value<'i>], DataError> {
        let expected = format!("{name}: expected an array of {length}");
        match value.get_ref() {
            DeValue::Array(array) if array.len() == length => Ok(array),
            DeValue::Array(array) => Err(self.error(value.span(), format!("{expected}, found {}", array.len()))),
            other => Err(self.error(value.span(), format!("{expected}, found {}", kind(other)))),
        }
    }

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

    fn string(&self, value: &Value<'_>, name: &str) -> Result<String, DataError> {
        match value.get_ref() {
            DeValue::String(text) => Ok(text.clone().into_owned()),
            other => Err(self.error(value.span(), format!("{name}: expected a text, found {}", kind(other)))),
        }
    }

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

pub(super) fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

/// Parses a file; `whole`: it has to have a vehicle.
pub(super) fn parse(text: &str, path: &Path, whole: bool) -> Result<BoardFile, DataError> {
    let source = Source { text, path };
    let root = source.root()?;
    let root = root.get_ref();
    let sections = || SECTIONS.map(|section| format!("[{}]", section.name)).join(", ");
    for (key, value) in root {
        let known = [effects::SECTION, BOARD_SECTION].contains(&key.get_ref().as_ref())
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
    let mut app = Vec::new();
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
                if !section.required {
                    continue;
                }
                let message = format!("section [{}] is missing; expected {}", section.name, sections());
                return Err(DataError::file(path, message));
            };
            numbers.read(&source, section.name, &header, table, section.required)?;
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
        let settings = &numbers.settings;
        vehicle = Some(VehicleFile {
            name,
            parameters: settings.vehicle,
            noise: settings.navigation.process_noise,
            sensors: settings.navigation.sensors,
            priors: settings.navigation.priors,
            installation: settings.app.installation,
            effects,
        });
    }
    // A file with [app] alone leaves the vehicle to the board.
    if vehicle.is_some() {
        let control = board.is_some().then_some(&numbers.settings.control);
        if let Err(inconsistent) = joint_check(&numbers.settings.vehicle, control) {
            let named = |(parameter, _): &&(&Parameter, _)| inconsistent.parameters().contains(&parameter.name);
            let span = numbers.places.iter().find(named).map_or(0..0, |(_, span)| span.clone());
            return Err(source.error(span, in_words(inconsistent, &numbers.settings)));
        }
    }
    Ok(BoardFile { vehicle, app })
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
        source: &Source<'_>,
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
