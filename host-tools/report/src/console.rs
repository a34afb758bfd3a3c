//! What goes to the terminal.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// Work that is done sooner shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

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

/// A progress bar on stderr with the time left, for work of any number of threads.
pub struct Progress {
    began: Instant,
    bar: ProgressBar,
}

impl Progress {
    /// A bar of this length; `what` stands before it.
    #[must_use]
    pub fn new(what: impl Into<String>, length: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(length as u64), ProgressDrawTarget::hidden());
        let style = ProgressStyle::with_template("{msg} {wide_bar} {pos} of {len}, {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_message(what.into());
        Self { began: Instant::now(), bar }
    }

    /// So much is done.
    pub fn set(&self, position: usize) {
        self.show();
        self.bar.set_position(position as u64);
    }

    /// One more is done.
    pub fn advance(&self) {
        self.show();
        self.bar.inc(1);
    }

    fn show(&self) {
        if self.bar.is_hidden() && self.began.elapsed() > PATIENCE {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
