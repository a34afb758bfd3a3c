//! The page docs/guide/parameters.md, made from the table of parameters.

use super::schema::{BOARD_SECTION, range, value_text};
use backseat_app::parameters::{PARAMETERS, Parameter, Settings};
use backseat_core::parameters::{Presence, SECTIONS, UnderWay};
use std::fmt::Write as _;

const HEAD: &str = "\
# Parameters

Made by `backseat params docs` from the one table that the board, the vehicle file and every tool share; do not edit.

Names are those of `backseat params`; in a vehicle file the part before the first dot is the section. Symbols are
Fossen's and the thesis'. A board starts with the defaults; a vehicle file may leave out what the section says. *Live*
parameters may change while a mission runs; with any other one navigation starts again, so that it is refused then.
*Live, down* and *live, up* are limits of safety: while a mission runs or is armed they change in that direction only.
A number outside its range is refused, and so are numbers that do not go together, with the same words on the board
and in every tool.
";

/// The page in Markdown.
#[must_use]
pub fn parameters_page() -> String {
    let mut page = HEAD.to_owned();
    for section in SECTIONS {
        let optional = match section.presence {
            Presence::Required => "",
            Presence::Whole => " May be left out as a whole: the defaults hold. If it is there, so are all its keys.",
            Presence::Optional => " May be left out, whole or in part: the defaults hold.",
        };
        write_section(&mut page, section.name, &format!("{}.{optional}", sentence(section.about)));
    }
    let effects = "Effects that `diagnose` found, each in a table `[effects.NAME]`; 0 is no effect. \
                   `backseat sim dataset --list` lists them.";
    write_section(&mut page, "effects", effects);
    let app =
        "What belongs to the board itself: filter, aiding, protocols, frontseat, control, modes. May be left out.";
    write_section(&mut page, BOARD_SECTION, app);
    page
}

fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

fn write_section(page: &mut String, section: &str, about: &str) {
    let _ = write!(page, "\n## [{section}]\n\n{about}\n\n");
    page.push_str("| parameter | symbol | unit | default | range | live | meaning |\n|---|---|---|---|---|---|---|\n");
    let alike = |a: &Parameter, b: &Parameter| a.key == b.key && a.first == b.first && a.key != "effects";
    for row in PARAMETERS.chunk_by(alike).filter(|row| row[0].section() == section) {
        let [first, .., last] = row else {
            write_row(page, row[0].name.to_owned(), row);
            continue;
        };
        let whole = first.name.split('[').next().unwrap_or(first.name);
        let part = first.shape.len() != row.len();
        let name = if part { format!("{whole}[{}] to [{}]", first.element, last.element) } else { whole.to_owned() };
        write_row(page, name, row);
    }
}

fn write_row(page: &mut String, name: String, row: &[Parameter]) {
    let first = &row[0];
    let unit = if first.unit == "1" { "" } else { first.unit };
    let default = match row {
        [one] => format!("{}", one.default()),
        _ => value_text(row, &Settings::DEFAULT),
    };
    let live = match first.under_way {
        UnderWay::Fixed => "",
        UnderWay::Free => "live",
        UnderWay::Lower => "live, down",
        UnderWay::Higher => "live, up",
    };
    let help = first.help.replace('|', "\\|");
    let _ = writeln!(page, "| `{name}` | {} | {unit} | {default} | {} | {live} | {help} |", first.symbol, range(first));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `UPDATE_PAGES=1 cargo test -p backseat-logs` writes the page anew.
    #[test]
    fn the_page_in_the_guide_is_current() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/guide/parameters.md");
        if std::env::var_os("UPDATE_PAGES").is_some() {
            std::fs::write(path, parameters_page()).unwrap();
        }
        assert!(
            std::fs::read_to_string(path).unwrap() == parameters_page(),
            "backseat params docs > docs/guide/parameters.md"
        );
    }
}
