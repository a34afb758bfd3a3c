//! The text of a vehicle file, and what is wrong where in it.

use crate::DataError;
use crate::settings::place;
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

pub(super) type Value<'i> = Spanned<DeValue<'i>>;

/// A text with its origin, to say where in it something is wrong.
pub(super) struct FileText<'a> {
    pub(super) text: &'a str,
    pub(super) path: &'a Path,
}

impl FileText<'_> {
    pub(super) fn error(&self, span: Range<usize>, message: impl Into<String>) -> DataError {
        let (line, column) = place(self.text, span.start);
        DataError::at(self.path, line, column, message)
    }

    pub(super) fn root(&self) -> Result<Spanned<DeTable<'_>>, DataError> {
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

    /// The value of `{ value = …, ci95 = [low, high] }`, or the value itself, and the interval.
    pub(super) fn value_and_interval<'v, 'i>(
        &self,
        value: &'v Value<'i>,
        name: &str,
    ) -> Result<(&'v Value<'i>, Option<[f64; 2]>), DataError> {
        let DeValue::Table(table) = value.get_ref() else { return Ok((value, None)) };
        if let Some(key) = table.keys().find(|key| !["value", "ci95"].contains(&key.get_ref().as_ref())) {
            let message = format!("unknown key {} in {name}; it has value, ci95", key.get_ref());
            return Err(self.error(key.span(), message));
        }
        let number = table.get("value").ok_or_else(|| self.error(value.span(), format!("{name} lacks value")))?;
        let Some(interval) = table.get("ci95") else { return Ok((number, None)) };
        let mut limits = [0.0; 2];
        for (limit, value) in limits.iter_mut().zip(self.array(interval, 2, name)?) {
            *limit = self.number(value, name)?;
        }
        if limits[0].is_nan() || limits[1].is_nan() || limits[0] > limits[1] {
            return Err(self.error(interval.span(), format!("{name}: ci95 is low, high")));
        }
        Ok((number, Some(limits)))
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

    pub(super) fn string(&self, value: &Value<'_>, name: &str) -> Result<String, DataError> {
        match value.get_ref() {
            DeValue::String(text) => Ok(text.clone().into_owned()),
            other => Err(self.error(value.span(), format!("{name}: expected a text, found {}", kind(other)))),
        }
    }
}

/// A number, with its interval where it has one, as [`FileText::value_and_interval`] reads it.
pub(super) fn with_interval(number: String, ci95: Option<[f64; 2]>) -> String {
    match ci95 {
        Some([low, high]) => format!("{{ value = {number}, ci95 = [{low:?}, {high:?}] }}"),
        None => number,
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
