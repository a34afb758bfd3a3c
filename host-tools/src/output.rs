//! The options by which a command shows and writes its report.

use backseat_logs::output::{self, Existing};
use backseat_report::{Report, console};
use std::path::PathBuf;

/// Where a report goes: the terminal, as text or as JSON, and a page.
#[derive(clap::Args)]
pub struct Output {
    /// Write an HTML report into this folder
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Print one JSON object instead of the text
    #[arg(long)]
    json: bool,
    /// Go on with a log that contradicts physics, and replace results that exist
    #[arg(long)]
    force: bool,
}

impl Output {
    /// Whether to go on with what is not to be trusted.
    pub const fn is_forced(&self) -> bool {
        self.force
    }

    /// What is to be done with results that exist.
    pub fn existing(&self) -> Existing {
        if self.force { Existing::Replace } else { Existing::Keep }
    }

    fn page(&self) -> Option<PathBuf> {
        self.report.as_ref().map(|folder| folder.join("report.html"))
    }

    /// A file beside the page.
    pub fn in_report(&self, name: &str) -> Option<PathBuf> {
        self.report.as_ref().map(|folder| folder.join(name))
    }

    /// Before any work: whether the page and these files can be written.
    ///
    /// # Errors
    /// One of them exists, and `--force` was not given; or nothing can be written there.
    pub fn check(&self, others: &[&Option<PathBuf>]) -> anyhow::Result<()> {
        let page = self.page();
        let mut paths = [&page].into_iter().chain(others.iter().copied()).flatten();
        Ok(paths.try_for_each(|path| output::check(path, self.existing()))?)
    }

    /// Writes the page, and prints the report.
    ///
    /// # Errors
    /// The page cannot be written.
    pub fn show(&self, report: Report) -> anyhow::Result<()> {
        let page = self.page();
        let report = report.file("report", page.as_deref());
        if let Some(page) = &page {
            output::write(page, self.existing(), |file| file.write_all(report.html().as_bytes()))?;
        }
        self.print(&report)
    }

    /// Prints a report that has no page.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn print(&self, report: &Report) -> anyhow::Result<()> {
        print(report, self.json)
    }
}

/// Prints a report.
///
/// # Errors
/// What the operating system reports.
pub fn print(report: &Report, json: bool) -> anyhow::Result<()> {
    console::print(if json { report.to_json() } else { report.to_text() }.as_bytes())
}
