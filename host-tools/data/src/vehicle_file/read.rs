//! Parsing: every complaint names line, column and what was expected.

use super::VehicleFile;
use super::effects::{self, VehicleEffects};
use super::schema::{self, BOARD_SECTION, FIELDS, Field, OPTIONAL, SECTIONS, Shape};
use crate::DataError;
use backseat_core::dynamics::VehicleParameters;
use backseat_core::navigation::{NavigationConfig, ProcessNoise};
use backseat_core::parameters::Installation;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Names the fins must have, if they are named.
const FIN_NAMES: [&str; 4] = ["top", "bottom", "port", "starboard"];

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

    /// A number, or arrays of numbers to any depth, as `name`, `name[0]`, `name[0][1]`.
    fn flatten(&self, name: String, value: &Value<'_>, into: &mut Vec<(String, f64)>) -> Result<(), DataError> {
        let DeValue::Array(array) = value.get_ref() else {
            let number = self.number(value, &name)?;
            into.push((name, number));
            return Ok(());
        };
        array.iter().enumerate().try_for_each(|(index, value)| self.flatten(format!("{name}[{index}]"), value, into))
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

    /// The numbers of a field with their places in the text.
    fn numbers(&self, field: &Field, value: &Value<'_>) -> Result<Vec<(f64, Range<usize>)>, DataError> {
        let name = format!("{}.{}", field.section, field.key);
        let of = |values: &[Value<'_>]| -> Result<Vec<_>, DataError> {
            values.iter().map(|value| Ok((self.number(value, &name)?, value.span()))).collect()
        };
        match field.shape {
            Shape::Scalar => of(std::slice::from_ref(value)),
            Shape::Vector(length) => of(self.array(value, length, &name)?),
            Shape::Matrix(rows, columns) => {
                let mut all = Vec::with_capacity(rows * columns);
                for row in self.array(value, rows, &name)? {
                    all.extend(of(self.array(row, columns, &name)?)?);
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
        let of_section = FIELDS.iter().filter(|field| field.section == section).map(|field| field.key);
        let known: Vec<&str> = text_key.into_iter().chain(of_section).collect();
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

/// The numbers of the board's own section under their dotted keys, and whether the file has sections of a vehicle.
pub(super) fn board_section(text: &str, path: &Path) -> Result<(Vec<(String, f64)>, bool), DataError> {
    let source = Source { text, path };
    let root = source.root()?;
    let root = root.get_ref();
    let mut values = Vec::new();
    if let Some((_, value)) = root.get_key_value(BOARD_SECTION) {
        let Some(table) = value.get_ref().as_table() else {
            let message = format!("{BOARD_SECTION}: expected a table, found {}", kind(value.get_ref()));
            return Err(source.error(value.span(), message));
        };
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        for (key, value) in entries {
            source.flatten(format!("{BOARD_SECTION}.{}", key.get_ref()), value, &mut values)?;
        }
    }
    Ok((values, root.keys().any(|key| key.get_ref() != BOARD_SECTION)))
}

pub(super) fn parse(text: &str, path: &Path) -> Result<VehicleFile, DataError> {
    let source = Source { text, path };
    let root = source.root()?;
    let root = root.get_ref();
    let mut file = VehicleFile {
        name: String::new(),
        parameters: VehicleParameters::IVER3,
        noise: ProcessNoise::DYNAMIC,
        sensors: NavigationConfig::REFERENCE.sensors,
        installation: Installation::DEFAULT,
        effects: VehicleEffects::default(),
    };
    let sections = || SECTIONS.map(|(name, ..)| format!("[{name}]")).join(", ");
    for (key, value) in root {
        let known = key.get_ref() == effects::SECTION || SECTIONS.iter().any(|(name, ..)| name == key.get_ref());
        if key.get_ref() == BOARD_SECTION {
            continue;
        }
        if !known {
            return Err(source.error(key.span(), format!("unknown key {}; expected {}", key.get_ref(), sections())));
        }
        if !value.get_ref().is_table() {
            let message = format!("{}: expected a table, found {}", key.get_ref(), kind(value.get_ref()));
            return Err(source.error(value.span(), message));
        }
    }
    let mut places = Vec::new();
    for (section, _, optional) in SECTIONS {
        let Some((header, table)) = root.get_key_value(section) else {
            if optional {
                continue;
            }
            return Err(DataError::file(path, format!("section [{section}] is missing; expected {}", sections())));
        };
        let Some(table) = table.get_ref().as_table() else { continue };
        source.check_keys(section, table)?;
        for field in FIELDS.iter().filter(|field| field.section == section) {
            let Some(value) = table.get(field.key) else {
                if optional || OPTIONAL.contains(&(section, field.key)) {
                    continue;
                }
                let message = format!("[{section}] lacks {} ({}): {}", field.key, field.unit, field.meaning);
                return Err(source.error(header.span(), message));
            };
            for (index, (number, span)) in source.numbers(field, value)?.into_iter().enumerate() {
                *(field.slot)(&mut file, index) = number;
                places.push((field.dotted(index), span));
            }
        }
        match section {
            "vehicle" => match table.get("name") {
                Some(name) => file.name = source.string(name, "vehicle.name")?,
                None => return Err(source.error(header.span(), "[vehicle] lacks name (a text)")),
            },
            "fins" => table.get("names").map_or(Ok(()), |names| source.fin_names(names))?,
            _ => {}
        }
    }
    if let Some(table) = root.get(effects::SECTION).and_then(|value| value.get_ref().as_table()) {
        file.effects = VehicleEffects::parse(&source, table)?;
    }
    match schema::first_outside(&file) {
        None => Ok(file),
        Some((field, index, value, [min, max])) => {
            let name = field.dotted(index);
            let span = places.iter().find(|(place, _)| *place == name).map_or(0..0, |(_, span)| span.clone());
            Err(source.error(span, format!("{name}: {value} is outside {min} to {max} ({})", field.unit)))
        }
    }
}
