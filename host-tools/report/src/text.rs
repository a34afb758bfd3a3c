//! A report as text for a terminal.

use crate::markdown::broken;
use crate::report::{Part, Report, Shown};
use crate::table::Table;
use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, Width, presets};
use std::fmt::Write as _;

/// Columns of a terminal that nobody has enlarged.
const WIDTH: usize = 80;
/// A column of words is not made narrower than this: a table of many numbers is broken into several instead.
const NARROWEST: u16 = 24;
/// Blanks between two columns.
const BETWEEN: u16 = 2;

/// Prose in lines of [`WIDTH`]; lines with blanks in front stay as they are.
pub(crate) fn prose(text: &str) -> String {
    let line = |line: &str| if line.starts_with(' ') { line.to_owned() } else { broken(line, WIDTH, 2) };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

impl Report {
    /// The report for a terminal: doubts, answer, then the parts but for figures.
    pub fn to_text(&self) -> String {
        let mut out = String::new();
        for doubt in self.alarms.iter().cloned().chain(self.doubts.iter().map(|doubt| format!("DO NOT TRUST: {doubt}")))
        {
            let _ = writeln!(out, "{}", prose(&doubt));
        }
        let _ = writeln!(out, "{}", prose(&self.answer));
        let parts = self.parts.iter().filter(|(shown, _)| *shown != Shown::Page).map(|(_, part)| part);
        let parts: Vec<&Part> = parts.filter(|part| !matches!(part, Part::Figure { .. })).collect();
        let (mut is_after_block, mut is_after_section) = (false, false);
        // facts of the terminal alone stand with those before them
        for group in parts.chunk_by(|a, b| matches!((a, b), (Part::Facts(_), Part::Facts(_)))) {
            let is_prose = matches!(group, [Part::Paragraph(_) | Part::Note(_) | Part::Command(_)]);
            if is_after_block || !is_prose && !is_after_section {
                out.push('\n');
            }
            is_after_section = matches!(group, [Part::Section(_)]);
            is_after_block = matches!(group, [Part::Facts(_) | Part::Table(_), ..]);
            let _ = match group {
                [Part::Section(title)] => writeln!(out, "{title}"),
                [Part::Paragraph(text)] => writeln!(out, "{}", prose(text)),
                [Part::Note(text)] => writeln!(out, "{}", prose(&format!("note: {text}"))),
                [Part::Command(text)] => writeln!(out, "  {text}"),
                [Part::Table(table)] => write!(out, "{}", table.to_text()),
                group => write!(out, "{}", aligned(group)),
            };
        }
        out
    }
}

/// A line each, the values below each other.
fn aligned(parts: &[&Part]) -> String {
    let facts = || parts.iter().flat_map(|part| if let Part::Facts(facts) = part { &facts[..] } else { &[] });
    let width = facts().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    facts().fold(String::new(), |mut out, (name, value)| {
        let place = width + 3;
        let value = broken(value, WIDTH.saturating_sub(place), 0).replace('\n', &format!("\n{:place$}", ""));
        let _ = writeln!(out, "{name:width$}   {value}");
        out
    })
}

impl Table {
    /// Numbers are never broken; words are, where the table is wider than a terminal. Columns that do not fit beside the
    /// others stand below them, with the first column again.
    fn to_text(&self) -> String {
        let caption = if self.caption.is_empty() { String::new() } else { prose(&self.caption) + "\n" };
        let blocks: Vec<String> = self.blocks().iter().map(|places| self.block(places) + "\n").collect();
        caption + &blocks.join("\n")
    }

    /// The columns that fit beside each other.
    fn blocks(&self) -> Vec<Vec<usize>> {
        let widest = |place: usize| {
            let cells = self.rows.iter().chain([&self.header]).filter_map(|row| row.get(place));
            cells.flat_map(|cell| cell.lines()).map(|line| line.chars().count()).max().unwrap_or(0)
        };
        let width = |place: usize| {
            let words = if self.is_numeric(place) { usize::MAX } else { usize::from(NARROWEST) };
            widest(place).min(words) + usize::from(BETWEEN)
        };
        let mut blocks = vec![vec![0]];
        for place in 1..self.columns() {
            match blocks.last_mut() {
                Some(block) if block.len() == 1 || fits(block.iter().copied().chain([place]).map(width).sum()) => {
                    block.push(place);
                }
                _ => blocks.push(vec![0, place]),
            }
        }
        blocks
    }

    /// These columns beside each other.
    fn block(&self, places: &[usize]) -> String {
        let of = |row: &Vec<String>| places.iter().map(|place| row.get(*place).cloned().unwrap_or_default()).collect();
        let mut text = comfy_table::Table::new();
        text.load_preset(presets::NOTHING)
            .set_content_arrangement(ContentArrangement::Dynamic)
            .set_width(WIDTH as u16)
            .set_header::<Vec<String>>(of(&self.header))
            .add_rows(self.rows.iter().map(|row| -> Vec<String> { of(row) }));
        let widths = text.column_max_content_widths();
        for (&place, (column, width)) in places.iter().zip(text.column_iter_mut().zip(widths)) {
            column.set_padding((0, BETWEEN));
            if self.is_numeric(place) {
                column.set_cell_alignment(CellAlignment::Right);
                column.set_constraint(ColumnConstraint::ContentWidth);
            } else {
                column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(width.min(NARROWEST) + BETWEEN)));
            }
        }
        text.trim_fmt()
    }
}

/// Whether columns of this width together, each with the blanks behind it, fit beside each other.
const fn fits(width: usize) -> bool {
    width <= WIDTH + BETWEEN as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_has_the_parts_of_a_terminal() {
        let table = Table::new("Error", &["model", "median [m]"]).row(["nominal", "0.46"]).row(["kinematic", "24.70"]);
        let report = Report::new("Title", "It is 0.46 m.")
            .warnings(&["heading turns the wrong way".to_owned()])
            .table(table)
            .fact("time", "1 s")
            .fact("digest", "00ff")
            .on_page()
            .text("long")
            .on_terminal()
            .note("written");
        let expected = "DO NOT TRUST: heading turns the wrong way\nIt is 0.46 m.\n\nError\nmodel      median [m]\n\
                        nominal          0.46\nkinematic       24.70\n\ntime     1 s\ndigest   00ff\n\nnote: written\n";
        assert_eq!(report.to_text(), expected);
        let html = report.html();
        assert!(html.contains("<p>long</p>") && !html.contains("written"), "{html}");
    }

    #[test]
    fn no_line_is_wider_than_a_terminal() {
        let words = "what was assumed and left out of it ".repeat(9);
        let header = ["navigation", "median [m]", "95 % [m]", "max [m]", "RMS / DRMS"];
        let table = Table::new(words.clone(), &header).row(["dynamic, no DVL", "0.46", "0.98", "1.61", "0.80"]).row([
            words.as_str(),
            "24.72",
            "104.01",
            "209.61",
            "1.19",
        ]);
        let report = Report::new("Title", words.clone())
            .warnings(std::slice::from_ref(&words))
            .text(&words)
            .note(&words)
            .table(table)
            .fact("name", words.clone())
            .command("backseat navigate log.csv");
        let text = report.to_text();
        assert!(text.lines().all(|line| line.chars().count() <= 80 && line.trim_end() == line), "{text}");
        // nothing is lost, and numbers stay whole
        assert_eq!(text.matches("assumed").count(), 7 * 9, "{text}");
        assert!(text.lines().any(|line| line.ends_with("24.72    104.01   209.61        1.19")), "{text}");
    }

    /// What does not fit beside the other numbers stands below, each row by its name.
    #[test]
    fn a_table_of_many_numbers_is_broken_between_columns() {
        let sensors = ["depth", "attitude", "rates", "dvl", "gnss", "ship_gnss", "range", "range_rate"];
        let header: Vec<&str> = ["navigation"].into_iter().chain(sensors).collect();
        let row = |name: &'static str| [name; 1].into_iter().chain(["0.95 (0)"; 8]);
        let table = Table::new("NIS", &header).row(row("backseat: dynamic, no DVL, packets")).row(row("kinematic"));
        let text = Report::new("Title", "answer").table(table).to_text();
        assert!(text.lines().all(|line| line.chars().count() <= 80 && line.trim_end() == line), "{text}");
        assert_eq!((text.matches("0.95 (0)").count(), text.matches("kinematic").count()), (16, 2), "{text}");
        let place = |word: &str| text.find(word).unwrap_or_else(|| panic!("{word}: {text}"));
        assert!(place("depth") < place("range_rate"), "{text}");
    }
}
