//! The page: title, verdict, tables, figures, and what made it.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write as _};
use std::path::Path;

use super::glossary::explained;
use super::lettering::{self, escape};
use super::palette;

/// What made a report: enough to make it again. No date, so that the same input gives the same bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Provenance<'a> {
    /// The command as typed.
    pub command: &'a str,
    /// Seed of everything random, if anything was.
    pub seed: Option<u64>,
    /// Version of the program, normally `env!("CARGO_PKG_VERSION")`.
    pub version: &'a str,
}

/// A table whose header names the units. Columns that hold only numbers are set flush right.
#[derive(Clone, Debug)]
pub struct Table {
    caption: String,
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table; `header` names each column with its unit, as in `median [m]`.
    pub fn new(caption: impl Into<String>, header: &[&str]) -> Self {
        Self { caption: caption.into(), header: header.iter().map(|h| h.to_string()).collect(), rows: Vec::new() }
    }

    /// Adds a row. Missing cells stay empty.
    pub fn row(mut self, cells: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.rows.push(cells.into_iter().map(Into::into).collect());
        self
    }

    fn html(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).chain([self.header.len()]).max().unwrap_or(0);
        let cell = |row: &[String], column: usize| row.get(column).cloned().unwrap_or_default();
        let class: Vec<&str> = (0..columns)
            .map(|column| {
                let mut filled =
                    self.rows.iter().map(|row| cell(row, column)).filter(|text| !text.is_empty()).peekable();
                if filled.peek().is_some() && filled.all(|text| is_numeric(&text)) { " class=\"n\"" } else { "" }
            })
            .collect();
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

/// A report in the making. Parts appear in the order in which they are added: the summary table first.
#[derive(Clone, Debug)]
pub struct Report {
    title: String,
    body: String,
    footer: String,
}

impl Report {
    /// A report with its title and the result in one sentence.
    pub fn new(title: impl Into<String>, verdict: impl Into<String>) -> Self {
        let title = escape(&title.into());
        let body = format!("<h1>{title}</h1>\n<p class=\"verdict\">{}</p>\n", escape(&verdict.into()));
        Self { title, body, footer: String::new() }
    }

    /// Says in red, above everything else, why the result is not to be trusted; nothing without a reason.
    pub fn warnings(mut self, reasons: &[String]) -> Self {
        if !reasons.is_empty() {
            let text = format!("Do not trust this result: {}.", reasons.join("; "));
            self.headline(&text);
        }
        self
    }

    /// A red headline, such as "Capsized", above everything else.
    #[must_use]
    pub fn alarm(mut self, text: &str) -> Self {
        self.headline(text);
        self
    }

    fn headline(&mut self, text: &str) {
        self.body.insert_str(0, &format!("<p class=\"alarm\" role=\"alert\">{}</p>\n", escape(text)));
    }

    /// Adds a command to be typed.
    pub fn command(mut self, command: &str) -> Self {
        let _ = writeln!(self.body, "<pre class=\"scroll\"><code>{}</code></pre>", escape(command));
        self
    }

    /// Adds a section heading.
    pub fn section(mut self, title: &str) -> Self {
        let _ = writeln!(self.body, "<h2>{}</h2>", escape(title));
        self
    }

    /// Adds a table.
    pub fn table(mut self, table: Table) -> Self {
        self.body.push_str(&table.html());
        self
    }

    /// Adds a figure made by one of the functions in [`plots`](super::plots).
    pub fn figure(mut self, caption: &str, svg: String) -> Self {
        let _ = writeln!(self.body, "<figure>\n{svg}<figcaption>{}</figcaption>\n</figure>", explained(caption));
        self
    }

    /// Adds a paragraph of plain text.
    pub fn text(mut self, paragraph: &str) -> Self {
        let _ = writeln!(self.body, "<p>{}</p>", escape(paragraph));
        self
    }

    /// States at the bottom of the page what made it.
    pub fn provenance(mut self, provenance: Provenance<'_>) -> Self {
        let seed = provenance.seed.map_or(String::new(), |seed| format!("<dt>Seed</dt><dd>{seed}</dd>\n"));
        self.footer = format!(
            "<footer><dl>\n<dt>Command</dt><dd><code>{}</code></dd>\n{seed}<dt>Version</dt><dd>{}</dd>\n</dl></footer>\n",
            escape(provenance.command),
            escape(provenance.version)
        );
        self
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
            self.title,
            self.body,
            self.footer,
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

/// Whether a cell is to be set flush right: a number, perhaps with a sign, a unit or a deviation, or a dash for none.
fn is_numeric(text: &str) -> bool {
    let digits = text.trim_start_matches(['+', '-', '−', '±', '<', '>', '≤', '≥', '~', ' ', '(', '[']);
    digits.starts_with(|c: char| c.is_ascii_digit() || c == '.') || ["–", "—", "-", "NaN", "inf"].contains(&text)
}
