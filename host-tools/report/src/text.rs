//! A report as text for a terminal.

use crate::report::{Part, Report, Shown};
use crate::table::Table;
use std::fmt::Write as _;

impl Report {
    /// The report for a terminal: doubts, answer, then the parts but for figures.
    pub fn to_text(&self) -> String {
        let mut out = String::new();
        for doubt in self.alarms.iter().cloned().chain(self.doubts.iter().map(|doubt| format!("DO NOT TRUST: {doubt}")))
        {
            let _ = writeln!(out, "{doubt}");
        }
        let _ = writeln!(out, "{}", self.answer);
        for (shown, part) in &self.parts {
            if *shown == Shown::Page {
                continue;
            }
            let _ = match part {
                Part::Section(title) => writeln!(out, "\n{title}"),
                Part::Paragraph(text) => writeln!(out, "{text}"),
                Part::Note(text) => writeln!(out, "note: {text}"),
                Part::Command(text) => writeln!(out, "  {text}"),
                Part::Table(table) => write!(out, "\n{}", table.to_text()),
                Part::Facts(facts) => write!(out, "\n{}", aligned(facts)),
                Part::Figure { .. } => Ok(()),
            };
        }
        out
    }
}

/// A line each, the values below each other.
fn aligned(facts: &[(String, String)]) -> String {
    let width = facts.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    facts.iter().fold(String::new(), |mut out, (name, value)| {
        let _ = writeln!(out, "{name:width$}   {value}");
        out
    })
}

impl Table {
    fn to_text(&self) -> String {
        let columns = self.columns();
        let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
        let widths: Vec<usize> = (0..columns)
            .map(|column| {
                let cells = self.rows.iter().chain([&self.header]).map(|row| cell(row, column).chars().count());
                cells.max().unwrap_or(0)
            })
            .collect();
        let numeric: Vec<bool> = (0..columns).map(|column| self.is_numeric(column)).collect();
        let mut out = String::new();
        if !self.caption.is_empty() {
            let _ = writeln!(out, "{}", self.caption);
        }
        for row in [&self.header].into_iter().chain(&self.rows) {
            let cells = (0..columns).map(|column| {
                let (text, width) = (cell(row, column), widths[column]);
                if numeric[column] { format!("{text:>width$}") } else { format!("{text:<width$}") }
            });
            let _ = writeln!(out, "{}", cells.collect::<Vec<_>>().join("  ").trim_end());
        }
        out
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
                        nominal          0.46\nkinematic       24.70\n\ntime     1 s\ndigest   00ff\nnote: written\n";
        assert_eq!(report.to_text(), expected);
        let html = report.html();
        assert!(html.contains("<p>long</p>") && !html.contains("written"), "{html}");
    }
}
