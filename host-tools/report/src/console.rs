//! What goes to the terminal.

use crate::lettering::printable;
use crate::text::prose;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{self, Write};
use std::time::{Duration, Instant};

/// Work that is done sooner shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Text as it may go to a terminal: what a log, a file or a board wrote into it moves no cursor and sets no title.
fn visible(text: &str) -> String {
    text.chars().map(printable).collect()
}

/// Writes a line to stderr; whether anybody reads it is not this program's care.
pub fn say(line: &str) {
    let _ = writeln!(io::stderr(), "{}", visible(line));
}

/// Writes prose to stderr, in lines of a terminal.
pub fn tell(text: &str) {
    say(&prose(text));
}

/// Writes to stdout; a reader that has gone (`| head`) is no failure.
///
/// # Errors
/// What the operating system reports.
pub fn print(text: &[u8]) -> anyhow::Result<()> {
    let mut stdout = io::stdout().lock();
    let shown = std::str::from_utf8(text).map(visible);
    match stdout.write_all(shown.as_ref().map_or(text, |shown| shown.as_bytes())).and_then(|()| stdout.flush()) {
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

/// What is being done, on stderr, where its length is not known.
pub struct Spinner {
    bar: ProgressBar,
}

impl Spinner {
    /// A spinner; `what` stands before what is being done.
    pub fn new(what: &'static str) -> Self {
        let bar = ProgressBar::new_spinner().with_prefix(what);
        if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix}: {msg} ({elapsed})") {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }

    /// This is being done now.
    pub fn set(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }
}

impl Drop for Spinner {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_moves_a_cursor_or_sets_a_title_is_shown() {
        let nasty = "a\u{1b}[31mred\u{7}\u{9b}2J\r\u{7f}b\nc\td é °";
        assert_eq!(visible(nasty), "a\u{fffd}[31mred\u{fffd}\u{fffd}2J\u{fffd}\u{fffd}b\nc\td é °");
    }
}
