//! Parameters for the eye.

use crate::board::{Declared, number};
use std::fmt::Write as _;

/// A row a parameter; a star where the value is not the default.
pub fn text(parameters: &[&Declared]) -> String {
    let rows: Vec<[String; 5]> = parameters
        .iter()
        .map(|p| {
            let star = if p.value == p.default { "" } else { "*" };
            [p.name.clone(), number(p.value) + star, p.unit.clone(), p.range(), number(p.default)]
        })
        .collect();
    let head = ["name", "value", "unit", "range", "default"].map(str::to_owned);
    let mut widths = [0; 5];
    for row in std::iter::once(&head).chain(&rows) {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = cell.chars().count().max(*width);
        }
    }
    let [name, value, unit, range, default] = widths;
    let mut text = String::new();
    let meanings = std::iter::once(("meaning", None)).chain(parameters.iter().map(|p| (p.description(), p.effect())));
    for ([a, b, c, d, e], (meaning, effect)) in std::iter::once(&head).chain(&rows).zip(meanings) {
        let live = if effect.is_some_and(|effect| effect.starts_with("at once")) { " (under way too)" } else { "" };
        let line = format!("{a:<name$}  {b:>value$}  {c:<unit$}  {d:<range$}  {e:>default$}  {meaning}{live}");
        let _ = writeln!(text, "{}", line.trim_end());
    }
    text
}
