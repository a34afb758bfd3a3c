//! `[short_runs]` of a vehicle file: terms of all runs, and a table `[[short_runs.configuration]]` for each configuration.

use super::source::{FileText, Value as TomlValue, kind, with_interval};
use crate::DataError;
use crate::short_runs::{COMMON, Configuration, OF_CONFIGURATION, ShortRuns, Term, Value};
use std::fmt::Write as _;
use toml::de::{DeTable, DeValue};

/// The section's name.
pub(super) const SECTION: &str = "short_runs";
const CONFIGURATION: &str = "configuration";

/// The terms of the section.
pub(super) fn parse(source: &FileText<'_>, table: &DeTable<'_>) -> Result<ShortRuns, DataError> {
    let mut runs = ShortRuns::default();
    for (key, value) in table {
        if key.get_ref() == CONFIGURATION {
            let DeValue::Array(array) = value.get_ref() else {
                let found = kind(value.get_ref());
                let message = format!("{SECTION}.{CONFIGURATION}: expected tables [[...]], found {found}");
                return Err(source.error(value.span(), message));
            };
            for table in array {
                runs.configurations.push(configuration(source, table)?);
            }
            continue;
        }
        let place = place(source, key.get_ref(), key.span(), &COMMON, SECTION)?;
        runs.common[place] = number(source, value, &COMMON[place])?;
    }
    Ok(runs)
}

fn place(
    source: &FileText<'_>,
    name: &str,
    span: std::ops::Range<usize>,
    terms: &[Term],
    section: &str,
) -> Result<usize, DataError> {
    terms.iter().position(|term| term.name == name).ok_or_else(|| {
        let known: Vec<&str> = terms.iter().map(|term| term.name).collect();
        source.error(span, format!("unknown key {name} in [{section}]; it has {}", known.join(", ")))
    })
}

fn number(source: &FileText<'_>, value: &TomlValue<'_>, term: &Term) -> Result<Value, DataError> {
    let Term { name, unit, min, max, .. } = term;
    let key = format!("{SECTION}.{name}");
    let (inner, ci95) = source.value_and_interval(value, &key)?;
    let number = source.number(inner, &key)?;
    if !(*min..=*max).contains(&number) {
        let message = format!("{SECTION}.{name}: {number} is outside {min} to {max} ({unit})");
        return Err(source.error(value.span(), message));
    }
    Ok(Value { value: number, ci95 })
}

fn configuration(source: &FileText<'_>, value: &TomlValue<'_>) -> Result<Configuration, DataError> {
    let whole = format!("{SECTION}.{CONFIGURATION}");
    let Some(table) = value.get_ref().as_table() else {
        return Err(source.error(value.span(), format!("{whole}: expected a table, found {}", kind(value.get_ref()))));
    };
    let values = OF_CONFIGURATION.map(|term| term.default.into());
    let mut configuration = Configuration { name: String::new(), settings: Vec::new(), values };
    for (key, value) in table {
        match key.get_ref().as_ref() {
            "name" => configuration.name = source.string(value, &format!("{whole}.name"))?,
            "settings" => {
                let Some(settings) = value.get_ref().as_table() else {
                    let message = format!("{whole}.settings: expected a table, found {}", kind(value.get_ref()));
                    return Err(source.error(value.span(), message));
                };
                for (key, value) in settings {
                    let text = source.string(value, &format!("{whole}.settings"))?;
                    configuration.settings.push((key.get_ref().clone().into_owned(), text));
                }
                configuration.settings.sort();
            }
            name => {
                let place = place(source, name, key.span(), &OF_CONFIGURATION, &whole)?;
                configuration.values[place] = number(source, value, &OF_CONFIGURATION[place])?;
            }
        }
    }
    if configuration.name.is_empty() {
        return Err(source.error(value.span(), format!("{whole} lacks name (a text)")));
    }
    Ok(configuration)
}

fn write_value(text: &mut String, term: &Term, value: &Value) {
    let Term { name, unit, min, max, help, .. } = term;
    let number = with_interval(format!("{:?}", value.value), value.ci95);
    let _ = writeln!(text, "{name} = {number}  # {unit}; {min} to {max}; {help}");
}

/// The section's text.
pub(super) fn to_toml(runs: &ShortRuns) -> String {
    let mut text = format!("\n[{SECTION}]  # beyond the sections above, by short runs (diagnose FOLDER)\n");
    COMMON.iter().zip(&runs.common).for_each(|(term, value)| write_value(&mut text, term, value));
    for configuration in &runs.configurations {
        let name = toml::Value::from(configuration.name.as_str());
        let _ = writeln!(text, "\n[[{SECTION}.{CONFIGURATION}]]\nname = {name}");
        let quoted = |text: &str| toml::Value::from(text).to_string();
        let settings: Vec<String> =
            configuration.settings.iter().map(|(key, value)| format!("{} = {}", quoted(key), quoted(value))).collect();
        let _ = writeln!(text, "settings = {{ {} }}  # of a run of it; \"\": absent", settings.join(", "));
        OF_CONFIGURATION
            .iter()
            .zip(&configuration.values)
            .for_each(|(term, value)| write_value(&mut text, term, value));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VehicleFile;
    use std::path::Path;

    #[test]
    fn a_file_of_short_runs_reads_as_it_was_written() {
        let mut runs = ShortRuns::default();
        runs.common[0] = Value { value: -0.25, ci95: Some([-0.3, -0.2]) };
        runs.configurations.push(Configuration {
            name: "13 September".to_owned(),
            settings: vec![("control.rollpidp".to_owned(), String::new()), ("fins.x".to_owned(), "3".to_owned())],
            values: [0.1, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0].map(Value::from),
        });
        let vehicle = VehicleFile { short_runs: Some(runs), ..VehicleFile::reference() };
        let text = vehicle.to_toml("a test");
        assert_eq!(VehicleFile::parse(&text, Path::new("v.toml")).unwrap(), vehicle);
        for (from, to, expected) in [
            ("fin_delay_s", "fin_delay", "unknown key fin_delay in [short_runs]; it has fin_delay_s"),
            ("value = -0.25", "value = 9.0", "short_runs.fin_delay_s: 9 is outside -3 to 5 (s)"),
            ("k_uu = 0.1", "k_uu = \"a\"", "short_runs.k_uu: expected a number, found a text"),
            ("name = \"13 September\"", "", "short_runs.configuration lacks name"),
        ] {
            let error = VehicleFile::parse(&text.replace(from, to), Path::new("v.toml")).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
