//! Lines that mend a log of messages, or a table that is read by a mapping: they name the number that a column was read
//! from, and hold its unit and sign.

use super::{Finding, MENDED_BY};
use crate::log::units;
use crate::log::{Column, Source};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The time of a vehicle log, as its entry of a mapping names it.
const OF_TIME: &str = "column = \"t_s\"";

/// Puts the numbers of the messages, or the columns of the table and that of its time, in the place of the columns.
pub(super) fn name(finding: &mut Finding, sources: &BTreeMap<Column, Source>, time: Option<&str>) {
    if let (None, Some(time)) = (finding.column, time) {
        let entry = format!("column = {}", toml::Value::from(time));
        finding.message = finding.message.replace(OF_TIME, &entry);
        finding.mend = finding.mend.as_ref().map(|lines| lines.replace(OF_TIME, &entry));
        return;
    }
    if let Some((said, tail)) = finding.message.clone().rsplit_once(MENDED_BY) {
        let mends = tail.split(" or columns.").enumerate();
        let lines = mends.map(|(place, text)| if place == 0 { text.to_owned() } else { format!("columns.{text}") });
        let named = lines.filter_map(|text| lines_of(&text.replace(" and columns.", "\ncolumns."), sources));
        let named: Vec<String> = named.map(|lines| lines.replace('\n', " and ")).collect();
        finding.message = match (named.is_empty(), finding.column) {
            (false, _) => format!("{said}{MENDED_BY}{}", named.join(" or ")),
            (true, None) => format!("{said}; no mapping changes the times of a log of messages"),
            (true, Some(column)) => {
                let name = column.name();
                format!("{said}; no line mends {name} here: it is not read from one number, or no mapping reads it")
            }
        };
    }
    finding.mend = finding.mend.take().and_then(|lines| lines_of(&lines, sources));
    finding.alternatives = finding.alternatives.iter().filter_map(|lines| lines_of(lines, sources)).collect();
}

fn lines_of(lines: &str, sources: &BTreeMap<Column, Source>) -> Option<String> {
    let lines: Option<Vec<String>> = lines.lines().map(|line| line_of(line, sources)).collect();
    lines.map(|lines| lines.join("\n"))
}

/// One line; `None` of one that a mapping cannot say.
fn line_of(line: &str, sources: &BTreeMap<Column, Source>) -> Option<String> {
    let table: toml::Table = toml::from_str(line).ok()?;
    let (target, entry) = table.get("columns")?.as_table()?.iter().next()?;
    let text = |key: &str| entry.get(key).and_then(toml::Value::as_str);
    let number = |key: &str, otherwise: f64| {
        let value = entry.get(key);
        value.and_then(|v| v.as_float().or(v.as_integer().map(|whole| whole as f64))).unwrap_or(otherwise)
    };
    let source = sources.get(&Column::from_name(text("column")?)?)?;
    let of_unit = text("unit").map_or(Some(1.0), |unit| units::factor(target, unit))?;
    let change = of_unit * number("sign", 1.0) * number("scale", 1.0);
    let (scale, offset) = (source.scale * change, source.offset + number("offset", 0.0) / source.scale);
    // the unit that is meant, or one that has this factor
    let meant = text("unit").filter(|_| source.scale.abs() == 1.0).map(|unit| (unit, of_unit));
    let is_same = |factor: f64| (factor / scale.abs() - 1.0).abs() < 1e-9;
    let unit = meant.or_else(|| units::of(target).find(|(_, factor)| is_same(*factor)).copied());
    let rest = scale.abs() / unit.map_or(1.0, |(_, factor)| factor);
    let mut line = format!("columns.{target} = {{ column = {}", toml::Value::from(source.name.as_str()));
    if let Some((unit, _)) = unit.filter(|(_, factor)| *factor != 1.0) {
        let _ = write!(line, ", unit = \"{unit}\"");
    }
    if scale < 0.0 {
        line += ", sign = -1";
    }
    if (rest - 1.0).abs() > 1e-9 {
        let _ = write!(line, ", scale = {rest:.7}");
    }
    if offset != 0.0 {
        let _ = write!(line, ", offset = {offset:.7}");
    }
    Some(line + " }")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sources() -> BTreeMap<Column, Source> {
        let source = |name: &str, scale| Source { name: name.to_owned(), scale, offset: 0.0 };
        BTreeMap::from([
            (Column::Roll, source("NAV_ROLL", 1.0)),
            (Column::Heading, source("ATT.Yaw", 1.0_f64.to_radians())),
            (Column::Depth, source("CTUN.BAlt", -1.0)),
        ])
    }

    #[test]
    fn lines_name_the_number_and_hold_its_unit() {
        for (line, expected) in [
            (r#"columns.roll_rad = { column = "roll_rad", unit = "deg" }"#, r#"{ column = "NAV_ROLL", unit = "deg" }"#),
            (
                r#"columns.heading_rad = { column = "heading_rad", sign = -1 }"#,
                r#"{ column = "ATT.Yaw", unit = "deg", sign = -1 }"#,
            ),
            // a quarter turn in the number's own unit
            (
                r#"columns.heading_rad = { column = "heading_rad", offset = 1.5707963267948966 }"#,
                r#"{ column = "ATT.Yaw", unit = "deg", offset = 90.0000000 }"#,
            ),
            (
                r#"columns.depth_m = { column = "depth_m", unit = "ft" }"#,
                r#"{ column = "CTUN.BAlt", unit = "ft", sign = -1 }"#,
            ),
        ] {
            let found = line_of(line, &sources()).unwrap();
            assert!(found.ends_with(&format!("= {expected}")), "{found}");
        }
    }

    #[test]
    fn what_a_mapping_cannot_say_is_told() {
        let mut finding = Finding::suspicious(Column::GpsX, "mirrored")
            .mended_by("columns.gps_x_m = { column = \"gps_x_m\", sign = -1 }".to_owned());
        name(&mut finding, &sources(), None);
        assert!(finding.mend.is_none() && finding.message.starts_with("mirrored; no line mends gps_x_m here"));
        let time = "time = { column = \"t_s\", unit = \"min\" }";
        let mut finding =
            Finding { column: None, ..Finding::suspicious(Column::GpsX, "slow").mended_by(time.to_owned()) };
        let mut of_table = finding.clone();
        name(&mut of_table, &sources(), Some("Zeit"));
        assert_eq!(of_table.message, "slow; mended by time = { column = \"Zeit\", unit = \"min\" }");
        name(&mut finding, &sources(), None);
        assert_eq!(finding.message, "slow; no mapping changes the times of a log of messages");
    }
}
