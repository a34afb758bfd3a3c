//! A report as one HTML page that needs nothing from elsewhere.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write as _};
use std::path::Path;

use super::glossary::explained;
use super::lettering::{self, escape};
use super::palette;
use crate::report::{Part, Report, Shown};
use crate::table::Table;

impl Table {
    fn html(&self) -> String {
        let columns = self.columns();
        let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
        let class = |column: usize| if self.is_numeric(column) { " class=\"n\"" } else { "" };
        let class: Vec<&str> = (0..columns).map(class).collect();
        let line = |tag: &str, row: &[String]| {
            let cells = (0..columns).map(|c| format!("<{tag}{}>{}</{tag}>", class[c], explained(&cell(row, c))));
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        let head = line("th", &self.header);
        let body: String = self.rows.iter().map(|row| line("td", row)).collect();
        format!(
            "<div class=\"scroll\"><table>\n<caption>{}</caption>\n<thead>{head}</thead>\n<tbody>\n{body}</tbody>\n</table></div>\n",
            explained(&self.caption)
        )
    }
}

impl Part {
    fn html(&self) -> String {
        match self {
            Self::Section(title) => format!("<h2>{}</h2>\n", escape(title)),
            Self::Paragraph(text) | Self::Note(text) => format!("<p>{}</p>\n", escape(text)),
            Self::Table(table) => table.html(),
            Self::Facts(facts) => {
                let rows =
                    facts.iter().map(|(name, value)| format!("<dt>{}</dt><dd>{}</dd>", explained(name), escape(value)));
                format!("<dl>{}</dl>\n", rows.collect::<String>())
            }
            Self::Figure { caption, svg } => {
                format!("<figure>\n{svg}<figcaption>{}</figcaption>\n</figure>\n", explained(caption))
            }
            Self::Command(command) => format!("<pre class=\"scroll\"><code>{}</code></pre>\n", escape(command)),
        }
    }
}

impl Report {
    fn body(&self) -> String {
        let mut out = String::new();
        let doubts =
            (!self.doubts.is_empty()).then(|| format!("Do not trust this result: {}.", self.doubts.join("; ")));
        for alarm in self.alarms.iter().rev().chain(&doubts) {
            let _ = writeln!(out, "<p class=\"alarm\" role=\"alert\">{}</p>", escape(alarm));
        }
        let (title, answer) = (escape(&self.title), escape(&self.answer));
        let _ = write!(out, "<h1>{title}</h1>\n<p class=\"verdict\">{answer}</p>\n");
        out.extend(self.parts.iter().filter(|(shown, _)| *shown != Shown::Terminal).map(|(_, part)| part.html()));
        out
    }

    fn footer(&self) -> String {
        let Some((command, seed, version)) = &self.provenance else { return String::new() };
        let seed = seed.map_or(String::new(), |seed| format!("<dt>Seed</dt><dd>{seed}</dd>\n"));
        format!(
            "<footer><dl>\n<dt>Command</dt><dd><code>{}</code></dd>\n{seed}<dt>Version</dt><dd>{}</dd>\n</dl></footer>\n",
            escape(command),
            escape(version)
        )
    }

    /// The whole page.
    pub fn html(&self) -> String {
        let style = include_str!("style.css")
            .replace("@DARK@", &palette::dark_rules())
            .replace("@FONT@", &lettering::units(lettering::FONT).to_string())
            .replace("@PHONE_FONT@", &lettering::units(lettering::PHONE_FONT).to_string())
            .replace("@WIDE_FONT@", &lettering::units(lettering::WIDE_FONT).to_string());
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>{}</title>\n<style>\n{style}</style>\n</head>\n\
             <body>\n<main>\n{}{}</main>\n<script>//<![CDATA[\n{}//]]></script>\n</body>\n</html>\n",
            escape(&self.title),
            self.body(),
            self.footer(),
            include_str!("figure.js")
        )
    }

    /// Writes the page to a new file.
    ///
    /// # Errors
    /// [`io::ErrorKind::AlreadyExists`] rather than overwrite an earlier result, and whatever the file system reports.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        File::create_new(path)?.write_all(self.html().as_bytes())
    }
}
