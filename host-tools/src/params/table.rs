//! Parameters for the eye.

use backseat_link::board::{Declared, Effect, number};
use std::fmt::Write as _;

/// A row a parameter; a star where the value is not the default.
pub fn text(parameters: &[&Declared]) -> String {
    let rows: Vec<[String; 6]> = parameters
        .iter()
        .map(|p| {
            let star = if p.value == p.default { "" } else { "*" };
            [
                p.name.clone(),
                number(p.value) + star,
                p.unit.clone(),
                p.range(),
                number(p.default),
                p.effect().map_or("", Effect::name).to_owned(),
            ]
        })
        .collect();
    let head = ["name", "value", "unit", "range", "default", "takes effect"].map(str::to_owned);
    let mut widths = [0; 6];
    for row in std::iter::once(&head).chain(&rows) {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = cell.chars().count().max(*width);
        }
    }
    let [name, value, unit, range, default, effect] = widths;
    let mut text = String::new();
    let meanings = std::iter::once("meaning").chain(parameters.iter().map(|p| p.description()));
    for ([a, b, c, d, e, f], meaning) in std::iter::once(&head).chain(&rows).zip(meanings) {
        let line = format!("{a:<name$}  {b:>value$}  {c:<unit$}  {d:<range$}  {e:>default$}  {f:<effect$}  {meaning}");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}
