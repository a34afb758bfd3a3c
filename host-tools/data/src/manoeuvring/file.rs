//! `[manoeuvring]` of a vehicle file: columns of propellers and rudders, and a table of coefficients for each axis.

use super::{AXES, Coefficient, ManoeuvringModel};
use crate::DataError;
use crate::log::Column;
use crate::vehicle_file::source::{Source, kind};
use std::fmt::Write as _;
use toml::de::{DeTable, DeValue};

/// The section's name.
pub(crate) const SECTION: &str = "manoeuvring";
const ACTUATORS: [&str; 2] = ["propellers", "rudders"];
/// Larger coefficients are no vessel's.
const LARGEST: f64 = 1e6;
/// Most propellers and rudders together, as many as a log has columns for.
const MOST_ACTUATORS: usize = 8;

impl ManoeuvringModel {
    pub(crate) fn parse(source: &Source<'_>, table: &DeTable<'_>) -> Result<Self, DataError> {
        let mut model = Self::default();
        for (key, value) in table {
            let name = key.get_ref().as_ref();
            if let Some(place) = ACTUATORS.iter().position(|known| *known == name) {
                let name = format!("{SECTION}.{name}");
                let DeValue::Array(array) = value.get_ref() else {
                    let found = kind(value.get_ref());
                    return Err(
                        source.error(value.span(), format!("{name}: expected an array of columns, found {found}"))
                    );
                };
                for column in array {
                    let text = source.string(column, &name)?;
                    let found = Column::ALL.iter().find(|known| known.name() == text);
                    let unknown = || source.error(column.span(), format!("{name}: a log has no column {text}"));
                    model.actuators[place].push(*found.ok_or_else(unknown)?);
                }
            } else if !AXES.contains(&name) {
                let known = ACTUATORS.iter().chain(&AXES).copied().collect::<Vec<_>>().join(", ");
                return Err(source.error(key.span(), format!("unknown key {name} in [{SECTION}]; it has {known}")));
            }
        }
        if model.actuators.iter().map(Vec::len).sum::<usize>() > MOST_ACTUATORS {
            let message = format!("{SECTION}: more than {MOST_ACTUATORS} propellers and rudders");
            return Err(source.error(table.values().next().map_or(0..0, toml::Spanned::span), message));
        }
        for (axis, name) in AXES.into_iter().enumerate() {
            let Some(value) = table.get(name) else { continue };
            let Some(of_axis) = value.get_ref().as_table() else {
                let message = format!("{SECTION}.{name}: expected a table, found {}", kind(value.get_ref()));
                return Err(source.error(value.span(), message));
            };
            model.parse_axis(source, axis, of_axis)?;
        }
        Ok(model)
    }

    fn parse_axis(&mut self, source: &Source<'_>, axis: usize, table: &DeTable<'_>) -> Result<(), DataError> {
        let zeros = |term| Coefficient { axis, term, value: 0.0, ci95: None };
        let known: Vec<String> = (0..self.terms(axis).count()).map(|term| self.name(&zeros(term)).0).collect();
        let mut coefficients = Vec::new();
        for (key, value) in table {
            let name = key.get_ref().as_ref();
            let Some(term) = known.iter().position(|known| known == name) else {
                let message = format!("unknown key {name} in [{SECTION}.{}]; it has {}", AXES[axis], known.join(", "));
                return Err(source.error(key.span(), message));
            };
            let name = format!("{SECTION}.{}.{name}", AXES[axis]);
            let (number, ci95) = source.with_interval(value, &name)?;
            if number.is_nan() || number.abs() > LARGEST {
                return Err(source.error(value.span(), format!("{name}: {number} is outside ±{LARGEST}")));
            }
            coefficients.push(Coefficient { axis, term, value: number, ci95 });
        }
        coefficients.sort_by_key(|coefficient| coefficient.term);
        self.coefficients.extend(coefficients);
        Ok(())
    }

    /// The section's text.
    pub(crate) fn to_toml(&self) -> String {
        let mut text =
            format!("\n[{SECTION}]  # surge, sway and yaw of a vessel with propellers and rudders (identify)\n");
        for (name, columns) in ACTUATORS.iter().zip(&self.actuators) {
            let names: Vec<&str> = columns.iter().map(|column| column.name()).collect();
            let _ = writeln!(text, "{name} = {names:?}");
        }
        for (axis, axis_name) in AXES.iter().enumerate() {
            let about = ["m/s²", "m/s²", "rad/s²"][axis];
            let _ = writeln!(text, "\n[{SECTION}.{axis_name}]  # acceleration, {about}, for each term");
            for coefficient in self.coefficients.iter().filter(|coefficient| coefficient.axis == axis) {
                let (name, unit) = self.name(coefficient);
                let value = match coefficient.ci95 {
                    Some([low, high]) => {
                        format!("{{ value = {:?}, ci95 = [{low:?}, {high:?}] }}", coefficient.value)
                    }
                    None => format!("{:?}", coefficient.value),
                };
                let _ = writeln!(text, "{name} = {value}  # {unit}");
            }
        }
        text
    }
}
