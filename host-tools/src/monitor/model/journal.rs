//! What happened, newest last.

use std::collections::VecDeque;

/// As many events are kept.
const CAPACITY: usize = 1000;

/// How much an event or an alarm matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Good to know.
    Info,
    /// Somebody should look.
    Warning,
    /// The vehicle or the view of it is at stake.
    Critical,
}

impl Severity {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Critical => "critical",
        }
    }
}

/// One event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JournalEntry {
    /// Time of day, or the board's own time where UTC is not known.
    pub when: String,
    pub severity: Severity,
    pub text: String,
}

/// The events.
#[derive(Default)]
pub struct Journal {
    events: VecDeque<JournalEntry>,
    /// Of all that ever happened.
    count: u64,
}

impl Journal {
    pub fn note(&mut self, when: String, severity: Severity, text: impl Into<String>) {
        if self.events.len() == CAPACITY {
            self.events.pop_front();
        }
        self.events.push_back(JournalEntry { when, severity, text: text.into() });
        self.count += 1;
    }

    pub fn len(&self) -> usize {
        self.events.len()
    }

    /// The newest first.
    pub fn newest(&self) -> impl Iterator<Item = &JournalEntry> {
        self.events.iter().rev()
    }

    /// Events after the first `seen` of all, and how many there are now.
    pub fn since(&self, seen: u64) -> (impl Iterator<Item = &JournalEntry>, u64) {
        let new = usize::try_from(self.count.saturating_sub(seen)).unwrap_or(usize::MAX).min(self.events.len());
        (self.events.iter().skip(self.events.len() - new), self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_go_and_what_is_new_is_told_once() {
        let mut journal = Journal::default();
        for i in 0..CAPACITY + 5 {
            journal.note(String::new(), Severity::Info, i.to_string());
        }
        assert_eq!((journal.len(), journal.newest().last().unwrap().text.as_str()), (CAPACITY, "5"));
        let (events, seen) = journal.since(1003);
        assert_eq!(events.map(|event| event.text.as_str()).collect::<Vec<_>>(), ["1003", "1004"]);
        assert_eq!(journal.since(seen).0.count(), 0);
    }
}
