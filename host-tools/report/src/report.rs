//! A report as a value: the answer first, then its parts in the order of reading.

use crate::table::Table;
use serde_json::{Map, Value};

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

/// One part of a report.
#[derive(Clone, Debug)]
pub(crate) enum Part {
    Section(String),
    Paragraph(String),
    /// What was assumed or left out.
    Note(String),
    Table(Table),
    /// Named values, a line each.
    Facts(Vec<(String, String)>),
    /// For the page only.
    Figure {
        caption: String,
        svg: String,
    },
    /// A command to be typed.
    Command(String),
}

/// Where a part is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    Everywhere,
    /// Too long for a terminal.
    Page,
    /// What a page says elsewhere, such as its own path.
    Terminal,
}

/// A report in the making. [`text`](Report::to_text), [`json`](Report::to_json) and [`html`](Report::html) show it.
///
/// Parts appear in the order in which they are added. The object of JSON has a contract of its own: its values are
/// given by [`value`](Report::value), and neither parts nor their order change it.
#[derive(Clone, Debug)]
pub struct Report {
    pub(crate) title: String,
    pub(crate) answer: String,
    pub(crate) alarms: Vec<String>,
    pub(crate) doubts: Vec<String>,
    pub(crate) parts: Vec<(Shown, Part)>,
    pub(crate) values: Map<String, Value>,
    /// Command, seed, version.
    pub(crate) provenance: Option<(String, Option<u64>, String)>,
    shown: Shown,
}

impl Report {
    /// A report with its title and the result in one sentence.
    pub fn new(title: impl Into<String>, answer: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            answer: answer.into(),
            alarms: Vec::new(),
            doubts: Vec::new(),
            parts: Vec::new(),
            values: Map::new(),
            provenance: None,
            shown: Shown::Everywhere,
        }
    }

    fn add(mut self, part: Part) -> Self {
        self.parts.push((self.shown, part));
        self
    }

    /// What is added from here on is shown on the page only.
    #[must_use]
    pub fn on_page(mut self) -> Self {
        self.shown = Shown::Page;
        self
    }

    /// What is added from here on is shown as text only.
    #[must_use]
    pub fn on_terminal(mut self) -> Self {
        self.shown = Shown::Terminal;
        self
    }

    /// What is added from here on is shown as text and on the page, as at the start.
    #[must_use]
    pub fn everywhere(mut self) -> Self {
        self.shown = Shown::Everywhere;
        self
    }

    /// Says above everything else why the result is not to be trusted; nothing without a reason.
    pub fn warnings(mut self, reasons: &[String]) -> Self {
        self.doubts.extend_from_slice(reasons);
        self
    }

    /// A headline in red, such as "Capsized", above everything else.
    #[must_use]
    pub fn alarm(mut self, text: &str) -> Self {
        self.alarms.push(text.to_owned());
        self
    }

    /// Adds a section heading.
    pub fn section(self, title: &str) -> Self {
        self.add(Part::Section(title.to_owned()))
    }

    /// Adds a paragraph of plain text.
    pub fn text(self, paragraph: &str) -> Self {
        self.add(Part::Paragraph(paragraph.to_owned()))
    }

    /// Adds a note: what was assumed or left out.
    pub fn note(self, note: &str) -> Self {
        self.add(Part::Note(note.to_owned()))
    }

    /// Adds notes.
    pub fn notes<'a>(self, notes: impl IntoIterator<Item = &'a String>) -> Self {
        notes.into_iter().fold(self, |report, note| report.note(note))
    }

    /// Adds a table.
    pub fn table(self, table: Table) -> Self {
        self.add(Part::Table(table))
    }

    /// Adds a named value; those that follow each other stand below each other.
    pub fn fact(mut self, name: &str, value: impl Into<String>) -> Self {
        let fact = (name.to_owned(), value.into());
        match self.parts.last_mut() {
            Some((shown, Part::Facts(facts))) if *shown == self.shown => facts.push(fact),
            _ => return self.add(Part::Facts(vec![fact])),
        }
        self
    }

    /// Adds a figure made by one of the functions in [`plots`](super::plots), for the page.
    pub fn figure(self, caption: &str, svg: String) -> Self {
        self.add(Part::Figure { caption: caption.to_owned(), svg })
    }

    /// Adds a command to be typed.
    pub fn command(self, command: &str) -> Self {
        self.add(Part::Command(command.to_owned()))
    }

    /// Adds a value of the JSON object.
    pub fn value(mut self, key: &str, value: impl Into<Value>) -> Self {
        self.values.insert(key.to_owned(), value.into());
        self
    }

    /// States at the bottom of the page what made it.
    pub fn provenance(mut self, provenance: Provenance<'_>) -> Self {
        let Provenance { command, seed, version } = provenance;
        self.provenance = Some((command.to_owned(), seed, version.to_owned()));
        self
    }

    /// The JSON object, on one line.
    pub fn to_json(&self) -> String {
        format!("{}\n", Value::Object(self.values.clone()))
    }
}
