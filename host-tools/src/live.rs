//! What commands share that go on until Ctrl-C, the end of `--for`, or their reader's going.

use anyhow::{Context, bail};
use serde_json::Value;
use std::io::{ErrorKind, IsTerminal, Write, stdin, stdout};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The clock of such a command, and its end.
pub struct Course {
    begun: Instant,
    limit: Option<Duration>,
    /// Ctrl-C outside a view, SIGTERM, SIGHUP.
    pub stop: Arc<AtomicBool>,
}

impl Course {
    /// From now on, which no signal ends.
    pub fn new(limit: Option<Duration>) -> Self {
        Self { begun: Instant::now(), limit, stop: Arc::new(AtomicBool::new(false)) }
    }

    /// From now on; a signal ends it.
    pub fn stoppable(limit: Option<Duration>) -> anyhow::Result<Self> {
        let course = Self::new(limit);
        let flag = Arc::clone(&course.stop);
        ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed)).context("signal handler")?;
        Ok(course)
    }

    /// Its time begins again.
    pub fn restart(&mut self) {
        self.begun = Instant::now();
    }

    pub fn elapsed(&self) -> Duration {
        self.begun.elapsed()
    }

    pub fn now_us(&self) -> u64 {
        u64::try_from(self.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    pub fn is_over(&self) -> bool {
        self.is_stopped() || self.limit.is_some_and(|limit| self.elapsed() >= limit)
    }
}

/// A time span of an option.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| format!("{text}: expected a number of seconds"))?;
    Duration::try_from_secs_f64(seconds).map_err(|_| format!("{text}: expected a positive number of seconds"))
}

/// A view has somebody to look at it.
pub fn needs_terminal(json: bool) -> anyhow::Result<()> {
    if !(json || stdout().is_terminal() && stdin().is_terminal()) {
        bail!("the view needs a terminal; use --json to write to a file or a pipe");
    }
    Ok(())
}

/// Prints a line; false when its reader has gone (`| head`), and so has seen enough.
pub fn print_line(object: &Value) -> anyhow::Result<bool> {
    match writeln!(stdout(), "{object}") {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        written => Ok(written.map(|()| true)?),
    }
}
