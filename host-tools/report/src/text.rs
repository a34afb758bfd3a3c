//! A report as text for a terminal.

use crate::markdown::broken;
use crate::report::{Part, Report, Shown};
use crate::table::Table;
use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, Width, presets};
use std::fmt::Write as _;

/// Columns of a terminal that nobody has enlarged.
const WIDTH: usize = 80;
/// A column of words is not made narrower than this: a table of many numbers is wider than [`WIDTH`] instead.
const NARROWEST: u16 = 24;

/// Prose in lines of [`WIDTH`]; lines with blanks in front stay as they are.
fn prose(text: &str) -> String {
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
    /// Numbers are never broken; words are, where the table is wider than a terminal.
    fn to_text(&self) -> String {
        let mut text = comfy_table::Table::new();
        text.load_preset(presets::NOTHING)
            .set_content_arrangement(ContentArrangement::Dynamic)
            .set_width(WIDTH as u16)
            .set_header(&self.header)
            .add_rows(&self.rows);
        let widths = text.column_max_content_widths();
        for (place, (column, width)) in text.column_iter_mut().zip(widths).enumerate() {
            column.set_padding((0, 2));
            if self.is_numeric(place) {
                column.set_cell_alignment(CellAlignment::Right);
                column.set_constraint(ColumnConstraint::ContentWidth);
            } else {
                column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(width.min(NARROWEST) + 2)));
            }
        }
        let caption = if self.caption.is_empty() { String::new() } else { prose(&self.caption) + "\n" };
        caption + &text.trim_fmt() + "\n"
    }
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
}
