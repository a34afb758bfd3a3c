//! `[manoeuvring]` of a vehicle file: columns of propellers and rudders, and a table of coefficients for each axis.

use super::source::{FileText, kind};
use crate::DataError;
use crate::log::Column;
use crate::manoeuvring::{AXES, Coefficient, ManoeuvringModel};
use std::fmt::Write as _;
use toml::de::{DeTable, DeValue};

/// The section's name.
pub(super) const SECTION: &str = "manoeuvring";
const ACTUATORS: [&str; 2] = ["propellers", "rudders"];
/// Larger coefficients are no vessel's.
const LARGEST: f64 = 1e6;
/// Most propellers and rudders together, as many as a log has columns for.
const MOST_ACTUATORS: usize = 8;

/// The model of the section.
pub(super) fn parse(source: &FileText<'_>, table: &DeTable<'_>) -> Result<ManoeuvringModel, DataError> {
    let mut model = ManoeuvringModel::default();
    for (key, value) in table {
        let name = key.get_ref().as_ref();
        if let Some(place) = ACTUATORS.iter().position(|known| *known == name) {
            let name = format!("{SECTION}.{name}");
            let DeValue::Array(array) = value.get_ref() else {
                let found = kind(value.get_ref());
                return Err(source.error(value.span(), format!("{name}: expected an array of columns, found {found}")));
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
        parse_axis(&mut model, source, axis, of_axis)?;
    }
    Ok(model)
}

fn parse_axis(
    model: &mut ManoeuvringModel,
    source: &FileText<'_>,
    axis: usize,
    table: &DeTable<'_>,
) -> Result<(), DataError> {
    let zeros = |term| Coefficient { axis, term, value: 0.0, ci95: None };
    let known: Vec<String> = (0..model.terms(axis).count()).map(|term| model.name(&zeros(term)).0).collect();
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
    model.coefficients.extend(coefficients);
    Ok(())
}

/// The section's text.
pub(super) fn to_toml(model: &ManoeuvringModel) -> String {
    let mut text = format!("\n[{SECTION}]  # surge, sway and yaw of a vessel with propellers and rudders (identify)\n");
    for (name, columns) in ACTUATORS.iter().zip(&model.actuators) {
        let names: Vec<&str> = columns.iter().map(|column| column.name()).collect();
        let _ = writeln!(text, "{name} = {names:?}");
    }
    for (axis, axis_name) in AXES.iter().enumerate() {
        let about = ["m/s²", "m/s²", "rad/s²"][axis];
        let _ = writeln!(text, "\n[{SECTION}.{axis_name}]  # acceleration, {about}, for each term");
        for coefficient in model.coefficients.iter().filter(|coefficient| coefficient.axis == axis) {
            let (name, unit) = model.name(coefficient);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VehicleFile;
    use std::path::Path;

    #[test]
    fn a_file_of_a_model_reads_as_it_was_written() {
        let of = |axis, term, value, ci95| Coefficient { axis, term, value, ci95 };
        let model = ManoeuvringModel {
            actuators: [vec![Column::PropRpm], vec![Column::Rudder, Column::FinTop]],
            coefficients: vec![of(0, 0, -0.1, Some([-0.11, -0.09])), of(1, 0, -0.5, None), of(2, 5, -0.5, None)],
        };
        let vehicle = VehicleFile { manoeuvring: Some(model), ..VehicleFile::reference() };
        let text = vehicle.to_toml("a test");
        assert!(text.contains("\n[manoeuvring.yaw]") && text.contains("uud_1 = -0.5  # 1/m²"), "{text}");
        assert_eq!(VehicleFile::parse(&text, Path::new("v.toml")).unwrap(), vehicle);
        for (from, to, expected) in [
            ("\"rudder_rad\", ", "\"rudder\", ", "manoeuvring.rudders: a log has no column rudder"),
            ("uud_1 = -0.5", "uud = -0.5", "unknown key uud in [manoeuvring.yaw]; it has uv, ur, vv, rr, nn, uud_1"),
            ("uud_1 = -0.5", "uud_1 = 1e9", "manoeuvring.yaw.uud_1: 1000000000 is outside ±1000000"),
            ("[manoeuvring.sway]", "[manoeuvring.heave]", "unknown key heave in [manoeuvring]"),
            ("propellers = [\"prop_rpm\"]", "propellers = 1", "manoeuvring.propellers: expected an array of columns"),
            ("ci95 = [-0.11, -0.09]", "ci95 = [-0.09, -0.11]", "manoeuvring.surge.uu: ci95 is low, high"),
        ] {
            let wrong = text.replace(from, to);
            let error = VehicleFile::parse(&wrong, Path::new("v.toml")).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
