//! What goes to the terminal.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// Writes to stdout; a reader that has gone (`| head`) is no failure.
///
/// # Errors
/// What the operating system reports.
pub fn print(text: &[u8]) -> anyhow::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => Ok(result?),
    }
}

/// A progress bar on stderr that appears only where the work takes more than a second.
pub struct Progress {
    what: &'static str,
    length: usize,
    began: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// A bar of this length; `what` stands before it.
    #[must_use]
    pub fn new(what: &'static str, length: usize) -> Self {
        Self { what, length, began: Instant::now(), bar: None }
    }

    /// So much is done.
    pub fn set(&mut self, position: usize) {
        if self.bar.is_none() && self.began.elapsed() > Duration::from_secs(1) {
            let bar = ProgressBar::new(self.length as u64).with_message(self.what);
            if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent} % {eta}") {
                bar.set_style(style);
            }
            self.bar = Some(bar);
        }
        if let Some(bar) = &self.bar {
            bar.set_position(position as u64);
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
